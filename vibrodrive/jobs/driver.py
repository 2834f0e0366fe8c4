"""`vd.driver`: motion of a vibratory driver in SI units, and its change if a parameter changes by ±1 %.

A vibratory driver is the machine that the oscillator models: a mass, an incline that vibrates, and an obstacle. A
`Scene` describes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from vibrodrive.batch.conveying import conveying_velocity
from vibrodrive.jobs.call import sweep
from vibrodrive.model.choices import Status
from vibrodrive.model.names import ETA
from vibrodrive.model.parameters import bad, check, check_setting
from vibrodrive.model.physical import Scene

VARIED = {"a0": "a0", "omega0": "Ω0", "mu": "μ", "alpha": "α"}
"""Quantities of the scene that are varied by 1 %, and their symbols. The mass scales powers only."""

STEP = 0.01

TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Driver:
    """Motion of a vibratory driver in SI units, from rest at the obstacle, after its transient.

    Attributes
    ----------
    scene : Scene
    period : float
        period of the motion, in s; NaN if it does not repeat within 64 excitation periods, or if `periods` is too short
        to show it.
    blows : float
        impacts per second, including touches.
    speed : float
        largest velocity of the impacts, in m/s.
    speed_mean : float
        mean velocity of the impacts, in m/s.
    power : float
        mean power of the impacts, in W.
    friction : float
        mean power of friction, in W.
    drive : float
        mean power of the excitation, in W: the sum of `power` and `friction`.
    lift : float
        largest gap, in m.
    conveying : float
        mean velocity without an obstacle, in m/s, negative down the incline. It is -inf for B > 1, because the mass
        then accelerates without limit, and NaN if it does not settle. With the obstacle the mean velocity is 0.
    status : Status
        status of the motion.
    beside : dict of str to (Driver, Driver)
        for each of a0, omega0, mu and alpha: (driver with 1 % less, driver with 1 % more of this quantity).
    """

    scene: Scene
    period: float
    blows: float
    speed: float
    speed_mean: float
    power: float
    friction: float
    drive: float
    lift: float
    conveying: float
    status: Status
    beside: dict[str, tuple[Driver, Driver]] = field(default_factory=dict, repr=False)

    def __str__(self) -> str:
        """Return a table with rows for this motion and for the motions with 1 % less and 1 % more of each quantity."""
        s = self.scene
        rows = [("driver", self)]
        for name, pair in self.beside.items():
            rows += [(f"{VARIED[name]} {sign}1 %", one) for sign, one in zip("−+", pair, strict=True)]
        leaves = "the mass leaves the obstacle (A > 1 + B)" if s.A > 1 + s.B else "the mass rests (A ≤ 1 + B)"
        lines = [
            f"a0 = {1e3 * s.a0:.5g} mm, Ω0 = {s.omega0:.5g} rad/s ({s.omega0 / TURN:.5g} Hz), μ = {s.mu:.5g}, "
            f"α = {s.alpha:.5g}°, m = {s.mass:.5g} kg",
            f"A = {s.A:.5g}, B = {s.B:.5g}: {leaves}",
            "",
            f"{'':9}" + "".join(f"{heading:>10}" for heading, *_ in SHOWN.values()),
            f"{'':9}" + "".join(f"{unit:>10}" for _, unit, _ in SHOWN.values()),
        ]
        for name, one in rows:
            values = (getattr(one, key) * scale for key, (_, _, scale) in SHOWN.items())
            ended = "" if one.status == Status.OK else f"  {one.status.name}"
            lines.append(f"{name:9}" + "".join(f"{'–' if v != v else f'{v:.4g}':>10}" for v in values) + ended)
        return "\n".join([*lines, "", FREE])


SHOWN = {
    "period": ("period", "ms", 1e3),
    "blows": ("impacts", "1/s", 1.0),
    "speed": ("max speed", "m/s", 1.0),
    "power": ("power", "W", 1.0),
    "friction": ("friction", "W", 1.0),
    "lift": ("lift", "mm", 1e3),
    "conveying": ("conveying", "mm/s", 1e3),
}
"""Columns of the table: heading, unit, and factor from the SI unit to this unit."""

FREE = """\
impacts: number per second, touches included; max speed: velocity of the fastest impact.
power, friction: mean power of the impacts and of friction; lift: largest gap.
conveying: mean velocity without an obstacle, negative down the incline; with the obstacle it is 0.
–: the motion does not repeat within 64 excitation periods, or the mean has not settled."""


def driver(scene: Scene, *, eps: float = 0.0, eta: float = ETA, transient: int = 1000, periods: int = 250) -> Driver:
    """Compute the motion of a vibratory driver in SI units, and its change if a0, omega0, mu or alpha changes by ±1 %.

    Parameters
    ----------
    scene : Scene
        driver in SI units. Its mass scales the powers.
    eps, eta : float
        relative amplitude and frequency ratio of the disturbance, as in `simulate`.
    transient : int
        excitation periods before the record.
    periods : int
        excitation periods in the record.

    Returns
    -------
    Driver
        period, impacts per second, impact speeds, powers, largest gap and conveying velocity. It prints as a table.

    Raises
    ------
    TypeError, ValueError
        if an argument is invalid. The message is one sentence: name, value and allowed values of the argument.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> found = vd.driver(vd.Scene(a0=0.8e-3, omega0=150.0, mu=0.6, alpha=3.4, mass=250.0))
    >>> f"{found.blows:.2f} blows a second, {found.speed:.3f} m/s, {found.power:.2f} W"
    '11.94 blows a second, 0.092 m/s, 10.19 W'
    >>> less, more = found.beside["omega0"]
    >>> f"{found.conveying:.4f} m/s without an obstacle, {more.conveying:.4f} m/s at 1 % more Ω0"
    '-0.0159 m/s without an obstacle, -0.0162 m/s at 1 % more Ω0'
    """
    if not isinstance(scene, Scene):
        raise TypeError(bad("scene", scene, "a Scene"))
    check("eps", eps)
    check("eta", eta)
    check_setting("transient", transient)
    check_setting("periods", periods)
    scenes = [scene]
    for name in VARIED:
        scenes += [Scene.quiet(**vars(scene) | {name: getattr(scene, name) * by}) for by in (1.0 - STEP, 1.0 + STEP)]
    points = {"A": [s.A for s in scenes], "B": [s.B for s in scenes]}
    r = sweep(points=points, eps=eps, eta=eta, transient=transient, periods=periods, record="summary")
    found = []
    for k, s in enumerate(scenes):
        found.append(
            Driver(
                scene=s,
                period=float(s.time(TURN * r.period[k])) if r.period[k] > 0 else math.nan,
                blows=float(r.impacts[k] / s.time(TURN)),
                speed=float(s.velocity(r.impact_speed_max[k])),
                speed_mean=float(s.velocity(r.impact_speed_mean[k])),
                power=float(s.power(r.energy[k])),
                friction=float(s.power(r.friction_loss[k])),
                drive=float(s.power(r.drive_work[k])),
                lift=float(s.length(r.xi_max[k])),
                conveying=float(s.velocity(conveying_velocity(s.A, s.B, eps, eta))),
                status=Status(int(r.status[k])),
            )
        )
    pairs = zip(found[1::2], found[2::2], strict=True)
    return replace(found[0], beside=dict(zip(VARIED, pairs, strict=True)))
