"""The page as one document: its scripts, its style and what the scripts know are parts of it, so that it loads nothing
else."""

from __future__ import annotations

import json
from pathlib import Path

from vibrodrive.explorer.controls import known
from vibrodrive.explorer.starts import ABOUT, STARTS
from vibrodrive.explorer.view import View

HERE = Path(__file__).parent

SCRIPTS = "page.js", "picture.js", "controls.js", "motion.js"


def build(view: View, refused: str) -> str:
    """Return the HTML of the page with its first view, and the reason why it is not the view of the address, or ""."""
    first = {"view": view.state(), "refused": refused, "starts": [start._asdict() for start in STARTS], "about": ABOUT}
    told = json.dumps({**known(), **first}).replace("</", "<\\/")
    parts = {
        "style": (HERE / "page.css").read_text(),
        "known": told,
        "script": "\n".join((HERE / name).read_text() for name in SCRIPTS),
    }
    text = (HERE / "page.html").read_text()
    for name, part in parts.items():
        text = text.replace("{{ " + name + " }}", part)
    return text
