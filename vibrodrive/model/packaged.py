"""The configurations that come with the program."""

from __future__ import annotations

import tomllib
from pathlib import Path


def configurations() -> Path:
    """The directory of the configurations: beside the package in a checkout, inside it when installed."""
    here = Path(__file__).parents[1]
    for place in (here / "configs", here.parent / "configs"):
        if place.is_dir():
            return place
    raise FileNotFoundError(2, "no configurations beside the package: give their directory", str(here))


def titles() -> dict[str, str]:
    """Name and title of each of them, in the order of the alphabet."""
    return {
        p.stem: tomllib.loads(p.read_text(encoding="utf-8"))["title"] for p in sorted(configurations().glob("*.toml"))
    }
