"""`vibrodrive plot` and `vibrodrive trajectory`: figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from vibrodrive.cli_common import FILE, METHOD, SET, check_figure, read, save, say, working


@click.command()
@click.argument("file", type=FILE)
@click.option("-o", "--output", type=FILE, help="Figure: .png, .pdf or .svg (default FILE with .png).")
@click.option("--kind", type=click.Choice(["bifurcation", "poincare"]), help="Which diagram.")
@click.option("--quantity", type=click.Choice(["dxi", "xi"]), help="Velocity or gap at the section.")
@click.option("--dpi", type=click.IntRange(20, 2400), help="Pixels per inch (default 250).")
@click.option("--follow", is_flag=True, help="Draw again and again until the sweep is complete.")
def plot(
    file: Path, output: Path | None, kind: str | None, quantity: str | None, dpi: int | None, follow: bool
) -> None:
    """Draw the diagram of a result file, finished or not."""
    options = {k: v for k, v in {"kind": kind, "quantity": quantity}.items() if v is not None}
    target = output or file.with_suffix(".png")
    check_figure(target)
    share = draw(file, target, options, dpi)
    while follow and share < 1:
        share = draw(file, target, options, dpi, unless=share)


def draw(
    file: Path, target: Path, options: dict[str, Any], dpi: int | None = None, unless: float = -1.0
) -> float:
    """Draw a file and return the share that is computed; wait for more than `unless` of it."""
    import time

    from vibrodrive import config, figures
    from vibrodrive.store_read import load, look

    while (report := look(file)).share <= unless:
        time.sleep(FOLLOW_SECONDS)
    origin = report.header.origin
    wanted = config.parse(origin.config, origin.overrides).figure | options
    save(figures.from_results(load(file), **wanted), target, dpi)
    if not report.complete:
        say(f"{file}: {100 * report.share:.1f} % computed")
    say(f"{target} drawn")
    return report.share


FOLLOW_SECONDS = 1.0


@click.command()
@click.argument("config", type=FILE)
@click.option("-o", "--output", type=FILE, help="Figure: .png, .pdf or .svg (default CONFIG with .png, here).")
@SET
@METHOD
def trajectory(config: Path, output: Path | None, overrides: tuple[str, ...], method: str | None) -> None:
    """Follow one motion and draw its phase curve and its course in time."""
    import numpy as np

    from vibrodrive.config import ConfigError
    from vibrodrive.parameters import Status, bad

    settings = read(config, overrides, method)
    drawn = dict(settings.trajectory)
    arguments = dict(settings.arguments)
    for name, value in arguments.items():
        if isinstance(value, np.ndarray):
            if len(value) > 1:
                several = f"{len(value)} values from {value[0]:g} to {value[-1]:g}"
                raise ConfigError(bad(f"sweep.{name}", several, f"one number (--set {name}={value[0]:g})"))
            arguments[name] = float(value[0])
    if "periods" in drawn:
        arguments["periods"] = drawn.pop("periods")
    target = output or Path(config.stem + ".png")
    check_figure(target)
    settings.plan()
    from vibrodrive import figures, simulate

    with working(config.stem):
        motion = simulate(**arguments)
        figure = figures.trajectory_figure(motion, **drawn)
    save(figure, target)
    say(f"{target} drawn: {len(motion.switches)} switches, closest decision {motion.margin:.2g} away")
    if motion.status != Status.OK:
        say(f"{Status(motion.status).name}: {Status(motion.status).advice}")
