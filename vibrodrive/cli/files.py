"""`vibrodrive info` and `vibrodrive verify`: what a result file holds, and whether it is whole."""

from __future__ import annotations

import math
import signal
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from vibrodrive.cli.common import FILE, JSON, put_json, say
from vibrodrive.errors import Damaged
from vibrodrive.model.kinds import FILES

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from vibrodrive.store.layout import Progress


@click.command()
@click.argument("file", type=FILE)
@JSON
def info(file: Path, as_json: bool) -> None:
    """Say what a result file of any kind holds and how far it is."""
    from vibrodrive.model.size import human
    from vibrodrive.store.every_kind import summary

    found = summary(file)
    size = file.stat().st_size
    written = datetime.fromtimestamp(file.stat().st_mtime, UTC).isoformat(timespec="seconds")
    if as_json:
        put_json(
            {"file": str(file), "kind": found.kind, "title": found.title, "computed": found.share, **found.facts}
            | {"bytes": size, "written": written}
        )
        return
    kind = FILES[found.kind]
    lines = [
        ("holds", f"{kind.holds} (vibrodrive {kind.command})"),
        ("computed", f"{100 * found.share:.1f} %"),
        *found.lines,
        ("size", human(size)),
        ("made by", ", ".join(f"{name} {version}" for name, version in found.facts["versions"].items())),
        ("written", written),
    ]
    width = max(9, *(len(name) for name, _ in lines))
    click.echo(f"{file}: {found.title}")
    for name, text in lines:
        click.echo(f"{name:<{width}} {text}")
    for fault in found.faults:
        say(f"damaged: {fault}")


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

    HDF5 loops for ever on some damaged files, without Python looking at signals, and crashes on others. Raises Damaged
    if it crashes, or a step takes longer than `patience` seconds (except on Windows, which has no alarm); or as `read`.
    """
    from multiprocessing import get_context

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
    """Read in the process of its own: send a line for each step, then the result or the exception."""
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
    from vibrodrive.store.every_kind import summary

    found = summary(file, thorough=True, progress=progress)
    lines = [] if math.isnan(found.share) else [f"computed: {100 * found.share:.1f} %"]
    lines += [f"{name}: {text}" for name, text in found.lines if name in ("blocks", "status")]
    return Verified(found.share, found.faults, lines)
