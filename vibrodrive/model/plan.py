"""Plan of a sweep: its points, their order and their blocks. This module does not import Numba.

The points are the product of the axes, flattened in C-order. One axis, `point`, may represent several parameters that
change together. A block is a contiguous range of points, which a result file has with a digest.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import product
from typing import Any

import numpy as np

from vibrodrive.model.choices import ACTS_ON, Method, used_by
from vibrodrive.model.names import AXES, PARAMETERS, SCENE, SETTINGS, Settings
from vibrodrive.model.parameters import COLUMNS, bad, check, check_setting, real_array, unknown
from vibrodrive.model.physical import PACES, Scene, check_scene, refuse_incomplete, with_A_and_B
from vibrodrive.model.quantities import Quantity
from vibrodrive.model.records import SECTION, Records, check_record, quantities

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

DEFAULTS = {name: row.default for name, row in PARAMETERS.items() if row.default is not None}

POINT = "point"  # axis of a sweep along which parameters change together; its values are 0, 1, …
SAMPLED = 100  # largest number of values of the axis `point` that are checked before a warning


@dataclass(frozen=True)
class Plan:
    """A checked sweep.

    axes : values of each axis, in the order of the call or of the configuration. Quantities of the scene (SCENE_AXES)
        may be axes.
    scalars : parameters with one value, and the quantities of the scene, if any, that are not axes. If A or B depends
        on an axis of the scene, it is neither axis nor scalar, but is computed for each point.
    record : the records (records.py).
    together : values of the parameters, and quantities of the scene, that change together along the axis POINT.
    tiling : shape of a block in an existing file, so that a version with other block sizes can resume the sweep; None
        for the shape that `chunk` computes.
    stored : quantities in an existing file, whose version may have recorded fewer, or with other types; None for all
        quantities of the records.
    """

    axes: dict[str, np.ndarray]
    scalars: dict[str, float]
    settings: Settings
    tiling: tuple[int, ...] | None = None
    record: Records = (SECTION,)
    together: dict[str, np.ndarray] = field(default_factory=dict)
    stored: tuple[Quantity, ...] | None = None

    @property
    def varied(self) -> dict[str, np.ndarray]:
        """Values of all parameters and quantities of the scene that vary, each along its axis or along POINT."""
        return {name: values for name, values in self.axes.items() if name != POINT} | self.together

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities of the records, without the section."""
        return quantities(self.record) if self.stored is None else self.stored

    @property
    def point_bytes(self) -> int:
        """Number of bytes of the records of one point."""
        return sum(one.point_bytes(self.settings.periods) for one in self.record)

    @property
    def per_point(self) -> bool:
        """True if the points are computed one by one, by stability/per_point.py."""
        return any(one.per_point for one in self.record)

    @property
    def seeks(self) -> bool:
        """True if each point is a search for the limit of a disturbance."""
        return any(one.seeks for one in self.record)

    @property
    def sectioned(self) -> bool:
        """True if sections are recorded."""
        return any(q.along == "period" for one in self.record for q in one.quantities)

    @property
    def bounded(self) -> bool:
        """True if error bounds are recorded."""
        return any(one.bounded for one in self.record)

    @property
    def summarised(self) -> bool:
        """True if summaries are recorded."""
        return any(one.summarised for one in self.record)

    @cached_property
    def shape(self) -> tuple[int, ...]:
        return tuple(map(len, self.axes.values()))

    @property
    def n_points(self) -> int:
        return math.prod(self.shape)

    def points(self, start: int, stop: int) -> np.ndarray:
        """Return the points `start` to `stop` - 1 as rows: float64 (stop - start, len(COLUMNS))."""
        return self.rows(np.arange(start, stop))

    def rows(self, which: np.ndarray) -> np.ndarray:
        """Return the points with the numbers `which`, int64 (n,), as float64 (n, len(COLUMNS))."""
        out = np.empty((len(which), len(COLUMNS)))
        if not self.axes:  # A and B are scalars, too
            out[:] = [self.scalars[name] for name in COLUMNS]
            return out
        index = np.unravel_index(which, self.shape)
        at = dict(zip(self.axes, index, strict=True))
        along = {name: self.axes[name][k] for name, k in at.items() if name != POINT}
        along |= {name: values[at[POINT]] for name, values in self.together.items()}
        values = with_A_and_B({**self.scalars, **along})
        for c, name in enumerate(COLUMNS):
            out[:, c] = values[name]
        return out

    def extremes(self) -> np.ndarray:
        """Return the points at all combinations of the least and largest values of the axes, as `points` does.

        For the axis `point` up to SAMPLED of its values are used instead.
        """
        some = [
            np.unique(
                np.linspace(0, len(values) - 1, SAMPLED).astype(int)
                if name == POINT
                else [np.argmin(values), np.argmax(values)]
            )
            for name, values in self.axes.items()
        ]
        which = np.ravel_multi_index(np.ix_(*some), self.shape).reshape(-1) if some else np.zeros(1, int)
        return self.rows(which)

    def ends(self) -> list[tuple[float, float, float, float]]:
        """Return (A, B, ε, η) at the `extremes`."""
        columns = [COLUMNS.index(name) for name in ("A", "B", "eps", "eta")]
        return [tuple(row) for row in self.extremes()[:, columns].tolist()]

    def single(self, at: int) -> "Plan":
        """Return the plan of the one point with the number `at`, with its scene, if any, and without axes."""
        index = dict(zip(self.axes, np.unravel_index(at, self.shape), strict=True)) if self.axes else {}
        along = {name: float(self.axes[name][k]) for name, k in index.items() if name in SCENE}
        along |= {name: float(values[index[POINT]]) for name, values in self.together.items() if name in SCENE}
        point = dict(zip(COLUMNS, self.points(at, at + 1)[0].tolist(), strict=True))
        scene = {name: value for name, value in self.scalars.items() if name in SCENE}
        return replace(self, axes={}, together={}, scalars=point | scene | along, tiling=None)

    def arguments(self, at: int) -> dict[str, Any]:
        """Return the arguments of `simulate` for the point with the number `at`."""
        point: dict[str, Any] = dict(zip(COLUMNS, self.points(at, at + 1)[0].tolist(), strict=True))
        s = self.settings
        point |= dict.fromkeys(idle(s.method))
        if point["dtau"] is not None and math.isnan(point["dtau"]):  # no grid step
            point["dtau"] = None
        return point | vars(s) | {"method": Method(s.method)}

    @property
    def sought(self) -> str:
        """The disturbance whose limit the record `limit` is: ε, or Δτ with a grid method without a step."""
        grid = "dtau" not in idle(self.settings.method)
        return "dtau" if grid and "dtau" not in self.varied and math.isnan(self.scalars["dtau"]) else "eps"

    @property
    def chunk(self) -> tuple[int, ...]:
        """Shape of a block: 1 along the leading axes, a part of one axis, and the full length of the trailing axes."""
        if self.tiling is not None:
            return self.tiling
        most = min(one.block_points for one in self.record)
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
        given: dict[str, Any] = {**self.scalars, **self.varied}
        names = [name for name in ("A", "B", "eps", "eta", "dtau", *SCENE) if name in given]
        ends = ({v} if isinstance(v := given[n], float) else {float(v.min()), float(v.max())} for n in names)
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


@cache
def idle(method: int) -> tuple[str, ...]:
    """Return the parameters that a method does not use."""
    return tuple(name for name, methods in ACTS_ON.items() if method not in methods)


def refuse_idle(plan: Plan, written: Mapping[str, object]) -> None:
    """Refuse a given parameter or an axis that the method of the plan does not use. Raises ValueError."""
    given = {**plan.varied, **written}
    for name in idle(plan.settings.method):
        value = given.get(name)
        if value is not None:
            value = value.tolist() if isinstance(value, np.ndarray) else value
            method = plan.settings.method_name
            allowed = f"left out with method = {method!r}, because it is used by {used_by(name)} only"
            raise ValueError(bad(name, value, allowed))


def make_plan(arguments: Mapping[str, object]) -> Plan:
    """Check all arguments of a sweep and return its plan.

    The keys are the names of the arguments of `sweep`. Sequences become axes. The quantities of a scene (see `Scene`)
    may replace A and B, or only B if `a0` is missing. Raises TypeError or ValueError with a message that gives the
    argument, its value and the allowed values (`bad`).
    """
    arguments = _with_scene(arguments)
    chosen: dict[str, int] = {}
    record: Records = (SECTION,)
    axes: dict[str, np.ndarray] = {}
    together: dict[str, np.ndarray] = {}
    scalars = {**DEFAULTS}
    for key, value in arguments.items():
        if key in SETTINGS:
            chosen[key] = check_setting(key, value)
        elif key == "record":
            record = check_record(value)
        elif key in PARAMETERS or key in SCENE:
            _sort_in(key, value, axes, scalars)
        elif key != "points":
            raise TypeError(unknown("argument", key, [*COLUMNS, *SETTINGS, *SCENE, "record", "points"]))
        elif value is not None:
            together = _together(value, arguments)
            scalars = {name: default for name, default in scalars.items() if name not in together}
            axes[POINT] = np.arange(len(next(iter(together.values()))))
    given = {*scalars, *axes, *together}
    if not given.isdisjoint(SCENE):
        _follow_scene({**axes, **together}, scalars, {**arguments, **together})
    if given.isdisjoint(("A", "a0")):
        raise TypeError("A is missing: must be given, " + PARAMETERS["A"].allowed)
    for one in record:
        if one.periods is not None:
            chosen.setdefault("periods", one.periods)
    plan = Plan(axes, scalars, Settings(**chosen), record=record, together=together)
    if plan.sought == "dtau" and not plan.seeks:
        name = plan.settings.method_name
        raise ValueError(f"dtau is missing: must be given for method = {name!r}, {PARAMETERS['dtau'].allowed}")
    for one in record:
        one.refuse(plan)
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


def _sort_in(key: str, value: object, axes: dict[str, np.ndarray], scalars: dict[str, float]) -> None:
    """Check a parameter or a quantity of the scene, and add it to the axes or to the scalars."""
    if value is None and key in PARAMETERS:
        if PARAMETERS[key].default is None:
            raise TypeError(bad(key, value, PARAMETERS[key].allowed))
        return
    if key in SCENE and key not in AXES and np.ndim(value):  # type: ignore[arg-type]
        check_scene(key, value)  # g is no axis: refused, because it is no number
    values = _checked(key, value)
    if isinstance(values, float):
        scalars[key] = values
    else:
        axes[key] = values


def _with_scene(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments with the quantities of `scene` instead of it, apart from an a0 of 0, which A replaces. Another
    argument, or a key of `points`, replaces a quantity of the scene. Raises TypeError."""
    given = {name: value for name, value in arguments.items() if value is not None or name not in (*SCENE, "scene")}
    scene = given.pop("scene", None)
    if scene is None:
        return given
    if not isinstance(scene, Scene):
        raise TypeError(bad("scene", scene, "a Scene"))
    if given.get("A", 0.0) is None:  # as in the signature
        del given["A"]
    keys = getattr(given.get("points"), "keys", None)
    replaced = {*given, *(keys() if callable(keys) else ()), *([] if scene.a0 else ["a0"])}
    replaced |= PACES if PACES & replaced else set()
    return {name: value for name, value in scene.given.items() if name not in replaced} | given


def _together(value: Any, arguments: Mapping[str, object]) -> dict[str, np.ndarray]:
    """Return the parameters and quantities of a scene that change together, checked.

    Raises TypeError or ValueError.
    """
    allowed = 'sequences of one length, by parameter name, such as {"A": [3.0, 3.1], "eps": [0.0, 1e-4]}'
    if not callable(getattr(value, "keys", None)) or not hasattr(value, "__getitem__"):
        raise TypeError(bad("points", value, allowed))
    found = {}
    for name in value.keys():  # noqa: SIM118 - also for a pandas.DataFrame
        if name not in AXES:
            raise ValueError(unknown("key of points", name, AXES))
        if arguments.get(name) is not None:
            raise ValueError(bad(name, arguments[name], f"left out, because points already gives {name}"))
        values = _checked(name, value[name], "points.")
        if isinstance(values, float):
            raise TypeError(bad(f"points.{name}", value[name], "a sequence (give one number outside of points)"))
        found[name] = values
    labels = {name: labels for name in found if (labels := _labels(value[name])) is not None}
    for name in labels:
        if not labels[name].equals(labels[first := next(iter(labels))]):
            allowed = f"in the order of the labels of points.{first}, or an array without labels"
            raise ValueError(bad(f"points.{name}", value[name], allowed))
    lengths = {name: len(values) for name, values in found.items()}
    if len({*lengths.values()}) != 1:
        told = ", ".join(f"{n} of {name}" for name, n in lengths.items()) or "nothing"
        raise ValueError(f"points = {told}: must be {allowed}")
    return found


def _labels(values: Any) -> Any:
    """Return the labels of a pandas.Series or of an xarray.DataArray of one dimension, or None without labels."""
    if hasattr(values, "get_index"):
        return values.get_index(values.dims[0])
    index = getattr(values, "index", None)
    return index if hasattr(index, "equals") else None


def _follow_scene(axes: Mapping[str, np.ndarray], scalars: dict[str, float], written: Mapping[str, Any]) -> None:
    """Check a scene. Add A or B to the scalars if it is the same at all points. Raises ValueError.

    `axes` contains the values of all that varies, `written` the arguments of the call, in which a scene replaces A and
    B.
    """
    scalars.setdefault("g", Scene.g)
    known = {**scalars, **axes}
    refuse_incomplete(known, axes)
    if known.keys() >= PACES:
        raise ValueError(bad("frequency", np.asarray(known["frequency"]).tolist(), "left out if omega0 is given"))
    for name, source in (("A", "a0"), ("B", "alpha")):
        if source in known and written.get(name) is not None:
            raise ValueError(bad(name, written[name], "left out, because it follows from the scene"))
    scene = {name: value for name, value in scalars.items() if name in SCENE}
    # A and B are largest where friction is least
    ends = {name: float(axis.min() if name == "mu" else axis.max()) for name, axis in axes.items() if name in SCENE}
    extreme = Scene.quiet(**(scene | ends))
    pace = "frequency" if "frequency" in known else "omega0"
    for name, sources in (("A", ("a0", pace, "mu", "alpha")), ("B", ("mu", "alpha"))):
        if name == "A" and "a0" not in scene | ends:
            continue
        value, row = float(getattr(extreme, name)), PARAMETERS[name]
        if not row.allows(value):
            computed = ", ".join(f"{key} = {getattr(extreme, key):g}" for key in sources)
            raise ValueError(f"{name} = {value!r}, computed from {computed}: must be {row.allowed}")
        if set(sources) & set(axes):
            scalars.pop(name, None)
        else:
            scalars[name] = value
    for name in (*SCENE, "A"):  # in an order that does not depend on the call
        if name in scalars:
            scalars[name] = scalars.pop(name)


def _checked(key: str, value: object, place: str = "") -> float | np.ndarray:
    """Return one value of a parameter, a float, or its values along an axis, float64 (n,), checked.

    Messages put `place` before the name. Raises TypeError or ValueError.
    """
    if isinstance(value, float) or type(value) is int:  # nearly always
        return check_at(key, value, place + key)
    allowed = PARAMETERS[key].allowed if key in PARAMETERS else "a number or a one-dimensional axis"
    array = real_array(place + key, value, allowed)
    if array.ndim == 0:
        return check_at(key, value, place + key)
    if array.ndim > 1:
        raise ValueError(f"{place}{key} = array of shape {array.shape}: must be a number or a one-dimensional axis")
    if array.size == 0:
        raise ValueError(bad(place + key, [], "an axis with at least one value"))
    suspects: Iterable[int] = range(len(array))
    if key in PARAMETERS:  # an axis may have millions of values: find those to be refused without a loop
        p = PARAMETERS[key]
        within = (array > p.low if p.open_low else array >= p.low) & (array <= p.high)
        suspects = (~within).nonzero()[0].tolist()
    for i in suspects:
        check_at(key, array[i].item(), f"{place}{key}[{i}]")
    return array + 0.0


def check_at(key: str, value: object, place: str) -> float:
    """Return one value of a parameter or quantity of the scene, checked; `place` is its name in the error message."""
    return check_scene(key, value, place) if key in SCENE else check(key, value, place)
