"""`vibrodrive limits`, `orbits` and `failures`: from a configuration to a result file, a table and figures."""

from __future__ import annotations

from pathlib import Path

import click

from vibrodrive.cli import common
from vibrodrive.cli.common import FILE, JSON, OVERWRITE, SET, THREADS
from vibrodrive.model.kinds import FILES
from vibrodrive.store.place import check_output

HELP = {
    "limits": """Find the limits of practically orbital stability over A, B or eta, list and draw them.

    One or two of these are axes. The figure is written next to the result file. An existing file is resumed.

    [limits] quantity in CONFIG is what is sought: "k2" (the default), the disturbance, in ε and in Δτ, that a motion
    stands; "k1", how far the start may be off, in xi0, dxi0 and tau0; or "ku", the disturbance from which all starts
    end on one motion. [limits] criterion is what k2 keeps: "impacts" (the default), "word" or "rho < x", joined by
    "and".
    """,
    "orbits": """Find all orbits over A, stable or not, and where they are born, change or die.

    The bifurcations are listed on stdout, as a table or as JSON. The figures are written next to the result file: the
    bifurcation diagram, and the multipliers. A file of the same configuration is listed and drawn again.

    Over A and B the bifurcations are followed as curves through the plane, listed and drawn there.
    """,
    "failures": """Map missed, late and wrongly decided switches over A and Δτ, or A and ε, and draw the map.

    The figure is written next to the result file. A file of the same configuration is drawn again. The file is written
    at the end: an interrupted run starts over.
    """,
}


def result_command(name: str, *, hidden: bool = False) -> click.Command:
    """Make a command that computes a result file and shows it."""

    @click.command(name, help=HELP[name], hidden=hidden)
    @click.argument("config", type=FILE)
    @click.option("-o", "--output", type=FILE, help="Result file (default CONFIG with the ending .h5, here).")
    @SET
    @THREADS
    @OVERWRITE
    @JSON
    def command(
        config: Path,
        output: Path | None,
        overrides: tuple[str, ...],
        threads: int | None,
        overwrite: bool,
        as_json: bool,
    ) -> None:
        settings = common.read(config, overrides, None)
        if name == "orbits":
            common.judge_idle(settings)
        common.judge_slip(settings, always=name != "failures")
        kind = "curves" if name == "orbits" and len(settings.plan().axes) == 2 else name
        path = output or Path(config.stem + ".h5")
        picture = path.with_suffix(".png")
        pictures = [picture.with_stem(picture.stem + ending) for ending in FILES[kind].figures]
        check_output(path, config, kind, overwrite=overwrite, figures=pictures)
        from vibrodrive.figures.style import drawn_as, save
        from vibrodrive.jobs.runner import recipe_of, run

        recipe = recipe_of(kind)
        with common.working(path.name) as show, drawn_as(**settings.look):

            def progress(done: int, total: int) -> None:
                show.update(lambda: f"{done} of {total}")

            found, computed = run(kind, settings, path, progress, threads=threads, overwrite=overwrite)
            for figure, target in zip(recipe.figures(found, threads), pictures, strict=True):
                save(figure, target)
        if as_json:
            common.put_json(recipe.listed(found))
        elif table := recipe.table(found):
            click.echo(table)
        done = "written" if computed else "is complete: nothing to do"
        common.say(f"{path} {done}; {' and '.join(map(str, pictures))} drawn")

    return command
