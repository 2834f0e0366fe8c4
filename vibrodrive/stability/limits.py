"""Limits over one or two of the axes A, B and η: the object that `vd.limits` returns and a file of limits contains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from vibrodrive.batch.sweep import collect
from vibrodrive.model.described import Lines, Stored, axis_facts, words
from vibrodrive.model.drawing import MAP
from vibrodrive.model.kinds import above
from vibrodrive.model.parameters import bad, bad_axes
from vibrodrive.model.plan import make_plan
from vibrodrive.stability.criterion import IMPACTS, parse_criterion
from vibrodrive.stability.limit import Limit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CURVES = (("eps", "certified"), ("dtau", "fixed"), ("dtau", "muller"))  # disturbance and method of each curve
FINE = 1500  # number of values of A in the bifurcation diagram
SHOWN = 120  # number of periods recorded at each value of A in the bifurcation diagram
K2 = "k2"


class Quantity(NamedTuple):
    """One kind of limit over axes.

    curves : disturbance and method of each curve of limits.
    numbers : meaning of each number of a limit, by name. The names are attributes of a Limit, and the keys of
        `Limits.numbers`.
    last : name of the upper end of the band (limit.py) above the limit; "" if this limit has no band.
    """

    curves: tuple[tuple[str, str], ...]
    numbers: Mapping[str, str]
    last: str = ""


# the keys are the names of the limits
QUANTITIES = {
    K2: Quantity(
        CURVES,
        {
            "k2": "smallest disturbance found that violates the criterion; inf: none up to searched_to",
            "kept_below": "largest disturbance below k2 that was kept",
            "last_kept": "largest value that is kept together with its lower neighbour on the grid",
            "share_kept": "share of the values tried between k2 and last_kept that are kept",
            "searched_to": "largest disturbance tried",
            "velocity": "k2 as a velocity amplitude V: k2 eta A in eps, k2 in dtau",
            "velocity_last": "last_kept as a velocity amplitude V",
            "rho_kept": "largest distance from the orbit at kept_below, of one disturbed motion",
            "rho_lost": "largest distance from the orbit at k2, of one disturbed motion",
        },
        "last_kept",
    ),
}


def values_of(quantity: str, found: Limit) -> dict[str, float]:
    """Return the numbers of a limit by name, for the names in QUANTITIES."""
    return {name: getattr(found, name) for name in QUANTITIES[quantity].numbers}


def check_quantity(quantity: object, criterion: str | None) -> str:
    """Return the criterion as text, by default "impacts". Raises ValueError for an unknown quantity or criterion."""
    if quantity not in QUANTITIES:
        raise ValueError(bad("quantity", quantity, "one of " + ", ".join(QUANTITIES)))
    return parse_criterion(IMPACTS if criterion is None else criterion).text


@dataclass(frozen=True, repr=False)
class Limits(Stored):
    """Limits over one or two axes, as returned by `limits` and by `load` for a file of limits.

    The arrays in `numbers` and the arrays `n`, `done` and `how` have the shape (curve, axes…). A curve is a disturbance
    with a method (`curves`).

    Attributes
    ----------
    axes : dict of str to float64 array
        values of one or two of A, B and eta, in the order of the dimensions.
    fixed : dict of str to float
        values of the parameters A, B and eta, except the axes.
    numbers : dict of str to float64 array
        dimensionless results by name, for example `k2`, `kept_below` and `velocity`.
    n : int array
        period of the undisturbed orbit in excitation periods, 0 if it has none.
    done : bool array
        True where the limit has been computed.
    how : str array
        description of the loss at k2, or the reason why there is no k2.
    criterion : str
        criterion that disturbed motions satisfy below `k2`.
    fine, diagram : float64 arrays, or None
        bifurcation diagram of the undisturbed motion, if A is the only axis. `fine` (m,) contains values of A, and
        `diagram` (m, periods) contains ξ' at the section points.
    shared : dict
        parameters and settings that all points share, by name.
    mm_s : float or None
        velocity in mm/s that corresponds to a dimensionless velocity of 1; None without a scene in SI units.
    """

    file_kind = "limits"

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
    quantity: str = K2

    @property
    def A(self) -> np.ndarray:
        """The values of A. Raises ValueError unless A is the only axis."""
        if list(self.axes) != ["A"]:
            raise ValueError(bad_axes(self.axes, "A only"))
        return self.axes["A"]

    @property
    def curves(self) -> tuple[tuple[str, str], ...]:
        """(disturbance, method) of each curve."""
        return QUANTITIES[self.quantity].curves

    @property
    def values(self) -> np.ndarray:
        """The limits, float64 (curve, axes…)."""
        return self.numbers[self.quantity]

    def known(self, name: str = "") -> np.ndarray:
        """Return the limits or, with `name`, the numbers of this name; NaN where no limit > 0 was found."""
        found = self.done & np.isfinite(self.values) & (self.values > 0)
        return np.where(found, self.numbers[name or self.quantity], np.nan)

    def last(self) -> np.ndarray:
        """Return the upper ends of the bands above the limits; NaN where no limit > 0 was found."""
        return self.known(QUANTITIES[self.quantity].last)

    def ratio(self) -> np.ndarray:
        """Return k2(Δτ) of the method "fixed" divided by k2(ε) ηA: float64 (axes…); NaN where a limit is missing."""
        V = self.known("velocity")
        return V[1] / V[0]

    @property
    def computed(self) -> float:
        """Share of the limits that are computed, 0 to 1."""
        return float(self.done.mean())

    def plot(self, kind: Literal["map"] | None = None, *, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """Draw the limits as velocity amplitudes over the axis with more values.

        If there are limits both in ε and in Δτ, a second panel shows their ratio.

        Parameters
        ----------
        kind : "map", optional
            "map" draws the limits in ε as colours in the plane of two axes.
        ax : matplotlib Axes or sequence of them, optional
            axes to draw in, one for each panel; by default those of a new figure.

        Returns
        -------
        Figure
            Matplotlib figure. A notebook displays it, and its method `savefig` writes it to a file.

        Raises
        ------
        ValueError
            if `kind` is neither "map" nor left out, or if `kind` is "map" and there is only one axis.
        """
        if kind not in (None, MAP):
            raise ValueError(bad("kind", kind, f"{MAP}, or left out"))
        return above("the map of limits" if kind == MAP else "the figure of limits")(self, ax=ax)

    def facts(self) -> dict[str, Any]:
        return {
            "axes": {name: axis_facts(values) for name, values in self.axes.items()},
            "parameters": self.fixed,
            "quantity": self.quantity,
            "criterion": self.criterion,
            "curves": [curve_facts(self, c) for c in range(len(self.curves))],
        }

    def lines(self) -> Lines:
        facts = self.facts()
        lines = words({name: facts[name] for name in ("axes", "parameters", "criterion")})
        return lines + [(curve["disturbance"], curve_line(curve, self.mm_s)) for curve in facts["curves"]]


def curve_facts(found: Limits, c: int) -> dict[str, Any]:
    """Return a dict with the progress of curve c and the ranges of its limits, as disturbances and as velocities."""
    disturbance, method = found.curves[c]
    facts = {
        "disturbance": disturbance, "method": method, "computed": int(found.done[c].sum()), "of": found.done[c].size,
    }  # fmt: skip
    some = found.done[c] & np.isfinite(found.values[c])
    for name in (found.quantity, "velocity"):
        values = found.numbers[name][c][some] if name in found.numbers else np.empty(0)
        if len(values):
            facts[name] = {"min": float(values.min()), "max": float(values.max())}
    return facts


def curve_line(facts: dict[str, Any], mm_s: float | None) -> str:
    text = f"{facts['method']}: {facts['computed']} of {facts['of']} limits"
    for name in QUANTITIES.keys() & facts.keys():
        text += f", {facts[name]['min']:.3g} to {facts[name]['max']:.3g}"
    if "velocity" in facts:
        low, high = facts["velocity"]["min"], facts["velocity"]["max"]
        text += f", V = {low:.3g} to {high:.3g}"
        text += "" if mm_s is None else f" ({mm_s * low:.3g} to {mm_s * high:.3g} mm/s)"
    return text


def undisturbed_diagram(common: Mapping[str, Any], A: np.ndarray, threads: int | None) -> np.ndarray:
    """Compute ξ' at SHOWN section points of the undisturbed motion for each A (m,): float64 (m, SHOWN)."""
    return collect(make_plan({**common, "A": A, "eps": 0.0, "periods": SHOWN}), threads).section[..., 1]
