"""What the commands share: their options, how they speak, and how they end.

Only the `cli` modules print, and only they exit. They import what they need when they run, so that
`--help` is instant.
"""

from __future__ import annotations

import os
import shlex
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vibrodrive.config import Config
    from vibrodrive.progress import Show

FILE = click.Path(dir_okay=False, path_type=Path)

SET = click.option(
    "--set", "overrides", metavar="KEY=VALUE", multiple=True, help="Replace an entry of the configuration."
)
METHOD = click.option(
    "--method",
    type=click.Choice(["certified", "muller", "fixed"]),
    help="How a switch is found (default certified).",
)
THREADS = click.option("--threads", type=click.IntRange(min=1), help="Threads to compute with (default all).")


def read(config: Path, overrides: tuple[str, ...], method: str | None) -> Config:
    from vibrodrive import config as configuration

    flags = (f"switching.method={method}",) if method else ()
    return configuration.read(config, (*overrides, *flags))


def say(message: str) -> None:
    click.echo(message, err=True)


def same_command() -> str:
    return shlex.join(["vibrodrive", *(a for a in sys.argv[1:] if a != "--overwrite")])


def leave(code: int, message: str) -> NoReturn:
    """End at once, whatever other threads are doing; everything that matters is on the disk."""
    try:
        os.write(2, f"vibrodrive: {message}\n".encode())  # the stream may be in use: this may be a signal handler
    finally:
        os._exit(code)


def check_figure(target: Path) -> None:
    """Refuse what cannot be drawn or written before anything is computed."""
    from vibrodrive.parameters import bad
    from vibrodrive.style import FORMATS

    if target.suffix.lower() not in FORMATS:
        raise click.ClickException(bad("figure", str(target), "a file name ending in " + ", ".join(FORMATS)))
    if not target.absolute().parent.is_dir():
        raise click.ClickException(bad("figure", str(target), "in a directory that exists"))


def check_output(path: Path) -> Path:
    """Refuse a result file that cannot be made; returns the figure that will stand beside it."""
    from vibrodrive.parameters import bad
    from vibrodrive.style import FORMATS

    if path.suffix.lower() in FORMATS:
        raise click.ClickException(bad("output", str(path), "the result file: the figure stands beside it"))
    if not path.absolute().parent.is_dir():
        raise click.ClickException(bad("output", str(path), "in a directory that exists"))
    if not os.access(path if path.exists() else path.absolute().parent, os.W_OK):
        raise click.ClickException(bad("output", str(path), "where files may be written"))
    return path.with_suffix(".png")


@contextmanager
def working(name: str) -> Iterator[Show]:
    """Show that work goes on, count while kernels are compiled, and say in one line what a runner refuses."""
    from vibrodrive._jit import compilation
    from vibrodrive.progress import Show, duration

    show = Show(sys.stderr, name)
    show.update(lambda: "begun")
    ended = threading.Event()

    def watch() -> None:
        counting = False
        while not ended.wait(WATCH_SECONDS):
            if compilation.running:
                show.compiling(compilation.seconds)
            elif counting:
                show.clear()
            counting = compilation.running

    watcher = threading.Thread(target=watch, name="watch", daemon=True)
    watcher.start()
    try:
        yield show
    except (TypeError, ValueError) as error:
        raise click.ClickException(str(error)) from error
    finally:
        ended.set()
        watcher.join()
        show.clear()
    if compilation.seconds >= 1:
        show.say(f"kernels compiled in {duration(compilation.seconds)}")


WATCH_SECONDS = 0.2


def save(figure: Figure, target: Path, dpi: int | None = None) -> None:
    """Write a figure so that whoever looks at it meanwhile sees the old one or the new one."""
    from vibrodrive import figures

    draft = target.with_name(f".{target.stem}.part{target.suffix}")
    try:
        figures.save(figure, draft, dpi)
        os.replace(draft, target)
    finally:
        draft.unlink(missing_ok=True)
