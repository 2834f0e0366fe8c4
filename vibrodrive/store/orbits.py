"""Orbits and bifurcations as an HDF5 file with netCDF-4 dimension scales.

Dimensions `orbit` (one entry an orbit at one A), `impact` (those of all orbits, in order: orbit i has the
rows first_impact[i] to first_impact[i] + impacts[i]) and `bifurcation`.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import h5py
import numpy as np

from vibrodrive.errors import ConfigError
from vibrodrive.model.above import above
from vibrodrive.model.config import parse
from vibrodrive.model.described import Described
from vibrodrive.model.plan import Plan
from vibrodrive.periodic.bifurcations import Bifurcation
from vibrodrive.periodic.family import Family
from vibrodrive.periodic.search import Orbit
from vibrodrive.store import netcdf
from vibrodrive.store.describe import explained
from vibrodrive.store.file import Summary, axis_facts, axis_line, counted, find_faults, new_file, reading, versions_of
from vibrodrive.store.layout import Origin, about

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCHEMA_VERSION = 1

CONTENTS = (
    "Every periodic orbit of the undisturbed motion (ε = 0) at each A that was looked at, a row each along `orbit`; "
    "its impacts are the rows first_impact to first_impact + impacts - 1 along `impact`; and the bifurcations."
)
"""Of a file, for a reader who sees nothing else."""

NEXT = " | "
"""Between the flights in the name of an orbit."""


def save_family(path: Path, found: Family, origin: Origin, section_phase: float) -> None:
    """Write everything about a family into `path`, at once: the file is there whole or not at all.

    `origin` is the configuration it comes from, `section_phase` the phase φ_s of its diagram.

    Raises
    ------
    NoResult
        if `path` is there and is no result file of this program.
    OSError
        if it cannot be written.
    """
    with new_file(path, seal=True) as file:
        file.attrs.update(about("orbits", origin) | {"schema_version": SCHEMA_VERSION})
        shared = {"B": found.B, "max_period": found.max_period, "section_phase": section_phase}
        file.attrs.update(explained(CONTENTS, shared))
        for dimension, columns in _tables(found).items():
            netcdf.table(file, dimension, columns)


@dataclass(frozen=True, eq=False, repr=False)
class StoredOrbits(Described):
    """A family as a file holds it. `plan` is the sweep of the configuration, None if that is not what the file
    holds."""

    family: Family
    origin: Origin
    section_phase: float
    plan: Plan | None

    @property
    def title(self) -> str:
        return self.origin.title

    def plot(
        self,
        kind: Literal["bifurcation", "multipliers"] = "bifurcation",
        quantity: Literal["dxi", "xi"] = "dxi",
        *,
        ax: Axes | Sequence[Axes] | None = None,
    ) -> Figure:
        """The orbits over A with their bifurcations, above what is simulated.

        Parameters
        ----------
        kind : str
            "multipliers": those of the orbits in the place of the section.
        quantity : str
            of the section: ξ' or ξ.
        ax : matplotlib Axes or sequence of them, optional
            where to draw, one for each panel (two where bifurcations are dense); a new figure unless given.

        Returns
        -------
        Figure
            which shows itself in a notebook; `savefig` writes it.

        Raises
        ------
        ValueError
            for another kind or quantity.
        """
        return above("jobs.orbits").drawn(self, kind, quantity, ax=ax)

    def _described(self) -> dict[str, str]:
        found = self.family
        kinds = Counter(b.kind for b in found.bifurcations)
        return {
            "of": f"{sum(map(len, found.orbits))} orbits at {len(found.A)} values of A",
            "computed": f"up to period {found.max_period}",
            "axes": f"A {found.A[0]:g}…{found.A[-1]:g}",
            "fixed": f"B = {found.B:g}",
            "bifurcations": ", ".join(f"{n} x {kind}" for kind, n in sorted(kinds.items())),
        }


def load_orbits(path: Path) -> StoredOrbits:
    """Read a file of orbits. Orbits were sought where its configuration says, if that fits the file.

    Raises
    ------
    NoResult
        if it is none, Damaged if it makes no sense.
    OSError
        if the system refuses.
    """
    with reading(path, "orbits") as file:
        attrs = file.attrs
        origin = Origin(str(attrs["config"]), tuple(json.loads(attrs["overrides"])), str(attrs["title"]))
        plan = _plan_of(origin, float(attrs["B"]))
        found = _family(file, None if plan is None else plan.axes["A"])
        return StoredOrbits(found, origin, float(attrs["section_phase"]), plan)


def _plan_of(origin: Origin, B: float) -> Plan | None:
    """The sweep that a file of orbits was made from, or None if its configuration does not contain it."""
    try:
        plan = parse(origin.config, origin.overrides).plan()
    except ConfigError:
        return None
    return plan if list(plan.axes) == ["A"] and plan.scalars["B"] == B else None


def _family(file: h5py.File, grid: np.ndarray | None) -> Family:
    B, longest = float(file.attrs["B"]), int(file.attrs["max_period"])
    at, period, impacts = file["A"][...], file["period"][...], file["impacts"][...]
    first, multiplier = file["first_impact"][...], file["multiplier"][...]
    kind, word = file["kind"].asstr()[...], file["word"].asstr()[...]
    name = [tuple(n.split(NEXT)) for n in file["name"].asstr()[...]]
    phase, speed, gap = file["phase"][...], file["speed"][...], file["gap"][...]
    A = np.unique(at if grid is None else np.concatenate([at, grid]))
    orbits: list[list[Orbit]] = [[] for _ in A]
    for i, place in enumerate(np.searchsorted(A, at).tolist()):
        rows = slice(int(first[i]), int(first[i] + impacts[i]))
        orbits[place].append(
            Orbit(
                int(period[i]), int(impacts[i]), phase[rows], speed[rows], gap[rows], float(multiplier[i]),
                str(kind[i]), str(word[i]), float(at[i]), B, name[i],
            )
        )  # fmt: skip
    return Family(A, B, longest, orbits, list(_bifurcations(file, B)))


def _bifurcations(file: h5py.File, B: float) -> Iterator[Bifurcation]:
    A, kind = file["bifurcation_A"][...], file["bifurcation_kind"].asstr()[...]
    period, impacts = file["bifurcation_period"][...], file["bifurcation_impacts"][...]
    word = file["bifurcation_word"].asstr()[...]
    below, above = file["multiplier_below"][...], file["multiplier_above"][...]
    at, phase = file["bifurcation_orbit_A"][...], file["bifurcation_phase"][...]
    for i in range(len(A)):
        orbit = Orbit(
            int(period[i]), int(impacts[i]), np.atleast_1d(phase[i]), np.empty(0), np.empty(0, np.int64), math.nan,
            "", str(word[i]), float(at[i]), B, (),
        )  # fmt: skip
        yield Bifurcation(float(A[i]), str(kind[i]), orbit, float(below[i]), float(above[i]))


def summary(path: Path, thorough: bool = False) -> Summary:
    """What a file of orbits holds; `thorough` reads everything and looks for faults. Raises as `load_orbits`."""
    with reading(path, "orbits") as file:
        title = str(file.attrs["title"])
        faults = find_faults(file) if thorough else []
        if faults:
            return Summary(title, 1.0, [], faults)
        impacts, first = file["impacts"][...], file["first_impact"][...]
        if not np.array_equal(np.cumsum(impacts) - impacts, first) or impacts.sum() != len(file["impact"]):
            faults.append("first_impact: does not fit the impacts of the orbits")
        there = np.unique(file["A"][...])
        B, longest = float(file.attrs["B"]), int(file.attrs["max_period"])
        kinds = counted(file["kind"])
        bifurcations = counted(file["bifurcation_kind"])
        facts = {
            "axes": {"A": axis_facts(there)} if len(there) else {}, "parameters": {"B": B}, "max_period": longest,
            "orbits": kinds, "bifurcations": bifurcations, "versions": versions_of(file),
        }  # fmt: skip
        lines = [axis_line("A", there)] if len(there) else []
        listed = "".join(f", {n} {kind}" for kind, n in kinds.items())
        lines += [
            ("fixed", f"B = {B:g}"), ("periods", f"up to {longest}"), ("orbits", f"{sum(kinds.values())}{listed}"),
            *(("found", f"{n} x {kind}") for kind, n in bifurcations.items()),
        ]  # fmt: skip
        return Summary(title, 1.0, lines, faults, facts)


def _tables(found: Family) -> dict[str, dict[str, tuple[Any, str]]]:
    """Columns (values, long name) by dimension."""
    orbits = [o for there in found.orbits for o in there]
    impacts = np.array([o.impacts for o in orbits], dtype=np.int64)
    joined = {
        name: np.concatenate([getattr(o, name) for o in orbits] or [np.empty(0)])
        for name in ("phases", "speeds", "gaps")
    }
    b = found.bifurcations
    return {
        "orbit": {
            "A": (np.array([o.A for o in orbits]), "excitation amplitude"),
            "period": (np.array([o.period for o in orbits], np.int64), "whole excitation periods"),
            "impacts": (impacts, "number of impacts"),
            "multiplier": (np.array([o.multiplier for o in orbits]), "derivative of the return map"),
            "kind": ([o.kind for o in orbits], "stability"),
            "word": ([o.word for o in orbits], "states of one period"),
            "first_impact": (np.cumsum(impacts) - impacts, "row of its first impact"),
            "name": ([NEXT.join(o.name) for o in orbits], "word and windows of each flight: what a branch keeps"),
        },
        "impact": {
            "phase": (joined["phases"], "phase of the impact"),
            "speed": (joined["speeds"], "impact speed"),
            "gap": (joined["gaps"].astype(np.int64), "whole excitation periods to the next impact"),
        },
        "bifurcation": {
            "bifurcation_A": (np.array([x.A for x in b]), "excitation amplitude"),
            "bifurcation_orbit_A": (np.array([x.orbit.A for x in b]), "excitation amplitude its orbit was computed at"),
            "bifurcation_phase": (np.array([x.orbit.phases[0] for x in b]), "phase of the first impact of its orbit"),
            "bifurcation_kind": ([x.kind for x in b], "kind of bifurcation"),
            "bifurcation_period": (np.array([x.orbit.period for x in b], np.int64), "period of its orbit"),
            "bifurcation_impacts": (np.array([x.orbit.impacts for x in b], np.int64), "impacts of its orbit"),
            "bifurcation_word": ([x.orbit.word for x in b], "states of its orbit"),
            "multiplier_below": (np.array([x.multiplier_below for x in b]), "multiplier a little below"),
            "multiplier_above": (np.array([x.multiplier_above for x in b]), "multiplier a little above"),
        },
    }
