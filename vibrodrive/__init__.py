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
    "bifurcations",
    "impact_map",
    "limit",
    "load",
    "orbits",
    "simulate",
    "sweep",
]

_HOMES = {
    **dict.fromkeys(["ETA", "Method", "Physical", "Scan", "State", "Status"], "parameters"),
    **dict.fromkeys(["Trajectory", "simulate"], "trajectory"),
    "Results": "results",
    "bifurcations": "orbit_bifurcations",
    "impact_map": "orbit_map",
    "limit": "limits",
    "load": "store_read",
    "orbits": "orbit_search",
    "sweep": "sweep",
}
"""Module of every public name."""

if TYPE_CHECKING:
    from vibrodrive.limits import limit
    from vibrodrive.orbit_bifurcations import bifurcations
    from vibrodrive.orbit_map import impact_map
    from vibrodrive.orbit_search import orbits
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
