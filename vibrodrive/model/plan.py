"""A sweep before it runs: which points, in which order, in which blocks. No Numba here.

Points are the flattened (C-order) product of the axes. A block is a contiguous range of points and
at the same time one chunk of the result file, so that a finished block is written once and never touched again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any

import numpy as np

from vibrodrive.model.parameters import (
    COLUMNS,
    PARAMETERS,
    Method,
    Scan,
    bad,
    check,
    check_choice,
    check_count,
)
from vibrodrive.model.physical import SCENE, Physical, check_scene, with_A_and_B
from vibrodrive.model.records import SECTION, SUMMARY, check_record, point_bytes

BLOCK_BYTES = 4 << 20
"""Section data of one block, at most (unless one point alone is larger): large enough that writing is
sequential, small enough that little is lost if the process is killed, and that memory use stays constant."""

BLOCK_POINTS, BLOCK_POINTS_SMALL = 1024, 8192
"""Points of one block, at most: with sections or impacts, and where a point is a few numbers."""

WAVE_BYTES = 8 << 20
WAVE_POINTS = 8192
"""Blocks computed together, at most: long enough that the end of a wave, where lanes run empty, costs little."""

IN_FLIGHT = 16
"""Tasks an executor holds at a time unless its number of workers is known; bounds the memory of finished ones."""

DEFAULT_BUDGET = 100_000
"""Switches allowed in one excitation period; a trajectory with more is ended as chattering."""


def _setting(default: int, check: Callable[..., int], **allowed: Any) -> Any:
    return field(default=int(default), metadata={"check": partial(check, **allowed)})


@dataclass(frozen=True)
class Settings:
    """What all points of a sweep share: the one table of the settings, their defaults and what they may be."""

    method: int = _setting(Method.CERTIFIED, check_choice, choices=Method)
    scan: int = _setting(Scan.SKIP, check_choice, choices=Scan)
    transient: int = _setting(1000, check_count, low=0)
    periods: int = _setting(250, check_count, low=1)
    budget: int = _setting(DEFAULT_BUDGET, check_count, low=1)


SETTINGS: dict[str, Callable[[str, object], int]] = {f.name: f.metadata["check"] for f in fields(Settings)}
"""The check of each: name and value -> the plain int that a Settings holds. Raises TypeError or ValueError."""


@dataclass(frozen=True)
class Plan:
    """A checked sweep. `axes` in the user's order; `scalars` holds the remaining columns of a point.

    Axes may be quantities of the scene (SCENE_AXES). Then `scalars` has the rest of the scene, and A, or A and B, are
    neither axes nor scalars: they follow for each point.

    `record` is what is kept of each motion (records.py).

    `tiling` fixes the shape of a block where a file has it already, so that a sweep can be resumed by a
    version that would cut it differently.
    """

    axes: dict[str, np.ndarray]
    scalars: dict[str, float]
    settings: Settings
    tiling: tuple[int, ...] | None = None
    record: tuple[str, ...] = (SECTION,)

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(a) for a in self.axes.values())

    @property
    def n_points(self) -> int:
        return math.prod(self.shape)

    def points(self, start: int, stop: int) -> np.ndarray:
        """Rows start..stop of the flattened product: float64 (stop - start, len(COLUMNS))."""
        return self.rows(np.arange(start, stop))

    def rows(self, which: np.ndarray) -> np.ndarray:
        """Rows of the flattened product by their numbers: int64 (n,) -> float64 (n, len(COLUMNS))."""
        out = np.empty((len(which), len(COLUMNS)))
        index = np.unravel_index(which, self.shape) if self.axes else ()
        along = {name: axis[k] for (name, axis), k in zip(self.axes.items(), index, strict=True)}
        values = with_A_and_B({**self.scalars, **along})
        for c, name in enumerate(COLUMNS):
            out[:, c] = values[name]
        return out

    def arguments(self, at: int) -> dict[str, Any]:
        """What `simulate` is to be called with for one point, by its number."""
        point: dict[str, Any] = dict(zip(COLUMNS, self.points(at, at + 1)[0].tolist(), strict=True))
        if math.isnan(point["dtau"]):  # no grid step
            point["dtau"] = None
        s = self.settings
        return point | vars(s) | {"method": Method(s.method), "scan": Scan(s.scan)}

    @property
    def chunk(self) -> tuple[int, ...]:
        """Shape of a block over the axes: leading axes 1, one axis cut, trailing axes whole."""
        if self.tiling is not None:
            return self.tiling
        most = BLOCK_POINTS_SMALL if self.record == (SUMMARY,) else BLOCK_POINTS
        rows = max(1, min(most, BLOCK_BYTES // point_bytes(self.record, self.settings.periods)))
        chunk = [1] * len(self.shape)
        for k in range(len(self.shape) - 1, -1, -1):
            chunk[k] = min(self.shape[k], rows)
            rows //= chunk[k]
            if chunk[k] < self.shape[k] or rows == 0:
                break
        return tuple(chunk)

    @property
    def wave_points(self) -> int:
        """Points of the blocks that are computed together, at most; a larger block is computed alone."""
        return max(1, min(WAVE_POINTS, WAVE_BYTES // point_bytes(self.record, self.settings.periods)))

    def blocks(self) -> list[tuple[int, int]]:
        """(start, stop) of every block, in C-order of the points."""
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
    """Check every argument of a sweep (keys as in `simulate`; sequences become axes) and lay it out.

    In the place of A and B there may be a scene, as in `Physical`: without `a0` it gives B alone.

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed.
    """
    known = [*COLUMNS, *SETTINGS, "record"]
    chosen: dict[str, int] = {}
    record: tuple[str, ...] = (SECTION,)
    axes: dict[str, np.ndarray] = {}
    scalars = {name: p.default for name, p in PARAMETERS.items() if p.default is not None}
    for key, value in arguments.items():
        if key in SETTINGS:
            chosen[key] = SETTINGS[key](key, value)
        elif key == "record":
            record = check_record(value)
        elif key in SCENE:
            if _is_scalar(key, value):
                scalars[key] = check_scene(key, value)
            else:
                axes[key] = np.array([check_scene(key, v) for v in np.asarray(value).tolist()])
        elif key not in COLUMNS:
            raise TypeError(bad("argument", key, "one of " + ", ".join(known)))
        elif value is None:
            if PARAMETERS[key].default is None:
                raise TypeError(bad(key, value, PARAMETERS[key].allowed))
        elif _is_scalar(key, value):
            scalars[key] = check(key, value if not isinstance(value, np.ndarray) else value.item())
        else:
            axes[key] = _axis(key, value)
    if not {"A", "a0"} & {*scalars, *axes}:
        raise TypeError("A is missing: must be given, " + PARAMETERS["A"].allowed)
    if {*SCENE} & {*scalars, *axes}:
        _follow_scene(axes, scalars)
    plan = Plan(axes, scalars, Settings(**chosen), record=record)
    method = plan.settings.method
    if method != Method.CERTIFIED and "dtau" not in axes and math.isnan(scalars["dtau"]):
        name = Method(method).name.lower()
        raise ValueError(f"dtau is missing: method {name!r} needs a grid step, {PARAMETERS['dtau'].allowed}")
    return plan


def _follow_scene(axes: Mapping[str, np.ndarray], scalars: dict[str, float]) -> None:
    """Check the A and B of a scene, and leave to the points what varies. Raises ValueError."""
    scalars.setdefault("g", Physical.g)
    scene = {name: value for name, value in scalars.items() if name in SCENE}
    # A and B are largest where friction is least
    ends = {name: float(axis.min() if name == "mu" else axis.max()) for name, axis in axes.items() if name in SCENE}
    extreme = Physical(**({"a0": 0.0} | scene | ends))
    for name, sources in (("A", ("a0", "omega0", "mu", "alpha")), ("B", ("mu", "alpha"))):
        if name == "A" and "a0" not in scene | ends:
            continue
        try:
            value = check(name, getattr(extreme, name))
        except ValueError as error:
            place = ", ".join(f"{key} = {getattr(extreme, key):g}" for key in sources)
            raise ValueError(f"{error}, at {place}") from None
        if set(sources) & set(axes):
            scalars.pop(name, None)
        else:
            scalars[name] = value


def _is_scalar(key: str, value: object) -> bool:
    """Whether an argument is one thing, not a sequence. Raises ValueError for what is no axis either."""
    try:
        return np.ndim(value) == 0 and not isinstance(value, str)  # type: ignore[arg-type]
    except ValueError:
        raise ValueError(bad(key, value, "a number or a one-dimensional axis")) from None  # rows of different lengths
    except MemoryError:
        raise ValueError(bad(key, value, "an axis that fits the memory")) from None


def _axis(key: str, value: object) -> np.ndarray:
    if isinstance(value, str):
        check(key, value)
    array = np.asarray(value)
    if array.ndim != 1:
        raise ValueError(bad(key, f"array of shape {array.shape}", "a number or a one-dimensional axis"))
    if array.size == 0:
        raise ValueError(bad(key, [], "an axis with at least one value"))
    if array.dtype.kind not in "iuf":
        for v in array.tolist():
            check(key, v)
    wide = array.astype(np.float64)
    p = PARAMETERS[key]
    wrong = ~((wide >= p.low) & (wide <= p.high)) | (p.open_low & (wide == p.low))
    if wrong.any():
        at = int(np.argmax(wrong))
        raise ValueError(bad(f"{key}[{at}]", array[at].item(), p.allowed))
    return wide + 0.0
