"""`vibrodrive orbits`: every periodic orbit of the undisturbed motion over A, and its bifurcations."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from vibrodrive.cli.common import (
    FILE,
    JSON,
    OVERWRITE,
    SET,
    THREADS,
    judge_idle,
    judge_slip,
    put_json,
    read,
    say,
    working,
)
from vibrodrive.jobs.output import check_output

if TYPE_CHECKING:
    from vibrodrive.model.config import Config


@click.command()
@click.argument("config", type=FILE)
@click.option("-o", "--output", type=FILE, help="Result file (default CONFIG with the ending .h5, here).")
@SET
@THREADS
@OVERWRITE
@JSON
def orbits(
    config: Path,
    output: Path | None,
    overrides: tuple[str, ...],
    threads: int | None,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Find all orbits over A, stable or not, and where they are born, change or die.

    The bifurcations are listed on stdout, as a table or as JSON. The figures stand beside the result file: the
    bifurcation diagram, and the multipliers. A file of the same configuration is listed and drawn again.

    Over A and B the bifurcations are followed as curves through the plane, listed and drawn there.
    """
    settings = read(config, overrides, None)
    judge_idle(settings)
    judge_slip(settings, always=True)
    path = output or Path(config.stem + ".h5")
    if len(settings.plan().axes) == 2:
        _curves(settings, config, path, overwrite, as_json)
        return
    picture = path.with_suffix(".png")
    multipliers = picture.with_stem(picture.stem + "_multipliers")
    check_output(path, config, "orbits", overwrite=overwrite, figures=[picture, multipliers])
    plan = settings.plan()
    complete = path.exists() and not overwrite
    from vibrodrive.figures.style import drawn_as
    from vibrodrive.jobs.orbits import listed, run_orbits, table
    from vibrodrive.store.layout import Origin

    origin = Origin(settings.text, settings.overrides, settings.title)
    with working(path.name), drawn_as(**settings.look):
        found = run_orbits(plan, path, origin=origin, threads=threads, overwrite=overwrite, **settings.orbits)
    if as_json:
        put_json(listed(found))
    else:
        click.echo(table(found))
    say(f"{path} {'is complete: nothing to do' if complete else 'written'}, {picture} and {multipliers.name} drawn")


def _curves(settings: Config, config: Path, path: Path, overwrite: bool, as_json: bool) -> None:
    """Curves of bifurcations over A and B."""
    picture = path.with_suffix(".png")
    check_output(path, config, "curves", overwrite=overwrite, figures=[picture])
    complete = path.exists() and not overwrite
    from vibrodrive.figures.style import drawn_as
    from vibrodrive.jobs.curves import listed, run_curves, table
    from vibrodrive.store.layout import Origin

    origin = Origin(settings.text, settings.overrides, settings.title)
    with working(path.name), drawn_as(**settings.look):
        found = run_curves(settings.plan(), path, origin=origin, overwrite=overwrite, **settings.orbits)
    if as_json:
        put_json(listed(found))
    else:
        click.echo(table(found))
    say(f"{path} {'is complete: nothing to do' if complete else 'written'}, {picture} drawn")
