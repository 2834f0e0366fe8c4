"""`vibrodrive plot` and `vibrodrive trajectory`: figures."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vibrodrive.cli.common import FILE, METHOD, SET, judge_idle, judge_slip, read, refuse_axes, say, working
from vibrodrive.model.drawing import (
    BIFURCATION,
    DIAGRAM_QUANTITIES,
    FIGURE_KINDS,
    K2,
    KEPT,
    MAP,
    MAP_QUANTITIES,
    STYLES,
    WIDTHS,
    choose_drawing,
    merge_wishes,
)
from vibrodrive.store.place import check_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vibrodrive.model.config import Config
    from vibrodrive.model.physical import Scene
    from vibrodrive.model.plan import Plan


def _looking(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of how a figure looks, as one argument `look` that has what is given."""

    @click.option("--style", type=click.Choice(STYLES), help="Colours for a screen (default), or black ink for print.")
    @click.option("--width", type=click.Choice(WIDTHS), help="Columns of a page the figure is for (default double).")
    @wraps(command)
    def looking(*args: Any, style: str | None, width: str | None, **options: Any) -> Any:
        given = {"style": style, "width": width}
        return command(*args, look={k: v for k, v in given.items() if v is not None}, **options)

    return looking


@click.command()
@click.argument("file", type=FILE)
@click.option("-o", "--output", type=FILE, help="Figure: .png, .pdf or .svg (default FILE with .png).")
@click.option("--kind", type=click.Choice([*FIGURE_KINDS, "multipliers"]), help="Which diagram.")
@click.option(
    "--quantity",
    metavar="NAME",
    type=click.Choice([*DIAGRAM_QUANTITIES, *MAP_QUANTITIES, K2]),
    help="Of the section: dxi or xi; of main impacts: impact_phase or impact_speed. Of a map: "
    + ", ".join(MAP_QUANTITIES)
    + f"; of limits over two axes: {K2}.",
)
@click.option(
    "--over", type=FILE, multiple=True, help="Draw limits, or bifurcations over A and B, from their file over a map."
)
@_looking
@click.option("--dpi", type=click.IntRange(20, 2400), help="Pixels per inch (default 250).")
def plot(
    file: Path,
    output: Path | None,
    kind: str | None,
    quantity: str | None,
    over: tuple[Path, ...],
    look: dict[str, str],
    dpi: int | None,
) -> None:
    """Draw what a result file holds, finished or not: a sweep, limits, a failure map, orbits or curves.

    What is not given is as [figure] of the configuration in the file says.
    """
    options = {k: v for k, v in {"kind": kind, "quantity": quantity}.items() if v is not None}
    target = output or file.with_suffix(".png")
    check_figure(target, {"result file": file, **{f"file {one} of --over": one for one in over}})
    draw(file, target, options, look, dpi, over)


def draw(
    file: Path,
    target: Path,
    options: dict[str, Any],
    look: dict[str, Any] | None = None,
    dpi: int | None = None,
    over: tuple[Path, ...] = (),
) -> None:
    """Draw a file, and what lies over it. What is damaged is left out and named, with exit code 1."""
    from vibrodrive.figures.style import drawn_as, save
    from vibrodrive.store.header import read_kind

    holds = read_kind(file)
    _refuse_options(file, holds, options)
    if over and holds != "sweep":
        from vibrodrive.model.parameters import bad

        raise click.ClickException(bad("--over", str(over[0]), f"left out: {file} holds no sweep"))
    damaged: list[str] = []
    with drawn_as(**(_look(file) | (look or {}))):
        figure, share = _figure(file, holds, options, over, damaged)
    save(figure, target, dpi)
    if share < 1:
        say(f"{file}: {100 * share:.1f} % computed")
    say(f"{target} drawn")
    for what in damaged:
        say(what)
    if damaged:
        raise click.exceptions.Exit(1)


def _look(file: Path) -> dict[str, Any]:
    """How the configuration in a file wants it drawn."""
    from vibrodrive.errors import ConfigError
    from vibrodrive.model import config
    from vibrodrive.store.header import origin_of, reading

    try:
        with reading(file) as opened:
            origin = origin_of(opened)
        return config.parse(origin.config, origin.overrides).look
    except ConfigError:  # of another version
        return {}


def _figure(
    file: Path, holds: str, options: dict[str, Any], over: tuple[Path, ...], damaged: list[str]
) -> tuple[Figure, float]:
    """The figure of a file, with what lies over it, and the share that is computed; `damaged` is added to."""
    if holds == "sweep":
        with _left_out(damaged):
            figure, share = _sweep(file, options, over)
    else:
        from vibrodrive.store.every_kind import load

        found: Any = load(file)
        share = getattr(found, "computed", 1.0)
        with working(file.name), _in_one_line():
            figure = found.plot(**({"kind": MAP} if holds == "limits" and options else options))
    return figure, share


@contextmanager
def _in_one_line() -> Iterator[None]:
    """What cannot be drawn as it is asked for is said in a line; files that cannot be read have their own."""
    from vibrodrive.errors import NoResult

    try:
        yield
    except NoResult:
        raise
    except ValueError as error:
        raise click.ClickException(str(error)) from None


@contextmanager
def _left_out(damaged: list[str]) -> Iterator[None]:
    """Collect what is said about damaged blocks, and let other warnings pass."""
    from vibrodrive.store.reader import DamagedBlock

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DamagedBlock)
        yield
    for w in caught:
        if issubclass(w.category, DamagedBlock):
            damaged.append(str(w.message))
        else:
            warnings.warn_explicit(w.message, w.category, w.filename, w.lineno)


def _sweep(file: Path, options: dict[str, Any], over: tuple[Path, ...]) -> tuple[Figure, float]:
    from vibrodrive.figures import diagrams as figures
    from vibrodrive.jobs.maps import read_overlays, undisturbed_gaps
    from vibrodrive.model import config
    from vibrodrive.store.every_kind import load
    from vibrodrive.store.reader import look

    report = look(file)
    origin = report.header.origin
    figure = config.parse(origin.config, origin.overrides).figure
    wanted = merge_wishes({k: v for k, v in figure.items() if k not in ("style", "width")}, options)
    check_drawing(wanted, report.header.plan, asked="kind" in options)
    results, drawn_over = load(file), read_overlays(over)
    if wanted.get("quantity") == KEPT:
        with working(file.name):
            drawn_over["undisturbed"] = undisturbed_gaps(results)
    with _in_one_line():
        return figures.from_results(results, **wanted, **drawn_over), report.share


def check_drawing(wanted: dict[str, Any], plan: Plan, asked: bool = False) -> None:
    """Refuse a diagram that a sweep does not have the axes or the record for.

    A sweep of one motion, whose configuration was made for an axis, has its section drawn, unless a diagram was
    `asked` for now.
    """
    from vibrodrive.model.parameters import bad

    for key in ("x", "y"):
        known = [*plan.axes, *plan.together]
        if plan.axes and wanted.get(key) not in (None, *known):
            raise click.ClickException(bad(f"figure.{key}", wanted[key], "one of the axes " + ", ".join(known)))
    if not plan.axes and wanted.get("kind") == BIFURCATION:
        if asked:
            raise click.ClickException(bad("--kind", BIFURCATION, "poincare for one motion: it has no axis"))
        return
    try:
        choose_drawing(plan, wanted.get("kind"), wanted.get("quantity"))
    except ValueError as error:
        raise click.ClickException(str(error)) from None


def _refuse_options(file: Path, holds: str, options: dict[str, Any]) -> None:
    """Refuse a kind of file that is not drawn, and an option that means nothing for this one."""
    from vibrodrive.model.kinds import FILES
    from vibrodrive.model.parameters import bad

    kind = FILES[holds]
    if kind.options is None:
        raise click.ClickException(f"{file}: holds {kind.holds}: `vibrodrive {kind.command}` draws them")
    for name, value in options.items():
        known = kind.options.get(name, ())
        if value not in known:
            allowed = f"one of {', '.join(known)}" if known else "left out"
            raise click.ClickException(bad(f"--{name}", value, f"{allowed}: {file} holds {kind.holds}"))


def _scene(settings: Config) -> Scene | None:
    """The scene of the one motion of a configuration, if it has any."""
    from vibrodrive.model.names import SCENE
    from vibrodrive.model.physical import Scene

    plan = settings.plan()
    known = plan.scalars | {name: float(values[0]) for name, values in plan.axes.items()}
    if settings.physical is not None or "omega0" not in known:
        return settings.physical
    return Scene.quiet(**{name: known[name] for name in SCENE if name in known})


@click.command()
@click.argument("config", type=FILE)
@click.option("-o", "--output", type=FILE, help="Figure: .png, .pdf or .svg (default CONFIG_trajectory.png, here).")
@SET
@METHOD
def trajectory(config: Path, output: Path | None, overrides: tuple[str, ...], method: str | None) -> None:
    """Follow one motion, describe it, and draw its phase curve and its course in time."""

    settings = read(config, overrides, method)
    drawn = dict(settings.trajectory)
    plan = settings.plan()
    judge_idle(settings)
    judge_slip(settings)
    refuse_axes(plan)
    arguments = plan.arguments(0)
    told = "periods" in drawn
    if told:
        arguments["periods"] = drawn.pop("periods")
    target = output or Path(config.stem + "_trajectory.png")  # CONFIG.png is the diagram of a sweep
    check_figure(target, {"configuration": config})
    from vibrodrive import simulate
    from vibrodrive.figures import diagrams as figures
    from vibrodrive.figures.curves import FIRST
    from vibrodrive.figures.style import save

    with working(config.stem):
        motion = simulate(**arguments)
        shown = None if told else FIRST
        figure = figures.trajectory_figure(motion, **drawn, shown=shown, **settings.look)
        words = motion.describe(_scene(settings))
    save(figure, target)
    click.echo(words)
    say(f"{target} drawn: {len(motion.switches)} switches")
