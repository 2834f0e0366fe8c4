"""Parameter sweeps of a friction-impact oscillator, every switching point located with a guarantee.

Names are imported when they are first used: `import vibrodrive` alone loads neither Numba nor HDF5.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

__all__ = [
    "ETA",
    "Method",
    "Physical",
    "Results",
    "Scan",
    "State",
    "Status",
    "Trajectory",
    "load",
    "simulate",
    "sweep",
]

_HOMES = {
    **dict.fromkeys(["ETA", "Method", "Physical", "Scan", "State", "Status"], "parameters"),
    **dict.fromkeys(["Trajectory", "simulate"], "trajectory"),
    "Results": "results",
    "load": "store_read",
    "sweep": "sweep",
}
"""Module of every public name."""

if TYPE_CHECKING:
    from vibrodrive.parameters import ETA, Method, Physical, Scan, State, Status
    from vibrodrive.results import Results
    from vibrodrive.store_read import load
    from vibrodrive.sweep import sweep
    from vibrodrive.trajectory import Trajectory, simulate


class _Package(ModuleType):
    """Keeps `vibrodrive.sweep` the function when something imports the module of the same name."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'vibrodrive' has no attribute {name!r}")
    value = getattr(import_module(f"vibrodrive.{_HOMES[name]}"), name)
    globals()[name] = value  # found without this function from now on
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
