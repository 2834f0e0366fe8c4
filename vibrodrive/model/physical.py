"""The scene in SI units, §2 of the paper, and the dimensionless numbers that follow from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from vibrodrive.model.parameters import bad, real_array, real_number

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Physical:
    """The scene in SI units, and the dimensionless numbers that follow from it (§2 of the paper).

    Parameters
    ----------
    a0, omega0 : float
        amplitude (m) and angular frequency (rad/s) of the excitation.
    mu, alpha : float
        coefficient of friction, and angle of the incline in degrees, 0 <= α < 90.
    mass, g : float
        mass in kg, which scales forces only, and acceleration of gravity in m/s².

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> scene = vd.Physical(a0=0.8e-3, omega0=150.0, mu=0.6, alpha=3.4, mass=250.0)
    >>> round(scene.A, 4), round(scene.B, 4)
    (3.0645, 0.099)
    >>> f"a gap of {1e3 * scene.length(6.5):.2f} mm, an impact at {100 * scene.velocity(2.0):.1f} cm/s"
    'a gap of 1.70 mm, an impact at 7.8 cm/s'
    """

    a0: float
    omega0: float
    mu: float
    alpha: float
    mass: float = 1.0
    g: float = 9.80665

    def __post_init__(self) -> None:
        for key in ("a0", "omega0", "mu", "mass", "g"):
            value = getattr(self, key)
            x = real_number(key, value, "a finite number > 0")
            if not 0.0 < x < math.inf and not (key == "a0" and x == 0.0):
                raise ValueError(bad(key, value, "a finite number > 0"))
            object.__setattr__(self, key, x)
        allowed = "an angle in degrees >= 0 and < 90"
        alpha = real_number("alpha", self.alpha, allowed)
        if not 0 <= alpha < 90:
            raise ValueError(bad("alpha", self.alpha, allowed))
        object.__setattr__(self, "alpha", alpha)

    @property
    def friction(self) -> float:
        """μ g cos α, the acceleration of sliding friction (m/s²)."""
        return self.mu * self.g * math.cos(math.radians(self.alpha)) or 5e-324  # never 0, however small

    @property
    def A(self) -> float:
        """Excitation amplitude A = Ω0² a0 / (μ g cos α)."""
        return self._omega0_squared * self.a0 / self.friction

    @property
    def _omega0_squared(self) -> float:
        return (self.omega0**2 or 5e-324) if self.omega0 < 1e150 else math.inf

    @property
    def B(self) -> float:
        """Incline over friction B = tan α / μ."""
        return math.tan(math.radians(self.alpha)) / self.mu

    def length(self, xi: ArrayLike) -> Any:
        """Gap x in m from dimensionless ξ = Ω0² x / (μ g cos α), number or array; TypeError for what is neither."""
        return _numbers("xi", xi) * self.friction / self._omega0_squared

    def velocity(self, dxi: ArrayLike) -> Any:
        """Relative velocity in m/s from dimensionless ξ', as `length`."""
        return _numbers("dxi", dxi) * self.friction / self.omega0

    def time(self, tau: ArrayLike) -> Any:
        """Time in s from τ = Ω0 t, as `length`."""
        return _numbers("tau", tau) / self.omega0

    def force(self, h: ArrayLike) -> Any:
        """Adhesive force F_H in N from H = F_H / (m μ g cos α), as `length`."""
        return _numbers("h", h) * self.mass * self.friction


def _numbers(key: str, value: object) -> Any:
    """A real number, or an array of them (of any library's kind). Raises TypeError with the one sentence."""
    array = real_array(key, value, "a number or an array of numbers")
    if hasattr(value, "dtype"):
        return value
    return float(array) if array.ndim == 0 else array
