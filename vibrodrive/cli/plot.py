"""`vibrodrive plot`: figures of result files."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from vibrodrive.cli.common import FILE, in_one_line, say, working
from vibrodrive.errors import ConfigError
from vibrodrive.model import drawing
from vibrodrive.model.parameters import bad
from vibrodrive.model.quantities import KEPT
from vibrodrive.store.place import check_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vibrodrive.model.plan import Plan


@click.command()
@click.argument("files", metavar="FILE...", type=FILE, nargs=-1, required=True)
@click.option("-o", "--output", type=FILE, help="Figure: .png, .pdf or .svg (default: FILE with .png).")
@click.option(
    "--kind", type=click.Choice(drawing.FIGURE_KINDS), help="Kind of diagram (default: depends on the contents)."
)
@click.option(
    "--quantity",
    metavar="NAME",
    help="Quantity to draw (default: depends on the contents). "
    "Section: dxi or xi. Main impacts: impact_phase or impact_speed. "
    "Map: " + ", ".join(drawing.MAP_QUANTITIES) + " (the page of maps explains them), or a number of a "
    "function of your own.",
)
@click.option(
    "--over",
    type=FILE,
    multiple=True,
    help="Also draw on a map the limits of a result file, or the bifurcations of a table of `orbits` (.csv); "
    "may be repeated.",
)
@click.option(
    "--units", type=click.Choice(drawing.FIGURE_UNITS), help="Units of the quantities of a scene (default: SI)."
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
    files: tuple[Path, ...], output: Path | None, over: tuple[Path, ...], dpi: int | None, **chosen: str | None
) -> None:
    """Draw a result file, finished or not.

    Several files are drawn together if they contain limits over the same axis, for example in ε and in Δτ. Options that
    are not given are taken from [figure] of the configuration in FILE.

    Output: the figure. Damaged blocks are left out and named on stderr; the exit code is then 1.
    """
    options = {name: value for name, value in chosen.items() if value is not None}
    look: dict[str, Any] = {name: options.pop(name) for name in ("style", "width") if name in options}
    target = output or files[0].with_suffix(".png")
    sources = {f"result file {i}" if i else "result file": file for i, file in enumerate(dict.fromkeys(files))}
    check_figure(target, sources | {f"--over[{i}]": one for i, one in enumerate(dict.fromkeys(over))})
    draw(files, target, options, look, dpi, over)


def draw(
    files: tuple[Path, ...],
    target: Path,
    options: dict[str, Any],
    look: dict[str, Any] | None = None,
    dpi: int | None = None,
    over: tuple[Path, ...] = (),
) -> None:
    """Draw result files and, over a map, the files `over`.

    Damaged blocks are left out and named in messages; the exit code is then 1.
    """
    from vibrodrive.figures.style import save

    damaged: list[str] = []
    configured, own = configured_in(files[0])
    look = own | (look or {})
    with left_out(damaged):
        several = len(files) > 1
        figure, share = (
            _several(files, options, over, look) if several else _figure(files[0], configured, options, over, look)
        )
    save(figure, target, dpi)
    if share < 1:
        say(f"{files[0]}: {100 * share:.1f} % computed")
    say(f"{target} drawn")
    for what in damaged:
        say(what)
    if damaged:
        raise click.exceptions.Exit(1)


def configured_in(file: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return [figure] of the configuration in a file, and its style and width."""
    from vibrodrive.store.header import origin_of, reading

    try:
        with reading(file) as opened:
            settings = origin_of(opened).parsed()
    except ConfigError:  # the configuration was written by another version, or contains a function
        return {}, {}
    return settings.figure, settings.look


@contextmanager
def left_out(damaged: list[str]) -> Iterator[None]:
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


def _figure(
    file: Path, configured: dict[str, Any], options: dict[str, Any], over: tuple[Path, ...], look: dict[str, Any]
) -> tuple[Figure, float]:
    """Return (figure of a file and of the files `over`, computed share)."""
    from vibrodrive.figures import diagrams as figures
    from vibrodrive.figures.plane import read_lines
    from vibrodrive.jobs.maps import undisturbed_gaps
    from vibrodrive.store.load import load

    results = load(file)
    wanted = check_drawing(configured, results.plan, options)
    with in_one_line("--"):
        others: dict[str, Any] = {"over": read_lines(over)}
    if wanted.pop("units", drawing.SI) == drawing.DIMENSIONLESS:
        results = results.dimensionless()
    if wanted.get("quantity") == KEPT.name:
        with working(file.name):
            others["undisturbed"] = undisturbed_gaps(results)
    with in_one_line():
        return figures.from_results(results, **wanted, **others, **look), results.computed


def _several(
    files: tuple[Path, ...], options: dict[str, Any], over: tuple[Path, ...], look: dict[str, Any]
) -> tuple[Figure, float]:
    """Return (figure of several files of limits, least computed share)."""
    from vibrodrive.figures.limits import check_limits, limits_figure
    from vibrodrive.store.load import load

    for name, value in {**options, **({"over": str(over[0])} if over else {})}.items():
        raise click.ClickException(bad(f"--{name}", value, "left out for several files, which must contain limits"))
    results = [load(file) for file in files]
    for file, one in zip(files, results, strict=True):
        try:
            check_limits(one, results[0])
        except ValueError as error:
            raise click.ClickException(f"{file}: {error}") from None
    with in_one_line():
        return limits_figure(results, **look), min(one.computed for one in results)


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
        drawing.choose_drawing(plan, **{key: value for key, value in wanted.items() if key != "units"})
    except ValueError as error:
        key = str(error).partition(" ")[0]
        place = "--" if key in options else "figure." if key in configured else ""
        raise click.ClickException(f"{place}{error}") from None
    return wanted
