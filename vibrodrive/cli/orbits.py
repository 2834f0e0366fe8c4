"""`vibrodrive orbits`: every periodic orbit of the undisturbed motion over A, and its bifurcations."""

from __future__ import annotations

from pathlib import Path

import click

from vibrodrive.cli.common import FILE, OVERWRITE, SET, THREADS, check_output, read, say, working


@click.command()
@click.argument("config", type=FILE)
@click.option("-o", "--output", type=FILE, help="Result file (default CONFIG with the ending .h5, here).")
@SET
@THREADS
@OVERWRITE
def orbits(config: Path, output: Path | None, overrides: tuple[str, ...], threads: int | None, overwrite: bool) -> None:
    """Find all orbits over A, stable or not, and where they are born, change or die.

    The bifurcations are listed on stdout. The figures stand beside the result file: the bifurcation diagram,
    and the multipliers. A file of the same configuration is listed and drawn again.
    """
    settings = read(config, overrides, None)
    path = output or Path(config.stem + ".h5")
    picture = path.with_suffix(".png")
    multipliers = picture.with_stem(picture.stem + "_multipliers")
    check_output(path, config, "orbits", overwrite=overwrite, figures=[picture, multipliers])
    plan = settings.plan()
    complete = path.exists() and not overwrite
    from vibrodrive.jobs.orbits import run_orbits
    from vibrodrive.store.layout import Origin

    origin = Origin(settings.text, settings.overrides, settings.title)
    with working(path.name):
        table = run_orbits(plan, path, origin=origin, threads=threads, overwrite=overwrite, **settings.orbits)
    click.echo(table)
    say(f"{path} {'is complete: nothing to do' if complete else 'written'}, {picture} and {multipliers.name} drawn")
