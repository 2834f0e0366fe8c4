"""Parameter sweeps of a friction-impact oscillator. The location of every switching point is guaranteed.

Names are imported on first use, so `import vibrodrive` loads neither Numba nor HDF5.
"""

from __future__ import annotations

from importlib import import_module

from vibrodrive.version import __version__ as __version__

TYPE_CHECKING = False  # defined here to avoid the import of `typing`: see __main__

__all__ = [
    "ETA",
    "Method",
    "Results",
    "Scene",
    "State",
    "Status",
    "Trajectory",
    "bifurcations",
    "errors",
    "explore",
    "impact_map",
    "limit",
    "load",
    "orbits",
    "own",
    "plot",
    "simulate",
    "sweep",
]

_HOMES = {
    **dict.fromkeys(["Method", "Status"], "model.choices"),
    "limit": "stability.limit",
    "ETA": "model.names",
    "Scene": "model.physical",
    "State": "model.states",
    **dict.fromkeys(["Trajectory", "simulate"], "batch.trajectory"),
    "Results": "model.results",
    "bifurcations": "periodic.bifurcations",
    "explore": "explorer.notebook",
    "impact_map": "periodic.impact_map",
    "load": "store.load",
    "orbits": "periodic.search",
    "own": "model.own",
    "sweep": "jobs.call",
}
"""Module of every public name."""

if TYPE_CHECKING:
    from typing import Any

    from vibrodrive import errors, plot
    from vibrodrive.batch.trajectory import Trajectory, simulate
    from vibrodrive.explorer.notebook import explore
    from vibrodrive.jobs.call import sweep
    from vibrodrive.model.choices import Method, Status
    from vibrodrive.model.names import ETA
    from vibrodrive.model.own import own
    from vibrodrive.model.physical import Scene
    from vibrodrive.model.results import Results
    from vibrodrive.model.states import State
    from vibrodrive.periodic.bifurcations import bifurcations
    from vibrodrive.periodic.impact_map import impact_map
    from vibrodrive.periodic.search import orbits
    from vibrodrive.stability.limit import limit
    from vibrodrive.store.load import load


def __getattr__(name: str) -> Any:
    if name in ("errors", "plot"):
        return import_module(f"vibrodrive.{name}")
    if name not in _HOMES:
        from vibrodrive.model.parameters import did_you_mean

        raise AttributeError(f"module 'vibrodrive' has no attribute {name!r}{did_you_mean(name, __all__)}")
    value = getattr(import_module(f"vibrodrive.{_HOMES[name]}"), name)
    globals()[name] = value  # later accesses do not call this function
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
