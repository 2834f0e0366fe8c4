"""Curves of bifurcations in the plane (A, B) as an HDF5 file with netCDF-4 dimension scales.

Dimensions `curve`, `point` (those of all curves, in order: curve i has the rows first_point[i] to first_point[i] +
points[i]), `unknown` (the times at which slides end, at all points, in the same order) and `meeting` (each point where
two curves meet, once).
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from vibrodrive.model.above import above
from vibrodrive.model.described import Described
from vibrodrive.periodic.conditions import Condition, Slide
from vibrodrive.periodic.curves import Curve
from vibrodrive.periodic.meetings import Meeting, meeting_points
from vibrodrive.store import netcdf
from vibrodrive.store.describe import explained
from vibrodrive.store.file import Summary, counted, find_faults, new_file, reading, versions_of
from vibrodrive.store.layout import Origin, about

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCHEMA_VERSION = 1

CONTENTS = (
    "Bifurcations of the undisturbed motion (ε = 0) as curves in the plane (A, B), within range_A and range_B; curve i "
    "has the rows first_point[i] to first_point[i] + points[i] - 1 along `point`."
)
"""Of a file, for a reader who sees nothing else."""


@dataclass(frozen=True, eq=False, repr=False)
class StoredCurves(Described):
    """What a file of curves holds: the curves, the longest period, the ranges of A and B that were searched."""

    curves: list[Curve]
    max_period: int
    A: tuple[float, float]
    B: tuple[float, float]
    title: str = ""

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """The curves in the plane (A, B), each with the period of its orbit, and where they meet.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            where to draw; a new figure unless given.

        Returns
        -------
        Figure
            which shows itself in a notebook; `savefig` writes it.
        """
        meets = [(A, B) for A, B, _ in meeting_points(self.curves)]
        return above("figures.plane").curves_figure(self.curves, self.A, self.B, self.max_period, meets, ax=ax)

    def _described(self) -> dict[str, str]:
        kinds = Counter(c.kind for c in self.curves)
        return {
            "of": f"{len(self.curves)} curves",
            "computed": f"up to period {self.max_period}",
            "ranges": f"A {self.A[0]:g}…{self.A[1]:g}, B {self.B[0]:g}…{self.B[1]:g}",
            "found": ", ".join(f"{n} x {kind}" for kind, n in sorted(kinds.items())),
        }


def save_curves(path: Path, found: StoredCurves, origin: Origin) -> None:
    """Write curves into `path`, at once: the file is there whole or not at all.

    Raises
    ------
    NoResult
        if `path` is there and is no result file of this program.
    OSError
        if it cannot be written.
    """
    with new_file(path, seal=True) as file:
        file.attrs.update(about("curves", origin) | {"schema_version": SCHEMA_VERSION})
        file.attrs.update(explained(CONTENTS, {"max_period": found.max_period}))
        file.attrs.update({"range_A": found.A, "range_B": found.B})
        for dimension, columns in _tables(found.curves).items():
            netcdf.table(file, dimension, columns)


def load_curves(path: Path) -> StoredCurves:
    """Read a file of curves.

    Raises
    ------
    NoResult
        if it is none, Damaged if it makes no sense.
    OSError
        if the system refuses.
    """
    with reading(path, "curves") as file:
        low, high = (tuple(map(float, file.attrs[f"range_{name}"])) for name in "AB")
        longest, title = int(file.attrs["max_period"]), str(file.attrs["title"])
        return StoredCurves(_curves(file), longest, low, high, title)  # type: ignore[arg-type]


def summary(path: Path, thorough: bool = False) -> Summary:
    """What a file of curves holds; `thorough` reads everything and looks for faults. Raises as `load_curves`."""
    with reading(path, "curves") as file:
        title = str(file.attrs["title"])
        faults = find_faults(file) if thorough else []
        if faults:
            return Summary(title, 1.0, [], faults)
        points, first = file["points"][...], file["first_point"][...]
        if not np.array_equal(np.cumsum(points) - points, first) or points.sum() != len(file["point"]):
            faults.append("first_point: does not fit the points of the curves")
            return Summary(title, 1.0, [], faults)
        ranges = {name: file.attrs[f"range_{name}"].tolist() for name in "AB"}
        longest, kinds, met = int(file.attrs["max_period"]), counted(file["kind"]), len(meeting_points(_curves(file)))
        facts = {
            "ranges": ranges, "max_period": longest, "curves": kinds, "points": int(points.sum()),
            "meeting_points": met, "versions": versions_of(file),
        }  # fmt: skip
        lines = [("range", f"{name} = {low:g} to {high:g}") for name, (low, high) in ranges.items()]
        lines += [
            ("periods", f"up to {longest}"),
            ("curves", f"{len(points)} with {points.sum()} points; meet at {met} points"),
            *(("found", f"{n} x {kind}") for kind, n in kinds.items()),
        ]
        return Summary(title, 1.0, lines, faults, facts)


def _tables(found: list[Curve]) -> dict[str, dict[str, tuple[Any, str]]]:
    """Columns (values, long name) by dimension."""
    points = np.array([len(c.A) for c in found], np.int64)
    times = [c.points[:, :-2].ravel() for c in found if c.condition is not None]
    meetings = [(i, m) for i, c in enumerate(found) for m in c.meets if i < m.other]
    return {
        "curve": {
            "kind": ([c.kind for c in found], "kind of bifurcation"),
            "period": (np.array([c.period for c in found], np.int64), "whole excitation periods of the orbit"),
            "impacts": (np.array([c.impacts for c in found], np.int64), "number of impacts of the orbit"),
            "word": ([c.word for c in found], "states of one period of the orbit"),
            "side": ([c.side for c in found], "end of the window that the impact of a border meets"),
            "first_end": ([c.ends[0] for c in found], "why the curve ends at its first point"),
            "last_end": ([c.ends[1] for c in found], "why the curve ends at its last point"),
            "first_point": (np.cumsum(points) - points, "row of its first point"),
            "points": (points, "number of points"),
            "condition": ([_written(c.condition) for c in found], "prescribed slides (JSON), empty for the onset"),
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
            "meeting_other": (np.array([m.other for _, m in meetings], np.int64), "the other one"),
            "meeting_kind": ([m.what for _, m in meetings], "whether one of them ends there"),
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


def _curves(file: h5py.File) -> list[Curve]:
    meets: dict[int, list[Meeting]] = {}
    columns = [file[f"meeting_{name}"][...].tolist() for name in ("A", "B", "curve", "other")]
    for A, B, i, j, what in zip(*columns, file["meeting_kind"].asstr()[...].tolist(), strict=True):
        meets.setdefault(i, []).append(Meeting(A, B, j, what))
        meets.setdefault(j, []).append(Meeting(A, B, i, what))
    A, B, times = file["A"][...], file["B"][...], file["time"][...]
    text = {name: file[name].asstr()[...].tolist() for name in ("kind", "word", "side", "first_end", "last_end")}
    found, used = [], 0
    for i, (first, count) in enumerate(zip(file["first_point"][...], file["points"][...], strict=True)):
        rows = slice(int(first), int(first + count))
        condition = _read(file["condition"].asstr()[i])
        width = 0 if condition is None else len(condition.slides)
        ends = times[used : used + width * count].reshape(count, width)
        used += width * int(count)
        points = np.empty((0, 0)) if condition is None else np.column_stack([ends, A[rows], B[rows]])
        found.append(
            Curve(
                text["kind"][i], int(file["period"][i]), int(file["impacts"][i]), text["word"][i], text["side"][i],
                A[rows], B[rows], (text["first_end"][i], text["last_end"][i]), tuple(meets.get(i, ())), condition,
                points,
            )
        )  # fmt: skip
    return found
