"""Motions of the paper, each computed once, and their analysis: bands, returns, phase slips, structure."""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import vibrodrive as vd
from benchmarks.paper.grids import returning
from vibrodrive import State
from vibrodrive.model.config import read
from vibrodrive.stability.main_impacts import are_main_impacts, impact_gaps
from vibrodrive.stability.structure import compare_structure, reference_orbit

CONFIGS = Path(__file__).parents[2] / "configs"

LAGS = 64  # largest number of periods after which a motion on a grid is compared with itself
PAPERS: dict[str, Any] = {"method": "muller", "dtau": 1e-5, "tol": 1e-7}  # the paper's setting of Muller's method
LONG = 600  # number of periods over which a structure is checked; the figures of the paper show only a few periods
SETTLED = 1e-6  # largest distance from an orbit at which a motion counts as settled on this orbit
SETTLING = 3000  # transient periods of undisturbed motions, enough at any A

SAMPLED = 200  # number of values of A in a diagram at which the impacts of a motion are analysed
PHASES = 200  # number of instants in a period at which different periods of a motion are compared


def loss_of_sticking(results: vd.Results) -> int | None:
    """Return the number of the first A at which the mass moves and never sticks, None if there is none."""
    gone = np.flatnonzero((results.switches[:, State.IMPACT] > 0) & (results.switches[:, State.STICK] == 0))
    return int(gone[0]) if len(gone) else None


class NotApplicable(ValueError):
    """A claim or figure does not apply to this configuration; the message is the reason."""


class Paper:
    """Configurations of the paper's figures and their motions, each computed once.

    Raises vd.errors.ConfigError for an invalid configuration.
    """

    def __init__(self, configs: Path = CONFIGS) -> None:
        self._configs = configs
        self._kept: dict[Any, Any] = {}

    def _once(self, key: Any, make: Callable[[], Any]) -> Any:
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def _config(self, name: str) -> Any:
        return self._once(("config", name), lambda: read(self._configs / f"{name}.toml"))

    def plan(self, name: str) -> Any:
        """Return the plan of a configuration: its `axes`, `scalars` and `settings`."""
        return self._once(("plan", name), lambda: self._config(name).plan())

    def points(self, name: str, least: int = 1) -> list[dict[str, Any]]:
        """Return the arguments of `simulate` for each point of a configuration.

        Raises NotApplicable if there are fewer than `least` points.
        """
        plan = self.plan(name)
        if plan.n_points < least:
            raise NotApplicable(f"{name} has fewer than {least} points")
        return [plan.arguments(at) for at in range(plan.n_points)]

    def results(self, name: str) -> vd.Results:
        """Return the sweep of a configuration."""
        return self._once(("results", name), lambda: vd.sweep(**self._config(name).arguments))

    def motions(self, name: str) -> list[vd.Trajectory]:
        """Return the motions of all points of a configuration."""
        return self._once(("motions", name), lambda: [vd.simulate(**point) for point in self.points(name)])

    def undisturbed(self, name: str, **changes: Any) -> Any:
        """Return the orbit at the first point of a configuration, with ε = 0 and certified switches.

        `changes` are arguments of `simulate` that replace those of the configuration.
        Raises NotApplicable if the motion has no period.
        """
        point = without_grid(self.plan(name).arguments(0)) | {"eps": 0.0, "periods": 256} | changes
        found = reference_orbit(vd.simulate(**point))
        if found is None:
            raise NotApplicable(f"the undisturbed motion at A = {point['A']:g} has no period")
        return found


def without_grid(arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of the same motion with certified switches, which need no grid."""
    return arguments | {"method": "certified", "dtau": None, "tol": None}


def widths(motion: vd.Trajectory) -> list[np.ndarray]:
    """Return [widths of ξ, widths of ξ'], each float64 (PHASES,): the range over all periods at each phase."""
    sample = motion.sample(PHASES)
    return [np.ptp(v[:-1].reshape(-1, PHASES), axis=0) for v in (sample.xi, sample.dxi)]


class PhaseSlip(NamedTuple):
    """A transient motion between two basic motions, in the terms of the paper (Fig. 12).

    before, during, after : (first, last) instant τ of the basic motion before the transient motion, of the transient
        motion, and of the basic motion after it.
    """

    usual: int  # number of periods between impacts in the basic motion
    odd: int  # number of periods between the impact before and the impact after the transient motion
    basic: int  # number of periods after which the basic motion nearly repeats
    before: tuple[float, float]
    during: tuple[float, float]
    after: tuple[float, float]


def find_phase_slip(motion: vd.Trajectory, base: Any) -> PhaseSlip:
    """Return the first transient motion between two complete basic motions. Raises NotApplicable if there is none."""
    landed = landings(motion, base)
    apart = impact_gaps(landed)
    if len(apart) < 3:
        raise NotApplicable("the motion has fewer than four main impacts")
    usual = int(np.bincount(apart).argmax())
    basic = int(returning(motion.section, 12).argmin()) + 1
    count = max(1, round(basic / usual))
    tau = 2 * math.pi * landed["period"] + landed["phase"]
    for k in np.flatnonzero(apart != usual):
        if k >= count and k + 1 + count < len(tau):
            ends = [(tau[k - count], tau[k]), (tau[k], tau[k + 1]), (tau[k + 1], tau[k + 1 + count])]
            return PhaseSlip(usual, int(apart[k]), basic, *[(float(a), float(b)) for a, b in ends])
    raise NotApplicable("the motion has no transient between basic motions")


def landings(motion: vd.Trajectory, base: Any) -> np.ndarray:
    """Return the main impacts of a motion, as rows of `Trajectory.impacts`, without slower impacts (touches).

    Raises NotApplicable if the undisturbed orbit has no impacts.
    """
    if base.cycle is None:
        raise NotApplicable("the undisturbed motion has no impacts")
    return motion.impacts[are_main_impacts(base.cycle, motion.impacts)]


def structures(paper: Paper, name: str, **disturbance: float) -> list[Any]:
    """Return comparisons of disturbed motions with the undisturbed orbits, at SAMPLED values of A of a configuration.

    `disturbance` replaces arguments of the configuration. Values of A without a periodic orbit are left out.
    """
    plan, found = paper.plan(name), []
    A, point = plan.axes["A"], plan.arguments(0)
    for a in np.linspace(A[0], A[-1], SAMPLED).tolist():
        try:
            base = paper.undisturbed(name, A=a, transient=SETTLING)
        except NotApplicable:
            continue
        found.append(compare_structure(base, vd.simulate(**(point | {"A": a} | disturbance))))
    if not found:
        raise NotApplicable("no undisturbed motion has a period")
    return found


def order_and_gaps(base: Any) -> Callable[[vd.Trajectory], bool]:
    """Return the criterion of the paper for a motion: the order of the section points of the orbit `base`, and the
    numbers of periods between impacts, are kept."""

    def kept(motion: vd.Trajectory) -> bool:
        found = compare_structure(base, motion)
        return found.order and found.gaps

    return kept


def kept_by_period(found: Iterable[tuple[int, Any]]) -> dict[int, list[bool]]:
    """Return the list of answers for each period, in ascending order of the periods.

    found : pairs (period of the undisturbed orbit, True if the disturbed motion keeps the structure).
    """
    kept: dict[int, list[bool]] = {}
    for n, answer in found:
        kept.setdefault(int(n), []).append(bool(answer))
    return dict(sorted(kept.items()))


def low_and_high(kept: Mapping[int, list[bool]]) -> list[float]:
    """Return the shares of solutions whose structure is kept: [at periods up to 3, at longer periods].

    A share is NaN if there are no such solutions. `kept` is the result of `kept_by_period`.
    """
    sides = ([v for m, vs in kept.items() if (m <= 3) is low for v in vs] for low in (True, False))
    return [float(np.mean(side)) if side else np.nan for side in sides]


def shares(kept: Mapping[int, list[bool]]) -> str:
    """Return the share of solutions whose structure is kept, for each of the four shortest periods, as text."""
    return ", ".join(f"n = {m}: {100 * float(np.mean(kept[m])):.0f} %" for m in list(kept)[:4])
