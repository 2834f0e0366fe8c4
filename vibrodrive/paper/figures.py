"""Drawings of the figures of the paper, each from its configuration."""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from vibrodrive.batch.trajectory import simulate
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures import style
from vibrodrive.figures.conditions import conditions, of_sweep
from vibrodrive.figures.curves import curve, draw_time, periods_ticks, shared_by
from vibrodrive.figures.looks import INK
from vibrodrive.figures.model import drawing
from vibrodrive.figures.scheme import scheme
from vibrodrive.model.states import State
from vibrodrive.paper.analysis import LAGS, SETTLED, closing_periods, find_phase_slip, without_grid
from vibrodrive.paper.session import Session
from vibrodrive.paper.zeros import ZEROS, failures_by_zeros
from vibrodrive.stability.commensurability import closing, returning
from vibrodrive.stability.failures import JUDGED, METHODS
from vibrodrive.stability.structure import deviation
from vibrodrive.verdicts import NotApplicable

NOT_SETTLED = "#fff3b0"  # no solution has this colour


def fig02(session: Session) -> Figure:
    """Draw the scheme of Fig. 2. The path of the simplest solution is that of the undisturbed motion of Fig. 5."""
    switches = session.motions("fig05")[0].switches
    steps = zip(switches["before"].tolist(), switches["after"].tolist(), strict=True)
    return scheme({(State(before), State(after)) for before, after in steps}, "path of the simplest solution")


def _diagram(name: str) -> Callable[[Session], Figure]:
    def drawn(session: Session) -> Figure:
        wanted = {k: v for k, v in session.config(name).figure.items() if k not in ("style", "width")}
        return figures.from_results(session.results(name), **wanted)

    return drawn


@style.styled
def fig04(session: Session) -> Figure:
    motions = session.motions("fig04")
    fig, axes = style.new(height=2.8)
    ax = axes[0, 0]
    draw_time(ax, motions, "dxi", _axis_values(session, "fig04"))
    style.note(ax, shared_by(motions))
    style.explain(fig)
    return fig


def _phase_curves(name: str) -> Callable[[Session], Figure]:
    return lambda session: figures.phase_curve(session.motions(name), titles=_axis_values(session, name))


def _sections(name: str) -> Callable[[Session], Figure]:
    return lambda session: figures.poincare(session.results(name), reference=session.undisturbed(name).points)


def fig11(session: Session) -> Figure:
    disturbed = session.motions("fig11")[0]
    exact = simulate(**without_grid(session.points("fig11")[0]))
    step = disturbed.arguments["dtau"]
    return figures.phase_curve([exact, disturbed], titles=["exact", style.equation("dtau", step)])


@style.styled
def fig12(session: Session) -> Figure:
    motion = session.motions("fig12")[0]
    slip = find_phase_slip(motion, session.undisturbed("fig12"))
    drawn = curve(motion)
    fig, axes = style.new(2, 1, height=5.6, height_ratios=[1.5, 1.0])
    phase, time = axes[:, 0]
    marks = ((slip.before, "D", "basic motion before"), (slip.after, (6, 2, 0), "basic motion after"))
    for (start, stop), mark, name in marks:
        part = (drawn.tau >= start) & (drawn.tau <= stop)
        shown = np.flatnonzero(part & np.isfinite(drawn.xi))[::12]
        phase.plot(drawn.xi[shown], drawn.dxi[shown], ls="none", marker=mark, ms=3.6, mfc="none", mew=0.5, label=name)
        time.plot(drawn.tau[part], drawn.xi[part], color=style.look().main)
    part = (drawn.tau >= slip.during[0]) & (drawn.tau <= slip.during[1])
    phase.plot(drawn.xi[part], drawn.dxi[part], color=style.look().other, lw=1.1, label="transient motion (b: dashed)")
    time.plot(drawn.tau[part], drawn.xi[part], "--", color=style.look().other, lw=1.1)
    phase.axhline(0.0, color=style.look().support, lw=0.4, zorder=0)
    style.name_axes(phase, "xi", "dxi")
    low = 2 * math.pi * math.floor(slip.before[0] / (2 * math.pi))
    high = 2 * math.pi * math.ceil(slip.after[1] / (2 * math.pi))
    tau = np.linspace(low, high, 1000)
    time.plot(tau, np.sin(tau), color=style.look().support, lw=0.7, zorder=0, label=r"$\sin\tau$")
    periods_ticks(time, low, high)
    style.name_axes(time, None, "xi")
    style.letter(phase, 0)
    style.letter(time, 1)
    style.note(phase, shared_by([motion]))
    style.explain(fig)
    return fig


@style.styled
def coexisting(session: Session) -> Figure:
    """Draw a map of starts. The colour of a start shows the shift of the solution to which it leads."""
    results = session.results("coexisting")
    if len(results.axes) != 2:
        raise NotApplicable("a map of starts needs two axes")
    base = session.undisturbed("coexisting", xi0=0.0, dxi0=0.0, tau0=0.0)
    rho, shift = deviation(base.points, results.section)
    named = np.where(rho < SETTLED, shift, np.nan)
    (y, heights), (x, widths) = results.axes.items()
    fig, axes = style.new(1, 1, height=3.8)
    ax = axes[0, 0]
    tones = [style.look().density(0.75 * (1 - s / max(1, base.n - 1))) for s in range(base.n)]
    extent = (widths[0], widths[-1], heights[0], heights[-1])
    colours = {"cmap": ListedColormap(tones), "vmin": -0.5, "vmax": base.n - 0.5, "interpolation": "nearest"}
    ax.imshow(np.ma.masked_invalid(named), extent=extent, origin="lower", aspect="auto", **colours)
    labels = [rf"shifted by ${s}\cdot 2\pi$" if s else "not shifted" for s in range(base.n)]
    key = [Patch(fc=tone, ec=INK, lw=0.5, label=label) for tone, label in zip(tones, labels, strict=True)]
    if np.isnan(named).any():
        ax.set_facecolor(NOT_SETTLED)
        key.append(Patch(fc=NOT_SETTLED, ec=INK, lw=0.5, label="not settled on the orbit"))
    style.name_axes(ax, x, y)
    style.note(ax, conditions(of_sweep(results), results.axes, section=False))
    style.explain(fig, key)
    return fig


@style.styled
def grid(session: Session) -> Figure:
    """Compare the number of periods after which a motion nearly repeats with that after which the grid nearly closes.

    The grid closes after m periods if m·2π is an integer multiple of Δτ. Panel a) shows over Δτ the number of periods
    up to LAGS after which the motion returns most closely, and the number after which the grid closes most closely.
    Panel b) shows the distances of the motion and of the grid over the number of periods, at the Δτ of Fig. 12.
    """
    results = session.results("grid")
    steps = results.axes["dtau"]
    fig, axes = style.new(2, 1, height=5.8, height_ratios=[1.4, 1.0])
    over, one = axes[:, 0]
    closes = [closing_periods(step) for step in steps]
    returns = [int(returning(section, LAGS).argmin()) + 1 for section in results.section]
    circle = {"mfc": "none", "mec": style.look().other, "mew": 0.5}
    over.plot(steps, closes, "o", ms=5, **circle, label="a: the grid closes (convergent $q$)")
    over.plot(steps, returns, ".", ms=3.2, mew=0, color=style.look().main, label="a: the motion nearly repeats")
    over.set_ylim(0, LAGS + 1)
    over.margins(x=0.01)
    over.set_xlabel(style.symbol("dtau"))
    over.set_ylabel("periods $m$")
    style.letter(over, 0)
    style.note(over, conditions(of_sweep(results), results.axes))

    motion = session.motions("fig12")[0]
    step = motion.arguments["dtau"]
    m = np.arange(1, LAGS + 1)
    itself = {"lw": 0.6, "ms": 5, "mew": 0, "label": "b: distance of the motion from itself"}
    one.semilogy(m, returning(motion.section, LAGS), ".-", color=style.look().main, **itself)
    grid = {"lw": 0.5, "ms": 4, "mfc": "white", "mew": 0.5, "label": r"b: distance of $m\cdot2\pi$ from the grid"}
    one.semilogy(m, closing(step, LAGS), "o--", color=style.look().other, **grid)
    one.set_xlim(0, LAGS + 1)
    one.set_xlabel("periods $m$")
    one.set_ylabel("distance")
    style.letter(one, 1, style.equation("dtau", step))
    style.explain(fig)
    return fig


MARKS: dict[str, dict[str, Any]] = {
    "one": {"marker": "s", "ms": 3.6, "mew": 0, "color": "0.75"},
    "even": {"marker": "o", "ms": 3.6, "mew": 0.8, "mfc": "none", "mec": INK},
    "both": {"marker": "x", "ms": 3.6, "mew": 0.8, "color": INK},
    "odd": {"marker": "^", "ms": 3.6, "mew": 0.8, "color": INK},
}
"""Marks of the numbers of zeros in a step, by their names in ZEROS."""


@style.styled
def zeros(session: Session) -> Figure:
    """Mark over A and Δτ the numbers of zeros in the steps at which a switch is missed, late or followed by a wrong
    state, at ε = 0. There is a panel for each grid method."""
    plan = session.config("atlas_undisturbed").plan()
    fig, axes = style.new(1, len(METHODS), height=3.8, sharey=True)
    failed = [failures_by_zeros(plan, method)[1] for method in METHODS]
    for k, (ax, method, failures) in enumerate(zip(axes[0], METHODS, failed, strict=True)):
        for name, meaning in ZEROS.items():
            points = sorted({(f.A, f.dtau) for f in failures if f.zeros == name})
            count = sum(f.zeros == name for found in failed for f in found)
            A, dtau = zip(*points, strict=True) if points else ((), ())
            ax.plot(A, dtau, ls="none", label=f"{meaning} ({count} switches)", **MARKS[name])
        ax.set_yscale("log")
        ax.set_xlim(plan.axes["A"][0] - 0.05, plan.axes["A"][-1] + 0.05)
        ax.set_ylim(plan.axes["dtau"][0], 1.2 * plan.axes["dtau"][-1])
        style.name_axes(ax, "A", None if k else "dtau")
        style.letter(ax, k, method)
    first = plan.settings.transient + 1
    said = conditions(plan.scalars, ("A", "dtau"), section=False)
    style.note(axes[0, -1], [*said, f"periods {first}–{first + JUDGED - 1}"])
    style.explain(fig)
    return fig


def _axis_values(session: Session, name: str) -> list[str]:
    """Return a title for each point of a configuration, with the values of the axes."""
    plan = session.config(name).plan()
    index: Iterator[tuple[int, ...]] = np.ndindex(plan.shape)
    return [", ".join(style.equation(n, plan.axes[n][i]) for n, i in zip(plan.axes, at, strict=True)) for at in index]


class Drawing(NamedTuple):
    title: str
    draw: Callable[[Session], Figure]


FIGURES = {
    "fig01": Drawing("mass, vibrating incline and obstacle", lambda session: drawing()),
    "fig02": Drawing("scheme of states", fig02),
    "fig03": Drawing("bifurcation diagram, undisturbed", _diagram("fig03")),
    "fig04": Drawing("non-unique solutions", fig04),
    "fig05": Drawing("non-bifurcated solution, physical disturbance", _phase_curves("fig05")),
    "fig06": Drawing("Poincaré sections, physical disturbance", _sections("fig06")),
    "fig07": Drawing("bifurcation diagrams, undisturbed and disturbed", _diagram("fig07")),
    "fig08": Drawing("non-bifurcated solution, constant step", _phase_curves("fig08")),
    "fig09": Drawing("Poincaré sections, constant step", _sections("fig09")),
    "fig10": Drawing("bifurcation diagram, constant step", _diagram("fig10")),
    "fig11": Drawing("phase curves, exact and with a constant step", fig11),
    "fig12": Drawing("basic and transient motions", fig12),
    "coexisting": Drawing("solutions reached from different starts", coexisting),
    "zeros": Drawing("zeros in the steps at which a switch fails", zeros),
    "grid": Drawing("periods after which a grid closes and its motion returns", grid),
}
"""Drawings of `vibrodrive paper`: the figures of the paper, and three that explain Fig. 4, Fig. 12 and §5."""
