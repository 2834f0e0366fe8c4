"""`vibrodrive driver`: what a driver does, in SI units."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from vibrodrive.cli.common import FILE, JSON, SET, put_json, read, refuse_axes, working


@click.command()
@click.argument("config", type=FILE)
@SET
@JSON
def driver(config: Path, overrides: tuple[str, ...], as_json: bool) -> None:
    """Compute what a driver does in SI units: period, blows, power, and the same ±1 % beside its setting.

    CONFIG has one scene in [physical], with a0 and omega0. The motion starts from rest; its switches are certified.
    """
    from vibrodrive.errors import ConfigError
    from vibrodrive.model.names import SCENE
    from vibrodrive.model.physical import Scene

    configured = read(config, overrides, None)
    plan = configured.plan()
    refuse_axes(plan)
    known = plan.scalars | {name: float(values[0]) for name, values in plan.axes.items()}
    scene = configured.physical
    if scene is None and "a0" in known:  # quantities of the scene may be axes of one value
        scene = Scene(**{name: known[name] for name in SCENE})
    if scene is None or not scene.a0:
        raise ConfigError("physical.a0 is missing: a driver needs [physical] with a0 (m), omega0 (rad/s), mu and alpha")
    from vibrodrive.jobs.driver import driver as compute

    settings = plan.settings
    with working(config.stem):
        found = compute(
            scene,
            eps=known["eps"], eta=known["eta"], transient=settings.transient, periods=settings.periods,
        )  # fmt: skip
    if not as_json:
        click.echo(found)
        return
    put_json(_facts(found) | {"beside": {name: [_facts(one) for one in pair] for name, pair in found.beside.items()}})


def _facts(found: Any) -> dict[str, Any]:
    facts = {name: value for name, value in vars(found).items() if name != "beside"}
    return facts | {"scene": vars(found.scene), "status": found.status.name}
