"""`vibrodrive orbits`: list, draw and write the periodic orbits over A and their bifurcations."""

from __future__ import annotations

from pathlib import Path

import click

from vibrodrive.cli import common
from vibrodrive.cli.common import FILE, SET


@click.command()
@click.argument("config", type=FILE)
@common.OUTPUTS
@SET
def orbits(config: Path, outputs: tuple[Path, ...], overrides: tuple[str, ...]) -> None:
    """Find all periodic orbits over A, and their bifurcations.

    With the axis A, or a0, omega0 or frequency of a machine, these are all orbits up to the period `max_period` in
    [orbits] (default 3), stable or not, and the bifurcations at which they appear, change or disappear. With a second
    axis, B, mu or alpha, these are the bifurcations at each B, and `vibrodrive plot --over` draws their table over a
    map.

    Output: the bifurcations on stdout; the figure, which is the bifurcation diagram or the plane of both axes; and,
    with -o FILE.csv, a table of all orbits and bifurcations. With [physical] speeds are in m/s.
    """
    settings = common.read(config, overrides)
    common.judge_slip(settings, always=True)
    table, picture = common.targets(outputs, Path(config.stem + ".png"), config)
    from vibrodrive.figures.style import save
    from vibrodrive.jobs.orbits import check, columns, drawn, find, printed, rows
    from vibrodrive.store.tables import write_table

    with common.working(config.stem):
        result = find(*check(settings))
        figure = drawn(result, **settings.look) if picture else None
    click.echo(printed(result))
    if table:
        write_table(table, columns(result), rows(result))
        common.say(f"{table} written")
    if figure and picture:
        save(figure, picture)
        common.say(f"{picture} drawn")
