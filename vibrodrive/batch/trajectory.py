"""One trajectory: all switches after the transient, the section, and samples of the closed form."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrodrive.batch.frames import Table, frame
from vibrodrive.batch.parallel import BRIEF, run
from vibrodrive.batch.records import new_errors
from vibrodrive.jit.slices import Halt, in_slices
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels.arguments import SWITCH, Arguments, numbers_of
from vibrodrive.kernels.lane import new_lanes
from vibrodrive.kernels.sampling import sample_segments
from vibrodrive.kernels.single import single
from vibrodrive.model.choices import Method, Status
from vibrodrive.model.keywords import MethodLike, ScanLike, as_written
from vibrodrive.model.kinds import above
from vibrodrive.model.names import ETA
from vibrodrive.model.parameters import COLUMNS, bad, check_count
from vibrodrive.model.physical import Scene
from vibrodrive.model.plan import Plan, make_plan, refuse_idle
from vibrodrive.model.size import refuse_large_sample, refuse_many_rows, rows_that_fit

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vibrodrive.model.drawing import Style, Width

LONG = 100_000
"""Number of periods from which progress is shown, since a motion may then take more than a second."""

SWITCH_ERROR = np.dtype([("tau", "f8"), ("xi", "f8"), ("dxi", "f8")])
"""Row of `Trajectory.switch_errors`: bounds for the row of `Trajectory.switches` with the same index."""

MAIN_IMPACT = np.dtype([("period", "i8"), ("phase", "f8"), ("speed", "f8"), ("row", "i8")])
"""Row of `Trajectory.impacts`; `row` is the index of the impact in `Trajectory.switches`."""


def main_impacts(written: np.ndarray) -> np.ndarray:
    """Convert the main impacts of one motion, float64 (2 periods, 4) as written by its kernel, to MAIN_IMPACT."""
    last = bisect_left(range(len(written)), True, key=lambda row: math.isnan(written[row, 0]))  # then rows of NaN
    known = written[:last]
    rows = np.empty(len(known), MAIN_IMPACT)
    for column, name in enumerate(MAIN_IMPACT.names or ()):
        rows[name] = known[:, column]
    return rows


def same_array(one: Any, other: Any) -> bool:
    """Return True if two arrays, also of records, are equal; NaN equals NaN."""
    one, other = np.asarray(one), np.asarray(other)
    if one.dtype.names is not None:
        return one.dtype == other.dtype and all(same_array(one[name], other[name]) for name in one.dtype.names)
    return np.array_equal(one, other, equal_nan=True)


class Sample(NamedTuple):
    """Closed form at equidistant times: arrays of one length; `state` contains `State` members as int8."""

    tau: np.ndarray
    xi: np.ndarray
    dxi: np.ndarray
    state: np.ndarray
    H: np.ndarray

    def __eq__(self, other: object) -> bool:
        """Return True if all numbers are equal; NaN equals NaN."""
        return isinstance(other, Sample) and all(map(same_array, self, other))

    def __ne__(self, other: object) -> bool:
        return not self == other


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Result of `simulate`. Two are equal if their arguments and all results are equal to the bit.

    Attributes
    ----------
    switches : structured array
        switches in (τ0 + 2πT, τ0 + 2π(T + P)], in order, one row each: period (number of completed excitation periods
        since τ = 0), phase in [0, 2π), before and after (`State`), xi and dxi just before the switch.
    section : float64 (periods, 2)
        ξ, ξ' at τ = section_phase + 2πk.
    impacts : structured array
        main impacts among the switches, in order: period, phase, speed -ξ', and their row in `switches`. An impact is
        a main impact if there is no faster one within half an excitation period before or after it, else a touch.
    status : Status
        OK, or the reason why not; `status.advice` is a sentence. OK applies to the complete motion: no decision could
        have been changed by the error accumulated until then (`docs/certainty.md`). With "muller" this assumes that the
        grid misses no zero. With "fixed" it applies to each switch, with the state at the previous one taken as exact.
    margin : float
        distance of the closest decision from the opposite decision, with the state at the previous switch taken as
        exact; inf if there was no decision.
    error : float64 (periods, 2)
        bounds of the errors of ξ and ξ' in `section`, relative to the exact motion of the model from this start; inf
        from the first decision on that may be wrong. NaN if the section is NaN, and with "fixed", whose delay by up to
        Δτ is a disturbance to be studied, not an error to be bounded.
    switch_errors : structured array
        bounds for each row of `switches`: tau (its instant), xi, dxi; inf and NaN as in `error`.
    certain_until : float
        excitation period, counted as `switches["period"]`, from which on decisions may be wrong; inf if none may be
        wrong. Before it all decisions are certain, and the bounds `error` and `switch_errors` are finite. NaN with
        "fixed".
    evaluations : int
        number of evaluations of switching functions.
    arguments : dict
        all arguments after the checks; method and scan as the numbers of `Method` and `Scan`.

    Examples
    --------
    Every period of the motion at A = 1.5 has the same four states and one impact:

    >>> import vibrodrive as vd
    >>> motion = vd.simulate(1.5, transient=10, periods=1)
    >>> [vd.State(after).name for after in motion.switches["after"]]
    ['UP', 'STICK', 'DOWN', 'IMPACT', 'REST']
    >>> impact = motion.switches[motion.switches["after"] == vd.State.IMPACT]
    >>> impact["phase"].round(4), impact["dxi"].round(4)
    (array([5.4048]), array([-0.6999]))
    >>> motion.sample(4).xi.round(4)
    array([0.    , 0.055 , 0.5085, 0.3827, 0.    ])

    Every decision is certain, and the error of each instant is below 1e-12:

    >>> motion.certain_until, bool(motion.switch_errors["tau"].max() < 1e-12)
    (inf, True)
    """

    switches: np.ndarray
    section: np.ndarray
    impacts: np.ndarray
    status: Status
    margin: float
    error: np.ndarray
    switch_errors: np.ndarray
    certain_until: float
    evaluations: int
    arguments: dict[str, Any]
    _plan: Plan
    _start: np.ndarray

    def __eq__(self, other: object) -> bool:
        """Return True if arguments and results are equal to the bit (NaN equals NaN).

        Motions with different arguments (method, scan, …) are not equal: compare their switches or sections.
        """
        if not isinstance(other, Trajectory):
            return NotImplemented
        arrays = [
            (getattr(self, a), getattr(other, a))
            for a in ("switches", "section", "impacts", "_start", "error", "switch_errors")
        ]
        numbers = [(t.status, t.margin, t.certain_until, t.evaluations, *t.arguments.values()) for t in (self, other)]
        return same_array(*numbers) and all(same_array(a, b) for a, b in arrays)

    __hash__ = None  # type: ignore[assignment]  # arrays may change

    def __repr__(self) -> str:
        a = self.arguments
        start = [f"{name} {a[name]:g}" for name in ("A", "B", "eps") if name != "eps" or a[name]]
        method = Method(a["method"]).name.lower()
        how = f"{method}, {a['transient']} + {a['periods']} periods"
        found = f"{len(self.switches)} switches, {len(self.impacts)} main impacts; {self.status}"
        return f"<Trajectory {', '.join(start)}: {how}; {found}, margin {self.margin:.2g}>"

    def to_dataframe(self, of: Table = "switches") -> pandas.DataFrame:
        """Return the switches, the main impacts or the section points as a table. This needs the extra `data`.

        The columns are τ and the fields of the array, with states as names. `attrs` contains the arguments and the
        status. For lists of orbits, bifurcations or curves use `pandas.DataFrame(list)`.

        Parameters
        ----------
        of : "switches", "impacts" or "section"

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        ValueError
            for another name.
        ImportError
            if pandas is not installed, in one line.

        Examples
        --------
        >>> import vibrodrive as vd
        >>> table = vd.simulate(1.5, transient=10, periods=1).to_dataframe()
        >>> table[["before", "after", "xi"]].round(3)
           before   after     xi
        0    REST      UP  0.000
        1      UP   STICK  0.509
        2   STICK    DOWN  0.509
        3    DOWN  IMPACT  0.000
        4  IMPACT    REST  0.000
        >>> table.attrs["A"], table.attrs["status"]
        (1.5, 'OK')
        """
        return frame(self, of)

    def plot(
        self,
        curves: Sequence[str] = ("phase", "time"),
        *,
        shown: int | None = 10,
        ax: Axes | Sequence[Axes] | None = None,
        style: Style | None = None,
        width: Width | None = None,
    ) -> Figure:
        """Draw the motion as curves with its switches.

        Parameters
        ----------
        curves : sequence of str
            one panel each: "phase" ξ'(ξ), "time" ξ(τ), "velocity" ξ'(τ), "section".
        shown : int, optional
            number of periods in curves over time, from the first recorded one; None: all.
        ax : matplotlib Axes or sequence of them, optional
            axes to draw into, one for each panel; default: a new figure.
        style : "screen" or "print", optional
            colours that are distinct for colour-blind readers, or the black and white of a journal; default "screen".
        width : "double" or "single", optional
            width of a new figure in columns of a page; default "double".

        Returns
        -------
        Figure
            which a notebook displays; `savefig` writes it.

        Raises
        ------
        ValueError
            for an unknown curve, or if the numbers of axes and curves differ.
        """
        drawn = above("the figure of a motion")
        return drawn(self, curves, shown=shown, ax=ax, style=style, width=width)

    def describe(self, scene: Scene | None = None) -> str:
        """Return a description: status, closest decision, period, impacts, cycle of states, impact speeds.

        The period and the means are those of the recorded periods, or of 256 periods if fewer are recorded.

        Parameters
        ----------
        scene : Scene, optional
            scene in SI units from which A and B were computed: times are then in ms and speeds in m/s.

        Returns
        -------
        str
            of several lines.

        Raises
        ------
        TypeError
            if `scene` is no Scene.

        Examples
        --------
        >>> import vibrodrive as vd
        >>> print("\\n".join(vd.simulate(1.5, transient=10, periods=1).describe().splitlines()[3:]))
        period 1, 1 impacts an excitation period
        states: U S D I R (Up, Down, Stick, Rest, Impact)
        impact speed 0.699856, at most 0.699856
        """
        from vibrodrive.batch.describe import described

        if scene is not None and not isinstance(scene, Scene):
            raise TypeError(bad("scene", scene, "a Scene, or left out"))
        return described(self, self._plan, scene)

    def sample(self, points_per_period: int) -> Sample:
        """Evaluate the motion at points_per_period instants in each period of the recorded window, including both ends.

        Returns
        -------
        Sample
            tau, xi, dxi, H (float64) and state (int8, `State`), each (periods · points_per_period + 1,), dimensionless;
            H is the adhesive force of eqs. (2) and (9). NaN after the last switch if the budget was exhausted.

        Raises
        ------
        TypeError, ValueError
            if points_per_period is not an integer >= 1, or if the points do not fit the memory.
        """
        count = check_count("points_per_period", points_per_period, 1, 10**8)
        settings, rows = self._plan.settings, np.concatenate([self._start, self.switches])
        total = settings.periods * count + 1
        refuse_large_sample(count, total)
        out = np.empty((total, 3))
        state = np.empty(total, np.int8)
        w, k = new_lanes(1)
        point, under_way = self._plan.points(0, 1), np.array([0, -1])
        sampling = np.array([settings.method, settings.transient, count], np.int64)

        def advance(instants: int) -> bool:
            return sample_segments(w[0], k[0], point, rows, sampling, instants, under_way, out, state)

        in_slices(advance)
        tau = self.arguments["tau0"] + TWO_PI * (settings.transient + np.arange(total) / count)
        if self.status == Status.BUDGET:
            last = rows[-1]
            known = tau <= TWO_PI * last["period"] + last["phase"]
            out[~known] = np.nan
        return Sample(tau, out[:, 0], out[:, 1], state, out[:, 2])


@as_written
def simulate(
    written: Mapping[str, Any],
    /,
    A: float,
    *,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = ETA,
    method: MethodLike = "certified",
    dtau: float | None = None,
    tol: float | None = None,
    xi0: float = 0.0,
    dxi0: float = 0.0,
    tau0: float = 0.0,
    transient: int = 1000,
    periods: int = 250,
    section_phase: float = 0.0,
    scan: ScanLike = "skip",
    budget: int = 100_000,
) -> Trajectory:
    """Simulate one trajectory of the oscillator, eqs. (1)-(10) and the scheme of Fig. 2.

    All quantities are dimensionless (§2 of the paper; `Scene` converts from and to SI units).

    Parameters
    ----------
    A : float, 0 to 1e9
        excitation amplitude, A = Ω0² a0 / (μ g cos α).
    B : float, 0 to 1e9
        incline over friction, B = tan α / μ.
    eps, eta : float, 0 to 1e3 and 1e-9 to 1e8
        relative amplitude ε and frequency ratio η of the disturbance, eq. (9); defaults 0 and 10·√102.
    method : "certified", "muller" or "fixed"
        method of finding the end of a state: the first zero, guaranteed; a scan of the grid and Muller's method (§4);
        or the first grid point after the sign change (§5). The latter two need `dtau`.
    dtau : float, 1e-12 to 1e6
        grid step Δτ of "fixed" and "muller"; refused with "certified", which has no grid.
    tol : float, above 0 to 1
        step tolerance of "muller", default 1e-7; refused with the other methods.
    xi0, dxi0, tau0 : float
        gap ξ >= 0 and velocity ξ' at the initial time τ0; for ξ' = 0 Fig. 2 determines the initial state.
    transient, periods : int
        excitation periods before the record, and in the record.
    section_phase : float
        phase φ_s of the Poincaré section in radians.
    scan : "skip" or "literal"
        skip grid points that provably have no sign change, or visit each point; the results are the same to the bit.
    budget : int
        number of switches allowed in one period; with more the computation ends with the status BUDGET (chattering).

    Returns
    -------
    Trajectory
        with switches (n,), section (periods, 2), status, margin, error bounds, and `sample` for curves.

    Raises
    ------
    TypeError, ValueError
        with one sentence: key, value, allowed values.

    Examples
    --------
    At A = 3.04 the motion repeats after two excitation periods:

    >>> import vibrodrive as vd
    >>> motion = vd.simulate(3.04, transient=1000, periods=4)
    >>> motion.status.name
    'OK'
    >>> motion.section.round(4)
    array([[ 2.7734, -2.6102],
           [ 1.2155, -2.8904],
           [ 2.7734, -2.6102],
           [ 1.2155, -2.8904]])
    """
    plan = make_plan(written)
    refuse_idle(plan, written)
    for name, values in plan.axes.items():
        raise TypeError(bad(name, f"array of {len(values)} values", "a single number (axes belong to `sweep`)"))
    if plan.settings.transient + plan.settings.periods < LONG:
        return follow(plan)
    with above("a line while it lasts")("simulate"):
        return follow(plan)


def follow(plan: Plan, halt: Halt | None = None) -> Trajectory:
    """Simulate the single point of a plan. Raises Halted if `halt` is called meanwhile."""
    s, halt = plan.settings, halt or Halt()
    eps, eta, dtau = (plan.scalars[name] for name in ("eps", "eta", "dtau"))
    brief = s.work(eps, eta, dtau, bounded=False) <= BRIEF
    capacity = rows_that_fit(s.periods, 64 + s.periods * (8 if eps == 0.0 else 128))
    while True:
        section, impacts = np.empty((1, s.periods, 2)), np.empty((1, 2 * s.periods, 4))
        status, margin = np.empty(1, np.int8), np.empty(1)
        counts, work = np.zeros((1, 5), np.int64), np.empty(1)
        rows, off = np.empty(capacity, SWITCH), np.empty((capacity, 3))
        errors = new_errors(s.method, 1, s.periods)
        bounded = s.method != Method.FIXED
        stored = np.zeros(1, np.int64)
        w, k = new_lanes(1)
        arguments = Arguments(
            w[0], k[0], halt.flag, plan.points(0, 1), np.zeros(1, np.int64), np.zeros(1, np.int64), numbers_of(s),
            section, status, margin, counts, work, impacts, rows=rows, stored=stored, off=off, bounds=errors.section,
            until=errors.until,
        )  # fmt: skip
        run([(single(s.method, False, bounded), [arguments])], halt, brief=brief)
        n = int(stored[0])
        if n <= capacity:
            break
        refuse_many_rows(s.periods, n)
        capacity = n  # more switches than estimated: repeat with their number
    for array in (rows, off):
        array.resize(n, *array.shape[1:], refcheck=False)  # in place: a copy would touch all pages again
    if not bounded:
        off[:] = np.nan
    switch_errors = off[1:].view(SWITCH_ERROR)[:, 0]
    known = {**{c: plan.scalars[c] for c in COLUMNS}, **vars(s)}
    return Trajectory(
        rows[1:], section[0], main_impacts(impacts[0]), Status(int(status[0])), float(margin[0]),
        errors.section[0], switch_errors, float(errors.until[0]), int(work[0]), known, plan, rows[:1],
    )  # fmt: skip
