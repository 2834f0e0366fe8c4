"""Result files of every kind, by what they say they hold: read into an object, or summed up."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

from vibrodrive.errors import OtherKind
from vibrodrive.model.parameters import bad, is_name
from vibrodrive.store.header import read_kind
from vibrodrive.store.kind import KINDS

if TYPE_CHECKING:
    from vibrodrive.model.results import Results
    from vibrodrive.stability.limits import Limits
    from vibrodrive.store.curves import StoredCurves
    from vibrodrive.store.failures import FailureMap
    from vibrodrive.store.file import Summary
    from vibrodrive.store.orbits import StoredOrbits

LOADERS = {
    "sweep": "store.reader.load_sweep",
    "limits": "store.limits.load_limits",
    "failures": "store.failures.load_failures",
    "orbits": "store.orbits.load_orbits",
    "curves": "store.curves.load_curves",
}
"""What reads each kind. By name: some of them load the compiler, which a sweep is read without."""

SUMMARIES = {
    "limits": "store.limits.summary",
    "failures": "store.failures.summary",
    "orbits": "store.orbits.summary",
    "curves": "store.curves.summary",
    "switches": "store.file.summary",
}
"""What sums up each kind but sweeps, of which `reader.look` and `reader.verify` tell."""


@overload
def load(path: str | Path, kind: Literal["sweep"] | None = None) -> Results: ...
@overload
def load(path: str | Path, kind: Literal["limits"]) -> Limits: ...
@overload
def load(path: str | Path, kind: Literal["failures"]) -> FailureMap: ...
@overload
def load(path: str | Path, kind: Literal["orbits"]) -> StoredOrbits: ...
@overload
def load(path: str | Path, kind: Literal["curves"]) -> StoredCurves: ...
def load(path: str | Path, kind: str | None = None) -> Any:
    """What a result file holds, finished or not.

    Parameters
    ----------
    path : str or path
        a file that `vibrodrive sweep`, `limits`, `atlas` or `orbits`, or `vd.sweep(..., path=…)` writes.
    kind : "sweep", "limits", "failures", "orbits" or "curves", optional
        what the file must hold; whatever it holds unless given. It also tells type checkers what comes back, where
        it is no sweep.

    Returns
    -------
    Results
        of a sweep: as from `sweep`, with the title of the configuration. Its arrays are read on access, also while
        the sweep is still running. Blocks that are damaged are left out, as if they had not been computed, and named
        in a warning.
    Limits
        of `vibrodrive limits`: axes, numbers (k2, velocity, … by name, over (curve, axes…)), done, how, criterion.
    FailureMap
        of `vibrodrive atlas`: A, other, counts by kind, judged, limit, over (method, A, other).
    StoredOrbits
        of `vibrodrive orbits` over A: family (its orbits at each A, its bifurcations), section_phase, title.
    StoredCurves
        of `vibrodrive orbits` over A and B: curves (as from `curves`), A and B (ranges), max_period, title.

    Raises
    ------
    NoResult (a ValueError)
        if it is no result file of this version; OtherKind, a NoResult, if it holds something else than `kind`, or
        switches of single motions; Damaged, a NoResult, if it cannot be read.
    TypeError, ValueError
        if `path` is no name of a file, or `kind` none of these.
    OSError
        if the system refuses.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> r = vd.load("fig07.h5")  # made by `vibrodrive sweep configs/fig07.toml`
    >>> r.axes["eps"], r.computed
    (array([0.    , 0.0002]), 1.0)
    >>> vd.load("fig07.h5", kind="limits")
    Traceback (most recent call last):
        ...
    vibrodrive.errors.OtherKind: fig07.h5: holds a sweep, not limits of stability
    """
    path = check_path(path)
    if kind is not None and kind not in LOADERS:
        raise ValueError(bad("kind", kind, "one of " + ", ".join(LOADERS)))
    found = read_kind(path)
    if kind not in (None, found):
        raise OtherKind(f"{path}: holds {KINDS[found].holds}, not {KINDS[kind].holds}")
    if found not in LOADERS:
        raise OtherKind(f"{path}: holds {KINDS[found].holds}: xarray and h5py read them, `load` does not")
    return _named(LOADERS[found])(path)


def summary(path: Path, kind: str, thorough: bool = False) -> Summary:
    """What a file of a kind other than sweeps holds; `thorough` reads everything and looks for faults.

    Raises
    ------
    NoResult, OSError
        as `load`.
    """
    return _named(SUMMARIES[kind])(path, thorough)


def check_path(path: object) -> Path:
    """The name of a file. Raises TypeError or ValueError with the one sentence."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise TypeError(bad("path", path, "the name of a result file"))
    if not is_name(os.fspath(path)):
        raise ValueError(bad("path", path, "the name of a result file"))
    return Path(path)


def _named(place: str) -> Any:
    module, _, name = place.rpartition(".")
    return getattr(import_module(f"vibrodrive.{module}"), name)
