"""Table of all parameters, quantities of the scene, settings and coordinates, one row for each of them.

Configurations, files, figures and the explorer take meanings, symbols, ranges and units from this table, and so do the
signatures and the help of `simulate`, `sweep`, `limit` and the orbits (keywords.py). This module does not import NumPy,
and no kernel imports it: an edit recompiles nothing.

The parameters have the order of the columns of `Plan.points`.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from vibrodrive.model.choices import ACTS_ON, IN_LANES, Method

ETA = 10.0 * math.sqrt(102.0)
"""Frequency ratio of the disturbance used throughout the paper (§4): irrational, about 100.995."""

LINEAR, LOG = "linear", "log"

TURN = 2.0 * math.pi


class Name(NamedTuple):
    """Properties of one name.

    Attributes
    ----------
    meaning : one line for files, messages and help.
    symbol, mathtext : the symbol of the paper as plain text and in the mathtext of Matplotlib.
    table : table of a configuration that gives its value; "" for a coordinate.
    default : default value; None if the value must be given.
    low, high, open_low : range of allowed values; if `open_low`, `low` itself is not allowed.
    range_text : the range in words, if these are not its numbers.
    axis : ends and spacing of its axis in the explorer; None if it cannot be an axis.
    slider : ends of its slider in the explorer; None without a slider.
    choices : enumeration of the values of a setting with named values.
    unit : unit in files, in the notation of UDUNITS.
    shown : unit in figures.
    scale : factor that converts a value from `unit` to `shown`.
    note : what help says in addition to the meaning.
    """

    meaning: str
    symbol: str
    mathtext: str
    table: str = ""
    default: float | None = None
    low: float = 0.0
    high: float = math.inf
    open_low: bool = False
    range_text: str = ""
    axis: tuple[float, float, str] | None = None
    slider: tuple[float, float] | None = None
    choices: type[IntEnum] | None = None
    unit: str = "1"
    shown: str = ""
    scale: float = 1.0
    note: str = ""

    def allows(self, value: float) -> bool:
        """Return whether a value is in the range."""
        return self.low < value <= self.high or (value == self.low and not self.open_low)

    @property
    def unit_text(self) -> str:
        """The unit in files as it is written by hand, such as m/s² or degrees."""
        return self.unit.replace("degree", "degrees").replace(" s-1", "/s").replace(" s-2", "/s²")

    @property
    def allowed(self) -> str:
        """Allowed values of a parameter or quantity of a scene as text."""
        if self.range_text:
            return self.range_text
        if self.low == -self.high:
            return f"a number between {self.low:g} and {self.high:g}"
        return f"a number {'>' if self.open_low else '>='} {self.low:g} and <= {self.high:g}"


PARAMETERS: dict[str, Name] = {
    "A": Name("excitation amplitude A = Ω0² a0 / (μ g cos α)", "A", "A", "model", None, 0.0, 1e9,
              axis=(2.2, 5.0, LINEAR), slider=(1.0, 6.0)),
    "B": Name("incline over friction B = tan α / μ", "B", "B", "model", 0.1, 0.0, 1e9,
              axis=(0.02, 0.3, LINEAR), slider=(0.0, 0.6)),
    "eps": Name("relative amplitude ε of the disturbance, eq. (9)", "ε", r"\varepsilon", "model", 0.0, 0.0, 1e3,
                axis=(1e-6, 1e-3, LOG), slider=(1e-6, 1e-2)),
    "eta": Name("frequency ratio η of the disturbance, eq. (9)", "η", r"\eta", "model", ETA, 1e-9, 1e8,
                axis=(1.0, 200.0, LINEAR), slider=(1.0, 200.0)),
    "dtau": Name("step Δτ of the grid (fixed, muller)", "Δτ", r"\Delta\tau", "switching", math.nan, 1e-12, 1e6,
                 axis=(1e-3, 1.0, LOG), slider=(1e-4, 1.0), note="These two methods need it, and only they take it."),
    "tol": Name("step tolerance of Muller's method", "tol", r"\mathrm{tol}", "switching", 1e-7, 0.0, 1.0, True,
                axis=(1e-12, 1e-1, LOG),
                note="The refinement ends when its step is smaller. Not allowed with other methods."),
    "xi0": Name("initial gap ξ at τ0", "ξ₀", r"\xi_0", "model", 0.0, 0.0, 1e15, axis=(0.0, 10.0, LINEAR),
                note="Dimensionless with a scene, too: x metres are ``x / scene.length(1)``, and likewise for the "
                "velocity and the time."),
    "dxi0": Name("initial velocity ξ' at τ0", "ξ′₀", r"\xi\mathrm{′}_0", "model", 0.0, -1e12, 1e12,
                 axis=(-3.0, 3.0, LINEAR), note="If it is 0, Fig. 2 determines the initial state."),
    "tau0": Name("initial time τ0", "τ₀", r"\tau_0", "model", 0.0, -1e12, 1e12, axis=(0.0, TURN, LINEAR)),
    "section_phase": Name("phase φ_s of the Poincaré section", "φ_s", r"\varphi_s", "run", 0.0, -1e6, 1e6,
                          axis=(0.0, TURN, LINEAR), slider=(0.0, TURN), note="In radians."),
}  # fmt: skip
"""Dimensionless real arguments of `simulate`. Each may be an axis of a sweep."""

_ANY = (None, 0.0, sys.float_info.max, False, "a finite number >= 0")
_POSITIVE = (None, 0.0, sys.float_info.max, True, "a finite number > 0")
_ANGLE = (None, 0.0, math.nextafter(90.0, 0.0), False, "an angle in degrees >= 0 and < 90")

SCENE: dict[str, Name] = {
    "a0": Name("amplitude a0 of the excitation", "a₀", "a_0", "physical", *_ANY, axis=(3e-4, 1.2e-3, LINEAR),
               unit="m", shown="mm", scale=1e3),
    "omega0": Name("angular frequency Ω0 of the excitation", "Ω₀", r"\Omega_0", "physical", *_POSITIVE,
                   axis=(80.0, 200.0, LINEAR), unit="rad s-1", shown="rad/s"),
    "frequency": Name("frequency f = Ω0/2π of the excitation", "f", "f", "physical", *_POSITIVE,
                      axis=(12.0, 32.0, LINEAR), unit="Hz", shown="Hz"),
    "mu": Name("coefficient of friction μ", "μ", r"\mu", "physical", *_POSITIVE, axis=(0.2, 1.0, LINEAR)),
    "alpha": Name("angle α of the incline", "α", r"\alpha", "physical", *_ANGLE, axis=(0.5, 12.0, LINEAR),
                  unit="degree", shown="°"),
    "mass": Name("mass m", "mass", "m", "physical", *_POSITIVE, axis=(50.0, 500.0, LINEAR), unit="kg", shown="kg"),
    "g": Name("acceleration of gravity", "g", "g", "physical", 9.80665, *_POSITIVE[1:], unit="m s-2", shown="m/s²"),
}  # fmt: skip
"""Quantities of the scene in SI units. A quantity with `axis` may be an axis of a sweep; A and B are then computed for
each point. Exactly one of `omega0` and `frequency` is given."""

SETTINGS: dict[str, Name] = {
    "method": Name("method of finding switches", "method", "", "switching", Method.CERTIFIED, choices=Method),
    "transient": Name("excitation periods before the record begins", "transient", "", "run", 1000),
    "periods": Name("excitation periods recorded", "periods", "", "run", 250, 1),
    "budget": Name(
        "switches allowed in a period; evaluations also count, with a small weight",
        "budget",
        "",
        "run",
        100_000,
        1,
        note="A motion that exceeds it, for example by chattering, ends with the status BUDGET.",
    ),
}
"""Integer settings common to all points of a sweep. They are the fields of `Settings`."""

FURTHER: dict[str, Name] = {
    "scene": Name("machine in SI units, which gives A and B; if its a0 is 0, it gives only B and the units", "", ""),
    "record": Name("records of each motion", "record", "", "run"),
    "max_period": Name("longest period of the orbits, in excitation periods", "max_period", "", "orbits"),
}
"""Further settings, of sweeps and of single commands."""

COORDINATES: dict[str, Name] = {
    "xi": Name("gap ξ", "ξ", r"\xi"),
    "dxi": Name("velocity ξ'", "ξ′", r"\xi\mathrm{′}"),
    "tau": Name("time τ", "τ", r"\tau"),
}

SCENE_AXES = {name: row for name, row in SCENE.items() if row.axis}

AXES = PARAMETERS | SCENE_AXES

FOLLOWS = {"A": "a0", "B": "alpha"}  # parameters that a scene gives, each with the quantity by which it does

OTHERS = tuple(n for n in PARAMETERS if n not in ("A", "B", "eps", "eta", "dtau", "tol", "section_phase"))
"""Parameters that captions, the explorer and limits treat alike: the start, and any that the table gets."""

NAMES = PARAMETERS | SCENE | SETTINGS | FURTHER | COORDINATES

COSTS = {Method.CERTIFIED: (0.1, 0.1), Method.FIXED: (0.5, 0.1), Method.MULLER: (1.5, 0.15)}
"""CPU time in microseconds of an excitation period without a disturbance, and of a switch with one, by method
(`python -m benchmarks.work`)."""


IDLE = {int(m): tuple(name for name, methods in ACTS_ON.items() if m not in methods) for m in Method}
"""Parameters that a method does not use, by method."""


def _default(name: str) -> int:
    return int(SETTINGS[name].default or 0)


@dataclass(frozen=True)
class Settings:
    """Settings common to all points of a sweep."""

    method: int = _default("method")
    transient: int = _default("transient")
    periods: int = _default("periods")
    budget: int = _default("budget")

    @property
    def method_name(self) -> str:
        """Name of the method, as in a configuration."""
        return Method(self.method).name.lower()

    @property
    def idle(self) -> tuple[str, ...]:
        """Parameters that the method does not use."""
        return IDLE[self.method]

    @property
    def words(self) -> dict[str, int | str]:
        """All settings by name, with the method as in a configuration."""
        return vars(self) | {"method": self.method_name}

    def one_by_one(self, bounded: bool) -> bool:
        """Return True if the points of a sweep are computed one by one, not in batches.

        `bounded` states whether error bounds are recorded, which the method FIXED does not compute.
        """
        return self.method not in IN_LANES or (bounded and self.method != Method.FIXED)

    def work(
        self, A: float, B: float, eps: float, eta: float, dtau: float, *, summary: bool = False, bounded: bool = False
    ) -> float:
        """Return the work of a motion with these parameters: an estimate of its CPU time in microseconds.

        `summary` and `bounded` state whether a summary or error bounds are recorded. The estimate is computed, not
        measured, so that the blocks of a file do not depend on the machine. It is the time of the most expensive
        motions on a core of 2.6 GHz. Other motions with similar parameters take as little as a thirtieth of it.

        The time is proportional to the number of switches, of which a fast wave of the disturbance has up to four. A
        wave has switches while the mass rests, if ε η² is large enough to move it, and while the velocity ξ' is smaller
        than the velocity A ε η of the wave. The mass seldom rests if A is large compared with B.
        """
        alone = self.one_by_one(bounded)
        period, switch = COSTS[Method(self.method)]
        if alone:
            period, switch = 2.5, 6.0 * switch
        if eps > 0.0:
            rest, slow = 1.5 * eps * eta * eta, 0.35 * eps * eta
            share = (1.0 if A < 2.0 + 6.0 * B else 0.125) * rest / (1.0 + rest) + slow / (1.0 + 2.0 * slow)
            instants = TURN / dtau if self.method == Method.FIXED and dtau > 0.0 else math.inf  # each has one switch
            switches = min(5.0 + 4.0 * eta * share, instants, self.budget)
            period += switch * switches + (0.06 * (switches + eta) if summary else 0.0)
        return (self.transient + self.periods) * period
