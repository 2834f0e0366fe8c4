"""`vibrodrive info` and `vibrodrive verify`: what a result file holds, and whether it is whole."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from vibrodrive.cli.common import FILE, JSON, put_json, say

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from vibrodrive.store.file import Summary
    from vibrodrive.store.layout import Progress
    from vibrodrive.store.reader import Report


@click.command()
@click.argument("file", type=FILE)
@JSON
def info(file: Path, as_json: bool) -> None:
    """Say what a result file of any kind holds and how far it is."""
    from vibrodrive.model.size import human
    from vibrodrive.store.header import read_kind
    from vibrodrive.store.kind import KINDS

    kind = read_kind(file)
    found = _sweep(file) if kind == "sweep" else _other(file, kind)
    size, written = file.stat().st_size, _written(file)
    if as_json:
        put_json(
            {"file": str(file), "kind": kind, "title": found.title, "computed": found.share, **found.facts}
            | {"bytes": size, "written": written}
        )
        return
    click.echo(f"{file}: {found.title}")
    click.echo(f"holds     {KINDS[kind].holds} (vibrodrive {KINDS[kind].command})")
    if kind != "sweep":
        click.echo(f"computed  {100 * found.share:.1f} %")
    for name, text in found.lines:
        click.echo(f"{name:<9} {text}")
    click.echo(f"size      {human(size)}")
    click.echo("made by   " + ", ".join(f"{k} {v}" for k, v in found.facts["versions"].items()))
    click.echo(f"written   {written}")
    for fault in found.faults:
        say(f"damaged: {fault}")


def _written(file: Path) -> str:
    """When a file was last written: the system knows, the file does not, so that equal runs make equal files."""
    return datetime.fromtimestamp(file.stat().st_mtime, UTC).isoformat(timespec="seconds")


def _other(file: Path, kind: str, thorough: bool = False) -> Summary:
    from vibrodrive.store.every_kind import summary

    return summary(file, kind, thorough)


def _sweep(file: Path) -> Summary:
    """A sweep in the form in which the other kinds sum themselves up."""
    from vibrodrive.model.physical import SCENE_AXES
    from vibrodrive.store.describe import acting
    from vibrodrive.store.file import Summary, axis_facts, axis_line
    from vibrodrive.store.reader import look

    report = look(file)
    header, plan = report.header, report.header.plan
    shared = acting(plan)
    scalars = {name: value for name, value in shared.items() if name in plan.scalars}
    shown = {
        name: (SCENE_AXES[name].scale * v, SCENE_AXES[name].shown)
        for name, v in plan.axes.items()
        if name in SCENE_AXES
    }
    facts = {
        "blocks": {"computed": int(report.done.sum()), "of": len(report.done)},
        "axes": {name: axis_facts(values) for name, values in plan.axes.items()},
        "parameters": scalars,
        "settings": {name: value for name, value in shared.items() if name not in scalars},
        "statuses": report.statuses,
        "damaged": _faults(report),
        "versions": header.versions,
    }
    lines = [
        ("computed", f"{100 * report.share:.1f} % ({report.done.sum()} of {len(report.done)} blocks)"),
        *(axis_line(name, *shown.get(name, (values,))) for name, values in plan.axes.items()),
        *(("point", f"{name} between {v.min():g} and {v.max():g}") for name, v in plan.together.items()),
        ("fixed", ", ".join(f"{k} = {v:g}" for k, v in scalars.items())),
        ("switches", f"{shared['method']}, scan {shared['scan']}"),
        ("periods", f"{shared['transient']} transient, {shared['periods']} recorded"),
        *([("carried", f"{plan.carry} along {next(iter(plan.axes))}")] if plan.carry else []),
        *(("status", f"{name}: {points} points") for name, points in report.statuses.items()),
    ]
    return Summary(header.origin.title, report.share, lines, _faults(report), facts)


@click.command()
@click.argument("file", type=FILE)
def verify(file: Path) -> None:
    """Read everything in a result file of any kind and check that it is whole. Exit 1 if it is not."""
    found = read_apart(file, verified)
    for line in found.lines:
        click.echo(line)
    for fault in found.faults:
        say(f"damaged: {fault}")
    if found.faults:
        raise click.exceptions.Exit(1)
    click.echo("complete and whole" if found.share == 1 else "what is computed is whole")


class Verified(NamedTuple):
    """Share of a file that is computed, faults, and lines for a person."""

    share: float
    faults: list[str]
    lines: list[str]


PATIENCE = 60
"""Seconds that one step of reading may take: a block, a few MB, or a whole file of another kind."""


def read_apart(file: Path, read: Callable[[Path, Progress], Verified], patience: int = PATIENCE) -> Verified:
    """Call `read` in a process of its own, and show its progress.

    HDF5 loops for ever on some damaged files, without Python looking at signals, and crashes on others.

    Raises
    ------
    Damaged
        if HDF5 crashes, or a step takes longer than `patience` seconds (except on Windows, which has no alarm).
    NoResult, OSError
        as `read`.
    """
    from multiprocessing import get_context

    from vibrodrive.errors import Damaged
    from vibrodrive.jobs.progress import Show

    context = get_context("spawn")
    here, there = context.Pipe(duplex=False)
    child = context.Process(target=_read_here, args=(file, read, patience, there), daemon=True)
    child.start()
    there.close()
    show = Show(sys.stderr, file.name)
    try:
        while isinstance(said := here.recv(), str):
            show.update(partial(str, said))
    except EOFError:
        child.join()
        slow = child.exitcode == -getattr(signal, "SIGALRM", 0)
        what = f"HDF5 has not read on for {patience} s" if slow else "HDF5 crashes on it"
        raise Damaged(f"{file}: damaged beyond reading ({what}): restore it, or replace it with --overwrite") from None
    finally:
        show.clear()
    if isinstance(said, Exception):
        raise said
    return said


def _read_here(file: Path, read: Callable[[Path, Progress], Verified], patience: int, there: Connection) -> None:
    """In the process of its own: send a line for each step, then what is found or raised."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)

    def step(line: str) -> None:
        if hasattr(signal, "alarm"):
            signal.alarm(patience)  # ends this process, from within a loop of HDF5, too
        there.send(line)

    try:
        step("begun")
        there.send(read(file, lambda done, total: step(f"block {done} of {total}")))
    except Exception as error:
        there.send(error)


def verified(file: Path, progress: Progress) -> Verified:
    """Read everything in a file of any kind."""
    from vibrodrive.store.header import read_kind

    kind = read_kind(file)
    if kind == "sweep":
        return _verified_sweep(file, progress)
    found = _other(file, kind, thorough=True)
    lines = [] if found.faults else [f"computed: {100 * found.share:.1f} %"]
    return Verified(found.share, found.faults, lines)


def _verified_sweep(file: Path, progress: Progress) -> Verified:
    from vibrodrive.model import config
    from vibrodrive.store.compare import compare
    from vibrodrive.store.reader import verify as verify_sweep

    report = verify_sweep(file, progress)
    header = report.header
    differences = compare(header.plan, config.parse(header.origin.config, header.origin.overrides).plan())
    lines = [
        "configuration: SHA-256 fits" + (", but not what was laid out" if differences else ""),
        f"blocks: {report.done.sum()} of {len(report.done)} computed",
        *(f"status {name}: {points} points" for name, points in report.statuses.items()),
    ]
    faults = _faults(report) + [f"the configuration and the file differ: {what}" for what in differences]
    return Verified(report.share, faults, lines)


def _faults(report: Report) -> list[str]:
    blocks = [
        f"{report.place(k)}: {fault}; the same sweep command computes it again"
        for k, fault in sorted(report.faults.items())
    ]
    return blocks + report.general
