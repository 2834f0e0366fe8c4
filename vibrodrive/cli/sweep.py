"""`vibrodrive sweep`: compute a result file from a configuration."""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vibrodrive.cli import common
from vibrodrive.cli.common import FILE, SET
from vibrodrive.cli.plot import draw
from vibrodrive.figures.drawing import choose_configured
from vibrodrive.model.choices import Method, used_by
from vibrodrive.store.place import check_output

if TYPE_CHECKING:
    from vibrodrive.model.plan import Plan


class _Command(click.Command):
    """Command that allows `--plot` without a value before CONFIG; click would use CONFIG as the value of `--plot`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        words = pairwise([*args, ""])
        alone = [w == "--plot" and (after[:1] in ("", "-") or after.endswith(".toml")) for w, after in words]
        return super().parse_args(ctx, ["--plot=" if a else w for w, a in zip(args, alone, strict=True)])


def _figure(ctx: click.Context, option: click.Parameter, value: str | None) -> Path | None:
    """Return the path of the figure, or None without `--plot`.

    For `--plot` without a value the result is Path(), which means a figure next to the result file.
    """
    return FILE.convert(value, option, ctx) if value else None if value is None else Path()


@click.command(cls=_Command)
@click.argument("config", type=FILE)
@click.option("-o", "--output", type=FILE, help="Result file (default: name of CONFIG with .h5, in this directory).")
@SET
@click.option(
    "--method",
    type=click.Choice([method.name.lower() for method in reversed(Method)]),
    help=f"Method that finds the switches (default: the method of CONFIG, or certified); {used_by('dtau')} need dtau.",
)
@click.option("--threads", type=click.IntRange(min=1), help="Number of threads (default: all cores).")
@click.option(
    "--dask",
    metavar="ADDRESS",
    help="Compute on the Dask cluster of this scheduler (tcp://host:8786); needs the extra `dask`.",
)
@click.option(
    "--plot",
    "picture",
    metavar="[FIGURE]",
    callback=_figure,
    help="Also draw the complete result: .png, .pdf or .svg (default: name of the result file with .png).",
)
@click.option("--dry-run", is_flag=True, help="Estimate file size, memory and time; compute no result.")
@click.option("--overwrite", is_flag=True, help="Replace an existing result file; do not use its contents.")
def sweep(
    config: Path,
    output: Path | None,
    overrides: tuple[str, ...],
    method: str | None,
    threads: int | None,
    dask: str | None,
    picture: Path | None,
    dry_run: bool,
    overwrite: bool,
) -> None:
    """Compute the sweep of CONFIG and write a result file.

    A sweep computes one motion for each combination of the values of the axes in CONFIG, or several motions for the
    records limit and failures.

    An existing file of the same configuration is resumed. A file of another configuration is refused. Ctrl-C stops the
    sweep, and the same command resumes it.

    Output: the result file (HDF5), and with --plot a figure. On stderr: the progress, and the number of points with
    each status other than OK, with advice.
    """
    from vibrodrive.jobs.progress import Show
    from vibrodrive.model.size import refuse_large_block

    settings = common.read(config, (*overrides, f"switching.method={method}") if method else overrides)
    plan = settings.plan()
    common.judge_slip(settings)
    path = output or Path(config.stem + ".h5")
    if picture == Path():
        picture = path.with_suffix(".png")
    check_output(path, config, overwrite=overwrite, figures=[picture] if picture else [])
    if picture:
        with common.in_one_line():
            choose_configured(plan, settings.figure, {})
    refuse_large_block(plan, remote=dask is not None)
    if threads and not dask:
        from vibrodrive.batch.sweep import check_threads

        with common.in_one_line("--"):
            check_threads(threads)
    if dry_run:
        _dry_run(plan, path, threads, remote=dask is not None)
        return
    from vibrodrive.jobs.signals import Interrupted, raising
    from vibrodrive.jobs.sweep import Job, run
    from vibrodrive.store.layout import Origin

    try:
        with raising():
            run(Job(plan, Origin.of(settings), path, threads, dask, overwrite), Show(sys.stderr, path.name), after=0.0)
    except Interrupted as stopped:
        common.leave(130, f"{stopped}; resume with: {common.same_command()}")
    _print_statuses(path)
    if picture:
        draw((path,), picture, {})


def _dry_run(plan: Plan, path: Path, threads: int | None, remote: bool) -> None:
    from vibrodrive.jobs.estimate import estimate
    from vibrodrive.jobs.progress import duration
    from vibrodrive.model.size import file_bytes, human, refuse_large_file, working_bytes

    periods = plan.settings.transient + plan.settings.periods
    click.echo(f"points   {plan.n_points}")
    click.echo(f"periods  {plan.n_points * periods:.3g} ({periods} a point, {plan.settings.periods} recorded)")
    click.echo(f"file     {human(file_bytes(plan))}")
    click.echo(f"memory   {human(working_bytes(plan, remote))}, and that of the program itself")
    refuse_large_file(plan, path)
    if plan.per_point:
        why = "each point needs a search with several motions" if plan.seeks else "the points are computed one by one"
        click.echo(f"time     unknown, because {why} for the record {', '.join(plan.record)}")
        return
    with common.working(path.name):
        computing, least, most, loading = map(duration, estimate(plan, threads))
    click.echo(f"time     about {computing} ({least} to {most}) on idle cores, plus {loading} to load the kernels")


def _print_statuses(path: Path) -> None:
    """Print the number of points of each status other than OK, with advice."""
    from vibrodrive.model.choices import Status
    from vibrodrive.store.reader import look

    for name, points in look(path).statuses.items():
        if name != Status.OK.name:
            advice = Status[name].advice if name in Status.__members__ else "unknown"
            common.say(f"points with the status {name}: {points}; {advice}")
