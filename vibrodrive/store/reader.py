"""Read a result file, finished or not, and verify it."""

import functools
import itertools
import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibrodrive.errors import Different
from vibrodrive.model.described import Lines, counted, numbers
from vibrodrive.model.names import SCENE_AXES
from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import POINTS, SECTIONS, Quantity, length_along
from vibrodrive.model.records import functions, how_repeated
from vibrodrive.model.results import Index, Results
from vibrodrive.model.size import refuse_large_reading
from vibrodrive.model.statuses import count_statuses
from vibrodrive.store.describe import acting
from vibrodrive.store.digests import check_blocks, read_blocks, read_marks
from vibrodrive.store.header import (
    Header,
    damaged_descriptions,
    identity,
    open_result,
    read_header,
    reading,
)
from vibrodrive.store.layout import Progress, axes_of, quiet, tiles, variables_of


def read(file: h5py.File) -> Results:
    """Return the results of a sweep in an open file. Each access to an array opens the file again.

    An access raises Different if the file was replaced by the file of another sweep since.
    """
    header = read_header(file)
    plan, damaged = header.plan, dict[int, str]()
    source = functools.partial(_read, Path(file.filename).absolute(), identity(file), plan, header.rewritten, damaged)
    results = Results(plan, source, header.origin.title)
    results._origin, results._damaged = header.origin, damaged
    return results


class DamagedBlock(UserWarning):
    """Warning that blocks cannot be read and are left out. The message names these blocks in one line."""


def _read(
    path: Path,
    expected: tuple[object, ...],
    plan: Plan,
    rewritten: str,
    damaged: dict[int, str],
    name: str,
    index: Index,
) -> np.ndarray:
    """Return the array `name` of Results at an index. Blocks that are left out are added to `damaged`.

    `expected` is the identity of the file. In the array `status` the points of all damaged blocks are NOT_COMPUTED.
    """
    index = index if plan.axes else (0,)
    quantities = SECTIONS if name == "section" else (q for q in (*plan.quantities, *POINTS) if q.name == name)
    names = [q.variable for q in quantities]
    with open_result(path) as file:
        if identity(file) != expected:
            raise Different(f"{path}: was replaced since by the file of another sweep; load it again")
        variables = [q for q in variables_of(plan) if q.variable in names]
        shapes = [_shape(plan, q, index) for q in variables]
        need = sum(math.prod(shape) * q.itemsize for shape, q in zip(shapes, variables, strict=True))
        refuse_large_reading(f"{path}: {name}", need * len(names))  # two columns are read, and stacked
        earlier = dict(damaged) if name == "status" else {}
        status, done, wrong = read_marks(file, plan, earlier.items())
        arrays = [status[index]]
        if name != "status":
            parts = [part for part in _parts(plan, index) if done[part[0]]]
            arrays = [_array(file, q, plan, parts, shape, wrong) for q, shape in zip(variables, shapes, strict=True)]
            for q, array in zip(variables, arrays, strict=True):
                for _, into, _ in (part for part in parts if part[0] in wrong):
                    _points(array, q, plan)[into] = q.fill
    damaged |= wrong
    if new := {k: fault for k, fault in wrong.items() if k not in earlier}:
        places = "; ".join(f"{place(plan, k)}: {fault}" for k, fault in sorted(new.items()))
        message = f"{path}: damaged blocks are left out of {name}: {places}. {again(plan, rewritten, 'them')}"
        warnings.warn(message, DamagedBlock, stacklevel=2)
    return np.moveaxis(np.stack(arrays), 0, -1) if name == "section" else arrays[0]


Part = tuple[int, slice, slice | np.ndarray]
"""Part of a block that an index selects: number of the block, place among the selected points, rows of the block."""


def _parts(plan: Plan, index: Index) -> list[Part]:
    """Return the parts of the blocks that an index selects, which has a number or a whole slice for each axis."""
    blocks, shape = plan.blocks(), plan.shape or (1,)
    if all(isinstance(i, slice) for i in index):
        return [(k, slice(*block), slice(None)) for k, block in enumerate(blocks)]
    chosen = np.ix_(*(np.arange(n)[i] if isinstance(i, slice) else [i] for n, i in zip(shape, index, strict=True)))
    points = np.ravel_multi_index(chosen, shape).reshape(-1)
    cuts = np.searchsorted(points, [*(start for start, _ in blocks), plan.n_points]).tolist()
    spans = enumerate(itertools.pairwise(cuts))
    return [(k, slice(a, b), points[a:b] - blocks[k][0]) for k, (a, b) in spans if a < b]


def _array(
    file: h5py.File, quantity: Quantity, plan: Plan, parts: list[Part], shape: tuple[int, ...], wrong: dict[int, str]
) -> np.ndarray:
    """Return the parts of a variable as an array of this shape, with fill values elsewhere. Damaged blocks are added to
    `wrong`."""
    array = np.full(shape, quantity.fill, quantity.dtype)
    points = _points(array, quantity, plan)
    blocks = read_blocks(file, quantity, plan, np.array([k for k, _, _ in parts], int))
    for (k, values), (_, into, rows) in zip(blocks, parts, strict=True):
        if isinstance(values, str):
            wrong[k] = values
        else:
            points[into] = values[rows]
    return array


def _points(array: np.ndarray, quantity: Quantity, plan: Plan) -> np.ndarray:
    """Return an array with a row for each point."""
    return array.reshape(-1, math.prod(length_along(quantity.along, plan.settings.periods)))


def _shape(plan: Plan, quantity: Quantity, index: Index) -> tuple[int, ...]:
    """Return the shape of the part of a variable that an index selects."""
    lengths = [n for n, i in zip(plan.shape or (1,), index, strict=True) if isinstance(i, slice)]
    return *lengths, *length_along(quantity.along, plan.settings.periods)


def place(plan: Plan, k: int) -> str:
    """Describe block k of a sweep: its points and their range on each axis."""
    tile = tiles(plan)[k]
    spans = []
    for (name, values), s in zip(axes_of(plan).items(), tile.slab, strict=True):
        part = values[s]
        spans.append(f"{name} = {part[0]:g}" + (f" to {part[-1]:g}" if len(part) > 1 else ""))
    return f"block {k} (points {tile.start} to {tile.stop - 1}: {', '.join(spans)})"


def again(plan: Plan, rewritten: str, blocks: str) -> str:
    """Return the advice for damaged blocks."""
    elsewhere = ", into another file, because another program has rewritten this one" if rewritten else ""
    return f"Repeat {how_repeated(plan.record)} to compute {blocks} again{elsewhere}"


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
            "axes": {n: {"first": float(v[0]), "last": float(v[-1]), "num": len(v)} for n, v in plan.axes.items()},
            "parameters": scalars,
            "settings": {name: value for name, value in shared.items() if name not in scalars},
            "statuses": self.statuses,
            "damaged": self.complaints(),
            "rewritten": self.header.rewritten,
        }

    def lines(self) -> Lines:
        """Return the facts as text. Axes of a scene have the units of figures."""
        plan, shared = self.header.plan, acting(self.header.plan)
        lines = [("blocks", f"{self.done.sum()} of {len(self.done)}")]
        for name, values in (plan.axes | plan.together).items():
            axis = SCENE_AXES.get(name)
            ends = (values.min(), values.max()) if name in plan.together else (values[0], values[-1])
            low, high = (float(end) * (axis.scale if axis else 1.0) for end in ends)
            unit = f" {axis.shown}" if axis and axis.shown else ""
            if name in plan.together:
                lines.append(("point", f"{name} between {low:g} and {high:g}{unit}"))
            else:
                lines.append(("axis", f"{name} = {low:g} to {high:g}{unit}, {counted(len(values), 'value')}"))
        lines += [
            ("fixed", numbers({name: value for name, value in shared.items() if name in plan.scalars})),
            ("record", str(shared["record"])),
            ("switches", str(shared["method"])),
            ("periods", f"{shared['transient']} transient, {shared['periods']} recorded"),
        ]
        if functions(plan.record) and not self.complete and not self.header.rewritten:
            lines.append(("resume", f"repeat {how_repeated(plan.record).rstrip(',')}"))
        if self.header.rewritten:
            lines.append(("rewritten", f"by another program ({self.header.rewritten}): it cannot be resumed"))
        return lines + [("status", f"{name}: {counted(points, 'point')}") for name, points in self.statuses.items()]


def look(path: Path) -> Report:
    """Return the progress of a file without reading its sections. Raises the exceptions of `load`."""
    with reading(path) as file:
        header = read_header(file)
        marks = read_marks(file, header.plan)
        return Report(header, marks.done, count_statuses(marks.status), marks.wrong, [])


def verify(path: Path, progress: Progress = quiet) -> Report:
    """Read all finished blocks, check their digests and count the statuses. Raises the exceptions of `load`."""
    with reading(path) as file:
        header = read_header(file)
        plan = header.plan
        marks = check_blocks(file, plan, progress)
        general = [f"{name}: changed after it was written" for name in damaged_descriptions(file, plan)]
    return Report(header, marks.done, count_statuses(marks.status), marks.wrong, general)
