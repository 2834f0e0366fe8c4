"""The paper, recomputed: every figure from its own configuration, every claim held against the result."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from vibrodrive import __version__
from vibrodrive.figures.style import drawn_as, save
from vibrodrive.model.packaged import configurations
from vibrodrive.model.parameters import bad
from vibrodrive.paper import (  # noqa: F401 (they register their claims)
    claims_grid,
    claims_limits,
    claims_physical,
    claims_undisturbed,
)
from vibrodrive.paper.claim import CLAIMS, Judged, claims_table, judge
from vibrodrive.paper.figures import FIGURES
from vibrodrive.paper.session import Say, Session
from vibrodrive.store.draft import drafted
from vibrodrive.store.header import refuse_foreign
from vibrodrive.store.kind import special

SUBJECTS = (*FIGURES, "limits")
"""What can be asked for: what is drawn, and the limits, about which there are claims and no figure of the paper."""


class Paper(NamedTuple):
    """What `run_paper` leaves behind: the files written, and the claims, judged."""

    files: list[Path]
    claims: list[Judged]


def _prepare(folder: Path, configs: Path, figures: Sequence[str]) -> None:
    """Make the directory, and refuse what in it must not be replaced. Raises ValueError or OSError."""
    try:
        os.stat(folder)  # links in a circle have a name, and mkdir says no more than that it exists
    except FileNotFoundError:
        folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    sources = sorted(configs.glob("*.toml"))
    names = {p.stem for p in sources}
    data = [folder / f"{name}{ending}" for name in names for ending in (".h5", "_switches.h5")]
    others = [folder / f"{name}{ending}" for name in figures for ending in (".png", ".pdf")]
    for path in [*data, *others, folder / "claims.json", folder / "claims.md"]:
        if not path.exists():
            continue
        what = special(path)
        if what is not None:
            raise ValueError(bad("output", str(path), f"a file, and this is {what}"))
        for config_file in sources:
            if config_file.exists() and path.samefile(config_file):
                raise ValueError(bad("output", str(path), f"another file than the configuration {config_file}"))
        if path in data:
            refuse_foreign(path)


def run_paper(
    out: str | Path,
    figures: Sequence[str] | None = None,
    progress: Say | None = None,
    configs: str | Path | None = None,
    threads: int | None = None,
) -> Paper:
    """Recompute the paper into a directory: NAME.png, NAME.pdf, NAME.h5, claims.json and claims.md.

    Parameters
    ----------
    out : path
        directory; made if it is not there. Files of an earlier run are replaced, if they are what they are called:
        a .h5 that is no result file, or a name that leads to a configuration, is refused.
    figures : sequence of str, optional
        names of what is to be drawn (see figures.FIGURES), or "limits" for the claims about these alone; all unless
        given. Claims about other figures are left out.
    progress : callable, optional
        called with a line for each step.
    configs : path, optional
        directory of the configurations; those of this package unless given.
    threads : int, optional

    Raises
    ------
    ValueError
        for an unknown figure, a configuration that is wrong, or a file that must not be replaced.
    OSError
        if a file cannot be read or written.
    """
    names = list(SUBJECTS) if figures is None else list(figures)
    for name in names:
        if name not in SUBJECTS:
            raise ValueError(bad("figure", name, "one of " + ", ".join(SUBJECTS)))
    say = progress or (lambda line: None)
    folder = Path(out)
    source = Path(configs) if configs is not None else configurations()
    _prepare(folder, source, list(FIGURES))
    session = Session(source, folder, say, threads)
    for name in (n for n in names if n in FIGURES):
        say(f"{name}: {FIGURES[name].title}")
        with drawn_as("print", "double"):
            drawn = FIGURES[name].draw(session)
        session.files += [save(drawn, folder / f"{name}{ending}") for ending in (".png", ".pdf")]
    judged = []
    for claim in sorted((c for c in CLAIMS if c.figure in names), key=lambda c: SUBJECTS.index(c.figure)):
        say(f"claim {claim.id}")
        judged.append(judge(claim, session))
    document = {"vibrodrive": __version__, "claims": [c.record() for c in judged]}
    listed = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    for name, text in {"claims.json": listed, "claims.md": claims_table(judged)}.items():
        with drafted(folder / name) as draft:
            draft.write_text(text, encoding="utf-8")
        session.files.append(folder / name)
    return Paper(session.files, judged)
