"""`vibrodrive atlas`: where the fixed and the Muller path go wrong, and how."""

from __future__ import annotations

from pathlib import Path

import click

from vibrodrive.cli.common import FILE, OVERWRITE, SET, THREADS, judge_slip, read, say, working
from vibrodrive.jobs.output import check_output


@click.command()
@click.argument("config", type=FILE)
@click.option("-o", "--output", type=FILE, help="Result file (default CONFIG with the ending .h5, here).")
@SET
@THREADS
@OVERWRITE
def atlas(config: Path, output: Path | None, overrides: tuple[str, ...], threads: int | None, overwrite: bool) -> None:
    """Map missed, late and wrongly decided switches over A and Δτ, or A and ε, and draw the map.

    The figure is written next to the result file. A file of the same configuration is drawn again. The file is written
    at the end: an interrupted run starts over.
    """
    settings = read(config, overrides, None)
    judge_slip(settings)
    path = output or Path(config.stem + ".h5")
    picture = path.with_suffix(".png")
    check_output(path, config, "failures", overwrite=overwrite, figures=[picture])
    complete = path.exists() and not overwrite
    from vibrodrive.figures.failures import failures_figure
    from vibrodrive.figures.style import save
    from vibrodrive.jobs.failures import run_failures
    from vibrodrive.store.failures import load_failures

    with working(path.name) as show:

        def progress(known: int, total: int) -> None:
            show.update(lambda: f"{known} of {total} motions")

        run_failures(settings, path, progress, threads=threads, overwrite=overwrite)
    save(failures_figure(load_failures(path), **settings.look), picture)
    say(f"{path} {'is complete: nothing to do' if complete else 'written'}; {picture} drawn")
