"""`vibrodrive plot`: figures of result files."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from vibrodrive.cli.common import FILE, in_one_line, say
from vibrodrive.errors import ConfigError
from vibrodrive.figures.drawing import choose_configured
from vibrodrive.model.figure import BANDS, FIGURE_KINDS, FIGURE_UNITS, LOOK, MAP_QUANTITIES, STYLES, WIDTHS
from vibrodrive.model.parameters import bad
from vibrodrive.store.place import check_figure


@click.command()
@click.argument("files", metavar="FILE...", type=FILE, nargs=-1, required=True)
@click.option("-o", "--output", type=FILE, help="Figure: .png, .pdf or .svg (default: FILE with .png).")
@click.option("--kind", type=click.Choice(FIGURE_KINDS), help="Kind of diagram (default: depends on the contents).")
@click.option(
    "--quantity",
    metavar="NAME",
    help="Quantity to draw (default: depends on the contents). "
    "Section: dxi or xi. Main impacts: impact_phase or impact_speed. "
    "Map: " + ", ".join(MAP_QUANTITIES) + " (the page of maps explains them), or a number of a "
    "function of your own.",
)
@click.option(
    "--over",
    type=FILE,
    multiple=True,
    help="Also draw on a map the limits of a result file, or the bifurcations of a table of `orbits` (.csv); "
    "may be repeated.",
)
@click.option("--units", type=click.Choice(FIGURE_UNITS), help="Units of the quantities of a scene (default: SI).")
@click.option("--style", type=click.Choice(STYLES), help="screen: colours (default); print: black ink for a journal.")
@click.option(
    "--width",
    type=click.Choice(WIDTHS),
    help="double: 174 mm, two columns (default); single: 84 mm, one column.",
)
@click.option("--cmap", metavar="NAME", help="Colour map of Matplotlib for a map or a diagram, such as magma.")
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
    target = output or files[0].with_suffix(".png")
    sources = {f"result file {i}" if i else "result file": file for i, file in enumerate(dict.fromkeys(files))}
    check_figure(target, sources | {f"--over[{i}]": file for i, file in enumerate(dict.fromkeys(over))})
    draw(files, target, options, dpi, over)


def draw(
    files: tuple[Path, ...],
    target: Path,
    options: dict[str, Any],
    dpi: int | None = None,
    over: tuple[Path, ...] = (),
) -> None:
    """Draw result files and the files `over` them. `options` replace keys of [figure] of the first.

    Damaged blocks are left out and named in messages; the exit code is then 1.
    """
    from vibrodrive.figures import diagrams
    from vibrodrive.figures.limits import check_limits
    from vibrodrive.figures.looks import LOOKS
    from vibrodrive.figures.plane import read_lines
    from vibrodrive.figures.sheet import drawn_on
    from vibrodrive.figures.style import save
    from vibrodrive.store.load import load

    damaged: list[str] = []
    with left_out(damaged):
        results, further = load(files[0]), [load(file) for file in files[1:]]
        configured = results._origin.figure
        look = {name: (configured | options).get(name) for name in LOOK}
        options = {name: value for name, value in options.items() if name not in LOOK}
        options |= {"over": ", ".join(map(str, over))} if over else {}
        if further:
            for name, value in options.items():
                raise ConfigError(bad(f"--{name}", value, "left out for several files, which must contain limits"))
            for file, limits in zip(files, [results, *further], strict=True):
                with in_one_line(f"{file}: "):
                    check_limits(limits, results)
            options = {"kind": BANDS}
        cmap = options.get("cmap")
        with in_one_line("--"):
            lines = read_lines(over)
            LOOKS["screen"].with_map(cmap)
        with in_one_line(), drawn_on(**look, cmap=cmap) as sheet:
            shown, results = choose_configured(results, configured, options)
            figure = diagrams.draw(sheet, shown, [results, *further], lines)
        share = min(part.computed for part in (results, *further))
    save(figure, target, dpi)
    if share < 1:
        say(f"{files[0]}: {100 * share:.1f} % computed")
    say(f"{target} drawn")
    for message in damaged:
        say(message)
    if damaged:
        raise click.exceptions.Exit(1)


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
