"""Drawings of the figures of the paper, each from its configuration."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import vibrodrive as vd
from benchmarks.paper.drawing import drawing, scheme
from benchmarks.paper.grids import closing, convergents, returning
from benchmarks.paper.motions import LAGS, Paper, find_phase_slip, without_grid
from vibrodrive.figures import sheet as sheets


def fig02(paper: Paper, sheet: sheets.Sheet) -> Figure:
    """Draw the scheme of Fig. 2. The path of the simplest solution is that of the undisturbed motion of Fig. 5."""
    switches = paper.motions("fig05")[0].switches
    path = zip(switches["before"].tolist(), switches["after"].tolist(), strict=True)
    return scheme(sheet, set(path), "path of the simplest solution")


def _diagram(name: str) -> Callable[[Paper, sheets.Sheet], Figure]:
    return lambda paper, sheet: vd.plot.bifurcation(paper.results(name), quantity="dxi", style=sheet.style)


def _phase_curves(name: str) -> Callable[[Paper, sheets.Sheet], Figure]:
    return lambda paper, sheet: vd.plot.phase_curve(
        paper.motions(name), titles=_axis_values(paper, name), style=sheet.style
    )


def _sections(name: str) -> Callable[[Paper, sheets.Sheet], Figure]:
    return lambda paper, sheet: vd.plot.poincare(
        paper.results(name), reference=paper.undisturbed(name).points, style=sheet.style
    )


def fig04(paper: Paper, sheet: sheets.Sheet) -> Figure:
    fig, axes = sheet.new(height=2.8)
    motions = paper.motions("fig04")
    for motion, title, (colour, dashes) in zip(motions, _axis_values(paper, "fig04"), sheet.look.lines, strict=False):
        sample = motion.sample(400)
        axes[0, 0].plot(sample.tau, sample.dxi, color=colour, ls=dashes, label=title)
    _over_time(sheet, axes[0, 0], sample.tau[0], sample.tau[-1], "dxi")
    sheet.note(axes[0, 0], _said(motions[0].arguments, "A", "B", "eps", "tau0"))
    return fig


def fig11(paper: Paper, sheet: sheets.Sheet) -> Figure:
    disturbed = paper.motions("fig11")[0]
    exact = vd.simulate(**without_grid(paper.points("fig11")[0]))
    titles = ["exact", sheets.equation("dtau", disturbed.arguments["dtau"])]
    return vd.plot.phase_curve([exact, disturbed], titles=titles, style=sheet.style)


def fig12(paper: Paper, sheet: sheets.Sheet) -> Figure:
    motion = paper.motions("fig12")[0]
    slip = find_phase_slip(motion, paper.undisturbed("fig12"))
    drawn = motion.sample(400)
    fig, axes = sheet.new(2, 1, height=5.6, height_ratios=[1.5, 1.0])
    phase, time = axes[:, 0]
    marks = ((slip.before, "D", "basic motion before"), (slip.after, (6, 2, 0), "basic motion after"))
    for (start, stop), mark, name in marks:
        part = (drawn.tau >= start) & (drawn.tau <= stop)
        shown = np.flatnonzero(part)[::12]
        phase.plot(drawn.xi[shown], drawn.dxi[shown], ls="none", marker=mark, ms=3.6, mfc="none", mew=0.5, label=name)
        time.plot(drawn.tau[part], drawn.xi[part], color=sheet.look.main)
    part = (drawn.tau >= slip.during[0]) & (drawn.tau <= slip.during[1])
    phase.plot(drawn.xi[part], drawn.dxi[part], color=sheet.look.other, lw=1.1, label="transient motion (b: dashed)")
    time.plot(drawn.tau[part], drawn.xi[part], "--", color=sheet.look.other, lw=1.1)
    phase.axhline(0.0, color=sheet.look.support, lw=0.4, zorder=0)
    sheet.name(phase, "xi", "dxi")
    _over_time(sheet, time, slip.before[0], slip.after[1], "xi")
    sheet.letter(phase, 0)
    sheet.letter(time, 1)
    sheet.note(phase, _said(motion.arguments, "A", "B", "eps", "dtau"))
    return fig


def coexisting(paper: Paper, sheet: sheets.Sheet) -> Figure:
    """Draw a map of starts. The colour shows ξ at the last section, which differs between the solutions."""
    return vd.plot.map(paper.results("coexisting"), quantity="last_xi", style=sheet.style)


def grid(paper: Paper, sheet: sheets.Sheet) -> Figure:
    """Compare the number of periods after which a motion nearly repeats with that after which the grid nearly closes.

    The grid closes after m periods if m·2π is an integer multiple of Δτ. Panel a) shows over Δτ the number of periods
    up to LAGS after which the motion returns most closely, and the number after which the grid closes most closely.
    Panel b) shows the distances of the motion and of the grid over the number of periods, at the Δτ of Fig. 12.
    """
    results = paper.results("grid")
    steps = results.axes["dtau"]
    fig, axes = sheet.new(2, 1, height=5.8, height_ratios=[1.4, 1.0])
    over, one = axes[:, 0]
    closes = [convergents(step, LAGS)[-1].periods for step in steps]
    returns = [int(returning(section, LAGS).argmin()) + 1 for section in results.section]
    circle = {"mfc": "none", "mec": sheet.look.other, "mew": 0.5}
    over.plot(steps, closes, "o", ms=5, **circle, label="a: $m$ periods are nearly a whole number of steps")
    dot = {"ms": 3.2, "mew": 0, "color": sheet.look.main}
    over.plot(steps, returns, ".", **dot, label="a: the motion nearly repeats after $m$ periods")
    over.set_ylim(0, LAGS + 1)
    over.margins(x=0.01)
    over.set_xlabel(sheets.symbol("dtau"))
    over.set_ylabel("periods $m$")
    sheet.letter(over, 0)
    sheet.note(over, _said(results.scalars, "A", "B", "eps"))

    motion = paper.motions("fig12")[0]
    step = motion.arguments["dtau"]
    m = np.arange(1, LAGS + 1)
    itself, whole = "b: from the motion $m$ periods later", "b: of $m$ periods from a whole number of steps"
    one.semilogy(m, returning(motion.section, LAGS), ".-", lw=0.6, ms=5, mew=0, color=sheet.look.main, label=itself)
    grid = {"lw": 0.5, "ms": 4, "mfc": "white", "mew": 0.5, "color": sheet.look.other}
    one.semilogy(m, closing(step, LAGS), "o--", **grid, label=whole)
    one.set_xlim(0, LAGS + 1)
    one.set_xlabel("periods $m$")
    one.set_ylabel("distance")
    sheet.letter(one, 1, sheets.equation("dtau", step))
    return fig


def _over_time(sheet: sheets.Sheet, ax: Axes, low: float, high: float, quantity: str) -> None:
    """Add sin τ to a curve over τ from `low` to `high`, widened to whole periods, and label its axes."""
    first, last = math.floor(low / math.tau + 1e-9), math.ceil(high / math.tau - 1e-9)
    tau = np.linspace(math.tau * first, math.tau * last, 1000)
    ax.plot(tau, np.sin(tau), color=sheet.look.support, lw=0.7, zorder=0, label=r"$\sin\tau$")
    ax.set_xlim(tau[0], tau[-1])
    counts = range(0, last - first + 1, 1 if last - first < 15 else 2)
    ax.set_xticks([math.tau * (first + k) for k in counts], [str(k) for k in counts])
    ax.set_xlabel(rf"$\tau/2\pi - {first}$")
    sheet.name(ax, None, quantity)


def _said(known: Any, *names: str) -> list[str]:
    """Return equations with the values of parameters."""
    return [sheets.equation(name, known[name]) for name in names]


def _axis_values(paper: Paper, name: str) -> list[str]:
    """Return a title for each point of a configuration, with the values of the axes."""
    axes = paper.plan(name).axes
    return [", ".join(_said(point, *axes)) for point in paper.points(name)]


class Drawing(NamedTuple):
    title: str
    draw: Callable[[Paper, sheets.Sheet], Figure]


FIGURES = {
    "fig01": Drawing("mass, vibrating incline and obstacle", lambda paper, sheet: drawing(sheet)),
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
    "grid": Drawing("periods after which a grid closes and its motion returns", grid),
}
"""The figures of the paper, and two that explain Figs. 4 and 12."""
