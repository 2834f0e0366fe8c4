"""Reading a result file, finished or not, and proving that it is whole."""

from __future__ import annotations

import functools
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibrodrive.model.parameters import Status, bad
from vibrodrive.model.plan import Plan
from vibrodrive.model.results import Index, Results
from vibrodrive.store.checksums import check_block, read_marks
from vibrodrive.store.header import Damaged, Header, damaged_coordinates, open_result, read_header
from vibrodrive.store.layout import Progress, Tile, axes_of, quiet, tiles

__all__ = ["Report", "load", "look", "verify"]


def load(path: str | Path) -> Results:
    """The results of a sweep in a file; arrays are read on access. Works while the sweep is still running.

    Parameters
    ----------
    path : str or path
        a file that `vibrodrive sweep` writes.

    Returns
    -------
    Results
        as of `sweep`, and with the title of the configuration.

    Raises
    ------
    NoResult (a ValueError)
        if it is no result file of this version; OtherKind, a NoResult, if it holds limits, orbits or failures and
        no sweep; Damaged, a NoResult, if it cannot be read.
    TypeError, ValueError
        if `path` is no name of a file.
    OSError
        if the system refuses.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> r = vd.load("fig07.h5")  # made by `vibrodrive sweep configs/fig07.toml`
    >>> r.axes["eps"], r.computed
    (array([0.    , 0.0002]), 1.0)
    """
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise TypeError(bad("path", path, "the name of a result file"))
    if not os.fspath(path) or "\0" in os.fspath(path):
        raise ValueError(bad("path", path, "the name of a result file"))
    path = Path(path)
    with open_result(path) as file:
        header = read_header(file)
    plan = header.plan
    return Results(
        plan.axes,
        plan.scalars,
        plan.settings,
        functools.partial(_read, path.absolute(), plan),
        title=header.origin.title,
        record=plan.record,
    )


def _read(path: Path, plan: Plan, name: str, index: Index) -> np.ndarray:
    index = index if plan.axes else (0,)
    with open_result(path) as file:
        where = tiles(plan)
        _, done, wrong = read_marks(file, where)
        if wrong:
            k, fault = next(iter(wrong.items()))
            raise Damaged(_damaged(path, k, fault))
        finished, whole = [(k, where[k]) for k in np.flatnonzero(done).tolist()], bool(done.all())
        if name != "section":
            return _gather(file, plan, name, index, finished, whole)
        both = [_gather(file, plan, f"section_{q}", index, finished, whole) for q in ("xi", "dxi")]
        return np.moveaxis(np.stack(both), 0, -1)


def _gather(
    file: h5py.File, plan: Plan, name: str, index: Index, finished: list[tuple[int, Tile]], whole: bool
) -> np.ndarray:
    data = file[name]
    try:
        if whole:
            return np.asarray(data[index])
        return _blockwise(data, index, finished)
    except OSError:
        faults = ((k, check_block(file, tile, plan)) for k, tile in finished)
        k, fault = next(((k, f) for k, f in faults if f), (-1, "unreadable"))
        raise Damaged(_damaged(Path(file.filename), k, fault)) from None


def _blockwise(data: h5py.Dataset, index: Index, finished: list[tuple[int, Tile]]) -> np.ndarray:
    """data[index] with nothing read but committed blocks: another may be half written at this moment."""
    kept = [n for n, i in zip(data.shape, index, strict=False) if isinstance(i, slice)]
    out = np.full((*kept, *data.shape[len(index) :]), data.fillvalue, data.dtype)
    for _, tile in finished:
        source: list[Any] = []
        target = []
        for i, s in zip(index, tile.slab, strict=True):
            if isinstance(i, slice):
                source.append(s)
                target.append(s)
            elif s.start <= i < s.stop:
                source.append(i)
            else:
                break
        else:
            out[tuple(target)] = data[tuple(source)]
    return out


def _damaged(path: Path, k: int, fault: str) -> str:
    return f"{path}: block {k} is damaged ({fault}): the same sweep command computes it again"


@dataclass(frozen=True)
class Report:
    """State of a file. `faults` maps damaged blocks to what is wrong with them, `general` names the rest."""

    header: Header
    done: np.ndarray  # bool, one per block
    statuses: dict[str, int]  # points per status
    faults: dict[int, str]
    general: list[str]
    n_bytes: int

    @property
    def complete(self) -> bool:
        return bool(self.done.all())

    @property
    def share(self) -> float:
        """Share of the blocks that are computed, 0 to 1."""
        return float(self.done.mean())

    @property
    def sound(self) -> bool:
        return not self.faults and not self.general

    def place(self, k: int) -> str:
        """Block k in words: its points, and where they lie on the axes."""
        plan = self.header.plan
        tile = tiles(plan)[k]
        spans = []
        for (name, values), s in zip(axes_of(plan).items(), tile.slab, strict=True):
            part = values[s]
            spans.append(f"{name} = {part[0]:g}" + (f" to {part[-1]:g}" if len(part) > 1 else ""))
        return f"block {k} (points {tile.start} to {tile.stop - 1}: {', '.join(spans)})"


def look(path: Path) -> Report:
    """How far a file is, without reading its sections. Raises as `load`."""
    with open_result(path) as file:
        header = read_header(file)
        where = tiles(header.plan)
        status, done, wrong = read_marks(file, where)
        return Report(header, done, _count(status), wrong, [], path.stat().st_size)


def verify(path: Path, progress: Progress = quiet) -> Report:
    """Read every committed block, check its checksums, and count. Raises as `load`."""
    with open_result(path) as file:
        header = read_header(file)
        plan = header.plan
        where = tiles(plan)
        status, done, wrong = read_marks(file, where)
        for k in np.flatnonzero(done).tolist():
            fault = check_block(file, where[k], plan)
            if fault:
                wrong[k] = fault
            progress(k + 1, len(where))
        general = [f"coordinate {name}: not what was written" for name in damaged_coordinates(file, plan)]
        return Report(header, done, _count(status), wrong, general, path.stat().st_size)


def _count(status: np.ndarray) -> dict[str, int]:
    values, points = np.unique(status, return_counts=True)
    known = {int(s): s.name for s in Status}
    return {known.get(v, f"status {v}"): n for v, n in zip(values.tolist(), points.tolist(), strict=True)}
