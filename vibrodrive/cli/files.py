"""`vibrodrive info` and `vibrodrive verify`: what a result file holds, and whether it is whole."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vibrodrive.cli.common import FILE, say

if TYPE_CHECKING:
    from vibrodrive.store.file import Summary
    from vibrodrive.store.reader import Report

SUMMARIES = {
    "limits": "store.limits",
    "failures": "store.failures",
    "orbits": "store.orbits",
    "curves": "store.curves",
    "switches": "store.file",
}
"""Module of the function `summary` of each kind of file but sweeps."""


@click.command()
@click.argument("file", type=FILE)
def info(file: Path) -> None:
    """Say what a result file of any kind holds and how far it is."""
    from vibrodrive.store.header import read_kind

    kind = read_kind(file)
    if kind == "sweep":
        _sweep_info(file)
        return
    found = _summary(kind, file, thorough=False)
    _tell(file, kind, found)


def _summary(kind: str, file: Path, thorough: bool) -> Summary:
    summary = import_module(f"vibrodrive.{SUMMARIES[kind]}").summary
    return summary(file, thorough)


def _tell(file: Path, kind: str, found: Summary) -> None:
    from vibrodrive.model.size import human
    from vibrodrive.store.kind import KINDS

    click.echo(f"{file}: {found.title}")
    click.echo(f"holds     {KINDS[kind].holds} (vibrodrive {KINDS[kind].command})")
    click.echo(f"computed  {100 * found.share:.1f} %")
    for name, text in found.lines:
        click.echo(f"{name:<9} {text}")
    click.echo(f"size      {human(file.stat().st_size)}")


def _sweep_info(file: Path) -> None:
    from vibrodrive.model.parameters import Method, Scan
    from vibrodrive.model.physical import SCENE_AXES
    from vibrodrive.model.size import human
    from vibrodrive.store.reader import look

    report = look(file)
    header, plan = report.header, report.header.plan
    s = plan.settings
    click.echo(f"{file}: {header.origin.title}")
    click.echo("holds     a sweep (vibrodrive sweep)")
    click.echo(f"computed  {100 * report.share:.1f} % ({report.done.sum()} of {len(report.done)} blocks)")
    for name, values in plan.axes.items():
        unit, scale = (SCENE_AXES[name].shown, SCENE_AXES[name].scale) if name in SCENE_AXES else ("", 1.0)
        ends = f"{scale * values[0]:g} to {scale * values[-1]:g} {unit}".rstrip()
        click.echo(f"axis      {name} = {ends}, {len(values)} values")
    scalars = {k: v for k, v in plan.scalars.items() if k not in plan.axes}
    click.echo("fixed     " + ", ".join(f"{k} = {v:g}" for k, v in scalars.items() if v == v))
    click.echo(f"switches  {Method(s.method).name.lower()}, scan {Scan(s.scan).name.lower()}")
    click.echo(f"periods   {s.transient} transient, {s.periods} recorded")
    for name, points in report.statuses.items():
        click.echo(f"status    {name}: {points} points")
    click.echo(f"size      {human(report.n_bytes)}")
    click.echo("made by   " + ", ".join(f"{k} {v}" for k, v in header.versions.items()))
    click.echo(f"created   {header.created}")
    _complain(report)


@click.command()
@click.argument("file", type=FILE)
def verify(file: Path) -> None:
    """Read everything in a result file of any kind and check that it is whole. Exit 1 if it is not."""
    from vibrodrive.store.header import read_kind

    kind = read_kind(file)
    if kind == "sweep":
        _sweep_verify(file)
        return
    found = _summary(kind, file, thorough=True)
    for fault in found.faults:
        say(f"damaged: {fault}")
    if found.faults:
        raise click.exceptions.Exit(1)
    click.echo(f"computed: {100 * found.share:.1f} %")
    click.echo("complete and whole" if found.share == 1 else "what is computed is whole")


def _sweep_verify(file: Path) -> None:
    from vibrodrive.jobs.progress import Show
    from vibrodrive.model import config
    from vibrodrive.store.compare import compare
    from vibrodrive.store.reader import verify as verified

    show = Show(sys.stderr, file.name)
    report = verified(file, lambda k, n: show.update(lambda: f"block {k} of {n}"))
    show.clear()
    header = report.header
    differences = compare(header.plan, config.parse(header.origin.config, header.origin.overrides).plan())
    click.echo("configuration: SHA-256 fits" + (", but not what was laid out" if differences else ""))
    click.echo(f"blocks: {report.done.sum()} of {len(report.done)} computed")
    for name, points in report.statuses.items():
        click.echo(f"status {name}: {points} points")
    _complain(report)
    for what in differences:
        say(f"{file}: the configuration and the file differ: {what}")
    if not report.sound or differences:
        raise click.exceptions.Exit(1)
    click.echo("every computed block is whole" if not report.complete else "complete and whole")


def _complain(report: Report) -> None:
    for k, fault in sorted(report.faults.items()):
        say(f"damaged: {report.place(k)}: {fault}; the same sweep command computes it again")
    for what in report.general:
        say(f"damaged: {what}")
