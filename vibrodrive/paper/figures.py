"""How each figure of the paper is drawn from its configuration."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from vibrodrive.batch.trajectory import simulate
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures.conditions import conditions, of_sweep
from vibrodrive.figures.curves import curve, shared_by
from vibrodrive.figures.looks import INK
from vibrodrive.figures.model import drawing
from vibrodrive.figures.scheme import scheme
from vibrodrive.figures.style import (
    equation,
    explain,
    letter,
    look,
    name_axes,
    new,
    note,
    periods_ticks,
    styled,
    symbol,
)
from vibrodrive.model.states import State
from vibrodrive.paper.analysis import LAGS, closing_periods, find_phase_slip, without_grid
from vibrodrive.paper.session import Session, points
from vibrodrive.stability.commensurability import closing, returning
from vibrodrive.stability.structure import deviation
from vibrodrive.verdicts import NotApplicable


def fig01(session: Session) -> Figure:
    return drawing()


def fig02(session: Session) -> Figure:
    """The path of the simplest solution is read off the undisturbed motion of Fig. 5."""
    switches = session.motions("fig05")[0].switches
    steps = zip(switches["before"].tolist(), switches["after"].tolist(), strict=True)
    return scheme({(State(before), State(after)) for before, after in steps}, "path of the simplest solution")


def _diagram(name: str) -> Callable[[Session], Figure]:
    def drawn(session: Session) -> Figure:
        wanted = {k: v for k, v in session.config(name).figure.items() if k not in ("style", "width")}
        return figures.from_results(session.results(name), **wanted)

    return drawn


def fig04(session: Session) -> Figure:
    return figures.time_curve(session.motions("fig04"), "dxi", titles=_axis_values(session, "fig04"))


def fig05(session: Session) -> Figure:
    return figures.phase_curve(session.motions("fig05"), titles=_axis_values(session, "fig05"))


def fig06(session: Session) -> Figure:
    return figures.poincare(session.results("fig06"), reference=session.undisturbed("fig06").points)


def fig08(session: Session) -> Figure:
    return figures.phase_curve(session.motions("fig08"), titles=_axis_values(session, "fig08"))


def fig09(session: Session) -> Figure:
    return figures.poincare(session.results("fig09"), reference=session.undisturbed("fig09").points)


def fig11(session: Session) -> Figure:
    disturbed = session.motions("fig11")[0]
    exact = simulate(**without_grid(next(points(session.config("fig11").plan()))))
    step = disturbed.arguments["dtau"]
    return figures.phase_curve([exact, disturbed], titles=["exact", equation("dtau", step)])


@styled
def fig12(session: Session) -> Figure:
    motion = session.motions("fig12")[0]
    slip = find_phase_slip(motion, session.undisturbed("fig12"))
    drawn = curve(motion)
    fig, axes = new(2, 1, height=5.6, height_ratios=[1.5, 1.0])
    phase, time = axes[:, 0]
    marks = ((slip.before, "D", "basic motion before"), (slip.after, (6, 2, 0), "basic motion after"))
    for (start, stop), mark, name in marks:
        part = (drawn.tau >= start) & (drawn.tau <= stop)
        shown = np.flatnonzero(part & np.isfinite(drawn.xi))[::12]
        phase.plot(drawn.xi[shown], drawn.dxi[shown], ls="none", marker=mark, ms=3.6, mfc="none", mew=0.5, label=name)
        time.plot(drawn.tau[part], drawn.xi[part], color=look().main)
    part = (drawn.tau >= slip.during[0]) & (drawn.tau <= slip.during[1])
    phase.plot(drawn.xi[part], drawn.dxi[part], color=look().other, lw=1.1, label="transient motion (b: dashed)")
    time.plot(drawn.tau[part], drawn.xi[part], "--", color=look().other, lw=1.1)
    phase.axhline(0.0, color=look().support, lw=0.4, zorder=0)
    name_axes(phase, "xi", "dxi")
    low = 2 * math.pi * math.floor(slip.before[0] / (2 * math.pi))
    high = 2 * math.pi * math.ceil(slip.after[1] / (2 * math.pi))
    tau = np.linspace(low, high, 1000)
    time.plot(tau, np.sin(tau), color=look().support, lw=0.7, zorder=0, label=r"$\sin\tau$")
    periods_ticks(time, low, high)
    name_axes(time, None, "xi")
    letter(phase, 0)
    letter(time, 1)
    note(phase, shared_by([motion]))
    explain(fig)
    return fig


@styled
def coexisting(session: Session) -> Figure:
    """Which of the n coexisting solutions each start leads to, named by its shift."""
    results = session.results("coexisting")
    if len(results.axes) != 2:
        raise NotApplicable("a map of starts needs two axes")
    base = session.undisturbed("coexisting", xi0=0.0, dxi0=0.0, tau0=0.0)
    rho, shift = deviation(base.points, results.section)
    named = np.where(rho < SETTLED, shift, np.nan)
    (y, heights), (x, widths) = results.axes.items()
    fig, axes = new(1, 1, height=3.8)
    ax = axes[0, 0]
    tones = [look().density(0.75 * (1 - s / max(1, base.n - 1))) for s in range(base.n)]
    extent = (widths[0], widths[-1], heights[0], heights[-1])
    ax.imshow(
        np.ma.masked_invalid(named),
        extent=extent,
        origin="lower",
        aspect="auto",
        cmap=ListedColormap(tones),
        vmin=-0.5,
        vmax=base.n - 0.5,
        interpolation="nearest",
    )
    labels = [rf"shifted by ${s}\cdot 2\pi$" if s else "not shifted" for s in range(base.n)]
    key = [Patch(fc=tone, ec=INK, lw=0.5, label=label) for tone, label in zip(tones, labels, strict=True)]
    if np.isnan(named).any():
        ax.set_facecolor(ELSEWHERE)
        key.append(Patch(fc=ELSEWHERE, ec=INK, lw=0.5, label="not settled on it"))
    name_axes(ax, x, y)
    note(ax, conditions(of_sweep(results), results.axes, section=False))
    explain(fig, key)
    return fig


ELSEWHERE = "#fff3b0"
"""Of starts that have led to none of the solutions: a tone that they do not have."""

SETTLED = 1e-6
"""A motion this close to the orbit has arrived."""


@styled
def grid(session: Session) -> Figure:
    """After how many periods the motion comes back, and after how many the grid nearly closes.

    a) over Δτ, the best of both up to LAGS; b) every number of periods at the Δτ of Fig. 12.
    """
    results = session.results("grid")
    steps = results.axes["dtau"]
    fig, axes = new(2, 1, height=5.8, height_ratios=[1.4, 1.0])
    over, one = axes[:, 0]
    closes = [closing_periods(step) for step in steps]
    returns = [int(returning(section, LAGS).argmin()) + 1 for section in results.section]
    circle = {"mfc": "none", "mec": look().other, "mew": 0.5}
    over.plot(steps, closes, "o", ms=5, **circle, label="a: the grid closes (convergent $q$)")
    over.plot(steps, returns, ".", ms=3.2, mew=0, color=look().main, label="a: the motion comes back")
    over.set_ylim(0, LAGS + 1)
    over.margins(x=0.01)
    over.set_xlabel(symbol("dtau"))
    over.set_ylabel("periods $m$")
    letter(over, 0)
    note(over, conditions(of_sweep(results), results.axes))

    motion = session.motions("fig12")[0]
    step = motion.arguments["dtau"]
    m = np.arange(1, LAGS + 1)
    itself = {"lw": 0.6, "ms": 5, "mew": 0, "label": "b: distance of the motion from itself"}
    one.semilogy(m, returning(motion.section, LAGS), ".-", color=look().main, **itself)
    grid = {"lw": 0.5, "ms": 4, "mfc": "white", "mew": 0.5, "label": r"b: distance of $m\cdot2\pi$ from the grid"}
    one.semilogy(m, closing(step, LAGS), "o--", color=look().other, **grid)
    one.set_xlim(0, LAGS + 1)
    one.set_xlabel("periods $m$")
    one.set_ylabel("distance")
    letter(one, 1, equation("dtau", step))
    explain(fig)
    return fig


def _axis_values(session: Session, name: str) -> list[str]:
    """What distinguishes the points of a configuration, as titles."""
    plan = session.config(name).plan()
    index: Iterator[tuple[int, ...]] = np.ndindex(plan.shape)
    return [", ".join(equation(n, plan.axes[n][i]) for n, i in zip(plan.axes, at, strict=True)) for at in index]


class Drawing(NamedTuple):
    title: str
    draw: Callable[[Session], Figure]


FIGURES = {
    "fig01": Drawing("mass, vibrating incline and obstacle", fig01),
    "fig02": Drawing("scheme of states", fig02),
    "fig03": Drawing("bifurcation diagram, undisturbed", _diagram("fig03")),
    "fig04": Drawing("non-unique solutions", fig04),
    "fig05": Drawing("non-bifurcated solution, physical disturbance", fig05),
    "fig06": Drawing("Poincaré sections, physical disturbance", fig06),
    "fig07": Drawing("bifurcation diagrams, undisturbed and disturbed", _diagram("fig07")),
    "fig08": Drawing("non-bifurcated solution, constant step", fig08),
    "fig09": Drawing("Poincaré sections, constant step", fig09),
    "fig10": Drawing("bifurcation diagram, constant step", _diagram("fig10")),
    "fig11": Drawing("phase curves, exact and with a constant step", fig11),
    "fig12": Drawing("basic and transient motions", fig12),
    "coexisting": Drawing("which start leads to which solution", coexisting),
    "grid": Drawing("when a grid closes and when its motion returns", grid),
}
"""Everything `vibrodrive paper` draws: the figures of the paper, and two that explain Fig. 4 and Fig. 12."""
