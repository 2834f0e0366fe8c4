"""`vibrodrive info` and `vibrodrive verify`: contents and integrity of a result file."""

from __future__ import annotations

import math
import signal
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vibrodrive.cli.common import FILE, JSON, put_json, say
from vibrodrive.errors import Damaged
from vibrodrive.model.kinds import FILES

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from vibrodrive.store.every_kind import Summary


@click.command()
@click.argument("file", type=FILE)
@JSON
def info(file: Path, as_json: bool) -> None:
    """Show the contents and the progress of a result file.

    Output: on stdout the kind, the computed share, the axes, the settings, the size, and the versions of the program
    and of its libraries; on stderr the parts that are damaged.
    """
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
    """Read a result file of any kind and check its integrity.

    Output: on stdout the computed share, and whether the file is complete and undamaged; on stderr a line for each
    damaged part. The exit code is 1 if a part is damaged. An incomplete file is not an error.
    """
    from vibrodrive.store.every_kind import summary

    found = read_in_process(file, partial(summary, thorough=True))
    if not math.isnan(found.share):
        click.echo(f"computed: {100 * found.share:.1f} %")
    for name, text in found.lines:
        if name in ("blocks", "status"):
            click.echo(f"{name}: {text}")
    for fault in found.faults:
        say(f"damaged: {fault}")
    if found.faults:
        raise click.exceptions.Exit(1)
    click.echo("complete and undamaged" if found.share == 1 else "incomplete; the computed part is undamaged")


PATIENCE = 60
"""Longest time in seconds for a step of reading: a block of a sweep (a few MB), or a complete file of another kind."""


def read_in_process(file: Path, read: Callable[..., Summary], patience: int = PATIENCE) -> Summary:
    """Call `read` in a separate process, and show its progress.

    On some damaged files HDF5 loops endlessly and never returns to Python, where signals are handled. On other files it
    crashes. Raises Damaged if HDF5 crashes, or if a step takes longer than `patience` seconds (except on Windows, which
    has no alarm). Exceptions of `read` are raised again.
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
        what = f"HDF5 has made no progress for {patience} s" if slow else "HDF5 crashes"
        raise Damaged(f"{file}: cannot be read ({what}); restore it") from None
    finally:
        show.clear()
    if isinstance(said, Exception):
        raise said
    return said


def _read_here(file: Path, read: Callable[..., Summary], patience: int, there: Connection) -> None:
    """Read in the separate process: send a line for each step, then the result or the exception."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)

    def step(line: str) -> None:
        if hasattr(signal, "alarm"):
            signal.alarm(patience)  # ends even a loop within HDF5
        there.send(line)

    try:
        step("started")
        there.send(read(file, progress=lambda done, total: step(f"block {done} of {total}")))
    except Exception as error:
        there.send(error)
