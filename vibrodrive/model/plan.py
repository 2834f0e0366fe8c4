"""Plan of a sweep: its points, their order and their blocks. This module does not import Numba.

The points are the product of the axes, flattened in C-order. One axis, `point`, may represent several parameters that
change together. A block is a contiguous range of points, which a result file has with a digest.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from vibrodrive.model.choices import Method
from vibrodrive.model.names import PARAMETERS, SCENE, SETTINGS, Settings
from vibrodrive.model.parameters import COLUMNS, cast_arguments, missing
from vibrodrive.model.physical import follow_scene, with_A_and_B, with_scene
from vibrodrive.model.quantities import Quantity
from vibrodrive.model.records import SECTION, Records, check_record, quantities
from vibrodrive.model.variables import POINT, Variable, Variables, along, constants

BLOCK_BYTES = 4 << 20
"""Largest number of bytes of the records of a block of several points. Larger blocks are written faster. Smaller blocks
need less memory."""

BLOCK_WORK = 2e6
"""Largest work of a block, in microseconds of one core (`Settings.work`). If a sweep is stopped, the unfinished blocks
are lost."""

LEAST_POINTS = 64
"""Least number of points of a block, even if their work exceeds BLOCK_WORK: as many motions advance together on each
core (LANES in kernels/lane.py), so fewer points would not finish earlier. Motions that are computed one by one have no
such limit."""

WAVE_BYTES = 8 << 20
WAVE_POINTS = 8192
"""Largest number of bytes and of points of a wave, the blocks that are computed together. Some lanes of the kernels
(kernels/engine.py) become idle towards the end of a wave. With this number of points idle lanes cost little."""


IN_FLIGHT = 16
"""Largest number of submitted tasks of an executor whose number of workers is unknown. It bounds the memory of finished
tasks."""

DEFAULTS = constants({name: row.default for name, row in PARAMETERS.items() if row.default is not None})

SAMPLED = 100  # largest number of values of the axis `point` that are checked before a warning


@dataclass(frozen=True)
class Plan:
    """A checked sweep.

    variables : the parameters and the quantities of the scene, if any; those that vary in the order of the call or of
        the configuration. If A or B depends on a variable of the scene that varies, it is none of them, but is
        computed for each point.
    record : the records (records.py).
    tiling : shape of a block in an existing file, so that a version with other block sizes can resume the sweep; None
        for the shape that `chunk` computes.
    stored : quantities in an existing file, whose version may have recorded fewer, or with other types; None for all
        quantities of the records.
    axes : the dimensions by name, in order, with the coordinates of each: the values of its variable, or 0, 1, ….
    scalars : the variables with one value.
    """

    variables: Variables
    settings: Settings
    tiling: tuple[int, ...] | None = None
    record: Records = (SECTION,)
    stored: tuple[Quantity, ...] | None = None
    axes: dict[str, np.ndarray] = field(init=False, repr=False, compare=False)
    scalars: dict[str, float] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        axes: dict[str, np.ndarray] = {}
        scalars: dict[str, float] = {}
        for name, (values, dimension) in self.variables.items():
            if not dimension:
                scalars[name] = values
            elif dimension not in axes:
                variable = self.variables.get(dimension)
                axes[dimension] = np.arange(len(values)) if variable is None else variable.values
        object.__setattr__(self, "axes", axes)
        object.__setattr__(self, "scalars", scalars)

    @cached_property
    def together(self) -> dict[str, np.ndarray]:
        """Variables that change together along the dimension POINT."""
        return {name: variable.values for name, variable in self.variables.items() if variable.dimension == POINT}

    @cached_property
    def varied(self) -> dict[str, np.ndarray]:
        """Variables along a dimension."""
        return {name: variable.values for name, variable in self.variables.items() if variable.dimension}

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the dimensions."""
        return tuple(map(len, self.axes.values()))

    @property
    def values(self) -> dict[str, Any]:
        """All variables by name, without their dimensions."""
        return {name: variable.values for name, variable in self.variables.items()}

    def at(self, index: Mapping[str, Any]) -> dict[str, Any]:
        """Return all variables by name, those along a dimension of `index` at its places."""
        return {name: variable.at(index).values for name, variable in self.variables.items()}

    def having(self, values: Mapping[str, float]) -> "Plan":
        """Return the plan with these values of parameters."""
        return replace(self, variables={**self.variables, **constants(values)})

    def written(self, name: str) -> Any:
        """Return the value of a variable as a number, or its values as a list."""
        values = self.variables[name].values
        return values.tolist() if self.variables[name].dimension else values

    def grid(self) -> dict[str, Any]:
        """Return all variables by name, each with all dimensions, of length 1 where it does not vary."""
        return self.at(dict(zip(self.axes, np.ix_(*map(np.arange, self.shape)), strict=True)))

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities of the records, without the section."""
        return quantities(self.record) if self.stored is None else self.stored

    @property
    def point_bytes(self) -> int:
        """Number of bytes of the records of one point."""
        return sum(record.point_bytes(self.settings.periods) for record in self.record)

    @property
    def per_point(self) -> bool:
        """True if the points are computed one by one, by stability/per_point.py."""
        return any(record.per_point for record in self.record)

    @property
    def seeks(self) -> bool:
        """True if each point is a search for the limit of a disturbance."""
        return any(record.seeks for record in self.record)

    @property
    def sectioned(self) -> bool:
        """True if sections are recorded."""
        return any(q.along == "period" for record in self.record for q in record.quantities)

    @property
    def bounded(self) -> bool:
        """True if error bounds are recorded."""
        return any(record.bounded for record in self.record)

    @property
    def summarised(self) -> bool:
        """True if summaries are recorded."""
        return any(record.summarised for record in self.record)

    @property
    def n_points(self) -> int:
        return math.prod(self.shape)

    def points(self, start: int, stop: int) -> np.ndarray:
        """Return the points `start` to `stop` - 1 as rows: float64 (stop - start, len(COLUMNS))."""
        return self.rows(np.arange(start, stop))

    def rows(self, numbers: np.ndarray) -> np.ndarray:
        """Return the points with these numbers, int64 (n,), as float64 (n, len(COLUMNS))."""
        out = np.empty((len(numbers), len(COLUMNS)))
        if not self.axes:  # A and B are scalars, too
            out[:] = [self.scalars[name] for name in COLUMNS]
            return out
        index = dict(zip(self.axes, np.unravel_index(numbers, self.shape), strict=True))
        values = with_A_and_B(self.at(index))
        for c, name in enumerate(COLUMNS):
            out[:, c] = values[name]
        return out

    def extremes(self) -> np.ndarray:
        """Return the points at all combinations of the least and largest values of the axes, as `points` does.

        For the axis `point` up to SAMPLED of its values are used instead.
        """
        indices = [
            [np.argmin(values), np.argmax(values)]
            if name in self.variables
            else np.linspace(0, len(values) - 1, SAMPLED).astype(int)
            for name, values in self.axes.items()
        ]
        corners = np.ix_(*map(np.unique, indices))
        return self.rows(np.ravel_multi_index(corners, self.shape).reshape(-1) if indices else np.zeros(1, int))

    def ends(self) -> list[tuple[float, float, float, float]]:
        """Return (A, B, ε, η) at the `extremes`."""
        columns = [COLUMNS.index(name) for name in ("A", "B", "eps", "eta")]
        return [tuple(row) for row in self.extremes()[:, columns].tolist()]

    def single(self, at: int) -> "Plan":
        """Return the plan of the one point with the number `at`, with its scene, if any, and without axes."""
        index = dict(zip(self.axes, np.unravel_index(at, self.shape), strict=True)) if self.axes else {}
        point = dict(zip(COLUMNS, self.points(at, at + 1)[0].tolist(), strict=True))
        scene = {name: float(value) for name, value in self.at(index).items() if name in SCENE}
        return replace(self, variables=constants(point | scene), tiling=None)

    def arguments(self, at: int) -> dict[str, Any]:
        """Return the arguments of `simulate` for the point with the number `at`."""
        point: dict[str, Any] = dict(zip(COLUMNS, self.points(at, at + 1)[0].tolist(), strict=True))
        s = self.settings
        point |= dict.fromkeys(s.idle)
        if point["dtau"] is not None and math.isnan(point["dtau"]):  # no grid step
            point["dtau"] = None
        return point | vars(s) | {"method": Method(s.method)}

    @property
    def sought(self) -> str:
        """The disturbance whose limit the record `limit` is: ε, or Δτ with a grid method without a step."""
        grid = "dtau" not in self.settings.idle
        dtau = self.variables["dtau"]
        return "dtau" if grid and not dtau.dimension and math.isnan(dtau.values) else "eps"

    @property
    def chunk(self) -> tuple[int, ...]:
        """Shape of a block: 1 along the leading axes, a part of one axis, and the full length of the trailing axes."""
        if self.tiling is not None:
            return self.tiling
        most = min(record.block_points for record in self.record)
        most = most if self.per_point else min(most, self._most_points)
        rows = max(1, min(most, BLOCK_BYTES // self.point_bytes))
        chunk = [1] * len(self.shape)
        for k in range(len(self.shape) - 1, -1, -1):
            chunk[k] = -(-self.shape[k] // -(-self.shape[k] // rows))  # blocks of nearly equal length
            rows //= chunk[k]
            if chunk[k] < self.shape[k] or rows == 0:
                break
        return tuple(chunk)

    @property
    def n_blocks(self) -> int:
        return math.prod(-(-n // k) for n, k in zip(self.shape, self.chunk, strict=True))

    @property
    def wave_points(self) -> int:
        """Largest number of points of a wave of several blocks."""
        most = min(WAVE_POINTS, WAVE_BYTES // self.point_bytes)
        corners = self._corners()
        if {point["eps"] == 0.0 for point in corners} == {True, False}:
            # the points with ε = 0 are computed first, and may finish no block
            most = min(most, int(BLOCK_WORK // max(self._work(point | {"eps": 0.0}) for point in corners)))
        return max(1, most)

    @property
    def point_work(self) -> float:
        """Largest work of a point (`Settings.work`)."""
        return max(map(self._work, self._corners()))

    @property
    def _most_points(self) -> int:
        """Number of points whose work is BLOCK_WORK, but at least the least number of points of a block.

        The work is not computed if all points are within this least number.
        """
        least = 1 if self.settings.one_by_one(self.bounded) else LEAST_POINTS
        return least if self.n_points <= least else max(least, int(BLOCK_WORK // self.point_work))

    def _work(self, point: Mapping[str, float]) -> float:
        five = (point[name] for name in ("A", "B", "eps", "eta", "dtau"))
        return self.settings.work(*five, summary=self.summarised, bounded=self.bounded)

    def _corners(self) -> list[dict[str, float]]:
        """Return A, B, ε, η and Δτ by name at all combinations of the least and largest values of the parameters.

        One of these points has the largest work, which is monotone in each of them, as A and B are in each quantity of
        a scene.
        """
        values = self.values
        names = [name for name in ("A", "B", "eps", "eta", "dtau", *SCENE) if name in values]
        ends = ({v} if isinstance(v := values[n], float) else {float(v.min()), float(v.max())} for n in names)
        return [with_A_and_B(dict(zip(names, values, strict=True))) for values in product(*ends)]

    def blocks(self) -> list[tuple[int, int]]:
        """Return (number of the first point, number of the last point + 1) for every block."""
        if self.n_points == 1:
            return [(0, 1)]
        shape, chunk = self.shape, self.chunk
        cut = next((k for k in range(len(shape)) if chunk[k] > 1), len(shape) - 1)
        tail = math.prod(shape[cut + 1 :])
        line = shape[cut] * tail if shape else 1
        step = chunk[cut] * tail if shape else 1
        return [
            (base + s, base + min(s + step, line))
            for base in range(0, self.n_points, line)
            for s in range(0, line, step)
        ]


def make_plan(arguments: Mapping[str, object]) -> Plan:
    """Check all arguments of a sweep and return its plan.

    The keys are the names of the arguments of `sweep`. Sequences become axes. The quantities of a scene (see `Scene`)
    may replace A and B, or only B if `a0` is missing. Raises TypeError or ValueError with a message that gives the
    argument, its value and the allowed values (`bad`).
    """
    values = cast_arguments(with_scene(arguments))
    records = check_record(values.pop("record")) if "record" in values else (SECTION,)
    settings = {name: values.pop(name) for name in SETTINGS if name in values}
    for record in records:
        if record.periods is not None:
            settings.setdefault("periods", record.periods)
    variables: dict[str, Variable] = {}
    for name, value in values.items():
        if name == "points":
            variables |= along(POINT, value)
        else:
            variables[name] = Variable(value, "" if isinstance(value, float) else name)
    varied = [name for name, variable in variables.items() if variable.dimension]  # axes are last, in their order
    defaults = {name: default for name, default in DEFAULTS.items() if name not in varied} if varied else DEFAULTS
    plan = Plan(defaults | variables, Settings(**settings), record=records)
    if not SCENE.keys().isdisjoint(plan.variables):
        scalars = dict(plan.scalars)
        follow_scene(plan.varied, scalars)
        plan = replace(plan, variables=constants(scalars) | {name: variables[name] for name in varied})
    if plan.variables.keys().isdisjoint(("A", "a0")):
        raise TypeError(missing("A", f", {PARAMETERS['A'].allowed}"))
    if plan.sought == "dtau" and not plan.seeks:
        method = plan.settings.method_name
        raise ValueError(missing("dtau", f" for method = {method!r}, {PARAMETERS['dtau'].allowed}"))
    for record in records:
        record.refuse(plan)
    return plan


def of_motion(written: Mapping[str, object]) -> dict[str, object]:
    """Return those of the arguments that give A, B and a scene."""
    return {
        name: value
        for name, value in written.items()
        if name in ("A", "B") or (name in ("scene", *SCENE) and value is not None)
    }


def plan_motion(written: Mapping[str, object]) -> Plan:
    """Return the plan of one motion with the arguments of `of_motion`. Raises TypeError or ValueError."""
    plan = make_plan(of_motion(written))
    refuse_axes(plan.axes)
    return plan


def refuse_axes(axes: Mapping[str, np.ndarray], hint: str = "") -> None:
    """Refuse an axis where one number is needed. Raises TypeError."""
    for name, values in axes.items():
        raise TypeError(f"{name} = array of length {len(values)}: must be one number{hint}")
