"""`vibrodrive limits`: how large a disturbance the motion stands, over A."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from vibrodrive.cli_common import FILE, SET, THREADS, announce_compilation, check_output, read, refusals, save, say


@click.command()
@click.argument("config", type=FILE)
@click.option("-o", "--output", type=FILE, help="Result file (default CONFIG with the ending .h5, here).")
@SET
@THREADS
@click.option("--overwrite", is_flag=True, help="Replace the result file instead of going on with it.")
def limits(config: Path, output: Path | None, overrides: tuple[str, ...], threads: int | None, overwrite: bool) -> None:
    """Find the limits of practically orbital stability over A, in ε and in Δτ, and draw them.

    The figure stands beside the result file. A file that is there is gone on with.
    """
    from vibrodrive.progress import Show

    settings = read(config, overrides, None)
    path = output or Path(config.stem + ".h5")
    picture = check_output(path)
    from vibrodrive.limits_figure import limits_figure
    from vibrodrive.limits_store import load_limits, run_limits

    announce_compilation()
    show = Show(sys.stderr, path.name)

    def progress(known: int, total: int) -> None:
        show.update(lambda: f"{known} of {total} limits")

    with refusals():
        run_limits(settings, path, progress, **settings.limits, threads=threads, overwrite=overwrite)
    show.clear()
    found = load_limits(path)
    save(limits_figure(found), picture)
    say(f"{path} holds {found.done.sum()} limits; {picture} drawn")
