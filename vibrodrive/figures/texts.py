"""Texts in figures: symbols, numbers and equations, the parameters common to the motions shown, and their statuses."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from vibrodrive.model.choices import Method, Status
from vibrodrive.model.described import counted
from vibrodrive.model.names import NAMES, OTHERS, SCENE_AXES

if TYPE_CHECKING:
    from vibrodrive.batch.trajectory import Trajectory

PHASES = ("section_phase", "tau0")
PARTS = (1, 2, 3, 4, 6)  # possible denominators of phases that are written as fractions of π

SYMBOLS = {name: row.mathtext for name, row in NAMES.items() if row.mathtext}
UNITS = {name: row.shown for name, row in NAMES.items() if row.shown}
WORDS = {"frequency": "Excitation frequency "}  # before a symbol that the paper does not have

MATHTEXT = {row.mathtext: row.symbol for row in NAMES.values() if "\\" in row.mathtext} | {
    r"\varphi": "φ", r"\pi": "π", r"\cdot": "·", r"\sum": "∑", r"\mathrm": "", r"\,": "", "_0": "₀", "_2": "₂",
}  # fmt: skip
"""Commands of the mathtext in figures, and what they mean as plain text."""

ALWAYS_SAID = ("A", "B", "a0", "omega0", "frequency", "mu", "alpha", "mass", "eps")
PANELS = 6  # largest number of panels of one figure

COUNTED = (Status.TOO_CLOSE, Status.BUDGET, Status.NEVER_LEAVES, Status.NOT_COMPUTED)
"""Statuses whose points are counted in the note of a figure; figures of limits show where others are."""

_T = TypeVar("_T")


def symbol(name: str) -> str:
    """Return the axis label of a parameter or quantity; a name without a symbol is unchanged."""
    return f"${SYMBOLS[name]}$" if name in SYMBOLS else name


def name_of(name: str) -> str:
    """Return the label of an axis: the symbol of a parameter or quantity with its unit."""
    return WORDS.get(name, "") + symbol(name) + (f" in {UNITS[name]}" if name in UNITS else "")


def number(value: float) -> str:
    """Return a value as mathtext without dollars: 0.1, 3.04, 2·10⁻⁴."""
    text = f"{value:.6g}"
    if "e" not in text and (value == 0 or abs(value) >= 1e-2):
        return text
    mantissa, exponent = f"{value:.5e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".")
    power = rf"10^{{{int(exponent)}}}"
    if mantissa in ("1", "-1"):
        return mantissa[:-1] + power
    return rf"{mantissa}\cdot{power}"


def plain(text: str) -> str:
    """Return a text of a figure without mathtext and line breaks, such as ε = 2·10⁻⁴."""
    for code in sorted(MATHTEXT, key=len, reverse=True):  # some are beginnings of others
        text = text.replace(code, MATHTEXT[code])
    high = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    text = re.sub(r"\^\{?(-?\d+)\}?", lambda power: power[1].translate(high), text)
    return " ".join(re.sub(r"[${}\\]", "", text).split())


def phase(value: float) -> str:
    """Return a phase as mathtext without dollars: π/2, 3π/4, 0, 2."""
    for part in PARTS:
        count = round(value * part / math.pi)
        if count and value == count * math.pi / part:
            times = {1: "", -1: "-"}.get(count, str(count))
            return rf"{times}\pi" + (f"/{part}" if part > 1 else "")
    return number(value)


def equation(name: str, value: float) -> str:
    """Return an equation such as “ε = 2·10⁻⁴” as mathtext."""
    unit, value = UNITS.get(name, ""), float(as_shown(name, value))
    written = phase(value) if name in PHASES else number(value)
    return f"${SYMBOLS[name]} = {written}$" + (unit if unit == "°" else f" {unit}".rstrip())


def as_shown(name: str, values: Any) -> Any:
    """Return values of a parameter, number or array, in the unit used in figures."""
    return values * NAMES[name].scale if name in SCENE_AXES else values


def conditions(values: Mapping[str, Any], apart: Collection[str] = (), *, section: bool = True) -> list[str]:
    """Return the conditions common to all motions as phrases, without the parameters in `apart`.

    `values` contains parameters, `method`, `transient` and `periods`, like the `arguments` of a trajectory or what
    `of_sweep` returns. If `section`, the phase of the section is included.
    """
    disturbed = "eps" in apart or values.get("eps", 0.0) > 0.0
    names = [*ALWAYS_SAID, *(["eta"] if disturbed else [])]
    phrases = [equation(n, values[n]) for n in names if n in values and n not in apart]
    if "method" in values:
        method = Method(values["method"])
        phrases.append(method.name.lower())
        if method != Method.CERTIFIED and "dtau" in values and "dtau" not in apart:
            phrases.append(equation("dtau", values["dtau"]))
    if {"transient", "periods"} <= values.keys():
        phrases.append(f"periods {values['transient'] + 1}–{values['transient'] + values['periods']}")
    last = [*(["section_phase"] if section else []), *OTHERS]
    return phrases + [equation(n, values[n]) for n in last if n in values and n not in apart]


def shared_by(motions: Sequence[Trajectory], section: bool = False) -> list[str]:
    """Return the conditions common to all motions, and the statuses other than OK."""
    values = [m.arguments | (m.scene.given if m.scene else {}) for m in motions]
    first = values[0]
    apart = [n for n in first if any(v.get(n) != first[n] for v in values)]
    common = {n: value for n, value in first.items() if n not in apart}
    statuses = [Status(m.status).words for m in motions if m.status != Status.OK]
    return conditions(common, apart, section=section) + list(dict.fromkeys(statuses))


def of_sweep(results: Any) -> dict[str, Any]:
    """Return the scalars and settings of a sweep, which are common to all points."""
    return {**results.scalars, **vars(results.settings)}


def conditions_of(results: Any, drawn: Collection[str | None] = (), *, section: bool = True) -> list[str]:
    """Return the conditions common to all points of a sweep as phrases. With the axes `drawn` of a map, the others have
    their first value."""
    fixed = [name for name in results.axes if drawn and name not in drawn]
    first = [(name, results.axes[name][0], len(results.axes[name])) for name in fixed]
    phrases = [equation(name, value) + (f" (first of {count})" if count > 1 else "") for name, value, count in first]
    apart = [*results.axes, *([results.plan.sought] if results.plan.seeks else [])]
    return phrases + conditions(of_sweep(results), apart, section=section) + damaged(results)


def damaged(*several: Any) -> list[str]:
    """Return a phrase if a file of these results is damaged, as far as the arrays read so far show it."""
    return ["damaged parts of the file left out"] if any(results._damaged for results in several) else []


def status_phrases(status: np.ndarray) -> list[str]:
    """Return the number of points of each status of COUNTED as phrases.

    For example: "not computed: 3 of 100 points", "out of budget: 2".
    """
    counts = {s.words: int((status == s).sum()) for s in COUNTED}
    phrases = [f"{name}: {count}" for name, count in counts.items() if count]
    return [f"{phrases[0]} of {counted(status.size, 'point')}", *phrases[1:]] if phrases else []


def rest_phrases(dxi: np.ndarray, status: np.ndarray) -> list[str]:
    """Return the share of section points with ξ' = 0 as a phrase. `dxi` (…, n) or (…) has the status (…).

    Motions that rest permanently are not counted, because their status says so.
    """
    moving = dxi[status != Status.NEVER_LEAVES]
    finite = np.count_nonzero(np.isfinite(moving))
    rests = np.count_nonzero(moving == 0.0)
    if not rests:
        return []
    all_of_them = "at rest at every section point (another section phase may show the motion)"
    return [all_of_them if rests == finite else f"at rest at {100 * rests / finite:.2g} % of the section points"]


def some(items: Sequence[_T]) -> list[_T]:
    """Return at most PANELS of the items, evenly spaced, with the first and the last."""
    if len(items) <= PANELS:
        return list(items)
    return [items[round(k)] for k in np.linspace(0, len(items) - 1, PANELS)]


def choice(shown: int, total: int, of: str) -> list[str]:
    """Return ["6 of 9 panels shown"] if some panels or lines are not shown, and [] if all are shown."""
    return [f"{shown} of {total} {of} shown"] if shown < total else []


def place_of(results: Any, at: Mapping[str, int]) -> str:
    """Return the values of the axes at these indices as text. The axis `point` gives the values of its parameters."""
    values, variables = results.plan.at(at), results.plan.variables
    return ", ".join(
        equation(n, values[n]) for dimension in at for n in variables if variables[n].dimension == dimension
    )


def computed(status: np.ndarray) -> np.ndarray:
    """Return True for each point that has a section. A point with the status TOO_CLOSE has the section of one of the
    possible motions."""
    return ~np.isin(status, (Status.NOT_COMPUTED, Status.BUDGET))
