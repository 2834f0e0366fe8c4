"""Modules of higher floors, for methods that are there for convenience: `Results.plot`, `Trajectory.plot`, …"""

from __future__ import annotations

from importlib import import_module
from typing import Any


def above(module: str) -> Any:
    """A module of a floor above the caller's, found by its name when it is needed: the caller depends on none."""
    return import_module(f"vibrodrive.{module}")
