"""Every parameter, quantity of the scene, setting and coordinate: one row each, with all that is fixed about its name.

From here configurations, files, figures and the explorer have meanings, symbols, ranges and units. The signatures of
`simulate`, `sweep` and the limits stay written out; a test holds their defaults against this table. Nothing here
imports NumPy, and no kernel imports this module: an edit recompiles nothing.

The order of the parameters is that of the columns of a point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from vibrodrive.model.choices import Method, Scan

ETA = 10.0 * math.sqrt(102.0)
"""Frequency ratio of the disturbance used throughout the paper (§4): irrational, about 100.995."""

LINEAR, LOG = "linear", "log"
"""Spacing of the values of an axis."""

TURN = 2.0 * math.pi


class Name(NamedTuple):
    """All that is fixed about one name.

    Attributes
    ----------
    meaning : one line, as files and messages say it.
    symbol, mathtext : the symbol of the paper in plain letters, and as Matplotlib reads it.
    table : table of a configuration that holds it as one value; "" if it is a coordinate.
    default, low, high, open_low : default (None: must be given), and the range of allowed values; `open_low` excludes
        `low` itself.
    axis : ends and spacing of an axis of the explorer; None if it cannot be an axis.
    slider : ends and step of its slider in the explorer, if it has one.
    choices : the members that it may be, of a setting that is a choice.
    unit : unit in files (UDUNITS).
    shown, scale : unit in figures, and how many of them are one of files.
    """

    meaning: str
    symbol: str
    mathtext: str
    table: str = ""
    default: float | None = None
    low: float = 0.0
    high: float = math.inf
    open_low: bool = False
    axis: tuple[float, float, str] | None = None
    slider: tuple[float, float, float] | None = None
    choices: type[IntEnum] | None = None
    unit: str = "1"
    shown: str = ""
    scale: float = 1.0

    @property
    def allowed(self) -> str:
        """The allowed values of a parameter, in words."""
        if self.low == -self.high:
            return f"a number between {self.low:g} and {self.high:g}"
        return f"a number {'>' if self.open_low else '>='} {self.low:g} and <= {self.high:g}"


PARAMETERS: dict[str, Name] = {
    "A": Name("excitation amplitude A = Ω0² a0 / (μ g cos α)", "A", "A", "model", None, 0.0, 1e9,
              axis=(2.4, 3.25, LINEAR), slider=(1.0, 4.0, 0.001)),
    "B": Name("incline over friction B = tan α / μ", "B", "B", "model", 0.1, 0.0, 1e9,
              axis=(0.02, 0.3, LINEAR), slider=(0.0, 0.6, 0.001)),
    "eps": Name("relative amplitude ε of the disturbance, eq. (9)", "ε", r"\varepsilon", "model", 0.0, 0.0, 1e3,
                axis=(1e-6, 1e-3, LOG), slider=(0.0, 1e-3, 1e-6)),
    "eta": Name("frequency ratio η of the disturbance, eq. (9)", "η", r"\eta", "model", ETA, 1e-9, 1e8,
                axis=(1.0, 200.0, LINEAR), slider=(1.0, 200.0, 0.1)),
    "dtau": Name("step Δτ of the grid (fixed, muller)", "Δτ", r"\Delta\tau", "switching", math.nan, 1e-12, 1e6,
                 axis=(1e-3, 1.0, LOG), slider=(-5.0, 0.0, 0.01)),
    "tol": Name("step tolerance of Muller's method", "tol", r"\mathrm{tol}", "switching", 1e-7, 0.0, 1.0, True,
                axis=(1e-12, 1e-1, LOG)),
    "xi0": Name("initial gap ξ at τ0", "ξ₀", r"\xi_0", "model", 0.0, 0.0, 1e15, axis=(0.0, 10.0, LINEAR)),
    "dxi0": Name("initial velocity ξ' at τ0", "ξ′₀", r"\xi\mathrm{′}_0", "model", 0.0, -1e12, 1e12,
                 axis=(-3.0, 3.0, LINEAR)),
    "tau0": Name("initial time τ0", "τ₀", r"\tau_0", "model", 0.0, -1e12, 1e12, axis=(0.0, TURN, LINEAR)),
    "section_phase": Name("phase φ_s of the Poincaré section", "φ_s", r"\varphi_s", "run", 0.0, -1e6, 1e6,
                          axis=(0.0, TURN, LINEAR), slider=(0.0, 6.28, 0.01)),
}  # fmt: skip
"""Every real argument of `simulate`, all dimensionless: each may be an axis of a sweep. The slider of Δτ is over its
decimal logarithm."""

SCENE: dict[str, Name] = {
    "a0": Name("amplitude a0 of the excitation", "a₀", "a_0", "physical", axis=(3e-4, 1.2e-3, LINEAR),
               unit="m", shown="mm", scale=1e3),
    "omega0": Name("angular frequency Ω0 of the excitation", "Ω₀", r"\Omega_0", "physical", axis=(80.0, 200.0, LINEAR),
                   unit="rad s-1", shown="rad/s"),
    "mu": Name("coefficient of friction μ", "μ", r"\mu", "physical", axis=(0.2, 1.0, LINEAR)),
    "alpha": Name("angle α of the incline", "α", r"\alpha", "physical", axis=(0.5, 12.0, LINEAR),
                  unit="degree", shown="°"),
    "mass": Name("mass m", "mass", "m", "physical", 1.0, axis=(50.0, 500.0, LINEAR), unit="kg", shown="kg"),
    "g": Name("acceleration of gravity", "g", "g", "physical", 9.80665, unit="m s-2", shown="m/s²"),
}  # fmt: skip
"""Quantities of the scene in SI units; those with an axis may be one of a sweep, and A and B follow point by point."""

SETTINGS: dict[str, Name] = {
    "method": Name("how switches are found", "method", "", "switching", Method.CERTIFIED, choices=Method),
    "scan": Name("how a grid is visited", "scan", "", "switching", Scan.SKIP, choices=Scan),
    "transient": Name(
        "excitation periods before the record begins", "transient", "", "run", 1000, slider=(0, 2000, 10)
    ),
    "periods": Name("excitation periods recorded", "periods", "", "run", 250, 1, slider=(10, 1000, 10)),
    "budget": Name("switches allowed in a period", "budget", "", "run", 100_000, 1),
}
"""What all points of a sweep share, as integers: the fields of `Settings`."""

FURTHER: dict[str, Name] = {
    "record": Name("what is kept of each motion", "record", "", "run"),
    "criterion": Name("what of its structure a motion must keep", "criterion", "", "limits"),
    "quantity": Name(
        "k1, ku: how far a start may be off, which disturbance leaves one motion", "quantity", "", "limits"
    ),
    "max_period": Name("longest period sought, in excitation periods", "max_period", "", "orbits"),
}
"""Further settings, of sweeps and of single commands."""

COORDINATES: dict[str, Name] = {
    "xi": Name("gap ξ", "ξ", r"\xi"),
    "dxi": Name("velocity ξ'", "ξ′", r"\xi\mathrm{′}"),
    "tau": Name("time τ", "τ", r"\tau"),
}
"""Coordinates of a motion."""

SCENE_AXES = {name: row for name, row in SCENE.items() if row.axis}
"""Quantities of the scene that may be an axis of a sweep."""

AXES = PARAMETERS | SCENE_AXES
"""Everything that may be an axis of a sweep."""

NAMES = PARAMETERS | SCENE | SETTINGS | FURTHER | COORDINATES


def _default(name: str) -> int:
    return int(SETTINGS[name].default or 0)


@dataclass(frozen=True)
class Settings:
    """What all points of a sweep share."""

    method: int = _default("method")
    scan: int = _default("scan")
    transient: int = _default("transient")
    periods: int = _default("periods")
    budget: int = _default("budget")

    @property
    def literal(self) -> bool:
        """Whether every grid point is visited: the certified path has no grid."""
        return self.scan == Scan.LITERAL and self.method != Method.CERTIFIED

    def work(self, eps: float, eta: float, dtau: float, bounded: bool) -> float:
        """Return the work of one point, in undisturbed periods; the largest ε and η and the smallest Δτ cost most.

        It is counted from the arguments, as measured costs would give files that depend on the machine.
        """
        period = 4.0 + eps * eta * eta + eta / 64.0 if eps > 0.0 else 1.0
        if self.literal:
            period += 2.0 * math.pi / dtau / 256.0
        elif bounded:
            period *= 10.0
        return (self.transient + self.periods) * period
