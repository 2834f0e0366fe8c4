"""`vibrodrive limits`, `orbits` and `failures`: compute a result file, a table and figures from a configuration."""

from pathlib import Path

import click

from vibrodrive.cli import common
from vibrodrive.cli.common import FILE, JSON, OVERWRITE, SET, THREADS
from vibrodrive.model.kinds import FILES
from vibrodrive.store.place import check_output

HELP = {
    "limits": """Compute limits of stability over A, B or eta.

    They are limits k2 of practical orbital stability: the smallest disturbance, in ε and in Δτ, at which the motion
    loses the structure of the undisturbed motion. CONFIG has one or two of A, B and eta as axes. Its key `criterion` in
    [limits] defines the structure that must be kept: "impacts" (default: the order of the main impacts and the numbers
    of periods between them), "word" (the states between main impacts), or both joined by "and". A main impact has no
    faster impact within half a period.

    Output: the result file, a table on stdout, and a figure (.png) next to the file. An existing file of the same
    configuration is resumed.
    """,
    "orbits": """Compute all periodic orbits over A, and their bifurcations.

    With the axis A, the result contains all orbits up to the period `max_period` in [orbits] (default 3), stable or
    not, and the bifurcations at which they appear, change or disappear. With the axes A and B, it contains the curves
    of these bifurcations in the plane of A and B.

    Output: the result file, the bifurcations or curves on stdout, and figures (.png) next to the file: the bifurcation
    diagram and the multipliers, or the plane. If the file exists with the same configuration, nothing is computed, and
    the contents of the file are listed and drawn again. The file is written at the end, so an interrupted run starts
    again.
    """,
    "failures": """Draw a map of the failures of grid methods.

    The methods are `fixed` and `muller`. The map has the axes A and Δτ, or A and ε. A map over A and ε needs `dtau`,
    the grid step of the methods. A failure is a switch that is missed, is found late, or leads to a wrong state.

    Output: the result file and a figure (.png) next to it. If the file exists with the same configuration, only the
    figure is drawn again. The file is written at the end, so an interrupted run starts again.
    """,
}


def result_command(name: str, *, hidden: bool = False) -> click.Command:
    """Return a command that computes a result file and shows it."""

    @click.command(name, help=HELP[name], hidden=hidden)
    @click.argument("config", type=FILE)
    @click.option(
        "-o", "--output", type=FILE, help="Result file (default: name of CONFIG with .h5, in this directory)."
    )
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
        done = "written" if computed else "is complete: nothing to compute"
        common.say(f"{path} {done}; {' and '.join(map(str, pictures))} drawn")

    return command
