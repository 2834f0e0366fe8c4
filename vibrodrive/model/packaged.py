"""Configuration files that are part of the program."""

import tomllib
from pathlib import Path


def configurations() -> Path:
    """Return the directory of the configuration files: in an installed package, or beside the package in a clone."""
    package = Path(__file__).parents[1]
    for place in (package / "configs", package.parent / "configs"):
        if place.is_dir():
            return place
    raise FileNotFoundError(
        2, "the directory configs is neither here nor in the parent directory: install vibrodrive again", str(package)
    )


def titles() -> dict[str, str]:
    """Return the title of each configuration by its name, in alphabetical order."""
    return {
        p.stem: tomllib.loads(p.read_text(encoding="utf-8"))["title"] for p in sorted(configurations().glob("*.toml"))
    }
