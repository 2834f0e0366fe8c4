"""Public functions for the limits of stability k₂.

They share most of their keywords with `simulate`, and are in one file, so that a new keyword is added in one place.
limit.py and limits.py contain the searches and the results.
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
from vibrodrive.model.parameters import bad_axes
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.stability.criterion import IMPACTS, parse_criterion
from vibrodrive.stability.limit import AXES, PERIODS, Disturbance, Limit, LimitSearch, each_limit, plan_at_one_point
from vibrodrive.stability.limit_search import check_disturbance
from vibrodrive.stability.limits import CURVES, FINE, K2, QUANTITIES, Limits, undisturbed_diagram, values_of

T = TypeVar("T")


@as_written
def limit(
    written: Mapping[str, Any],
    /,
    A: float,
    disturbance: Disturbance = "eps",
    method: MethodLike | None = None,
    criterion: str = IMPACTS,
    *,
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
        excitation amplitude, dimensionless like all parameters.
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
