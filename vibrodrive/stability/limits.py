"""Limits over one or two axes of A, B and η, as the object that `vd.limits` returns and that a file of them holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrodrive.batch.sweep import collect
from vibrodrive.model.above import above
from vibrodrive.model.described import Described, numbers, share_computed, span
from vibrodrive.model.drawing import MAP
from vibrodrive.model.keywords import Axis, as_written
from vibrodrive.model.parameters import ETA, bad
from vibrodrive.model.plan import make_plan
from vibrodrive.stability.criterion import SOLUTION
from vibrodrive.stability.limit import AXES, PERIODS, Disturbance, Limit, each_limit
from vibrodrive.stability.starts import COORDINATES
from vibrodrive.stability.velocity import as_velocity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CURVES = (("eps", "certified"), ("dtau", "fixed"), ("dtau", "muller"))
"""Disturbance and path of each curve."""

STARTS = tuple((coordinate, "certified") for coordinate in COORDINATES)
"""The same where an error of the start is what disturbs (criterion "solution")."""


def curves_of(criterion: str) -> tuple[tuple[str, str], ...]:
    """Disturbance and path of each curve of a file with this criterion."""
    return STARTS if criterion == SOLUTION else CURVES


FINE = 1500
"""Values of A of the bifurcation diagram."""

SHOWN = 120
"""Periods of it recorded at each."""

NUMBERS = {
    "k2": "first loss of what the criterion asks for; inf: none found up to searched_to",
    "kept_below": "largest disturbance below k2 that was kept",
    "last_kept": "largest value kept together with its neighbour on the grid",
    "share_kept": "share of the values tried between k2 and last_kept that are kept",
    "searched_to": "largest disturbance tried",
    "velocity": "k2 as a velocity amplitude V: k2 eta A in eps, k2 in dtau, none in a start",
    "velocity_last": "last_kept as a velocity amplitude V",
    "rho_kept": "largest distance from the orbit at kept_below, of one disturbed motion",
    "rho_lost": "largest distance from the orbit at k2, of one disturbed motion",
}
"""float64 variables over curve and axes, dimensionless."""


def values_of(found: Limit) -> dict[str, float]:
    """The numbers of a limit, by the names of NUMBERS."""
    own = {
        "velocity_last": float(as_velocity(found.disturbance, found.last_kept, found.A, found.eta)),
        "rho_kept": found.kept.rho if found.kept is not None else np.nan,
        "rho_lost": found.lost.rho if found.lost is not None else np.nan,
    }
    return {name: own[name] if name in own else getattr(found, name) for name in NUMBERS}


@dataclass(frozen=True, repr=False)
class Limits(Described):
    """Limits over axes: what `limits`, and `load` of a file of limits, return.

    Arrays are over (curve, axes…), also `n`, the period of the undisturbed orbit.

    Attributes
    ----------
    axes : dict of str to float64 array
        one or two of A, B and eta, in the order of the dimensions.
    fixed : dict of str to float
        those of A, B and eta that are no axis.
    numbers : dict of str to float64 array
        by the names of NUMBERS.
    done, how
        what has been computed, and what was lost at k2, or why there is no k2.
    fine, diagram : float64 array (fine A), (fine A, periods), or None
        ξ' of the undisturbed motion, over A alone.
    shared : dict
        parameters and settings that all points share, by name.
    mm_s : float or None
        mm/s that a dimensionless velocity of 1 is, for a scene in SI units.
    """

    axes: dict[str, np.ndarray]
    fixed: dict[str, float]
    numbers: dict[str, np.ndarray]
    n: np.ndarray
    done: np.ndarray
    how: np.ndarray
    criterion: str
    title: str
    fine: np.ndarray | None = None
    diagram: np.ndarray | None = None
    mm_s: float | None = None
    shared: Mapping[str, Any] = field(default_factory=dict)

    @property
    def A(self) -> np.ndarray:
        """The values of A, if it is the one axis; ValueError if not."""
        if list(self.axes) != ["A"]:
            raise ValueError(bad("axes", ", ".join(self.axes), "A alone"))
        return self.axes["A"]

    @property
    def curves(self) -> tuple[tuple[str, str], ...]:
        """Disturbance and path of each curve."""
        return curves_of(self.criterion)

    def known(self, name: str = "k2") -> np.ndarray:
        """One of the numbers where k2 was found and is > 0, NaN elsewhere: where there is something to draw."""
        k2 = self.numbers["k2"]
        return np.where(self.done & np.isfinite(k2) & (k2 > 0), self.numbers[name], np.nan)

    def ratio(self) -> np.ndarray:
        """k2(Δτ), switches on the grid, over k2(ε) ηA: float64 (axes…); NaN where either is missing."""
        V = self.known("velocity")
        return V[1] / V[0]

    @property
    def computed(self) -> float:
        """Share of the limits that are computed, 0 to 1."""
        return float(self.done.mean())

    def plot(self, kind: Literal["map"] | None = None, *, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """The limits as velocity amplitudes over the longer axis and, of both kinds, their ratio.

        Parameters
        ----------
        kind : "map", optional
            over two axes: k₂ in ε as a colour in their plane.
        ax : matplotlib Axes or sequence of them, optional
            where to draw, one for each panel; a new figure unless given.

        Returns
        -------
        Figure
            which shows itself in a notebook; `savefig` writes it.

        Raises
        ------
        ValueError
            for another kind, and for a map over one axis.
        """
        if kind not in (None, MAP):
            raise ValueError(bad("kind", kind, f"{MAP}, or left out"))
        if kind == MAP:
            return above("figures.limits_map").limits_map(self, ax=ax)
        return above("figures.limits").limits_figure(self, ax=ax)

    def _described(self) -> dict[str, str]:
        shape = " × ".join(str(len(values)) for values in self.axes.values())
        return {
            "of": f"{len(self.curves)} disturbances at {shape} points",
            "computed": share_computed(self.computed),
            "axes": ", ".join(span(name, values) for name, values in self.axes.items()),
            "disturbances": ", ".join(f"{d} ({method})" for d, method in self.curves),
            "criterion": f"kept: {self.criterion}",
        }

    def _more(self) -> dict[str, str]:
        curves = {f"{d} ({m})": curve_line(curve_facts(self, c), self.mm_s) for c, (d, m) in enumerate(self.curves)}
        return {"fixed": numbers(self.fixed), **curves}


def curve_facts(found: Limits, c: int) -> dict[str, Any]:
    """How far a curve is, and from where to where its limits go: as values of the disturbance, and as velocities."""
    disturbance, method = found.curves[c]
    facts = {
        "disturbance": disturbance, "method": method, "computed": int(found.done[c].sum()), "of": found.done[c].size,
    }  # fmt: skip
    some = found.done[c] & np.isfinite(found.numbers["k2"][c])
    for name in ("k2", "velocity"):
        values = found.numbers[name][c][some]
        if not np.isnan(values).all():
            facts[name] = {"min": float(values.min()), "max": float(values.max())}
    return facts


def curve_line(facts: dict[str, Any], mm_s: float | None) -> str:
    text = f"{facts['method']}: {facts['computed']} of {facts['of']} limits"
    if "k2" in facts:
        text += f", {facts['k2']['min']:.3g} to {facts['k2']['max']:.3g}"
    if "velocity" in facts:
        low, high = facts["velocity"]["min"], facts["velocity"]["max"]
        text += f", V = {low:.3g} to {high:.3g}"
        text += "" if mm_s is None else f" ({mm_s * low:.3g} to {mm_s * high:.3g} mm/s)"
    return text


@as_written
def limits(
    written: Mapping[str, Any],
    /,
    A: Axis,
    disturbance: Disturbance | None = None,
    criterion: str | None = None,
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
    """Find the limits of practically orbital stability over one or two axes of A, B and η.

    Parameters
    ----------
    A, B, eta : float or sequence of float
        one or two of them are axes, in the order in which they are written.
    disturbance : "eps", "dtau", "xi0", "dxi0" or "tau0", optional
        all those of the criterion unless given: ε with certified switches and Δτ with "fixed" and with "muller", or
        the three of the start with the criterion "solution". What is not asked for is not computed: NaN.
    criterion, eps, tol, xi0, dxi0, tau0, transient, periods, section_phase, budget, threads
        as in `limit`. `eps` disturbs the motions whose limit in Δτ is sought, `tol` acts after Muller's method.

    Returns
    -------
    Limits
        numbers (k2, velocity, … by name, over (curve, axes…)), n, done, how; as `load` returns them of a file of
        `vibrodrive limits`.

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed, before anything is computed.

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
        raise ValueError(bad("axes", ", ".join(names) or "none", "one or two of A, B and eta (`limit` is for a point)"))
    wanted = ("solution" if disturbance in COORDINATES else "impacts") if criterion is None else criterion
    curves = curves_of(wanted)
    chosen = [c for c, (name, _) in enumerate(curves) if disturbance in (None, name)]
    if not chosen:
        raise ValueError(bad("disturbance", disturbance, "one of " + ", ".join(dict.fromkeys(d for d, _ in curves))))
    searches = {
        c: each_limit(disturbance=curves[c][0], method=curves[c][1], criterion=wanted, threads=threads, **common)
        for c in chosen
    }
    shape = (len(curves), *plan.shape)
    found = Limits(
        axes=dict(plan.axes), fixed={name: plan.scalars[name] for name in AXES if name not in plan.axes},
        numbers={name: np.full(shape, np.nan) for name in NUMBERS}, n=np.zeros(shape, np.int32),
        done=np.zeros(shape, bool), how=np.full(shape, "", object), criterion=wanted, title="",
        shared={**plan.scalars, **vars(plan.settings)},
    )  # fmt: skip
    if names == ["A"]:
        fine = np.linspace(plan.axes["A"].min(), plan.axes["A"].max(), FINE)
        found = replace(found, fine=fine, diagram=undisturbed_diagram(common, fine, threads))
    for c, search in searches.items():
        for i, one in search:
            at = (c, *(int(k) for k in np.unravel_index(i, plan.shape)))
            for name, value in values_of(one).items():
                found.numbers[name][at] = value
            found.n[at], found.how[at], found.done[at] = one.n, one.how, True
    return replace(found, how=found.how.astype(str))


def undisturbed_diagram(common: Mapping[str, Any], A: np.ndarray, threads: int | None) -> np.ndarray:
    """ξ' of the undisturbed motion over A, SHOWN periods of it: float64 (A, SHOWN)."""
    return collect(make_plan({**common, "A": A, "eps": 0.0, "periods": SHOWN}), threads).section[..., 1]
