"""`vibrodrive driver`: the motion of one driver, in SI units."""

from pathlib import Path
from typing import Any

import click

from vibrodrive.cli.common import FILE, JSON, SET, put_json, read, refuse_axes, working
from vibrodrive.errors import ConfigError


@click.command()
@click.argument("config", type=FILE)
@SET
@JSON
def driver(config: Path, overrides: tuple[str, ...], as_json: bool) -> None:
    """Compute the motion of a vibratory driver in SI units.

    CONFIG gives the driver in [physical]: a0 (m), omega0 (rad/s), mu, alpha (degrees) and mass (kg, default 1). The
    mass has an effect only on the powers. The motion starts from rest at the obstacle, and its switches are certified.

    Output: a table on stdout. Its rows are the driver, and the same driver with one of a0, omega0, mu and alpha changed
    by -1 % or +1 %. Its columns are the period (ms), the impacts per second, the velocity of the fastest impact (m/s),
    the powers of the impacts and of friction (W), the largest gap (mm), and the conveying velocity without an obstacle
    (mm/s).
    """
    configured = read(config, overrides, None)
    plan = configured.plan()
    refuse_axes(plan)
    from vibrodrive.model.physical import scene_of

    scene, point = scene_of(plan.single(0).scalars), plan.arguments(0)
    if scene is None or not scene.a0:
        raise ConfigError(
            "physical.a0 is missing: must be given, because a driver needs a0, omega0, mu and alpha in [physical]"
        )
    from vibrodrive.jobs.driver import driver as compute

    with working(config.stem):
        found = compute(scene, **{name: point[name] for name in ("eps", "eta", "transient", "periods")})
    if not as_json:
        click.echo(found)
        return
    put_json(_facts(found) | {"beside": {name: [_facts(one) for one in pair] for name, pair in found.beside.items()}})


def _facts(found: Any) -> dict[str, Any]:
    facts = {name: value for name, value in vars(found).items() if name != "beside"}
    return facts | {"scene": vars(found.scene), "status": found.status.name}
