"""Analysis of motions on a grid (§5): periods after which a motion nearly repeats, and transient motions."""

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from vibrodrive.batch.trajectory import Trajectory, simulate
from vibrodrive.paper.session import Session
from vibrodrive.stability.commensurability import convergents, returning
from vibrodrive.stability.criterion import Criterion
from vibrodrive.stability.main_impacts import are_main_impacts, impact_gaps
from vibrodrive.stability.structure import ReferenceOrbit, Structure, compare_structure
from vibrodrive.verdicts import NotApplicable

LAGS = 64  # largest number of periods after which a motion on a grid is compared with itself
SETTLED = 1e-6  # largest distance from an orbit at which a motion counts as settled on this orbit

SETTLING = 3000
"""Number of transient periods of undisturbed motions. It suffices at any A."""

SAMPLED = 200  # number of values of A in a diagram at which the impacts of a motion are analysed
PHASES = 200  # number of instants in a period at which different periods of a motion are compared

AT_SECTION = Criterion("order and gaps", ("order", "gaps"))
"""Criterion of the paper: the order of the section points, and the numbers of periods between impacts."""


def without_grid(arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of the same motion with certified switches, which need no grid."""
    return arguments | {"method": "certified", "dtau": None, "tol": None}


def widths(motion: Trajectory) -> list[np.ndarray]:
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


def find_phase_slip(motion: Trajectory, base: ReferenceOrbit) -> PhaseSlip:
    """Return the first transient motion between two complete basic motions. Raises NotApplicable if there is none."""
    landed = landings(motion, base)
    apart = impact_gaps(landed)
    if len(apart) < 3:
        raise NotApplicable("the motion has fewer than four main impacts")
    usual = int(np.bincount(apart).argmax())
    distance = returning(motion.section, 12)
    basic = int(distance.argmin()) + 1
    count = max(1, round(basic / usual))
    tau = 2 * math.pi * landed["period"] + landed["phase"]
    for k in np.flatnonzero(apart != usual):
        if k >= count and k + 1 + count < len(tau):
            ends = [(tau[k - count], tau[k]), (tau[k], tau[k + 1]), (tau[k + 1], tau[k + 1 + count])]
            return PhaseSlip(usual, int(apart[k]), basic, *[(float(a), float(b)) for a, b in ends])
    raise NotApplicable("the motion has no transient between basic motions")


def landings(motion: Trajectory, base: ReferenceOrbit) -> np.ndarray:
    """Return the main impacts of a motion, as rows of `Trajectory.impacts`, without slower impacts (touches).

    Raises NotApplicable if the undisturbed orbit has no impacts.
    """
    if base.cycle is None:
        raise NotApplicable("the undisturbed motion has no impacts")
    return motion.impacts[are_main_impacts(base.cycle, motion.impacts)]


def structures(session: Session, name: str, **disturbance: float) -> list[Structure]:
    """Return comparisons of disturbed motions with the undisturbed orbits, at SAMPLED values of A of a configuration.

    `disturbance` replaces arguments of the configuration. Values of A without a periodic orbit are left out.
    """
    plan = session.config(name).plan()
    found = []
    for A in np.linspace(plan.axes["A"][0], plan.axes["A"][-1], SAMPLED).tolist():
        try:
            base = session.undisturbed(name, A=A, transient=SETTLING)
        except NotApplicable:
            continue
        found.append(compare_structure(base, simulate(**(plan.arguments(0) | {"A": A} | disturbance))))
    if not found:
        raise NotApplicable("no undisturbed motion has a period")
    return found


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


def closing_periods(step: float) -> int:
    """Return the number of periods m, up to LAGS, for which m·2π is closest to an integer multiple of the grid step."""
    return convergents(step, LAGS)[-1].periods
