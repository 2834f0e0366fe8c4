"""`vd.limit`: the limit of stability k₂ at one point, explained. limit.py contains the search and the result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from vibrodrive.batch.sweep import check_threads
from vibrodrive.jit.slices import Halt
from vibrodrive.model import slips
from vibrodrive.model.above import above
from vibrodrive.model.choices import MethodLike
from vibrodrive.model.keywords import as_written
from vibrodrive.model.names import ETA
from vibrodrive.model.physical import Scene
from vibrodrive.model.plan import Plan
from vibrodrive.stability.criterion import IMPACTS, parse_criterion
from vibrodrive.stability.limit import PERIODS, Disturbance, Limit, LimitSearch, plan_at_one_point

T = TypeVar("T")


@as_written
def limit(
    written: Mapping[str, Any],
    /,
    A: float | None = None,
    disturbance: Disturbance = "eps",
    method: MethodLike | None = None,
    criterion: str = IMPACTS,
    *,
    scene: Scene | None = None,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = ETA,
    dtau: float | None = None,
    tol: float | None = None,
    xi0: float = 0.0,
    dxi0: float = 0.0,
    tau0: float = 0.0,
    transient: int = 1000,
    periods: int = PERIODS,
    section_phase: float = 0.0,
    budget: int = 100_000,
    threads: int | None = None,
) -> Limit:
    """Find the limit k₂ of practically orbital stability (§1) at one A.

    k₂ is the smallest disturbance at which a motion loses the structure of the undisturbed orbit.

    Parameters
    ----------
    A : float
        excitation amplitude, dimensionless like all parameters. Required without a scene.
    disturbance : "eps" or "dtau"
        the quantity whose limit is computed: the physical disturbance ε, eq. (9), or the step Δτ of the numerical
        disturbance (§5).
    method : "certified", "muller" or "fixed", optional
        method that finds the switches of the disturbed motion. The default is "certified" for a limit in ε and "fixed"
        for a limit in Δτ. A limit in Δτ cannot have the method "certified", which has no grid. The undisturbed motion
        is always computed with ε = 0 and the method "certified".
    criterion : str, optional
        condition on the disturbed motion, in comparison with the undisturbed orbit. "impacts": the main impacts
        (docs/stability.md) follow each other as in the orbit. "word": the states between the main impacts are those of
        the orbit. Both conditions may be joined by "and".
    scene : Scene, optional
        machine in SI units, which gives A and B, as in `simulate`.
    eps, dtau : float
        values of disturbances. Leave out the quantity that `disturbance` names. For a limit in ε, the methods "muller"
        and "fixed" need `dtau`. For a limit in Δτ, a value of `eps` disturbs the motion in addition.
    B, eta, tol, xi0, dxi0, tau0, transient, periods, section_phase, budget
        as in `simulate`; they apply to each disturbed motion.
    threads : int, optional
        number of threads; by default the number of threads of Numba (`numba.set_num_threads`).

    Returns
    -------
    Limit
        `k2` is the smallest disturbance found at which the criterion fails, dimensionless.
        `kept_below` is the largest disturbance found below `k2` at which the criterion holds.
        `last_kept` is the upper end of the band above `k2` in which the criterion holds at some values.
        `share_kept` is the share of the values between `k2` and `last_kept` at which the criterion holds, 0 to 1.
        `n` is the period of the undisturbed orbit in excitation periods.
        `how` is a text that describes the loss.
        `kept` and `lost` are the structures of the motions at `kept_below` and at `k2`.
        `velocity_si` is the limit as a velocity in m/s, if there is a scene.

    Raises
    ------
    TypeError, ValueError
        if an argument is invalid. The message is one sentence: name, value and allowed values of the argument.
    ValueError
        if `periods` is less than four times the period of the undisturbed motion. Such a record is too short for a
        comparison of the structure.

    Warns
    -----
    UserWarning
        for values that are probably a mistake: those of `simulate`; A <= 1 + B, at which the mass never leaves the
        obstacle; or an A that is above 100 and above 100 B.

    Examples
    --------
    The limit in ε at A = 1.5, from records of 50 periods:

    >>> import vibrodrive as vd
    >>> k = vd.limit(1.5, "eps", transient=50, periods=50)
    >>> k.n, k.kept_below < k.k2
    (1, True)
    >>> f"{k.k2:.3g}: {k.how}"
    '0.00388: gaps 1 became 1, 2'
    """
    plan = plan_at_one_point(written, disturbance, method, ' (for axes use `sweep` with record = "limit")')
    search = LimitSearch(plan, disturbance, parse_criterion(criterion), check_threads(threads), Halt())
    ((_, found),) = _answered("limit", plan, A, lambda: list(search.run([0], strict=True)))
    return found


def _answered(name: str, plan: Plan, given: object, search: Callable[[], T]) -> T:
    """Return the result of a search at the one point of a plan, with a warning of a likely mistake and a progress line.

    `given` is the A of the call.
    """
    A, B, eps, eta = (plan.scalars[key] for key in ("A", "B", "eps", "eta"))
    slips.warn([*slips.slip([(A, B, eps, eta)]), *slips.unlikely(plan), *slips.forgotten(given, B)])
    with above("the progress of a call")(name):
        return search()
