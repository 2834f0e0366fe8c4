"""Public functions for the limits of stability: k₂ (disturbance), k₁ (error of the start), k_u (one motion remains).

These functions share most of their keywords with `simulate`. They are in one file, so that a new keyword is added in
one place. limit.py, starts.py, unique_motion.py and limits.py contain the searches and the results.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from vibrodrive.batch.sweep import check_threads
from vibrodrive.model import slips
from vibrodrive.model.choices import MethodLike, ScanLike
from vibrodrive.model.keywords import Axis, as_written
from vibrodrive.model.kinds import above
from vibrodrive.model.names import ETA
from vibrodrive.model.parameters import bad_axes, check
from vibrodrive.model.physical import Scene
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.stability.criterion import IMPACTS, parse_criterion
from vibrodrive.stability.limit import AXES, PERIODS, Disturbance, Limit, LimitSearch, each_limit, plan_at_one_point
from vibrodrive.stability.limit_search import check_disturbance
from vibrodrive.stability.limits import CURVES, FINE, K2, QUANTITIES, Limits, undisturbed_diagram, values_of
from vibrodrive.stability.starts import Coordinate, StartLimit, nearest_other, plan_of_starts
from vibrodrive.stability.unique_motion import UniqueLimit, unique_at

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
    scan: ScanLike = "skip",
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
        the orbit. "rho < x": the distance of the motion from the orbit, as curves in the plane (ξ, ξ'), is below x, the
        k₃ of §1. Several conditions are joined by "and".
    scene : Scene, optional
        machine in SI units, which gives A and B, as in `simulate`.
    eps, dtau : float
        values of disturbances. Leave out the quantity that `disturbance` names. For a limit in ε, the methods "muller"
        and "fixed" need `dtau`. For a limit in Δτ, a value of `eps` disturbs the motion in addition.
    B, eta, tol, xi0, dxi0, tau0, transient, periods, section_phase, scan, budget
        as in `simulate`; they apply to each disturbed motion.
    threads : int, optional
        number of threads; by default the number of threads of Numba.

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
        for values that are probably a mistake: A <= 1 + B, at which the mass never leaves the obstacle; ε above 0.1; or
        an A that is above 100 and above 100 B.

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
    plan = plan_at_one_point(written, disturbance, method, " (for axes use `limits`)")
    search = LimitSearch(plan, disturbance, parse_criterion(criterion), check_threads(threads))
    ((_, found),) = _answered("limit", plan, lambda: list(search.run(strict=True)))
    return found


@as_written
def start_limit(
    written: Mapping[str, Any],
    /,
    A: float,
    axis: Coordinate,
    *,
    B: float = 0.1,
    xi0: float = 0.0,
    dxi0: float = 0.0,
    tau0: float = 0.0,
    transient: int = 1000,
    budget: int = 100_000,
    threads: int | None = None,
) -> StartLimit:
    """Find the limit k₁ (§1): the smallest error of one coordinate of the start that leads to another solution.

    The motion is undisturbed (ε = 0) and its switches are certified. The search covers deviations in both directions
    from the exact start: of τ0 up to 2π, and of ξ0 and ξ'0 up to 2π max(1, A). It does not try ξ0 < 0. If the orbit has
    a period n > 1, a deviation of τ0 by 2π always leads to another solution. The starts that lead to the same solution
    are its basin. The relative error of an edge of the basin is at most 1e-13, or its absolute error is at most the
    last bit of the coordinate.

    Parameters
    ----------
    A : float
        excitation amplitude, dimensionless like all parameters.
    axis : "xi0", "dxi0" or "tau0"
        the coordinate of the start that has an error.
    xi0, dxi0, tau0 : float
        the exact start. The deviation is counted from here.
    B, transient, budget
        as in `simulate`. A `transient` below 20 000 periods is raised to 20 000.
    threads : int, optional
        number of threads; by default the number of threads of Numba.

    Returns
    -------
    StartLimit
        `k1` is the distance of the nearer edge of the basin from the start, dimensionless like the coordinate.
        `below` and `above` are the edges in the two directions, each with `kept`, `lost` and `searched_to`.
        `n` is the period of the undisturbed orbit in excitation periods.
        `how` is a text that describes the result.

    Raises
    ------
    TypeError, ValueError
        if an argument is invalid. The message is one sentence: name, value and allowed values of the argument.

    Warns
    -----
    UserWarning
        for values that are probably a mistake, as in `limit`.

    Examples
    --------
    At A = 3.04 there are two solutions, one excitation period apart. A start 0.818 later leads to the second one:

    >>> import vibrodrive as vd
    >>> k = vd.start_limit(3.04, "tau0")
    >>> k.n, round(k.above.lost, 3), round(k.below.lost, 3), round(k.k1, 3)
    (2, 0.818, 5.465, 0.818)
    """
    if not hasattr(A, "__len__"):
        check("A", A)
    plan = plan_of_starts({name: value for name, value in written.items() if name not in ("axis", "threads")}, axis, ())
    count = check_threads(threads)
    return _answered("start_limit", plan, lambda: nearest_other(plan.arguments(0), axis, count))


@as_written
def unique_limit(
    written: Mapping[str, Any],
    /,
    A: float,
    disturbance: Disturbance = "eps",
    method: MethodLike | None = None,
    *,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = ETA,
    dtau: float | None = None,
    tol: float | None = None,
    tau0: float = 0.0,
    transient: int = 1000,
    periods: int = PERIODS,
    scan: ScanLike = "skip",
    budget: int = 100_000,
    threads: int | None = None,
) -> UniqueLimit:
    """Find the limit k_u: the smallest disturbance at which all starts end in one motion (§5, Fig. 11).

    Parameters
    ----------
    A : float
        excitation amplitude, dimensionless like all parameters.
    disturbance, method, eps, dtau
        as in `limit`.
    B, eta, tol, tau0, transient, periods, scan, budget
        as in `simulate`; they apply to each disturbed motion. The starts ξ0 and ξ'0 form a lattice that the function
        chooses. Two motions count as one if they agree over the last 64 recorded periods.
    threads : int, optional
        number of threads; by default the number of threads of Numba.

    Returns
    -------
    UniqueLimit
        `ku` is the smallest disturbance found at which all starts end in one motion, dimensionless.
        `several_below` is the largest disturbance found below `ku` at which several motions remain.
        `last_several` is the upper end of the band above `ku` in which several motions remain at some values.
        `share_several` is the share of the values between `ku` and `last_several` at which several motions remain.
        `n` is the number of solutions without a disturbance.
        `how` is a text that describes the result.

    Raises
    ------
    TypeError, ValueError
        if an argument is invalid. The message is one sentence: name, value and allowed values of the argument.

    Warns
    -----
    UserWarning
        for values that are probably a mistake, as in `limit`.

    Examples
    --------
    Under numerical disturbances the two solutions at A = 3.04 become one motion:

    >>> import vibrodrive as vd
    >>> k = vd.unique_limit(3.04, "dtau", transient=50, periods=50)
    >>> k.n, k.several_below < k.ku
    (2, True)
    """
    plan = plan_at_one_point(written, disturbance, method)
    count = check_threads(threads)
    return _answered("unique_limit", plan, lambda: unique_at(plan, 0, disturbance, count))


@as_written
def limits(
    written: Mapping[str, Any],
    /,
    A: Axis,
    disturbance: Disturbance | None = None,
    criterion: str = IMPACTS,
    *,
    B: Axis = 0.1,
    eps: float = 0.0,
    eta: Axis = ETA,
    tol: float | None = None,
    xi0: float = 0.0,
    dxi0: float = 0.0,
    tau0: float = 0.0,
    transient: int = 1000,
    periods: int = PERIODS,
    section_phase: float = 0.0,
    budget: int = 100_000,
    threads: int | None = None,
) -> Limits:
    """Find the limits k₂ of practically orbital stability over one or two axes of A, B and η.

    Parameters
    ----------
    A, B, eta : float or sequence of float
        one or two of these parameters are sequences and become axes, in the order of the arguments.
    disturbance : "eps" or "dtau", optional
        the quantity whose limits are computed. By default there are three curves of limits: in ε with the method
        "certified", in Δτ with "fixed", and in Δτ with "muller". With this argument the curves of the other disturbance
        are not computed, and their values are NaN.
    criterion, eps, tol, xi0, dxi0, tau0, transient, periods, section_phase, budget, threads
        as in `limit`. `eps` applies only to the limits in Δτ, and `tol` only to the limits of the method "muller".

    Returns
    -------
    Limits
        `numbers` is a dict of dimensionless arrays by name: `k2`, the limits; `velocity`, the limits as velocity
        amplitudes; and others. Each array is float64 (curve, axes…).
        `n` contains the periods of the undisturbed orbits in excitation periods, int32 (curve, axes…).
        `done` is True where a limit has been computed, bool (curve, axes…).
        `how` contains a description of each loss, (curve, axes…).
        `load` also returns a Limits, read from a file that `vibrodrive limits` has written.

    Raises
    ------
    TypeError, ValueError
        before any computation, if an argument is invalid. The message is one sentence: name, value and allowed values
        of the argument.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> found = vd.limits([1.5, 2.0], "eps", transient=50, periods=50)
    >>> found.n[0], found.numbers["k2"][0].round(4)
    (array([1, 1], dtype=int32), array([0.0039, 0.002 ]))
    """
    own = ("disturbance", "criterion", "threads")
    common = {name: value for name, value in written.items() if name not in own and value is not None}
    plan = make_plan({"periods": PERIODS, **common})
    names = list(plan.axes)
    if not 1 <= len(names) <= 2 or not set(names) <= set(AXES):
        raise ValueError(bad_axes(names, "one or two of A, B and eta (for one point use `limit`)"))
    if disturbance is not None:
        check_disturbance(disturbance)
    searches = {
        c: each_limit(common, name, method, criterion, threads)
        for c, (name, method) in enumerate(CURVES)
        if disturbance in (None, name)
    }
    shape = (len(CURVES), *plan.shape)
    found = Limits(
        axes=dict(plan.axes), fixed={name: plan.scalars[name] for name in AXES if name not in plan.axes},
        numbers={name: np.full(shape, np.nan) for name in QUANTITIES[K2].numbers}, n=np.zeros(shape, np.int32),
        done=np.zeros(shape, bool), how=np.full(shape, "", object), criterion=criterion, title="",
        shared={**plan.scalars, **vars(plan.settings)},
    )  # fmt: skip
    if names == ["A"]:
        fine = np.linspace(plan.axes["A"].min(), plan.axes["A"].max(), FINE)
        found = replace(found, fine=fine, diagram=undisturbed_diagram(common, fine, threads))
    for c, search in searches.items():
        for i, one in search:
            at = (c, *(int(k) for k in np.unravel_index(i, plan.shape)))
            for name, value in values_of(K2, one).items():
                found.numbers[name][at] = value
            found.n[at], found.how[at], found.done[at] = one.n, one.how, True
    return replace(found, how=found.how.astype(str))


def _answered(name: str, plan: Plan, search: Callable[[], T]) -> T:
    """Return the result of a search at the one point of a plan, with a warning of a likely mistake and a progress line.

    The warning names the line that calls the public function, three calls above this function.
    """
    A, B, eps, eta = (plan.scalars[key] for key in ("A", "B", "eps", "eta"))
    slips.warn_of_slip([(A, B, eps, eta)], depth=4)
    with above("the progress of a call")(name):
        return search()
