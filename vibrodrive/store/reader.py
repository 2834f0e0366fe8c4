"""Read a result file, finished or not, and verify it."""

import contextlib
import functools
import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibrodrive.errors import ConfigError, Different
from vibrodrive.model.choices import Status
from vibrodrive.model.described import Lines, axis_facts, counted, numbers
from vibrodrive.model.names import SCENE_AXES
from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import POINTS, SECTIONS, Quantity
from vibrodrive.model.records import functions, how_repeated
from vibrodrive.model.results import Index, Results
from vibrodrive.model.size import refuse_large_reading
from vibrodrive.model.statuses import count_statuses
from vibrodrive.store.checksums import check_blocks, checker, perhaps_lost, read_marks
from vibrodrive.store.compare import compare, written
from vibrodrive.store.describe import acting
from vibrodrive.store.header import (
    BROKEN,
    Header,
    damaged_descriptions,
    identity,
    interpreting,
    is_in_order,
    is_readable,
    open_result,
    read_header,
    reading,
)
from vibrodrive.store.layout import Progress, Tile, axes_of, quiet, starts, tiles, variables_of


def read(file: h5py.File) -> Results:
    """Return the results of a sweep in an open file. Each access to an array opens the file again.

    An access raises Different if the file was replaced by the file of another sweep since.
    """
    header = read_header(file)
    plan = header.plan
    seen = _Seen(header.rewritten)
    source = functools.partial(_read, Path(file.filename).absolute(), identity(file), plan, seen)
    results = Results.of(plan, source, header.origin.title)
    results._origin, results._damaged = header.origin, seen.damaged
    return results


class DamagedBlock(UserWarning):
    """Warning that blocks cannot be read and are left out. The message names these blocks in one line."""


@dataclass
class _Seen:
    """What the reading of some arrays of a file has shown: damaged blocks with their faults, blocks that are verified
    completely, and whether all statuses are verified."""

    rewritten: str
    damaged: dict[int, str] = field(default_factory=dict)
    sound: set[int] = field(default_factory=set)
    marks: bool = False


def _read(path: Path, own: tuple[object, ...], plan: Plan, seen: _Seen, name: str, index: Index) -> np.ndarray:
    """Return the array `name` of Results at an index, and add to what is seen.

    `own` is the identity of the file. In the array `status` the points of damaged blocks are NOT_COMPUTED.
    """
    index = index if plan.axes else (0,)
    wanted = SECTIONS if name == "section" else (q for q in (*plan.quantities, *POINTS) if q.name == name)
    names = [q.variable for q in wanted]
    with open_result(path) as file, interpreting(path):
        if identity(file) != own:
            raise Different(f"{path}: was replaced since by the file of another sweep; load it again")
        need = sum(math.prod(_shape(file[n], index)) * file[n].dtype.itemsize for n in names)
        refuse_large_reading(f"{path}: {name}", need * len(names))  # two columns are read, and stacked
        status, done, wrong = read_marks(file, plan, verify=not seen.marks)
        seen.marks = bool(done.all())
        if name == "status":
            arrays = [np.asarray(status[index])]
        else:
            variables = [v for v in variables_of(plan) if v.variable in names]
            arrays, left_out = _arrays(file, plan, variables, index, done, seen)
            wrong |= left_out
    seen.damaged |= wrong
    if name == "status":
        for k in seen.damaged:  # also those that another array has shown
            if (found := _place(index, tiles(plan)[k])) is not None:
                arrays[0][found[1]] = Status.NOT_COMPUTED
    if wrong:
        places = "; ".join(f"{place(plan, k)}: {fault}" for k, fault in sorted(wrong.items()))
        message = f"{path}: damaged blocks are left out of {name}: {places}. {again(plan, seen.rewritten, 'them')}"
        warnings.warn(message, DamagedBlock, stacklevel=2)
    return np.moveaxis(np.stack(arrays), 0, -1) if name == "section" else arrays[0]


def _arrays(
    file: h5py.File, plan: Plan, variables: list[Quantity], index: Index, done: np.ndarray, seen: _Seen
) -> tuple[list[np.ndarray], dict[int, str]]:
    """Return (arrays of variables at an index, faults of the blocks that are left out and have fill values).

    Only finished blocks are read, because a sweep may be writing any other block. Blocks whose values may be lost are
    verified once, and all blocks of a rewritten file, whose chunks may have no checksums, and of a wrong index. This
    index is listed only if a block is suspect or not read: zeros that exchange chunks leave a block without one.
    """
    stored = [file[v.variable] for v in variables]
    where, touched = tiles(plan), _touched(plan, index)
    places = {k: found for k in touched[done[touched]].tolist() if (found := _place(index, where[k])) is not None}
    arrays: list[np.ndarray] = []
    check: Callable[[Tile], str | None] | None = None
    wrong = {} if all(map(is_readable, stored)) else dict.fromkeys(places, "unreadable")
    if done.all() and not wrong:
        with contextlib.suppress(*BROKEN):  # after an error the arrays are read block by block
            arrays = [np.asarray(data[index]) for data in stored]
    if not arrays:
        arrays = [np.full(_shape(data, index), v.fill, data.dtype) for data, v in zip(stored, variables, strict=True)]
        for k, (within, into) in ({} if wrong else places).items():
            try:
                parts = [data[within] for data in stored]
            except BROKEN:
                wrong[k] = "unreadable"
                continue
            for array, part in zip(arrays, parts, strict=True):
                array[into] = part
    new = {k: [array[into] for array in arrays] for k, (_, into) in places.items() if k not in seen.sound}
    suspect = {k for k, parts in new.items() if any(map(perhaps_lost, parts, variables))}
    if seen.rewritten or ((suspect or wrong or len(places) < len(where)) and not is_in_order(*stored)):
        suspect = {*new}
    for k, (_, into) in places.items():
        if k in wrong or k in suspect:
            check = check or checker(file, plan)
            if fault := check(where[k]) or wrong.get(k):
                wrong[k] = fault
                for array, variable in zip(arrays, variables, strict=True):
                    array[into] = variable.fill
            else:
                seen.sound.add(k)
    return arrays, wrong


def _touched(plan: Plan, index: Index) -> np.ndarray:
    """Return the numbers of the blocks of which `index` selects a part."""
    grid = np.arange(len(plan.blocks())).reshape([len(cut) for cut in starts(plan)])
    at = tuple(i if isinstance(i, slice) else i // c for i, c in zip(index, plan.chunk or (1,), strict=True))
    return np.ravel(grid[at])


def _shape(data: h5py.Dataset, index: Index) -> tuple[int, ...]:
    """Return the shape of the part of a variable that `index` selects."""
    kept = [n for n, i in zip(data.shape, index, strict=False) if isinstance(i, slice)]
    return (*kept, *data.shape[len(index) :])


def _place(index: Index, tile: Tile) -> tuple[Index, Index] | None:
    """Return the part of a block that `index` selects, as (index of the part in the file, index of the part in the
    selected array); None if the part is empty."""
    pairs = list(zip(index, tile.slab, strict=True))
    if not all(isinstance(i, slice) or s.start <= i < s.stop for i, s in pairs):
        return None
    return tuple(s if isinstance(i, slice) else i for i, s in pairs), tuple(s for i, s in pairs if isinstance(i, slice))


def place(plan: Plan, k: int) -> str:
    """Describe block k of a sweep: its points and their range on each axis."""
    tile = tiles(plan)[k]
    spans = []
    for (name, values), s in zip(axes_of(plan).items(), tile.slab, strict=True):
        part = values[s]
        spans.append(f"{name} = {part[0]:g}" + (f" to {part[-1]:g}" if len(part) > 1 else ""))
    return f"block {k} (points {tile.start} to {tile.stop - 1}: {', '.join(spans)})"


def again(plan: Plan, rewritten: str, what: str) -> str:
    """Return the advice for damaged blocks."""
    where = ", into another file, because another program has rewritten this one" if rewritten else ""
    return f"Repeat {how_repeated(plan.record)} to compute {what} again{where}"


@dataclass(frozen=True)
class Report:
    """State of a file. `faults` maps numbers of damaged blocks to their faults; `general` lists all other faults."""

    header: Header
    done: np.ndarray  # bool (blocks,): True for each finished block
    statuses: dict[str, int]  # number of points with each status
    faults: dict[int, str]
    general: list[str]

    @property
    def complete(self) -> bool:
        return bool(self.done.all())

    @property
    def share(self) -> float:
        """Computed share of the blocks, 0 to 1."""
        return float(self.done.mean())

    @property
    def sound(self) -> bool:
        return not self.faults and not self.general

    def complaints(self) -> list[str]:
        """Return all faults, one line each."""
        plan, advice = self.header.plan, again(self.header.plan, self.header.rewritten, "this block")
        return [f"{place(plan, k)}: {fault}. {advice}" for k, fault in sorted(self.faults.items())] + self.general

    def facts(self) -> dict[str, Any]:
        """Return the contents by name, in types of JSON."""
        plan, shared = self.header.plan, acting(self.header.plan)
        scalars = {name: value for name, value in shared.items() if name in plan.scalars}
        return {
            "blocks": {"computed": int(self.done.sum()), "of": len(self.done)},
            "axes": {name: axis_facts(values) for name, values in plan.axes.items()},
            "parameters": scalars,
            "settings": {name: value for name, value in shared.items() if name not in scalars},
            "statuses": self.statuses,
            "damaged": self.complaints(),
            "rewritten": self.header.rewritten,
        }

    def lines(self) -> Lines:
        """Return the facts as text. Axes of a scene have the units of figures."""
        plan, shared = self.header.plan, acting(self.header.plan)
        found = [("blocks", f"{self.done.sum()} of {len(self.done)}")]
        for name, values in (plan.axes | plan.together).items():
            axis = SCENE_AXES.get(name)
            ends = (values.min(), values.max()) if name in plan.together else (values[0], values[-1])
            low, high = (float(end) * (axis.scale if axis else 1.0) for end in ends)
            unit = f" {axis.shown}" if axis and axis.shown else ""
            if name in plan.together:
                found.append(("point", f"{name} between {low:g} and {high:g}{unit}"))
            else:
                found.append(("axis", f"{name} = {low:g} to {high:g}{unit}, {counted(len(values), 'value')}"))
        found += [
            ("fixed", numbers({name: value for name, value in shared.items() if name in plan.scalars})),
            ("record", str(shared["record"])),
            ("switches", str(shared["method"])),
            ("periods", f"{shared['transient']} transient, {shared['periods']} recorded"),
        ]
        if functions(plan.record) and not self.complete and not self.header.rewritten:
            found.append(("resume", f"repeat {how_repeated(plan.record).rstrip(',')}"))
        if self.header.rewritten:
            found.append(("rewritten", f"by another program ({self.header.rewritten}): it cannot be resumed"))
        return found + [("status", f"{name}: {counted(points, 'point')}") for name, points in self.statuses.items()]


def look(path: Path) -> Report:
    """Return the progress of a file without reading its sections. Raises the exceptions of `load`."""
    with reading(path) as file:
        header = read_header(file)
        status, done, wrong = read_marks(file, header.plan)
        return Report(header, done, count_statuses(status), wrong, [])


def verify(path: Path, progress: Progress = quiet) -> Report:
    """Read all finished blocks, check their checksums and count the statuses. Raises the exceptions of `load`."""
    with reading(path) as file:
        header = read_header(file)
        plan = header.plan
        status, done, wrong = check_blocks(file, tiles(plan), plan, progress)
        general = [f"{name}: changed after it was written" for name in damaged_descriptions(file, plan)]
    return Report(header, done, count_statuses(status), wrong, general)


def contradictions(header: Header) -> list[str]:
    """Return in words what the configuration in a file says otherwise than its header."""
    with contextlib.suppress(ConfigError):  # the configuration was written by another version
        differences = compare(header.plan, written(header.plan, header.origin.parsed().plan()))
        return [f"the configuration and the file differ: {what}" for what in differences]
    return []
