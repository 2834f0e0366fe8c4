"""`vibrodrive trajectory`: compute, describe, draw and write one motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from vibrodrive.cli import common
from vibrodrive.cli.common import FILE, SET, judge_slip, read, refuse_axes, say, working
from vibrodrive.model.figure import DIMENSIONLESS


@click.command()
@click.argument("config", type=FILE)
@common.OUTPUTS
@SET
def trajectory(config: Path, outputs: tuple[Path, ...], overrides: tuple[str, ...]) -> None:
    """Compute one motion, describe it and draw it.

    CONFIG has one value for each parameter; --set A=3.04 replaces the axis A by one value. [trajectory] selects the
    curves and periods of the figure.

    Output: on stdout the status, the margin (smallest distance of a decision from the opposite decision), the period,
    the impacts and the cycle of states; the figure, by default with the phase curve ξ'(ξ) and the gap ξ(τ); and, with
    -o FILE.csv, a table of the switches. With [physical] all are in SI units, which the columns of the table have in
    their names, and a further table shows how often and how hard the machine strikes, and what 1 % of each parameter
    changes.
    """
    settings = read(config, overrides)
    drawn = dict(settings.trajectory)
    plan = settings.plan()
    judge_slip(settings)
    refuse_axes(plan)
    has_periods = "periods" in drawn
    plan = replace(plan.single(0), settings=replace(plan.settings, periods=drawn.pop("periods", plan.settings.periods)))
    # CONFIG.png is the diagram of a sweep
    table, picture = common.targets(outputs, Path(config.stem + "_trajectory.png"), config)
    from vibrodrive.batch.trajectory import follow
    from vibrodrive.figures.curves import FIRST, trajectory_figure
    from vibrodrive.figures.style import save
    from vibrodrive.model.described import counted
    from vibrodrive.store.tables import rows_of, write_table

    with working(config.stem):
        motion = follow(plan)
        if settings.figure.get("units") == DIMENSIONLESS:
            motion = motion.dimensionless()
        shown = None if has_periods else FIRST
        figure = trajectory_figure(motion, **drawn, shown=shown, **settings.look) if picture else None
        words = motion.describe()
    click.echo(words)
    if table:
        columns = motion.columns("switches")
        write_table(table, columns, rows_of(columns))
        say(f"{table} written: {counted(len(motion.switches), 'switch', 'es')}")
    if picture and figure:
        save(figure, picture)
        say(f"{picture} drawn: {counted(len(motion.switches), 'switch', 'es')}")
