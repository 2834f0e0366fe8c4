"""Functions for result files of all kinds: `load` and `summary`."""

from __future__ import annotations

import contextlib
import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, overload

from vibrodrive.errors import ConfigError, OtherKind
from vibrodrive.model.described import Lines
from vibrodrive.model.kinds import FILES, named
from vibrodrive.model.parameters import bad, is_name
from vibrodrive.store.checksums import find_faults
from vibrodrive.store.compare import compare
from vibrodrive.store.header import kind_in, reading
from vibrodrive.store.layout import Progress, quiet
from vibrodrive.store.reader import look, verify

if TYPE_CHECKING:
    from vibrodrive.model.results import Results
    from vibrodrive.stability.limits import Limits
    from vibrodrive.store.curves import StoredCurves
    from vibrodrive.store.failures import FailureMap
    from vibrodrive.store.orbits import StoredOrbits

LOADED = [name for name, kind in FILES.items() if kind.options is not None]  # kinds that `load` reads


class Summary(NamedTuple):
    """Contents of a file, for `info` and `verify`.

    `lines` gives the contents as pairs (name, text), `facts` gives them in types of JSON, and `share` is the computed
    share, 0 to 1. The lines and facts of a damaged file, which has `faults`, may be empty, and its share NaN.
    """

    kind: str
    title: str
    share: float
    lines: Lines
    facts: dict[str, Any]
    faults: list[str]


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
    """Read a result file, finished or not.

    Parameters
    ----------
    path : str or path
        a file written by `vibrodrive sweep`, `limits`, `failures` or `orbits`, or by `vd.sweep(..., path=…)`.
    kind : "sweep", "limits", "failures", "orbits" or "curves", optional
        required kind of the file; by default any kind. Type checkers derive the type of the result from this argument;
        without it they assume Results.

    Returns
    -------
    Results
        for a file of a sweep: results as from `sweep`, with the title of the configuration. The arrays are read on
        access, even while the sweep is running. Damaged blocks count as not computed; a warning names them.
    Limits
        for a file of `vibrodrive limits`. Attributes: `axes`; `numbers`, a dict of the arrays k2, velocity, … (curve,
        axes…); `done`, True for each computed limit; `how`, the reason of each loss as text; `criterion`.
    FailureMap
        for a file of `vibrodrive failures`. Attributes: `A`; `other`, the values of the other axis; `judged`, the
        numbers of compared switches (method, A, other); `counts`, a dict with the numbers of failures of each kind
        (method, A, other); `limit`, the disturbances at which the structure is lost (method, A).
    StoredOrbits
        for a file of `vibrodrive orbits` over A. Attributes: `family`, with the orbits at each A and the bifurcations;
        `section_phase`, in rad; `title`.
    StoredCurves
        for a file of `vibrodrive orbits` over A and B. Attributes: `curves`, as from `curves`; `A` and `B`, the
        searched ranges; `max_period`, the longest period of the search; `title`.

    Raises
    ------
    NoResult
        if `path` is not a result file of this version. All exceptions of this function are in `vibrodrive.errors`.
    OtherKind (a NoResult)
        if the kind of the file is not `kind`, or if the file contains switches of single motions.
    Damaged (a NoResult)
        if the file cannot be read.
    TypeError, ValueError
        if `path` is not a file name, or `kind` is unknown.
    OSError
        if the system cannot open the file.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> r = vd.load("fig07.h5")  # made by `vibrodrive sweep configs/fig07.toml`
    >>> r.axes["eps"], r.computed
    (array([0.    , 0.0002]), 1.0)
    >>> vd.load("fig07.h5", kind="limits")
    Traceback (most recent call last):
        ...
    vibrodrive.errors.OtherKind: fig07.h5: must contain limits of stability, but contains a sweep (`vibrodrive sweep`)
    """
    path = check_path(path)
    if kind is not None and kind not in LOADED:
        raise ValueError(bad("kind", kind, "one of " + ", ".join(LOADED)))
    with reading(path, kind) as file:
        found = kind_in(file)
        if found not in LOADED:
            raise OtherKind(f"{path}: contains {FILES[found].holds}, which `load` does not read; use xarray or h5py")
        return named(FILES[found].reader)(file)


def summary(path: Path, thorough: bool = False, progress: Progress = quiet) -> Summary:
    """Return the summary of a file of any kind. If `thorough`, the complete file is read and checked.

    Raises the exceptions of `load`.
    """
    with reading(path) as file:
        kind, title = kind_in(file), str(file.attrs["title"])
        versions = {"versions": json.loads(file.attrs["versions"])}
        if kind != "sweep":
            faults = find_faults(file) if thorough else []
            if faults:
                return Summary(kind, title, math.nan, [], {}, faults)
            found = named(FILES[kind].reader)(file)
            if thorough and FILES[kind].faults:
                faults = named(FILES[kind].faults)(file, found)
            return Summary(kind, title, found.computed, found.lines(), found.facts() | versions, faults)
    report = verify(path, progress) if thorough else look(path)
    faults = report.complaints()
    if thorough:
        with contextlib.suppress(ConfigError):  # the configuration was written by another version
            differences = compare(report.header.plan, report.header.origin.parsed().plan())
            faults += [f"the configuration and the file differ: {what}" for what in differences]
    return Summary(kind, title, report.share, report.lines(), report.facts() | versions, faults)


def check_path(path: object) -> Path:
    """Return a file name as Path. Raises TypeError or ValueError with a sentence that names the value of `path`."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise TypeError(bad("path", path, "the name of a result file"))
    if not is_name(os.fspath(path)):
        raise ValueError(bad("path", path, "the name of a result file"))
    return Path(path)
