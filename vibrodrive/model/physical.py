"""Scene in SI units, §2 of the paper, and its dimensionless numbers.

The messages of errors are sentences of the function `bad` in parameters.py: "KEY = VALUE: must be ALLOWED".
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from vibrodrive.model.described import html_table
from vibrodrive.model.names import PARAMETERS, SCENE, TURN
from vibrodrive.model.parameters import bad, check, missing, real_array, with_sentences
from vibrodrive.model.quantities import Quantity
from vibrodrive.model.slips import slip, warn

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


TINY = 5e-324
"""The smallest positive number. It replaces a positive result that underflows to 0."""


PACES = {"omega0", "frequency"}  # a scene has exactly one of them

AMPLITUDES = ("A", "a0", "omega0", "frequency")  # names over which A varies and B does not
INCLINES = ("B", "mu", "alpha")  # names over which B varies


def refuse_incomplete(values: Mapping[str, Any], axes: Collection[str] = ()) -> None:
    """Refuse a scene without one of its quantities, or with two for its pace. Raises ValueError."""
    for key in ("omega0", "mu", "alpha"):
        if key not in values and not (key in PACES and "frequency" in values):
            needed = "omega0, mu and alpha, and a0 unless A is given (frequency may replace omega0)"
            raise ValueError(missing(key, f", because a scene needs {needed}"))
    for key in PACES.intersection(axes):
        if "a0" not in values:
            raise ValueError(missing("a0", f" if {key} varies, because A is computed from both"))
    if values.keys() >= PACES:
        frequency = values["frequency"]
        given = frequency.tolist() if hasattr(frequency, "tolist") else frequency
        raise ValueError(bad("frequency", given, "left out if omega0 is given"))


def friction(mu: Any, alpha: Any, g: Any) -> Any:
    """Return μ g cos α, the acceleration of sliding friction (m/s²). Numbers and arrays give bitwise equal results."""
    acceleration = mu * g * _each(lambda degrees: _cosine_and_tangent(degrees)[0], alpha)
    return acceleration + TINY * (acceleration == 0.0)


def amplitude(a0: Any, omega0: Any, mu: Any, alpha: Any, g: Any) -> Any:
    """Return the excitation amplitude A = Ω0² a0 / (μ g cos α), for numbers or arrays with bitwise equal results."""
    return _each(_square, omega0) * a0 / friction(mu, alpha, g)


def incline(mu: Any, alpha: Any) -> Any:
    """Return B = tan α / μ (incline over friction), for numbers or arrays with bitwise equal results."""
    return _each(lambda degrees: _cosine_and_tangent(degrees)[1], alpha) / mu


def omega0_of(scene: Mapping[str, Any]) -> Any:
    """Return Ω0 (rad/s) of a scene by names, which contains it or the frequency (Hz)."""
    return scene["omega0"] if "omega0" in scene else TURN * scene["frequency"]


def has_units(values: Mapping[str, Any]) -> bool:
    """Return True if values by name contain a scene, apart from a0 and mass, which the units do not need."""
    return {"mu", "alpha", "g"} <= values.keys() and not PACES.isdisjoint(values)


class Unit(NamedTuple):
    """A unit in SI. `si` is its name in files and tables (UDUNITS), `shown` its name in figures after multiplication by
    `scale`, and `one` the value of the dimensionless 1 as a function of μ g cos α, Ω0 and the mass."""

    si: str
    shown: str
    scale: float
    one: Callable[[Any, Any, Any], Any]


UNITS = {
    "length": Unit("m", "mm", 1e3, lambda f, w, m: f / w / w),
    "velocity": Unit("m s-1", "m/s", 1.0, lambda f, w, m: f / w),
    "time": Unit("s", "ms", 1e3, lambda f, w, m: 1.0 / w),
    "rate": Unit("s-1", "", 1.0, lambda f, w, m: w / TURN),  # of numbers per excitation period
    "force": Unit("N", "N", 1.0, lambda f, w, m: m * f),
    "momentum": Unit("N s", "N s", 1.0, lambda f, w, m: m * f / w),
    "energy": Unit("J", "J", 1.0, lambda f, w, m: m * (f / w) * (f / w)),
    "power": Unit("W", "W", 1.0, lambda f, w, m: m * (f / w) * (f / w) * w / TURN),  # of an energy per period
}
"""How quantities scale with the scene (`Quantity.scales`)."""

PER_KG = ("force", "momentum", "energy", "power")  # without a mass: per kilogram


class Measure(NamedTuple):
    """Conversion of the dimensionless quantity of a row. `one` is the value of the dimensionless 1 in the unit `si`, a
    number or an array over axes; by default the quantity stays dimensionless. `shown` and `scale` are those of `Unit`.
    `apart` is True for a quantity that stays dimensionless although there is a scene; its words say so."""

    row: Quantity
    one: Any = 1.0
    si: str = "1"
    shown: str = ""
    scale: float = 1.0
    apart: bool = False

    def of(self, values: Any) -> Any:
        """Return dimensionless values in the unit `si`. Their first dimensions are those of `one`."""
        if self.si == "1":
            return values
        lacking = getattr(values, "ndim", 0) - getattr(self.one, "ndim", 0)
        return values * (self.one[(..., *[None] * lacking)] if hasattr(self.one, "ndim") else self.one)

    def shown_of(self, values: Any) -> Any:
        """Return dimensionless values in the unit of figures."""
        return self.of(values) if self.scale == 1.0 else self.of(values) * self.scale

    def ends(self, limits: tuple[float, float] | None) -> tuple[float, float] | None:
        """Return limits in the unit `si` in the unit of figures."""
        return limits and (limits[0] * self.scale, limits[1] * self.scale)

    def words(self, meaning: str) -> str:
        """Return the words for a dimensionless quantity as those for the quantity in SI: x for ξ, and per second."""
        if self.si == "1":
            return meaning + ", dimensionless" * self.apart
        text = re.sub(r",? (\$\\sum.*?\$|sum of \S+)", "", meaning)
        for greek, latin in ((r"$|\xi\mathrm{′}|$", "|dx/dt|"), (r"$\xi\mathrm{′}$", "dx/dt"), (r"$\xi$", "x"),
                             ("ξ'", "dx/dt"), ("ξ", "x")):  # fmt: skip
            text = text.replace(greek, latin)
        return re.sub("per (excitation )?period", "per second", text) if self.si == UNITS["rate"].si else text

    def label(self, meaning: str) -> str:
        """Return the label of an axis of a figure: the words of a quantity and its unit."""
        return self.words(meaning) + (f" in {self.shown}" if self.shown else "")


LATIN = {"tau": "t", "xi": "x", "dxi": "v"}  # names in SI


def column(quantity: str, si: str) -> str:
    """Return the name of a quantity with the unit `si` in tables, written and read, such as "x_max_m" or "v_m_per_s".

    The unit ends the name. A dimensionless quantity, also one in radians, keeps its own name, such as "xi_max". The
    column of a parameter has the name of its keyword, which implies the unit.
    """
    if si in ("1", "rad"):
        return quantity
    name = re.sub(rf"(?<![a-z])({'|'.join(LATIN)})(?![a-z])", lambda match: LATIN[match[0]], quantity)
    return "_".join([name, *re.sub(r"([a-z]+)-1?", r"per_\1", si).split()])


def measure(row: Quantity, values: Mapping[str, Any], dimensionless: bool = False) -> Measure:
    """Return the conversion of a quantity, if the `values` by name contain a scene.

    If `dimensionless`, only a power, which is no other quantity without a scene, is converted.
    """
    if not row.scales or not has_units(values):
        return Measure(row, shown="" if row.unit == "1" else row.unit)
    if dimensionless and row.scales != "power":
        return Measure(row, apart=True)
    unit, one = UNITS[row.scales], _one(row.scales, values)
    if row.scales in PER_KG and values.get("mass") is None:
        return Measure(row, one, f"{unit.si} kg-1", f"{unit.shown}/kg", unit.scale)
    return Measure(row, one, unit.si, unit.shown, unit.scale)


def _one(key: str, values: Mapping[str, Any]) -> Any:
    """Return the value of the dimensionless 1 in a unit; without a mass per kilogram."""
    mass = values.get("mass")
    force = friction(values["mu"], values["alpha"], values["g"])
    return UNITS[key].one(force, omega0_of(values), 1.0 if mass is None else mass)


def scene_of(values: Mapping[str, Any]) -> Scene | None:
    """Return the scene in values by name; None if there is none, or arrays. An a0 that is missing follows from A."""
    scene = {name: values[name] for name in SCENE if name in values}
    if not has_units(scene) or any(getattr(value, "ndim", 0) for value in scene.values()):
        return None
    if "a0" not in scene and isinstance(values.get("A"), float):
        scene["a0"] = amplitude_axis("a0", values["A"], scene)
    return Scene.quiet(**scene)


def with_A_and_B(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by name, for one or many points. Add A and B if the values contain the scene that gives them."""
    full = dict(values)
    if "A" not in full and "a0" in full and has_units(full):
        full["A"] = amplitude(full["a0"], omega0_of(full), *(full[name] for name in ("mu", "alpha", "g")))
    if "B" not in full and {"mu", "alpha"} <= full.keys():
        full["B"] = incline(full["mu"], full["alpha"])
    return full


def amplitude_axis(name: str, A: Any, scene: Mapping[str, Any]) -> Any:
    """Return the value of `name` ("A", "a0", "omega0" or "frequency") that gives the amplitude A.

    `scene` contains its other quantities by name.
    """
    if name == "A":
        return A
    unit = friction(scene["mu"], scene["alpha"], scene["g"])
    if name == "a0":
        return A * unit / _each(_square, omega0_of(scene))
    return _each(math.sqrt, A * unit / scene["a0"]) / (TURN if name == "frequency" else 1.0)


def incline_axis(name: str, B: Any, scene: Mapping[str, Any]) -> Any:
    """Return the value of `name` ("B", "mu", or "alpha" in degrees) that gives B; `scene` as in `amplitude_axis`."""
    if name == "B":
        return B
    if name == "mu":
        return incline(1.0, scene["alpha"]) / B
    return _each(lambda tangent: math.degrees(math.atan(tangent)), B * scene["mu"])


def _each(function: Callable[[float], float], x: Any) -> Any:
    """Apply a function to a number or to each element of an array."""
    if isinstance(x, float):
        return function(x)
    import numpy as np

    values, inverse = np.unique(x, return_inverse=True)  # each value is computed once; few values are distinct
    return np.array([function(v) for v in values.tolist()])[inverse].reshape(np.shape(x))


def _square(x: float) -> float:
    return x * x or TINY


@lru_cache(1 << 16)
def _cosine_and_tangent(degrees: float) -> tuple[float, float]:
    """Return the cosine and the tangent of an angle < 90°, rounded correctly, as Python divides whole numbers.

    The last bits of the functions of `math` and NumPy depend on the processor; A and B must not.
    """
    x = math.radians(degrees)
    bits = 160 - math.frexp(x)[1]
    angle, term, n, sums = int(math.ldexp(x, bits)), 1 << bits, 0, [0, 0]
    while term:  # xⁿ/n!, of the series of eⁱˣ, in units of 2^-bits
        sums[n % 2] += -term if n & 2 else term
        n += 1
        term = (term * angle >> bits) // n
    return sums[0] / (1 << bits), sums[1] / sums[0]


@dataclass(frozen=True, init=False)
class Scene:
    """Scene in SI units, with its dimensionless numbers (§2 of the paper). Each quantity is given by name.

    Parameters
    ----------
    a0 : float
        amplitude (m) of the excitation.
    omega0, frequency : float
        angular frequency (rad/s) of the excitation, or its frequency in hertz. Exactly one of the two must be given.
    mu : float
        coefficient of friction.
    alpha : float
        angle of the incline in degrees, 0 <= α < 90.
    mass : float, optional
        mass in kg. It scales forces, momenta, energies and powers only. Without it these are per kilogram.
    g : float
        acceleration of gravity in m/s².

    Raises
    ------
    TypeError, ValueError
        if an argument is invalid. The message is one sentence: name, value and allowed values of the argument.

    Warns
    -----
    UserWarning
        if A is so small that the mass cannot leave the obstacle, as with a wrong unit.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> scene = vd.Scene(a0=0.8e-3, omega0=150.0, mu=0.6, alpha=3.4, mass=250.0)
    >>> round(scene.A, 4), round(scene.B, 4), round(scene.frequency, 2)
    (3.0645, 0.099, 23.87)
    >>> f"a gap of {1e3 * scene.length(6.5):.2f} mm, an impact at {100 * scene.velocity(2.0):.1f} cm/s"
    'a gap of 1.70 mm, an impact at 7.8 cm/s'
    >>> round(vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4).omega0, 2)
    150.8
    """

    a0: float
    omega0: float
    mu: float
    alpha: float
    mass: float | None = None
    g: float = 9.80665
    _frequency: float | None = field(default=None, init=False, repr=False, compare=False)

    @with_sentences
    def __init__(
        self,
        *,
        a0: float,
        omega0: float | None = None,
        frequency: float | None = None,
        mu: float | None = None,
        alpha: float | None = None,
        mass: float | None = mass,
        g: float = g,
    ) -> None:
        optional = {"omega0": omega0, "frequency": frequency, "mu": mu, "alpha": alpha, "mass": mass}
        given = {"a0": a0, "g": g} | {name: value for name, value in optional.items() if value is not None}
        refuse_incomplete(given)
        self._take({name: check(name, value) for name, value in given.items()})
        has_A = self.a0 > 0.0 and math.isfinite(self.A)  # a scene with a0 = 0 gives only B and the units
        warn(slip([(self.A, self.B, 0.0, 1.0)], self.given) if has_A else ())

    @classmethod
    def quiet(cls, **values: float) -> Scene:
        """Return a scene without a warning of likely mistakes, as needed for the ends of axes. By default a0 is 0."""
        scene = cls.__new__(cls)
        scene._take({"a0": 0.0, "g": cls.g} | values)
        return scene

    def _take(self, values: Mapping[str, float]) -> None:
        for key, x in values.items():
            if key == "frequency":
                object.__setattr__(self, "_frequency", x)
                key, x = "omega0", TURN * x
            object.__setattr__(self, key, x)

    @property
    def given(self) -> dict[str, float]:
        """The quantities by name as they were given: `frequency` or `omega0`, and `mass` only if it is known."""
        pace = {"omega0": self.omega0} if self._frequency is None else {"frequency": self._frequency}
        mass = {} if self.mass is None else {"mass": self.mass}
        return {"a0": self.a0, **pace, "mu": self.mu, "alpha": self.alpha, **mass, "g": self.g}

    def _repr_html_(self) -> str:
        rows = {name: f"{x * SCENE[name].scale:.6g} {SCENE[name].shown}".strip() for name, x in self.given.items() if x}
        rows |= {"frequency": f"{self.frequency:.6g} Hz", "B": f"{self.B:.6g}"}
        return html_table("Scene", (rows | ({"A": f"{self.A:.6g}"} if self.a0 else {})).items())

    @property
    def frequency(self) -> float:
        """Frequency of the excitation in hertz."""
        return self.omega0 / TURN if self._frequency is None else self._frequency

    @property
    def friction(self) -> float:
        """μ g cos α, the acceleration of sliding friction (m/s²)."""
        return friction(self.mu, self.alpha, self.g)

    @property
    def A(self) -> float:
        """Excitation amplitude A = Ω0² a0 / (μ g cos α)."""
        return amplitude(self.a0, self.omega0, self.mu, self.alpha, self.g)

    @property
    def B(self) -> float:
        """Gravity along the incline over friction, B = tan α / μ."""
        return incline(self.mu, self.alpha)

    def length(self, xi: ArrayLike) -> Any:
        """Return the gap x in m from ξ = Ω0² x / (μ g cos α), a number or an array of numbers.

        Raises TypeError for any other type.
        """
        return self._in_si("length", "xi", xi)

    def velocity(self, dxi: ArrayLike) -> Any:
        """Return the velocity dx/dt in m/s from ξ', a number or an array. Raises TypeError as `length` does."""
        return self._in_si("velocity", "dxi", dxi)

    def time(self, tau: ArrayLike) -> Any:
        """Return the time t in s from τ = Ω0 t, a number or an array. Raises TypeError as `length` does."""
        return self._in_si("time", "tau", tau)

    def power(self, work: ArrayLike) -> Any:
        """Return the mean power in W from a dimensionless energy per excitation period, a number or an array.

        Without a mass the power is in W/kg. Raises TypeError as `length` does.
        """
        return self._in_si("power", "work", work)

    def force(self, h: ArrayLike) -> Any:
        """Return the adhesive force F_H in N from H = F_H / (m μ g cos α), a number or an array.

        Without a mass the force is in N/kg. Raises TypeError as `length` does.
        """
        return self._in_si("force", "h", h)

    def _in_si(self, unit: str, key: str, value: object) -> Any:
        return _numbers(key, value) * _one(unit, vars(self))


def _numbers(key: str, value: object) -> Any:
    """Return a number as a float, a sequence of numbers as a NumPy array, and an array of any library as it is.

    An array keeps its mask, its labels and its missing values. Raises TypeError with the sentence of `bad`.
    """
    import numpy as np

    data = value.data if isinstance(value, np.ma.MaskedArray) else value
    array = real_array(key, data, "a number or an array of numbers")
    if not hasattr(value, "dtype"):
        return float(array) if array.ndim == 0 else array
    return value.astype(float) if getattr(value.dtype, "kind", "") == "O" else value  # type: ignore[attr-defined]


OF_SCENE = {*SCENE, "scene"}


def with_scene(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments with the quantities of `scene` instead of it, apart from an a0 of 0, which A replaces. Another
    argument, or a key of `points`, replaces a quantity of the scene. Raises TypeError."""
    values = {name: value for name, value in arguments.items() if value is not None or name not in OF_SCENE}
    scene = values.pop("scene", None)
    if scene is None:
        return values
    if not isinstance(scene, Scene):
        raise TypeError(bad("scene", scene, "a Scene"))
    if values.get("A", 0.0) is None:  # as in the signature
        del values["A"]
    keys = getattr(values.get("points"), "keys", None)
    replaced = {*values, *(keys() if callable(keys) else ()), *([] if scene.a0 else ["a0"])}
    replaced |= PACES if PACES & replaced else set()
    return {name: value for name, value in scene.given.items() if name not in replaced} | values


def follow_scene(varied: Mapping[str, Any], scalars: dict[str, float]) -> None:
    """Refuse an incomplete scene, or one whose A or B is too large. Add A or B to the scalars if it is the same at all
    points. Raises ValueError.

    `varied` contains the values of all that varies.
    """
    scalars.setdefault("g", Scene.g)
    values = {**scalars, **varied}
    refuse_incomplete(values, varied)
    # A and B are largest where friction is least
    ends = {name: float(axis.min() if name == "mu" else axis.max()) for name, axis in varied.items() if name in SCENE}
    extreme = Scene.quiet(**{name: value for name, value in scalars.items() if name in SCENE} | ends)
    pace = "frequency" if "frequency" in values else "omega0"
    for name, sources in (("A", ("a0", pace, "mu", "alpha")), ("B", ("mu", "alpha"))):
        if name == "A" and "a0" not in values:
            continue
        largest, row = float(getattr(extreme, name)), PARAMETERS[name]
        if not row.allows(largest):
            computed = ", ".join(f"{key} = {getattr(extreme, key):g}" for key in sources)
            raise ValueError(f"{name} = {largest!r}, computed from {computed}: must be {row.allowed}")
        if set(sources) & set(varied):
            scalars.pop(name, None)
        else:
            scalars[name] = largest
    for name in (*SCENE, "A"):  # in an order that does not depend on the call
        if name in scalars:
            scalars[name] = scalars.pop(name)
