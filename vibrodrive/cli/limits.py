"""`vibrodrive limits`: how large a disturbance the motion stands, over A, B or η."""

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
def limits(config: Path, output: Path | None, overrides: tuple[str, ...], threads: int | None, overwrite: bool) -> None:
    """Find the limits of practically orbital stability over A, B or eta, list and draw them.

    One or two of these are axes. The figure stands beside the result file. A file that is there is gone on with.

    [limits] quantity in CONFIG is what is sought: "k2" (the default), the disturbance, in ε and in Δτ, that a motion
    stands; "k1", how far the start may be off, in xi0, dxi0 and tau0; or "ku", the disturbance from which all starts
    end on one motion. [limits] criterion is what k2 keeps: "impacts" (the default), "word" or "rho < x", joined by
    "and".
    """
    settings = read(config, overrides, None)
    judge_slip(settings, always=True)
    path = output or Path(config.stem + ".h5")
    picture = path.with_suffix(".png")
    check_output(path, config, "limits", overwrite=overwrite, figures=[picture])
    from vibrodrive.figures.limits import limits_figure
    from vibrodrive.figures.style import save
    from vibrodrive.jobs.limits import run_limits, table
    from vibrodrive.store.limits import load_limits

    sought = 0
    with working(path.name) as show:

        def progress(known: int, total: int) -> None:
            nonlocal sought
            sought += 1
            show.update(lambda: f"{known} of {total} limits")

        run_limits(settings, path, progress, **settings.limits, threads=threads, overwrite=overwrite)
    found = load_limits(path)
    save(limits_figure(found, **settings.look), picture)
    click.echo(table(found))
    said = f"holds {found.done.sum()} limits" if sought else f"is complete ({found.done.sum()} limits): nothing to do"
    say(f"{path} {said}; {picture} drawn")
