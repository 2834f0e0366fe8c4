"""Description of one motion in words, for `Trajectory.describe` and for a click in the explorer. With a scene it has a
table of the machine in SI units, and of the machines with one quantity changed by 1 %."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from html import escape
from typing import Any, NamedTuple

import numpy as np

from vibrodrive.batch.sweep import check_threads, compute
from vibrodrive.jit.slices import Halt
from vibrodrive.jit.trig import sincos
from vibrodrive.model.choices import Method, Status
from vibrodrive.model.names import PARAMETERS, SCENE, TURN, Settings
from vibrodrive.model.parameters import unknown
from vibrodrive.model.physical import Scene, measure, scene_of
from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import IMPACT_POWER, LONGEST, QUANTITIES, Quantity, number, period_words
from vibrodrive.model.records import SECTION, SUMMARY
from vibrodrive.model.states import IN_WORDS, PLAIN_STATES, states
from vibrodrive.model.variables import POINT, along

LEAST = 4 * LONGEST
"""Least number of excitation periods from which the summary is computed. They suffice to find the longest period."""

STEP = 0.01
SETTLING, LONGEST_TRANSIENT = 8.0, 100_000
"""Without an obstacle the velocity approaches its mean as exp(-4 n/A) or faster, with n the number of periods. The
transient is SETTLING A periods, but at most LONGEST_TRANSIENT."""

AVERAGED = 2048  # periods of the mean velocity; at η = 10·√102 the disturbance beats with the excitation in 200 periods
SETTLED = {False: 1e-6, True: 1e-4}
"""Largest difference of the means of both halves, in units of A, without and with a disturbance."""


class Column(NamedTuple):
    """Column of the table: its quantity, heading, and unit and factor if these are not those of figures."""

    row: Quantity
    heading: str
    shown: str = ""
    scale: float = 0.0


COLUMNS = (
    Column(number("period", "period of the motion", scales="time"), "period"),
    Column(QUANTITIES["impacts"], "impacts", "1/s"),
    Column(QUANTITIES["impact_speed_mean"], "mean speed"),
    Column(QUANTITIES["impact_speed_max"], "max speed"),
    Column(IMPACT_POWER, "power"),
    Column(number("friction_power", "power lost to friction", scales="power", source="friction_loss"), "friction"),
    Column(QUANTITIES["xi_max"], "lift"),
    Column(number("conveying", "mean velocity without an obstacle", scales="velocity"), "conveying", "mm/s", 1e3),
)

NOTES = """\
impacts: number per second, touches included; mean, max speed: velocity of the impacts.
power, friction: mean power of the impacts and of friction, whose sum is that of the excitation; lift: largest gap.
conveying: mean velocity without an obstacle, negative down the incline; with the obstacle it is 0. It is −∞ for B > 1:
friction is too weak to hold the mass, which accelerates without limit.
–: the motion does not repeat within 64 excitation periods, or the velocity has not settled."""


class _Rows(dict[str, Mapping[str, float]]):
    """Rows by name, which may have the minus of a keyboard instead of “−”."""

    def __contains__(self, name: object) -> bool:
        return super().__contains__(_named(name))

    def __missing__(self, name: str) -> Mapping[str, float]:
        if name not in self:
            raise KeyError(unknown("row", name, self) if self else "the table has no rows without a scene")
        return self[_named(name)]

    def get(self, name: str, default: Any = None) -> Any:
        return super().get(_named(name), default)


def _named(row: object) -> str:
    return str(row).replace("-", "−")


class Description(str):
    """Description of a motion as text. A notebook shows its table as a table.

    rows : dict of row to dict of column to number in SI units, per kilogram if the scene has no mass; empty without a
        scene. The rows are "machine" and the same machine with one quantity changed, such as "a0 −1 %". The columns
        have the names of COLUMNS.
    """

    rows: Mapping[str, Mapping[str, float]]
    _lines: Sequence[str]
    _table: Sequence[Sequence[str]]

    @classmethod
    def of(
        cls, lines: Sequence[str], rows: Mapping[str, Mapping[str, float]], scene: Mapping[str, float]
    ) -> Description:
        """Return the text of these lines and of a table, in the units of a scene by its quantities."""
        units = [measure(column.row, scene) for column in COLUMNS]
        table = [["", *(column.heading for column in COLUMNS)]]
        table.append(["", *(column.shown or unit.shown for column, unit in zip(COLUMNS, units, strict=True))])
        for name, row in rows.items():
            shown = (row[c.row.name] * (c.scale or unit.scale) for c, unit in zip(COLUMNS, units, strict=True))
            table.append([name, *("–" if value != value else f"{value:.4g}".replace("-inf", "−∞") for value in shown)])
        wide = ["".join([f"{line[0]:13}", *(f"{cell:>11}" for cell in line[1:])]) for line in table]
        self = cls("\n".join([*lines, *(["", *wide, "", NOTES] if rows else [])]))
        self.rows, self._lines, self._table = _Rows(rows), lines, table if rows else []
        return self

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        lines = ["<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in line) + "</tr>" for line in self._table]
        below = f"<table>{''.join(lines)}</table><pre>{NOTES}</pre>" if lines else ""
        return f"<pre>{escape(chr(10).join(self._lines))}</pre>{below}"


def _long(plan: Plan) -> Plan:
    """Return the plan of a motion, with at least LEAST recorded periods."""
    return replace(plan, settings=replace(plan.settings, periods=max(LEAST, plan.settings.periods)))


def long_summary(plan: Plan, halt: Halt | None = None) -> dict[str, Any]:
    """Return the summary of the single motion of a plan, from at least LEAST periods: numbers by the names in
    model/records.py. Raises Halted if `halt` is called."""
    return {name: values[0].item() for name, values in _summaries(_long(plan), halt).items()}


def _summaries(plan: Plan, halt: Halt | None = None) -> Mapping[str, np.ndarray]:
    return compute(replace(plan, record=(SUMMARY,)), 0, plan.n_points, check_threads(None), halt).records


def described(status: Status, margin: float, plan: Plan) -> Description:
    """Return the text of `Trajectory.describe`."""
    a, scene, long = plan.scalars, scene_of(plan.scalars), _long(plan)
    place = ", ".join(f"{name} = {a[name]:g}" for name in ("A", "B", "eps") if name != "eps" or a[name])
    if scene is None:
        return Description.of([place, *sentences(status, margin, long_summary(plan), plan)], {}, {})
    pull = a["A"] * (1.0 + a["eps"] * a["eta"] * a["eta"])  # largest excitation
    leaves = "the mass leaves the obstacle" if pull > 1.0 + a["B"] else "the mass rests at the obstacle"
    quantities = {name: value for name, value in scene.given.items() if name != "g" or value != Scene.g}
    machine = (f"{SCENE[n].symbol} = {v * SCENE[n].scale:.5g} {SCENE[n].shown}".strip() for n, v in quantities.items())
    scenes = {"machine": scene} | beside(scene)
    A, B = (np.array([getattr(s, name) for s in scenes.values()]) for name in ("A", "B"))
    A[0], B[0] = a["A"], a["B"]  # those of the motion, also if a0 was computed from A
    summaries, speeds = _summaries(_with(long, A=A, B=B)), conveying(long, A, B)
    rows = {}
    for k, (name, s) in enumerate(scenes.items()):
        at = {key: values[k].item() for key, values in summaries.items()} | {"conveying": float(speeds[k])}
        at["period"] = TURN * at["period"] if at["period"] > 0 else math.nan
        rows[name] = {row.name: measure(row, s.given).of(at[row.source or row.name]) for row, *_ in COLUMNS}
    first = {key: values[0].item() for key, values in summaries.items()}
    lines = [", ".join(machine), f"{place}: {leaves}", *sentences(status, margin, first, plan)]
    return Description.of(lines, rows, scene.given)


def beside(scene: Scene) -> dict[str, Scene]:
    """Return the scenes with one quantity changed by STEP, by names such as "a0 −1 %"."""
    quantities, scenes = scene.given, {}
    for name in (n for n in quantities if n not in ("mass", "g")):
        for sign, by in (("−", 1.0 - STEP), ("+", 1.0 + STEP)):
            value = quantities[name] * by
            value = min(value, 89.9) if name == "alpha" else value
            scenes[f"{name} {sign}1 %"] = Scene.quiet(**quantities | {name: value})
    return scenes


def _with(plan: Plan, **together: np.ndarray) -> Plan:
    """Return the plan of motions that differ in the given parameters only."""
    return replace(plan, variables={**plan.variables, **along(POINT, together)})


def conveying(plan: Plan, A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Return the mean ξ' of the motions of a plan without an obstacle, certified, at values of A and B.

    It is -inf for B > 1, because the mass then accelerates without limit, and NaN if the means of both halves of the
    record differ. The motions begin with the mean for A >> 1, -A sin(πB/2), where friction balances B.
    """
    eps, eta, n = plan.scalars["eps"], plan.scalars["eta"], AVERAGED
    transient = max(plan.settings.transient, math.ceil(min(SETTLING * A.max(), LONGEST_TRANSIENT)))
    # the velocity down never exceeds 2 A (1 + ε η), so that a mass at this gap does not reach the obstacle
    far = 1.0 + 2.0 * A * (1.0 + eps * eta) * TURN * (transient + n)
    computed = (B <= 1.0) & (far <= PARAMETERS["xi0"].high)
    level = np.array([sincos(0.25 * TURN * min(b, 1.0))[0] for b in B.tolist()])
    start = np.where(computed, [A, far, -A * (level + 1.0 + eps * eta)], 0.0)
    free = _with(plan, B=B, tau0=0.0 * B, **dict(zip(("A", "xi0", "dxi0"), start, strict=True)))
    settings = Settings(transient=transient, periods=n, budget=plan.settings.budget)
    section = compute(replace(free, settings=settings, record=(SECTION,)), 0, len(A), check_threads(None)).section
    assert section is not None
    gap, half = section[..., 0], n // 2
    early, late, mean = ((gap[:, k] - gap[:, k - m]) / (TURN * m) for k, m in ((half, half), (-1, half), (-1, n - 1)))
    settled = computed & (np.abs(early - late) <= SETTLED[eps > 0.0] * A)
    return np.where(B > 1.0, -math.inf, np.where(settled, mean, math.nan))


def sentences(status: Status, margin: float, summary: Mapping[str, Any], plan: Plan) -> list[str]:
    """Return the lines of the description: status, margin, period, impacts, cycle of states, impact speeds.

    `summary` is the result of `long_summary`. With a scene, times and speeds are in SI units.
    """
    scene, advice = scene_of(plan.scalars), status.advice
    if status == Status.OK and plan.settings.method == Method.FIXED:
        step = plan.scalars["dtau"]
        advice = (
            f"grid of step Δτ = {step:.6g}: switches are late by up to one step; two switches in a step may be missed"
        )
    closest = f"margin {margin:.3g}: smallest distance of a decision from the opposite decision, in H, ξ or ξ'"
    closest = "no decision" if math.isinf(margin) else closest
    plain = advice == Status.OK.advice  # it need not be said again of each motion
    lines = [f"OK, {closest}"] if plain else [f"{status.name}: {advice}", closest]
    if status != Status.OK:
        return lines
    period, impacts = summary["period"], summary["impacts"]
    cycle = period_words(period)
    if scene is not None and period > 0:
        cycle += f" ({1e3 * period / scene.frequency:.4g} ms)"
    if math.isnan(impacts):
        return [*lines, f"{cycle}; the record is too short for means, which need two main impacts"]
    rate = "" if scene is None else f" ({impacts * scene.frequency:.4g} per second)"
    over = "" if period > 0 else f", a mean of {_long(plan).settings.periods} periods, between main impacts"
    lines.append(f"{cycle}; impacts per excitation period: {impacts:.4g}{rate}{over}")
    if summary["sequence"] > 0:
        cycle = " ".join(states(summary["sequence"]))
        long = f"a cycle of more than {PLAIN_STATES}"  # its number is no text for a reader
        lines.append("states: " + (long if cycle[0].isdigit() else f"{cycle} ({IN_WORDS})"))
    mean, largest = summary["impact_speed_mean"], summary["impact_speed_max"]
    if scene is None:
        lines.append(f"mean impact speed {mean:.6g}, largest {largest:.6g}")
    else:
        lines.append(f"mean impact speed {scene.velocity(mean):.4g} m/s, largest {scene.velocity(largest):.4g} m/s")
    if math.isfinite(summary["lyapunov"]):
        a_unit, per = (1.0, "excitation period") if scene is None else (scene.frequency, "second")
        lines.append(f"Lyapunov exponent {a_unit * summary['lyapunov']:.4g} per {per}")
    return lines
