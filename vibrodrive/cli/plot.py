"""`vibrodrive plot` and `vibrodrive trajectory`: figures."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vibrodrive.cli.common import FILE, METHOD, SET, judge_idle, judge_slip, read, refuse_axes, say, scene_of, working
from vibrodrive.errors import ConfigError, NoResult
from vibrodrive.model import drawing
from vibrodrive.model.kinds import FILES
from vibrodrive.model.parameters import bad
from vibrodrive.store.place import check_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vibrodrive.model.plan import Plan


@click.command()
@click.argument("file", type=FILE)
@click.option("-o", "--output", type=FILE, help="Figure: .png, .pdf or .svg (default: FILE with .png).")
@click.option(
    "--kind",
    type=click.Choice([*drawing.FIGURE_KINDS, "multipliers"]),
    help="Kind of diagram (default: depends on the contents).",
)
@click.option(
    "--quantity",
    metavar="NAME",
    type=click.Choice([*drawing.DIAGRAM_QUANTITIES, *drawing.MAP_QUANTITIES, drawing.K2]),
    help="Quantity to draw (default: depends on the contents). "
    "Section: dxi or xi. Main impacts: impact_phase or impact_speed. "
    "Map: " + ", ".join(drawing.MAP_QUANTITIES) + " (explained on the page Maps of the documentation). "
    f"Limits over two axes: {drawing.K2}.",
)
@click.option(
    "--over",
    type=FILE,
    multiple=True,
    help="Also draw the limits, or the bifurcations over A and B, of this file on a map; repeatable.",
)
@click.option(
    "--style", type=click.Choice(drawing.STYLES), help="screen: colours (default); print: black ink for a journal."
)
@click.option(
    "--width",
    type=click.Choice(drawing.WIDTHS),
    help="double: 174 mm, two columns (default); single: 84 mm, one column.",
)
@click.option("--dpi", type=click.IntRange(20, 2400), help="Resolution in pixels per inch (default 250).")
def plot(
    file: Path,
    output: Path | None,
    kind: str | None,
    quantity: str | None,
    over: tuple[Path, ...],
    style: str | None,
    width: str | None,
    dpi: int | None,
) -> None:
    """Draw a result file of any kind, finished or not.

    FILE contains a sweep, limits, failures, orbits or curves of bifurcations. Options that are not given are taken from
    [figure] of the configuration in FILE.

    Output: the figure. Damaged blocks are left out and named on stderr; the exit code is then 1.
    """
    options = {k: v for k, v in {"kind": kind, "quantity": quantity}.items() if v is not None}
    look = {k: v for k, v in {"style": style, "width": width}.items() if v is not None}
    target = output or file.with_suffix(".png")
    check_figure(target, {"result file": file, **{f"--over[{i}]": one for i, one in enumerate(dict.fromkeys(over))}})
    draw(file, target, options, look, dpi, over)


def draw(
    file: Path,
    target: Path,
    options: dict[str, Any],
    look: dict[str, Any] | None = None,
    dpi: int | None = None,
    over: tuple[Path, ...] = (),
) -> None:
    """Draw a file and, over it, the files `over`.

    Damaged blocks are left out and named in messages; the exit code is then 1.
    """
    from vibrodrive.figures.style import drawn_as, save
    from vibrodrive.store.header import read_kind

    holds = read_kind(file)
    _refuse_options(file, holds, options)
    if over and holds != "sweep":
        raise click.ClickException(bad("--over", str(over[0]), f"left out, because {file} contains no sweep"))
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
    """Return the style and the width that are given by the configuration in a file."""
    from vibrodrive.store.header import origin_of, reading

    try:
        with reading(file) as opened:
            return origin_of(opened).parsed().look
    except ConfigError:  # the configuration was written by another version
        return {}


def _figure(
    file: Path, holds: str, options: dict[str, Any], over: tuple[Path, ...], damaged: list[str]
) -> tuple[Figure, float]:
    """Return (figure of a file and of the files `over`, computed share). Append messages to `damaged`."""
    from vibrodrive.store.every_kind import load

    if holds == "sweep":
        with _left_out(damaged):
            return _sweep(file, options, over)
    found: Any = load(file)
    with working(file.name), _in_one_line():
        return found.plot(**({"kind": drawing.MAP} if holds == "limits" and options else options)), found.computed


@contextmanager
def _in_one_line() -> Iterator[None]:
    """Turn the error of an option that does not apply into one line. Errors of unreadable files are not changed."""
    try:
        yield
    except NoResult:
        raise
    except ValueError as error:
        raise click.ClickException(str(error)) from None


@contextmanager
def _left_out(damaged: list[str]) -> Iterator[None]:
    """Append the warnings of damaged blocks to `damaged`. Other warnings are issued again."""
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
    from vibrodrive.store.every_kind import load
    from vibrodrive.store.reader import look

    report = look(file)
    wanted = check_drawing(report.header.origin.parsed().figure, report.header.plan, options)
    results, drawn_over = load(file), read_overlays(over)
    if wanted.get("quantity") == drawing.KEPT:
        with working(file.name):
            drawn_over["undisturbed"] = undisturbed_gaps(results)
    with _in_one_line():
        return figures.from_results(results, **wanted, **drawn_over), report.share


def check_drawing(figure: dict[str, Any], plan: Plan, options: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return the arguments with which a sweep is drawn: [figure] of its configuration, and the options of a command.

    The section of one motion is drawn, whatever the configuration says of axes. Raises an error if a sweep does not
    have the axes or the record that its figure needs, or if an argument has no effect.
    """
    options = options or {}
    configured = {key: value for key, value in figure.items() if plan.axes and key not in ("style", "width")}
    wanted = drawing.merge_options(configured, options)
    for key in ("x", "y"):
        known = [*plan.axes, *plan.together]
        if wanted.get(key) not in (None, *known):
            raise click.ClickException(bad(f"figure.{key}", wanted[key], "one of the axes " + ", ".join(known)))
    try:
        drawing.choose_drawing(plan, **wanted)
    except ValueError as error:
        key = str(error).partition(" ")[0]
        place = "--" if key in options else "figure." if key in configured else ""
        raise click.ClickException(f"{place}{error}") from None
    return wanted


def _refuse_options(file: Path, holds: str, options: dict[str, Any]) -> None:
    """Raise an error for a kind of file that cannot be drawn, and for options that do not apply to a kind."""
    kind = FILES[holds]
    if kind.options is None:
        raise click.ClickException(f"{file}: contains {kind.holds}, which only `vibrodrive {kind.command}` draws")
    for name, value in options.items():
        known = kind.options.get(name, ())
        if value not in known:
            allowed = f"one of {', '.join(known)}" if known else "left out"
            raise click.ClickException(bad(f"--{name}", value, f"{allowed}, because {file} contains {kind.holds}"))


@click.command()
@click.argument("config", type=FILE)
@click.option(
    "-o", "--output", type=FILE, help="Figure: .png, .pdf or .svg (default: CONFIG_trajectory.png, in this directory)."
)
@SET
@METHOD
def trajectory(config: Path, output: Path | None, overrides: tuple[str, ...], method: str | None) -> None:
    """Compute one motion, describe it and draw it.

    CONFIG has one value for each parameter; --set A=3.04 replaces the axis A by one value. [trajectory] selects the
    curves and periods of the figure.

    Output: on stdout the status, the margin (smallest distance of a decision from the opposite decision), the period,
    the impacts and the cycle of states; the figure, by default with the phase curve ξ'(ξ) and the gap ξ(τ).
    """
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
        words = motion.describe(scene_of(settings))
    save(figure, target)
    click.echo(words)
    say(f"{target} drawn: {len(motion.switches)} switches")
