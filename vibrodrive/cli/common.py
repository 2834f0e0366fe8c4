"""What the commands share: their options, how they speak, and how they end.

Only the `cli` modules print, and only they exit. They import what they need when they run, so that
`--help` is instant.
"""

from __future__ import annotations

import os
import shlex
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

if TYPE_CHECKING:
    from vibrodrive.jobs.progress import Show
    from vibrodrive.model.config import Config

FILE = click.Path(dir_okay=False, path_type=Path)

SET = click.option(
    "--set", "overrides", metavar="KEY=VALUE", multiple=True, help="Replace an entry of the configuration."
)
METHOD = click.option(
    "--method",
    type=click.Choice(["certified", "muller", "fixed"]),
    help="How a switch is found (default certified).",
)
OVERWRITE = click.option(
    "--overwrite", is_flag=True, help="Replace a result file, of whatever kind, instead of going on with it."
)
THREADS = click.option("--threads", type=click.IntRange(min=1), help="Threads to compute with (default all).")


def read(config: Path, overrides: tuple[str, ...], method: str | None) -> Config:
    from vibrodrive.model import config as configuration

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


def check_figure(target: Path, sources: Mapping[str, Path]) -> None:
    """Refuse what cannot be drawn or written before anything is computed. `sources`: what the figure is made from."""
    from vibrodrive.figures.style import FORMATS
    from vibrodrive.model.parameters import bad
    from vibrodrive.store.draft import draft_of
    from vibrodrive.store.kind import SIGNATURE

    if target.suffix.lower() not in FORMATS:
        raise click.ClickException(bad("figure", str(target), "a file name ending in " + ", ".join(FORMATS)))
    _check_different({**sources, "figure": target})
    _check_different({**sources, "draft of the figure": draft_of(target)})
    _check_place("figure", target, renamed=True)
    if target.exists() and os.access(target, os.R_OK):
        with open(target, "rb") as file:
            if file.read(len(SIGNATURE)) == SIGNATURE:
                raise click.ClickException(bad("figure", str(target), "another file: this one holds data (HDF5)"))


def check_output(path: Path, config: Path, kind: str, *, overwrite: bool, figures: Sequence[Path] = ()) -> None:
    """Refuse a result file that cannot be made, and files one of which would replace another.

    Nothing has been computed yet. A file that is there is gone on with if it is of this kind (and, which shows later,
    of the same configuration), and replaced (`overwrite`) if it is a result file of whatever kind.
    """
    from vibrodrive.figures.style import FORMATS
    from vibrodrive.model.parameters import bad
    from vibrodrive.store.draft import draft_of
    from vibrodrive.store.header import Damaged, NoResult, read_kind, refuse_foreign
    from vibrodrive.store.kind import KINDS

    if path.suffix.lower() in FORMATS:
        raise click.ClickException(bad("output", str(path), "the result file (.h5): the figure stands beside it"))
    _check_different({"configuration": config, "output": path})
    _check_place("output", path, renamed=overwrite)
    _check_different({"configuration": config, "draft of the output": draft_of(path)})
    for figure in figures:
        check_figure(figure, {"configuration": config, "output": path})
    if not path.exists():
        return
    if overwrite:
        refuse_foreign(path)
        return
    try:
        found = read_kind(path)
    except Damaged:
        raise
    except NoResult as error:
        why = ("no file of limits: " if kind == "limits" else "") + str(error).removeprefix(f"{path}: ")
        advice = "choose another file, as --overwrite replaces result files only"
        raise click.ClickException(f"output: {path}: {why}: {advice}") from None
    if found != kind:
        held = f"a file that holds {KINDS[kind].holds}, and this one holds {KINDS[found].holds} (or --overwrite)"
        raise click.ClickException(bad("output", str(path), held))


def _check_place(role: str, path: Path, *, renamed: bool) -> None:
    """Refuse a place where no file can be written. `renamed`: a draft beside it takes its place."""
    from vibrodrive.model.parameters import bad
    from vibrodrive.store.kind import special

    try:
        what = special(path)
        exists = True
    except FileNotFoundError:
        what, exists = None, False
    except OSError as error:
        raise click.ClickException(bad(role, str(path), f"a file that can be made ({error.strerror})")) from None
    if what is not None:
        raise click.ClickException(bad(role, str(path), f"a file, and this is {what}"))
    parent = os.path.dirname(os.path.realpath(path))
    if not os.path.isdir(parent):
        there = "in a directory that exists (No such file or directory)"
        raise click.ClickException(bad(role, str(path), there))
    needed = ([path] if exists else []) + ([Path(parent)] if renamed or not exists else [])
    if not all(os.access(place, os.W_OK) for place in needed):
        raise click.ClickException(bad(role, str(path), "where files may be written (Permission denied)"))


def _check_different(files: Mapping[str, Path]) -> None:
    """Refuse two names for one file, whether by spelling or by links."""
    from vibrodrive.model.parameters import bad

    for (role, path), (other, second) in combinations(files.items(), 2):
        try:
            same = os.path.samefile(path, second)
        except OSError:  # one is not there yet, or nowhere
            same = os.path.realpath(path) == os.path.realpath(second)
        if same:
            raise click.ClickException(bad(other, str(second), f"another file than the {role}, {str(path)!r}"))


@contextmanager
def working(name: str) -> Iterator[Show]:
    """Show that work goes on, count while kernels are compiled, and say in one line what a runner refuses."""
    from vibrodrive.jit.compile import compilation
    from vibrodrive.jobs.progress import Show, duration
    from vibrodrive.store.header import Damaged

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
        if isinstance(error, Damaged):
            raise
        raise click.ClickException(str(error)) from error
    finally:
        ended.set()
        watcher.join()
        show.clear()
    if compilation.seconds >= 1:
        show.say(f"kernels compiled in {duration(compilation.seconds)}")


WATCH_SECONDS = 0.2
