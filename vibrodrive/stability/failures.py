"""Failures of the usual methods: comparison of every switch of a motion with the certified one.

At each switch of a motion with the method `fixed` or `muller`, a certified motion starts from exactly the same state.
(An impact is followed by another switch at the same instant, and the certified motion starts at this second switch.)
Then the next switch of the method is compared with the next switch of the certified motion. So a failure does not
affect later comparisons. The switch of the method is

    missed   if it comes more than Δτ after the certified switch and is another transition: the method has passed over
             the true switch
    late     if it comes more than Δτ after the certified switch but is the same transition: the method has passed over
             the true zero and has found a later one
    wrong    if it comes in time but leads to another state
"""

from typing import NamedTuple

import numpy as np

from vibrodrive.batch.trajectory import Trajectory
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels import single as kernel
from vibrodrive.kernels.arguments import SWITCH
from vibrodrive.kernels.event import SMALLEST
from vibrodrive.kernels.lane import new_lanes
from vibrodrive.kernels.outputs import numbers_of
from vibrodrive.model.names import Settings
from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.states import State

KINDS = ("missed", "late", "wrong")
ROWS = 8  # space for certified switches after each start; an impact or a start close to a boundary gives more than one


class SwitchCounts(NamedTuple):
    """Numbers of switches of one motion: the compared switches (`judged`) and the failures of each kind."""

    judged: int
    missed: int
    late: int
    wrong: int


def next_switches(
    motion: Trajectory, tau: np.ndarray, xi: np.ndarray, states: np.ndarray, periods: int
) -> tuple[np.ndarray, ...]:
    """Return (period, phase, next state) of the certified switches that end the given states, with the parameters of a
    motion.

    Each state begins at time τ at the gap ξ with ξ' = 0. `tau` and `xi` are float64 (n,), `states` is int64 (n,). The
    results are int64 (n,), float64 (n,) and int64 (n,). The period is -1 if no switch follows within `periods`
    excitation periods.
    """
    points = np.repeat([[motion.arguments[name] for name in COLUMNS]], len(tau), axis=0)
    for name, values in (("xi0", xi), ("dxi0", 0.0), ("tau0", tau)):
        points[:, COLUMNS.index(name)] = values
    w, k = new_lanes(1)
    ends, phases = np.empty((len(tau), 2), np.int64), np.empty(len(tau))
    rows, stored = np.empty(ROWS, SWITCH), np.zeros(1, np.int64)
    numbers = numbers_of(Settings(transient=0, periods=periods, budget=ROWS), 1)
    kernel.next_switches(w[0], k[0], points, states, numbers, np.empty((1, periods, 2)), rows, stored, ends, phases)
    return ends[:, 0], phases, ends[:, 1]


class Comparison(NamedTuple):
    """Comparison of n switches of a motion with the certified ones; each array has n entries.

    start : rows of `Trajectory.switches`, the switch from which the certified motion starts.
    tau, xi : float64, time and gap of this start.
    certified : float64, time of the certified switch that follows; inf if there is none.
    behind : float64, delay of the next switch of the motion after the certified switch; inf if there is none.
    same : bool, True if both are the same transition.
    in_time : bool, True if the delay is at most a step.
    """

    start: np.ndarray
    tau: np.ndarray
    xi: np.ndarray
    certified: np.ndarray
    behind: np.ndarray
    same: np.ndarray
    in_time: np.ndarray

    def of(self, kind: str) -> np.ndarray:
        """Return bool (n,), True at each failure of the kind `kind`, a name in KINDS."""
        late = ~self.in_time & self.same
        return {"missed": ~self.in_time & ~self.same, "late": late, "wrong": self.in_time & ~self.same}[kind]


def compared(motion: Trajectory) -> Comparison:
    """Compare each switch of a motion (method fixed or muller) with the certified one.

    No method finds a zero before the first one, so only rounding and `tol` can make a delay negative.
    """
    rows = motion.switches
    judged = np.flatnonzero(rows["after"][:-1] != State.IMPACT)
    row, following = rows[judged], rows[judged + 1]
    at_obstacle = (row["after"] == State.REST) | (row["before"] == State.IMPACT)
    # if the end of a slide was found late, the mass may be below the obstacle: the next state then starts just above it
    xi = np.where(at_obstacle, 0.0, np.maximum(row["xi"], SMALLEST))
    tau = TWO_PI * row["period"] + row["phase"]
    longest = int((following["period"] - row["period"]).max(initial=0))  # a slow disturbance prolongs a rest
    period, phase, to = next_switches(motion, tau, xi, row["after"].astype(np.int64), longest + 2)
    exists = period >= 0
    certified = np.where(exists, TWO_PI * period + phase, np.inf)
    behind = np.where(exists, TWO_PI * (following["period"] - period) + (following["phase"] - phase), np.inf)
    in_time = behind <= motion.arguments["dtau"] * (1 + 1e-6)
    return Comparison(row, tau, xi, certified, behind, exists & (to == following["after"]), in_time)


def count_failures(motion: Trajectory) -> SwitchCounts:
    """Count the failures among the switches of a motion (`compared`)."""
    comparison = compared(motion)
    return SwitchCounts(len(comparison.behind), *(int(np.count_nonzero(comparison.of(kind))) for kind in KINDS))
