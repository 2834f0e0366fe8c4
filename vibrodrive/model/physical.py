"""Scene in SI units, §2 of the paper, and its dimensionless numbers.

The messages of errors are sentences of the function `bad` in parameters.py: "KEY = VALUE: must be ALLOWED".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from vibrodrive.model.names import SCENE
from vibrodrive.model.notebook import html_table
from vibrodrive.model.parameters import bad, real_array, real_number
from vibrodrive.model.slips import OfScene, slip, warn

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


TINY = 5e-324
"""The smallest positive number. It replaces a positive result that underflows to 0."""


def check_scene(key: str, value: object) -> float:
    """Cast one quantity of the scene to float. Raises TypeError or ValueError with the sentence of `bad`."""
    if key == "alpha":
        allowed = "an angle in degrees >= 0 and < 90"
        x = real_number(key, value, allowed)
        if not 0 <= x < 90:
            raise ValueError(bad(key, value, allowed))
        return x + 0.0  # -0.0 becomes 0.0
    allowed = f"a finite number {'>=' if key == 'a0' else '>'} 0"
    x = real_number(key, value, allowed)
    if not 0.0 < x < math.inf and not (key == "a0" and x == 0.0):
        raise ValueError(bad(key, value, allowed))
    return x


def friction(mu: Any, alpha: Any, g: Any) -> Any:
    """Return μ g cos α, the acceleration of sliding friction (m/s²). Numbers and arrays give bitwise equal results."""
    return _at_least_tiny(mu * g * _each(lambda degrees: math.cos(math.radians(degrees)), alpha))


def amplitude(a0: Any, omega0: Any, mu: Any, alpha: Any, g: Any) -> Any:
    """Return the excitation amplitude A = Ω0² a0 / (μ g cos α), for numbers or arrays with bitwise equal results."""
    return _each(_square, omega0) * a0 / friction(mu, alpha, g)


def incline(mu: Any, alpha: Any) -> Any:
    """Return B = tan α / μ (incline over friction), for numbers or arrays with bitwise equal results."""
    return _each(_tangent, alpha) / mu


def power(work: Any, omega0: Any, mu: Any, alpha: Any, mass: Any, g: Any) -> Any:
    """Return the mean power (W) from a dimensionless energy per excitation period, for numbers or arrays of one length.

    The unit of energy is m (μ g cos α / Ω0)²; the excitation period is 2π/Ω0.
    """
    return work * mass * (friction(mu, alpha, g) / omega0) ** 2 * omega0 / (2.0 * math.pi)


def with_A_and_B(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by name, for one or many points. Add A and B if the values contain the scene that gives them."""
    known = dict(values)
    if "A" not in known and {"a0", "omega0", "mu", "alpha", "g"} <= known.keys():
        known["A"] = amplitude(*(known[name] for name in ("a0", "omega0", "mu", "alpha", "g")))
    if "B" not in known and {"mu", "alpha"} <= known.keys():
        known["B"] = incline(known["mu"], known["alpha"])
    return known


def amplitude_axis(name: str, A: Any, known: Mapping[str, Any]) -> Any:
    """Return the value of `name` ("A", "a0" or "omega0") that gives the amplitude A.

    `known` contains the other quantities of the scene by name.
    """
    if name == "A":
        return A
    unit = friction(known["mu"], known["alpha"], known["g"])
    return A * unit / _each(_square, known["omega0"]) if name == "a0" else (A * unit / known["a0"]) ** 0.5


def incline_axis(name: str, B: Any, known: Mapping[str, Any]) -> Any:
    """Return the value of `name` ("B", "mu", or "alpha" in degrees) that gives B; `known` as in `amplitude_axis`."""
    if name == "B":
        return B
    if name == "mu":
        return _tangent(known["alpha"]) / B
    return _each(lambda tangent: math.degrees(math.atan(tangent)), B * known["mu"])


def _each(function: Callable[[float], float], x: Any) -> Any:
    """Apply a function to a number or to each element of an array.

    The functions of NumPy are not used, because their results differ from those of `math` in the last bits.
    """
    if isinstance(x, float):
        return function(x)
    import numpy as np

    values, where = np.unique(x, return_inverse=True)  # each value is computed once; few values are distinct
    return np.array([function(v) for v in values.tolist()])[where]


def _square(x: float) -> float:
    return (x**2 or TINY) if x < 1e150 else math.inf


def _tangent(degrees: float) -> float:
    return math.tan(math.radians(degrees))


def _at_least_tiny(x: Any) -> Any:
    if isinstance(x, float):
        return max(x, TINY)
    import numpy as np

    return np.maximum(x, TINY)


@dataclass(frozen=True, init=False)
class Scene:
    """Scene in SI units, with its dimensionless numbers (§2 of the paper).

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
    mass : float
        mass in kg. It scales forces and powers only.
    g : float
        acceleration of gravity in m/s².

    Raises
    ------
    TypeError, ValueError
        if an argument is invalid. The message is one sentence: name, value and allowed values of the argument.

    Warns
    -----
    UserWarning
        if A is so small that the mass cannot leave the obstacle, or so large that a wrong unit is likely.

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
    mass: float = 1.0
    g: float = 9.80665

    def __init__(
        self,
        a0: float,
        omega0: float | None = None,
        mu: float | None = None,
        alpha: float | None = None,
        mass: float = mass,
        g: float = g,
        *,
        frequency: float | None = None,
    ) -> None:
        if omega0 is None and frequency is None:
            raise TypeError(
                "omega0 is missing: must be given, a finite number > 0 in rad/s (or give frequency in hertz)"
            )
        if frequency is not None:
            if omega0 is not None:
                raise TypeError(bad("frequency", frequency, "left out if omega0 is given"))
            omega0 = 2.0 * math.pi * check_scene("frequency", frequency)
        self._take({"a0": a0, "omega0": omega0, "mu": mu, "alpha": alpha, "mass": mass, "g": g})
        if self.a0 > 0.0 and math.isfinite(self.A):  # a scene with a0 = 0 gives only B and the units
            warn(slip([(self.A, self.B, 0.0, 1.0)]))

    @classmethod
    def quiet(cls, **values: float) -> Scene:
        """Return a scene without a warning of likely mistakes, as needed for the ends of axes. By default a0 is 0."""
        scene = cls.__new__(cls)
        scene._take({"a0": 0.0, "mass": cls.mass, "g": cls.g} | values)
        return scene

    def _take(self, values: Mapping[str, object]) -> None:
        for key, value in values.items():
            object.__setattr__(self, key, check_scene(key, value))

    def _repr_html_(self) -> str:
        values = {name: (getattr(self, name, None), row) for name, row in SCENE.items()}
        rows = {name: f"{x * row.scale:.6g} {row.shown}".strip() for name, (x, row) in values.items() if x}
        rows |= {"frequency": f"{self.frequency:.6g} Hz", "B": f"{self.B:.6g}"}
        return html_table("Scene", (rows | ({"A": f"{self.A:.6g}"} if self.a0 else {})).items())

    @property
    def frequency(self) -> float:
        """Frequency of the excitation in hertz."""
        return self.omega0 / (2.0 * math.pi)

    @property
    def friction(self) -> float:
        """μ g cos α, the acceleration of sliding friction (m/s²)."""
        return friction(self.mu, self.alpha, self.g)

    @property
    def A(self) -> float:
        """Excitation amplitude A = Ω0² a0 / (μ g cos α)."""
        return OfScene(amplitude(self.a0, self.omega0, self.mu, self.alpha, self.g), self.B)

    @property
    def B(self) -> float:
        """Gravity along the incline over friction, B = tan α / μ."""
        return incline(self.mu, self.alpha)

    def length(self, xi: ArrayLike) -> Any:
        """Return the gap x in m from ξ = Ω0² x / (μ g cos α), a number or an array of numbers.

        Raises TypeError for any other type.
        """
        return _numbers("xi", xi) * self.friction / _square(self.omega0)

    def velocity(self, dxi: ArrayLike) -> Any:
        """Return the velocity dx/dt in m/s from ξ', a number or an array. Raises TypeError as `length` does."""
        return _numbers("dxi", dxi) * self.friction / self.omega0

    def time(self, tau: ArrayLike) -> Any:
        """Return the time t in s from τ = Ω0 t, a number or an array. Raises TypeError as `length` does."""
        return _numbers("tau", tau) / self.omega0

    def power(self, work: ArrayLike) -> Any:
        """Return the mean power in W from a dimensionless energy per excitation period, a number or an array.

        Raises TypeError as `length` does.
        """
        return power(_numbers("work", work), self.omega0, self.mu, self.alpha, self.mass, self.g)

    def force(self, h: ArrayLike) -> Any:
        """Return the adhesive force F_H in N from H = F_H / (m μ g cos α), a number or an array.

        Raises TypeError as `length` does.
        """
        return _numbers("h", h) * self.mass * self.friction


def _numbers(key: str, value: object) -> Any:
    """Return a number as a float, a sequence of numbers as a NumPy array, and an array of any library as it is.

    An array keeps its mask, its labels and its missing values. Raises TypeError with the sentence of `bad`.
    """
    import numpy as np

    known = value.data if isinstance(value, np.ma.MaskedArray) else value
    array = real_array(key, known, "a number or an array of numbers")
    if not hasattr(value, "dtype"):
        return float(array) if array.ndim == 0 else array
    return value.astype(float) if getattr(value.dtype, "kind", "") == "O" else value  # type: ignore[attr-defined]
