"""Orbits and bifurcations as an HDF5 file with netCDF-4 dimension scales.

Dimensions:

- `orbit`: one row for each orbit at each A.
- `impact`: the impacts of all orbits in order. Orbit i has `impacts[i]` rows from the row `first_impact[i]` on.
- `bifurcation`: one row for each bifurcation.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import h5py
import numpy as np

from vibrodrive.errors import ConfigError
from vibrodrive.model.described import Stored, axis_facts
from vibrodrive.model.kinds import above
from vibrodrive.model.plan import Plan
from vibrodrive.periodic.bifurcations import Bifurcation
from vibrodrive.periodic.family import Family
from vibrodrive.periodic.search import Orbit
from vibrodrive.store import tables
from vibrodrive.store.compare import altered
from vibrodrive.store.header import origin_of
from vibrodrive.store.layout import Origin

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CONTENTS = (
    "All periodic orbits of the undisturbed motion (ε = 0) at each A, one row each along `orbit`, and their "
    "bifurcations. The impacts of an orbit are the rows first_impact to first_impact + impacts - 1 along `impact`."
)
MAX_PERIOD = 3  # default of the longest period of orbits, in excitation periods
NEXT = " | "  # separator of the flights (motions from a launch to the next impact) in the name of an orbit


@dataclass(frozen=True, eq=False, repr=False)
class StoredOrbits(Stored):
    """A family of orbits in a file: all orbits at each A, and their bifurcations.

    `plan` is that of the configuration in the file, or None if this configuration does not match the orbits.
    """

    file_kind = "orbits"

    family: Family
    origin: Origin
    section_phase: float
    plan: Plan | None

    @property
    def title(self) -> str:  # type: ignore[override]
        return self.origin.title

    def facts(self) -> dict[str, Any]:
        found = self.family
        there = [A for A, some in zip(found.A, found.orbits, strict=True) if some]
        return {
            "axes": {"A": axis_facts(np.array(there))} if there else {},
            "parameters": {"B": found.B},
            "max_period": found.max_period,
            "orbits": dict(sorted(Counter(o.kind for some in found.orbits for o in some).items())),
            "bifurcations": dict(sorted(Counter(b.kind for b in found.bifurcations).items())),
        }

    def plot(
        self,
        kind: Literal["bifurcation", "multipliers"] = "bifurcation",
        quantity: Literal["dxi", "xi"] = "dxi",
        *,
        ax: Axes | Sequence[Axes] | None = None,
    ) -> Figure:
        """Draw the simulated motions over A, and over them the orbits and their bifurcations.

        Parameters
        ----------
        kind : "bifurcation" or "multipliers"
            "multipliers" draws the multipliers of the orbits and not their section points.
        quantity : "dxi" or "xi"
            coordinate of the section that is drawn: ξ' or ξ.
        ax : matplotlib Axes, or sequence of Axes with one for each panel, optional
            axes to draw into; by default those of a new figure. There are two panels if bifurcations are dense.

        Returns
        -------
        Figure
            the figure. A notebook shows it, and its method `savefig` writes it to a file.

        Raises
        ------
        ValueError
            if the kind or the quantity is unknown.
        """
        return above("the figure of orbits")(self, kind, quantity, ax=ax)


def save(path: Path, found: Family, origin: Origin, section_phase: float) -> None:
    """Write a family of orbits into a file. After an error no new file is left.

    `origin` is the configuration, and `section_phase` the phase φ_s of the diagram. Raises the exceptions of
    `tables.save`.
    """
    shared = {"B": found.B, "max_period": found.max_period, "section_phase": section_phase}
    tables.save(path, "orbits", origin, CONTENTS, shared, _tables(found))


def read(file: h5py.File) -> StoredOrbits:
    """Read an open file of orbits.

    The family has the values of A of all orbits in the file. If the configuration matches the file, the family also has
    the values of A of the configuration.
    """
    origin, B = origin_of(file), tables.number(file, "B")
    plan = _plan_of(origin, B)
    found = _family(file, B, None if plan is None else plan.axes["A"])
    return StoredOrbits(found, origin, tables.number(file, "section_phase"), plan)


def faults(file: h5py.File, found: StoredOrbits) -> list[str]:
    """Return contradictions between the attributes of a file and its configuration."""
    return altered(file, max_period=MAX_PERIOD)


def _plan_of(origin: Origin, B: float) -> Plan | None:
    """Return the plan of a configuration, or None if its only axis is not A, its B differs, or it cannot be parsed."""
    try:
        plan = origin.parsed().plan()
    except ConfigError:
        return None
    return plan if list(plan.axes) == ["A"] and plan.scalars["B"] == B else None


def _family(file: h5py.File, B: float, grid: np.ndarray | None) -> Family:
    at = file["A"][...]
    A = np.unique(at if grid is None else np.concatenate([at, grid]))
    phase, speed, gap = file["phase"][...], file["speed"][...], file["gap"][...]
    orbits: list[list[Orbit]] = [[] for _ in A]
    pieces = tables.parts(file, "first_impact", "impacts", "impact")
    columns = tables.rows(file, "A", "period", "impacts", "multiplier", "kind", "word", "name")
    for part, (a, period, impacts, multiplier, kind, word, name) in zip(pieces, columns, strict=True):
        flights = tuple(name.split(NEXT))
        orbit = Orbit(period, impacts, phase[part], speed[part], gap[part], multiplier, kind, word, a, B, flights)
        orbits[int(np.searchsorted(A, a))].append(orbit)
    return Family(A, B, tables.number(file, "max_period"), orbits, list(_bifurcations(file, B)))


def _bifurcations(file: h5py.File, B: float) -> Iterator[Bifurcation]:
    of_orbit = ("period", "impacts", "phase", "word", "orbit_A")
    names = ("bifurcation_A", "bifurcation_kind", *(f"bifurcation_{name}" for name in of_orbit))
    for A, kind, period, impacts, phase, word, at, below, above_ in tables.rows(
        file, *names, "multiplier_below", "multiplier_above"
    ):
        none = np.empty(0)
        orbit = Orbit(
            period, impacts, np.array([phase]), none, none.astype(np.int64), math.nan, "", word, at, B, ()
        )  # fmt: skip
        yield Bifurcation(A, kind, orbit, below, above_)


def _tables(found: Family) -> dict[str, tables.Table]:
    """Return the columns (values, long name) of each dimension, by name."""
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
            "period": (np.array([o.period for o in orbits], np.int64), "period in excitation periods"),
            "impacts": (impacts, "number of impacts"),
            "multiplier": (np.array([o.multiplier for o in orbits]), "derivative of the return map"),
            "kind": ([o.kind for o in orbits], "stability"),
            "word": ([o.word for o in orbits], "states of one period"),
            "first_impact": (tables.first_rows(impacts), "row of the first impact of the orbit"),
            "name": ([NEXT.join(o.name) for o in orbits], "word and windows of each flight; constant along a branch"),
        },
        "impact": {
            "phase": (joined["phases"], "phase of the impact"),
            "speed": (joined["speeds"], "impact speed"),
            "gap": (joined["gaps"].astype(np.int64), "number of excitation periods to the next impact"),
        },
        "bifurcation": {
            "bifurcation_A": (np.array([x.A for x in b]), "excitation amplitude"),
            "bifurcation_orbit_A": (
                np.array([x.orbit.A for x in b]),
                "excitation amplitude at which its orbit was computed",
            ),
            "bifurcation_phase": (np.array([x.orbit.phases[0] for x in b]), "phase of the first impact of its orbit"),
            "bifurcation_kind": ([x.kind for x in b], "kind of bifurcation"),
            "bifurcation_period": (np.array([x.orbit.period for x in b], np.int64), "period of its orbit"),
            "bifurcation_impacts": (np.array([x.orbit.impacts for x in b], np.int64), "impacts of its orbit"),
            "bifurcation_word": ([x.orbit.word for x in b], "states of its orbit"),
            "multiplier_below": (np.array([x.multiplier_below for x in b]), "multiplier at a slightly smaller A"),
            "multiplier_above": (np.array([x.multiplier_above for x in b]), "multiplier at a slightly larger A"),
        },
    }
