"""All orbits over a range of A, joined to branches between bifurcations."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vibrodrive.batch.trajectory import simulate
from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import Scene
from vibrodrive.periodic.bifurcations import MOST_VALUES, STEP, Bifurcation, Search, in_scene
from vibrodrive.periodic.continuation import DOUBLING, FOLD, GRAZING, scale_of
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.search import UNSTABLE, Orbit, orbits_of

# distances in A of additional values of A from a bifurcation, in units of `scale_of`
BESIDE = 1e-9
ROOT = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3)  # where branches change like a square root: DOUBLING, FOLD, GRAZING
CURVE = 250  # least number of values of A over the whole range for branches that look like curves


@dataclass(frozen=True, eq=False)
class Branch:
    """One orbit over an interval of A without a bifurcation, at the ascending values A (n,)."""

    A: np.ndarray
    orbits: list[Orbit]

    @property
    def unstable(self) -> bool:
        return self.orbits[len(self.orbits) // 2].kind == UNSTABLE


@dataclass(frozen=True, eq=False)
class Family:
    """All orbits of up to `max_period` periods at each of the values A, some of them just beside each bifurcation.

    A : float64 (n,), ascending.
    orbits : for each value of A the list of its orbits.
    """

    A: np.ndarray
    B: float
    max_period: int
    orbits: list[list[Orbit]]
    bifurcations: list[Bifurcation]

    def denser(self) -> Family:
        """Return a family with further orbits where values of A are too far apart for a drawing, most of them at the
        ends of a gap, because a branch may be steep beside a bifurcation."""
        orbits, step = dict(zip(self.A.tolist(), self.orbits, strict=True)), np.ptp(self.A) / CURVE
        for a, b in itertools.pairwise([*orbits]):
            x = np.linspace(0.0, 1.0, math.ceil((b - a) / step) + 1)[1:-1]
            share = x * x * (3.0 - 2.0 * x)
            orbits |= {at: orbits_of(ImpactMap(at, self.B), self.max_period) for at in (a + (b - a) * share).tolist()}
        return replace(self, A=np.array(sorted(orbits)), orbits=[orbits[at] for at in sorted(orbits)])

    def branches(self) -> Iterator[Branch]:
        """Yield the branches. A branch joins orbits that have the same name and kind at successive values of A."""
        indices: dict[tuple, list[int]] = defaultdict(list)
        rows: dict[tuple, list[Orbit]] = defaultdict(list)
        for i, orbits in enumerate(self.orbits):
            twins: dict[tuple, int] = defaultdict(int)
            for orbit in orbits:
                key = (orbit.name, orbit.kind)
                twins[key] += 1
                indices[(*key, twins[key])].append(i)
                rows[(*key, twins[key])].append(orbit)
        for key, places in indices.items():
            gaps = (np.flatnonzero(np.diff(places) != 1) + 1).tolist()
            for first, last in itertools.pairwise([0, *gaps, len(places)]):
                yield Branch(self.A[places[first:last]], rows[key][first:last])


def family(
    A: Sequence[float] | np.ndarray,
    B: float = 0.1,
    max_period: int = 3,
    scene: Callable[[float], Scene | None] = lambda A: None,
) -> Family:
    """Compute all orbits at the values `A`, and close to every bifurcation between the smallest and the largest `A`.

    `scene` returns the machine at an A.
    """
    grid = np.unique(np.asarray(A, float))
    if len(grid) < 2:
        raise ValueError(bad("A", list(A), "at least two different values"))
    low, high = float(grid[0]), float(grid[-1])
    step = max(float(np.diff(grid).max()), (high - low) / MOST_VALUES)
    bifurcations = Search(B, max_period).between(low, high, step if step < STEP * scale_of(low) else None)
    sides = [
        b.A + sign * d * scale_of(b.A)
        for b in bifurcations
        for d in (BESIDE, *(ROOT if b.kind in (DOUBLING, FOLD, GRAZING) else ()))
        for sign in (-1, 1)
    ]
    values = np.union1d(grid, [a for a in sides if low <= a <= high])
    orbits = [[replace(o, scene=scene(a)) for o in orbits_of(ImpactMap(a, B), max_period)] for a in values.tolist()]
    return Family(values, B, max_period, orbits, [in_scene(b, scene) for b in bifurcations])


def section(orbit: Orbit, phase: float = 0.0) -> np.ndarray:
    """Return the section points (ξ, ξ') of an orbit at τ = phase + 2πk after the first impact, float64 (period, 2)."""
    start = float(orbit.phases[0])
    motion = simulate(A=orbit.A, B=orbit.B, tau0=start, transient=0, periods=orbit.period, section_phase=phase)
    return np.asarray(motion.section)


def traces(branch: Branch, values: Callable[[Orbit], np.ndarray]) -> np.ndarray:
    """Return the sorted numbers `values(orbit)` for the orbit at each of the n values of A.

    The result is float64 (n, m) for up to m numbers. Missing numbers are NaN. Each column is a curve over A.
    """
    rows = [np.sort(values(orbit)) for orbit in branch.orbits]
    width = max(map(len, rows), default=0)
    return np.array([np.pad(r, (0, width - len(r)), constant_values=math.nan) for r in rows])
