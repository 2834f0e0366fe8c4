"""Curves of bifurcations in the plane (A, B) as an HDF5 file with netCDF-4 dimension scales.

Dimensions:

- `curve`: one row for each curve.
- `point`: the points of all curves in order. Curve i has `points[i]` rows from the row `first_point[i]` on.
- `unknown`: the times at which slides end, for all points in the same order.
- `meeting`: the points at which two curves meet, each listed once.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from vibrodrive.model.described import Stored
from vibrodrive.model.kinds import above
from vibrodrive.periodic.conditions import Condition, Slide
from vibrodrive.periodic.curve import Curve, Meeting
from vibrodrive.periodic.meetings import meeting_points
from vibrodrive.store import tables
from vibrodrive.store.compare import altered
from vibrodrive.store.layout import Origin
from vibrodrive.store.orbits import MAX_PERIOD

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONTENTS = (
    "Bifurcations of the undisturbed motion (ε = 0) as curves in the plane (A, B), within range_A and range_B. The "
    "points of curve i are the rows first_point[i] to first_point[i] + points[i] - 1 along `point`."
)


@dataclass(frozen=True, eq=False, repr=False)
class StoredCurves(Stored):
    """Contents of a file of curves: the curves, the longest period, and the searched ranges of A and B.

    `plot` draws the curves in the plane (A, B), each with the period of its orbit, and their meeting points.
    """

    file_kind = "curves"

    curves: list[Curve]
    max_period: int
    A: tuple[float, float]
    B: tuple[float, float]
    title: str = ""

    def facts(self) -> dict[str, Any]:
        return {
            "ranges": {"A": list(self.A), "B": list(self.B)},
            "max_period": self.max_period,
            "curves": dict(sorted(Counter(c.kind for c in self.curves).items())),
            "points": sum(len(c.A) for c in self.curves),
            "meeting_points": len(meeting_points(self.curves)),
        }

    def _drawn(self, **options: Any) -> Figure:
        meets = [(A, B) for A, B, _ in meeting_points(self.curves)]
        return above("the figure of curves")(self.curves, self.A, self.B, self.max_period, meets, **options)


def save(path: Path, found: StoredCurves, origin: Origin) -> None:
    """Write curves into a file. After an error no new file is left. Raises the exceptions of `tables.save`."""
    shared, ranges = {"max_period": found.max_period}, {"range_A": found.A, "range_B": found.B}
    tables.save(path, "curves", origin, CONTENTS, shared, _tables(found.curves), **ranges)


def read(file: h5py.File) -> StoredCurves:
    """Read an open file of curves."""
    low, high = (tuple(map(float, file.attrs[f"range_{name}"])) for name in "AB")
    longest = tables.number(file, "max_period")
    return StoredCurves(list(_curves(file)), longest, low, high, str(file.attrs["title"]))  # type: ignore[arg-type]


def faults(file: h5py.File, found: StoredCurves) -> list[str]:
    """Return contradictions between the attributes of a file and its configuration."""
    return altered(file, max_period=MAX_PERIOD)


def _tables(found: list[Curve]) -> dict[str, tables.Table]:
    points = np.array([len(c.A) for c in found], np.int64)
    times = [c.points[:, :-2].ravel() for c in found if c.condition is not None]
    meetings = [(i, m) for i, c in enumerate(found) for m in c.meets if i < m.other]
    return {
        "curve": {
            "kind": ([c.kind for c in found], "kind of bifurcation"),
            "period": (np.array([c.period for c in found], np.int64), "period of the orbit in excitation periods"),
            "impacts": (np.array([c.impacts for c in found], np.int64), "number of impacts of the orbit"),
            "word": ([c.word for c in found], "states of one period of the orbit"),
            "side": ([c.side for c in found], "border only: end of the window of phases at which the impact is"),
            "first_end": ([c.ends[0] for c in found], "reason why the curve ends at its first point"),
            "last_end": ([c.ends[1] for c in found], "reason why the curve ends at its last point"),
            "first_point": (tables.first_rows(points), "row of the first point of the curve"),
            "points": (points, "number of points"),
            "condition": ([_written(c.condition) for c in found], "prescribed slides as JSON, empty for the onset"),
        },
        "point": {
            "A": (np.concatenate([c.A for c in found] or [np.empty(0)]), "excitation amplitude"),
            "B": (np.concatenate([c.B for c in found] or [np.empty(0)]), "incline over friction"),
        },
        "unknown": {"time": (np.concatenate(times or [np.empty(0)]), "time at which a slide ends")},
        "meeting": {
            "meeting_A": (np.array([m.A for _, m in meetings]), "excitation amplitude"),
            "meeting_B": (np.array([m.B for _, m in meetings]), "incline over friction"),
            "meeting_curve": (np.array([i for i, _ in meetings], np.int64), "one of the two curves"),
            "meeting_other": (np.array([m.other for _, m in meetings], np.int64), "the other curve"),
            "meeting_kind": ([m.what for _, m in meetings], "end: one curve ends there; crossing: both continue"),
        },
    }


def _written(condition: Condition | None) -> str:
    return "" if condition is None else json.dumps(asdict(condition))


def _read(text: str) -> Condition | None:
    if not text:
        return None
    said = json.loads(text)
    slides = tuple(Slide(falls, begun, turns, lands) for falls, begun, turns, lands in said["slides"])
    return Condition(**{f.name: said[f.name] for f in fields(Condition)} | {"slides": slides})


def _curves(file: h5py.File) -> Iterator[Curve]:
    meets: dict[int, list[Meeting]] = {}
    names = ("meeting_A", "meeting_B", "meeting_curve", "meeting_other", "meeting_kind")
    for A, B, i, j, what in tables.rows(file, *names):
        meets.setdefault(i, []).append(Meeting(A, B, j, what))
        meets.setdefault(j, []).append(Meeting(A, B, i, what))
    A, B, times = file["A"][...], file["B"][...], file["time"][...]
    pieces = tables.parts(file, "first_point", "points", "point")
    columns = tables.rows(file, "kind", "period", "impacts", "word", "side", "first_end", "last_end", "condition")
    used = 0
    for i, (part, (kind, period, impacts, word, side, *ends, text)) in enumerate(zip(pieces, columns, strict=True)):
        condition = _read(text)
        points = np.empty((0, 0))
        if condition is not None:
            width, count = len(condition.slides), part.stop - part.start
            slides = times[used : used + width * count].reshape(count, width)
            used += width * count
            points = np.column_stack([slides, A[part], B[part]])
        yield Curve(
            kind, period, impacts, word, side, A[part], B[part], (ends[0], ends[1]), tuple(meets.get(i, ())), condition,
            points,
        )  # fmt: skip
