"""Computation of one trajectory: its switches and section points after the transient, and samples between switches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Unpack

import numpy as np

from vibrodrive.batch import memory
from vibrodrive.batch.describe import Description, described, long_summary
from vibrodrive.batch.frames import Table, columns, frame
from vibrodrive.batch.parallel import BRIEF, run
from vibrodrive.jit.slices import Halt, in_slices
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels.lane import new_lanes
from vibrodrive.kernels.outputs import numbers_of
from vibrodrive.kernels.sampling import sample_segments
from vibrodrive.kernels.single import single
from vibrodrive.model.above import above
from vibrodrive.model.choices import Method, MethodLike, Status
from vibrodrive.model.described import counted
from vibrodrive.model.figure import documented
from vibrodrive.model.keywords import Point, takes
from vibrodrive.model.parameters import COLUMNS, check_count, with_sentences
from vibrodrive.model.physical import Measure, Scene, measure, scene_of
from vibrodrive.model.plan import Plan, make_plan, refuse_axes
from vibrodrive.model.quantities import row_of
from vibrodrive.model.size import MOTION_BYTES, ROW_BYTES, fitting_rows, refuse_large
from vibrodrive.model.slips import names_scene, unlikely, warn

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vibrodrive.model.figure import Style, Width

LONG = 100_000  # from this number of periods on, progress is shown, because the computation may take more than a second

SWITCH_ERROR = np.dtype([("tau", "f8"), ("xi", "f8"), ("dxi", "f8")])
"""Row of `Trajectory.switch_errors`: bounds of the errors of the row of `Trajectory.switches` with the same index."""

MAIN_IMPACT = np.dtype([("period", "i8"), ("phase", "f8"), ("speed", "f8"), ("row", "i8")])
"""Row of `Trajectory.impacts`; `row` is the index of the impact in `Trajectory.switches`."""


def main_impacts(written: np.ndarray) -> np.ndarray:
    """Convert the main impacts that a kernel has written for one motion to an array of MAIN_IMPACT.

    `written` is a float64 array of shape (2 × periods, 4). The rows after the last main impact are NaN.
    """
    last = int(np.searchsorted(written[:, 0], np.nan))  # rows >= last are NaN
    impacts = written[:last]
    rows = np.empty(len(impacts), MAIN_IMPACT)
    for column, name in enumerate(MAIN_IMPACT.names or ()):
        rows[name] = impacts[:, column]
    return rows


def same_array(a: Any, b: Any) -> bool:
    """Return True if two arrays, plain or structured, are equal. NaN counts as equal to NaN."""
    a, b = np.asarray(a), np.asarray(b)
    if a.dtype.names is not None:
        return a.dtype == b.dtype and all(same_array(a[name], b[name]) for name in a.dtype.names)
    return np.array_equal(a, b, equal_nan=True)


class Sample(NamedTuple):
    """Motion at equidistant instants, from its closed form: dimensionless arrays of equal length.

    tau float64 : time τ
    xi, dxi float64 : gap ξ and velocity ξ'
    state int8 : values of `State`
    H float64 : adhesive force
    """

    tau: np.ndarray
    xi: np.ndarray
    dxi: np.ndarray
    state: np.ndarray
    H: np.ndarray

    def __eq__(self, other: object) -> bool:
        """Return True if all numbers are equal. NaN counts as equal to NaN."""
        return isinstance(other, Sample) and all(map(same_array, self, other))

    def __ne__(self, other: object) -> bool:
        return not self == other


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Result of `simulate`. Two trajectories are equal if their arguments and all results are equal to the bit.

    With T = `transient` and P = `periods`, the record is the time interval (τ0 + 2πT, τ0 + 2π(T + P)].

    Attributes
    ----------
    switches : structured array
        switches in the record, one row each, in order of time: period (number of completed excitation periods since
        τ = 0), phase in [0, 2π), before and after (the two states, `State`), xi and dxi (ξ and ξ' just before the
        switch). On a grid xi may be negative: with "fixed" because an impact is noticed late, with "muller" after a
        step that skipped two zeros of ξ'.
    section : float64 (periods, 2)
        ξ and ξ' at the section points of the record, τ = section_phase + 2πk. If the motion exceeded the budget, the
        points after its end are NaN.
    impacts : structured array
        main impacts in the record, one row each, in order of time: period, phase, speed (-ξ'), row (index of the impact
        in `switches`). An impact is a main impact if there is no faster impact within half an excitation period before
        or after it. Any other impact is a touch.
    status : Status
        OK, or another value that `status.advice` explains in a sentence. OK means that all decisions of the motion are
        certain: the accumulated error was always too small to change a decision (`docs/certified.md`). With "muller",
        OK assumes that the grid misses no zero. With "fixed", OK considers only the error since the previous switch, as
        if the state at the previous switch were exact.
    margin : float
        smallest distance, in H, ξ or ξ', of any decision from the opposite decision. The state at the previous switch
        is assumed to be exact. If there was no decision, the margin is inf.
    error : float64 (periods, 2)
        bounds of the errors of ξ and ξ' in `section`. The error is the difference from the exact solution of the model
        with the same initial values. The bounds are inf after the first decision that may be wrong, and NaN where
        `section` is NaN. With "fixed" all bounds are NaN: switches are late by up to Δτ, and this delay is a
        disturbance to be studied, not an error.
    switch_errors : structured array
        bounds of the errors of each row of `switches`: tau (time of the switch), xi (ξ) and dxi (ξ'). They are inf or
        NaN in the same cases as `error`.
    certain_until : float
        excitation period, counted as in `switches["period"]`, from which on a decision may be wrong; inf if all
        decisions are certain, NaN with "fixed". Before this period the bounds `error` and `switch_errors` are finite.
    evaluations : int
        number of evaluations of switching functions.
    arguments : dict
        all arguments by name, with their defaults; method is the integer of `Method`.

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

    Every decision is certain, and the error of the time of each switch is below 1e-12:

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

        Motions with different arguments (method, …) are not equal: compare their switches or sections.
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
        how = f"{method}, {a['transient']} + {counted(a['periods'], 'period')}"
        switches, impacts = counted(len(self.switches), "switch", "es"), counted(len(self.impacts), "main impact")
        return f"<Trajectory {', '.join(start)}: {how}; {switches}, {impacts}; {self.status}, margin {self.margin:.2g}>"

    @property
    def period(self) -> int:
        """Period of the motion in excitation periods, as in a summary: 0 if it does not repeat within 64 periods.

        It is computed at each access, from 256 periods if fewer are recorded.
        """
        return int(long_summary(self._plan)["period"])

    @property
    def scene(self) -> Scene | None:
        """The machine in SI units, or None. If only A was given, its a0 is computed from A."""
        return scene_of(self._plan.scalars)

    def dimensionless(self) -> Trajectory:
        """Return the same motion without its scene. Its tables, figures and description are dimensionless."""
        plan = self._plan
        return replace(self, _plan=replace(plan, variables={name: plan.variables[name] for name in COLUMNS}))

    def measure(self, quantity: str) -> Measure:
        """Return the conversion of a quantity to SI units; one that changes nothing without a scene."""
        return measure(row_of((), quantity), self._plan.scalars)

    @with_sentences
    def to_dataframe(self, of: Table = "switches") -> pandas.DataFrame:
        """Return the switches, the main impacts or the section points as a table.

        This needs pandas, which the extra `data` installs. For lists of orbits, bifurcations or curves use
        `pandas.DataFrame(list)`.

        Parameters
        ----------
        of : "switches", "impacts" or "section"
            the array to convert; default "switches".

        Returns
        -------
        pandas.DataFrame
            one row for each row of the array. The columns are tau (τ) and the fields of the array; states are given by
            name. With a scene the columns in SI units have the unit in their name: t_s, x_m, v_m_per_s (dx/dt),
            speed_m_per_s. `attrs` contains the arguments, the status and the `units` by column.

        Raises
        ------
        ValueError
            if `of` is another name.
        ImportError
            if pandas is not installed. The message contains the command that installs it.

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
        return frame(self._arrays, of, self.arguments, self.status, self.measure)

    def columns(self, of: Table = "switches") -> dict[str, np.ndarray]:
        """Return the columns of `to_dataframe` as arrays by name, without pandas."""
        return columns(self._arrays, of, self.arguments, self.measure)[0]

    @property
    def _arrays(self) -> dict[str, np.ndarray]:
        return {"switches": self.switches, "impacts": self.impacts, "section": self.section}

    @documented
    def plot(
        self,
        curves: Sequence[str] = ("phase", "time"),
        *,
        shown: int | None = 10,
        ax: Axes | Sequence[Axes] | None = None,
        style: Style | None = None,
        width: Width | None = None,
        notes: bool | None = None,
    ) -> Figure:
        """Draw the motion as curves with its switches.

        Parameters
        ----------
        curves : sequence of str
            panels to draw: "phase" (ξ' over ξ), "time" (ξ over τ), "velocity" (ξ' over τ), "section" (section points).
        shown : int, optional
            number of periods that curves over time show, from the first period of the record; None shows all. It needs
            a curve over time.

        Raises
        ------
        ValueError
            if a curve is unknown, or if a keyword has no effect on the curves.
        """
        drawn = above("the figure of a motion")
        return drawn(self, curves, shown=shown, ax=ax, style=style, width=width, notes=notes)

    def describe(self) -> Description:
        """Return a description: status, margin, period, impacts, cycle of states, impact speeds, Lyapunov exponent.

        The period and the means are those of a summary (see `Results`) of the recorded periods, or of 256 periods if
        fewer are recorded. With a scene it is in SI units and has a table: period, impacts per second, their velocity
        and power, the largest gap, and the mean velocity without an obstacle, for the machine and for those with a0,
        omega0 (or frequency), mu or alpha smaller or larger by 1 %.

        Returns
        -------
        Description
            text that a notebook shows as a table. Its attribute `rows` contains the numbers of the table in SI units.

        Examples
        --------
        >>> import vibrodrive as vd
        >>> print("\\n".join(vd.simulate(1.5, transient=10, periods=1).describe().splitlines()[2:]))
        period 1; impacts per excitation period: 1
        states: U S D I R (Up, Down, Stick, Rest, Impact)
        mean impact speed 0.699856, largest 0.699856
        >>> machine = vd.Scene(a0=0.8e-3, omega0=150.0, mu=0.6, alpha=3.4, mass=250.0)
        >>> rows = vd.simulate(scene=machine).describe().rows
        >>> found = rows["machine"]
        >>> f"{found['impacts']:.2f} impacts per second, {found['impact_power']:.2f} W"
        '11.94 impacts per second, 10.19 W'
        >>> f"{found['conveying']:.4f} m/s, with 1 % more Ω0 {rows['omega0 +1 %']['conveying']:.4f} m/s"
        '-0.0159 m/s, with 1 % more Ω0 -0.0162 m/s'
        """
        return described(self.status, self.margin, self._plan)

    @with_sentences
    def sample(self, points_per_period: int) -> Sample:
        """Evaluate the motion at equidistant instants of the record, including its beginning and its end.

        Parameters
        ----------
        points_per_period : int, at least 1
            number of instants in each excitation period.

        Returns
        -------
        Sample
            dimensionless arrays of length periods · points_per_period + 1: tau (time τ), xi (gap ξ), dxi (velocity ξ')
            and H (adhesive force of eqs. (2) and (9)), all float64, and state (int8, `State`). If the budget was
            exhausted, xi, dxi and H are NaN after the last switch.

        Raises
        ------
        TypeError, ValueError
            if points_per_period is not an integer >= 1, or if the arrays do not fit into memory.
        """
        count = check_count("points_per_period", points_per_period, 1, 10**8)
        settings, rows = self._plan.settings, np.concatenate([self._start, self.switches])
        total = settings.periods * count + 1
        # τ, ξ, ξ', H and the state, and temporary arrays
        refuse_large(f"points_per_period = {count}", f"{total} instants take", 64 * total)
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
            recorded = tau <= TWO_PI * last["period"] + last["phase"]
            out[~recorded] = np.nan
        return Sample(tau, out[:, 0], out[:, 1], state, out[:, 2])


@takes(Point[float])
def simulate(
    written: Mapping[str, Any],
    /,
    A: float | None = None,
    *,
    method: MethodLike = "certified",
    **parameters: Unpack[Point[float]],
) -> Trajectory:
    """Simulate one trajectory of the oscillator, eqs. (1)-(10) and the scheme of Fig. 2.

    All quantities are dimensionless (§2 of the paper). With a scene the description, tables and figures of the motion
    are in SI units.

    Parameters
    ----------
    A : float, 0 to 1e9
        excitation amplitude, A = Ω0² a0 / (μ g cos α). Required without a scene.
    method : "certified", "muller" or "fixed"
        method that finds the end of a state. "certified" finds the first zero of the switching function and never
        misses one. "muller" scans a grid and refines the zero by Muller's method (§4). "fixed" takes the first grid
        point after the sign change (§5). "muller" and "fixed" need `dtau`.
    **parameters

    Returns
    -------
    Trajectory
        the switches, section points and main impacts of the record, with status, margin and error bounds. Its method
        `sample` gives the motion between the switches.

    Raises
    ------
    TypeError, ValueError
        if an argument is invalid. The message is one sentence: name, value and allowed values of the argument.

    Warns
    -----
    UserWarning
        for values that are probably a mistake: a section_phase or tau0 in degrees; ε in per cent; a dtau above 2π; A
        and B swapped.

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
    refuse_axes(plan.axes, " (for an axis use `sweep`)")
    warn(unlikely(plan, names_scene(written, plan)))
    if plan.settings.transient + plan.settings.periods < LONG:
        return follow(plan)
    with above("the progress of a call")("simulate"):
        return follow(plan)


def follow(plan: Plan, halt: Halt | None = None) -> Trajectory:
    """Simulate the motion from the single point of a plan. Raises Halted if `halt` is called before the motion ends."""
    s, halt = plan.settings, halt or Halt()
    point = [plan.variables[name].values for name in COLUMNS]
    A, B, eps, eta, dtau, *_ = point
    brief = s.work(A, B, eps, eta, dtau, bounded=True) <= BRIEF
    reused = brief and s.periods <= memory.FEW
    capacity = fitting_rows(s.periods, 64 + s.periods * (8 if eps == 0.0 else 128))
    bounded = s.method != Method.FIXED
    while True:
        a: Any = memory.take(s.periods, capacity) if reused else memory.new(s.periods, capacity, halt.flag)
        a.points[0], a.numbers[:] = point, numbers_of(s, 1)
        a.bounds[:], a.until[:] = (0.0, 0.0) if bounded else (np.nan, np.nan)
        run([(single(s.method, False, bounded), [a])], halt, brief=brief)
        n = int(a.stored[0])
        if n <= capacity:
            break
        refuse_large(f"periods = {s.periods}", f"{n} switches take", MOTION_BYTES * s.periods + ROW_BYTES * n)
        if reused:
            memory.give_back(a)
        reused, capacity = False, n  # there are more switches than estimated: repeat the computation with enough rows
    rows, off, section, bounds = a.rows, a.off, a.section[0], a.bounds[0]
    if reused:
        rows, off, section, bounds = rows[:n].copy(), off[:n].copy(), section.copy(), bounds.copy()
    else:
        for array in (rows, off):
            array.resize(n, *array.shape[1:], refcheck=False)  # in place, because a copy takes time
    if not bounded:
        off[:] = np.nan
    switch_errors = off[1:].view(SWITCH_ERROR)[:, 0]
    arguments = {**dict(zip(COLUMNS, point, strict=True)), **vars(s)}
    trajectory = Trajectory(
        rows[1:], section, main_impacts(a.impacts[0]), Status(int(a.status[0])), float(a.margin[0]), bounds,
        switch_errors, float(a.until[0]), int(a.work[0]), arguments, plan, rows[:1],
    )  # fmt: skip
    if reused:
        memory.give_back(a)
    return trajectory
