"""Configuration files that are part of the program."""

import tomllib
from pathlib import Path


def configurations() -> Path:
    """Return the directory of the configuration files: in an installed package, or beside the package in a clone."""
    package = Path(__file__).parents[1]
    return package / "configs" if (package / "configs").is_dir() else package.parent / "configs"


def titles() -> dict[str, str]:
    """Return the title of each configuration by its name, in alphabetical order."""
    return {
        p.stem: tomllib.loads(p.read_text(encoding="utf-8"))["title"] for p in sorted(configurations().glob("*.toml"))
    }
