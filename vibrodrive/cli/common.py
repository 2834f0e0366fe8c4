"""Options, output and exit that the commands share.

Only the `cli` modules print and exit. They import other modules when a command runs, so that `--help` is fast.
"""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from vibrodrive.errors import ConfigError, VibrodriveError
from vibrodrive.model.names import SCENE
from vibrodrive.model.parameters import bad, has_control

if TYPE_CHECKING:
    from vibrodrive.model.config import Config
    from vibrodrive.model.plan import Plan


class _Name(click.Path):
    """A path without control characters, so that a message that contains it is one line."""

    def convert(self, value: str | os.PathLike[str], param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not os.fspath(value) or has_control(os.fspath(value)):
            role = "path" if param is None else str(param.name)
            raise click.ClickException(bad(role, os.fspath(value), "the name of a file, without control characters"))
        return super().convert(value, param, ctx)


FILE = _Name(dir_okay=False, path_type=Path)


def _assignments(ctx: click.Context, option: click.Parameter, values: tuple[str, ...]) -> tuple[str, ...]:
    """Refuse `--set KEY VALUE`, before click complains of an argument too many."""
    for value in values:
        if "=" not in value:
            raise click.ClickException(bad("--set", value, "KEY=VALUE or TABLE.KEY=VALUE"))
    return values


SET = click.option(
    "--set",
    "overrides",
    metavar="KEY=VALUE",
    multiple=True,
    callback=_assignments,
    help="Set an entry of the configuration, such as periods=100 or A.num=50; repeatable.",
)
OUTPUTS = click.option(
    "-o",
    "--output",
    "outputs",
    type=FILE,
    multiple=True,
    help="Table (.csv) or figure (.png, .pdf, .svg), by the ending; repeatable (default: a figure).",
)


def read(config: Path, overrides: tuple[str, ...] = ()) -> Config:
    from vibrodrive.model import config as configuration

    return configuration.read(config, overrides)


def targets(outputs: tuple[Path, ...], default: Path, config: Path) -> tuple[Path | None, Path | None]:
    """Return (path of the table, path of the figure) of `-o`, each None if it is not wanted. Raises ConfigError."""
    from vibrodrive.model.figure import FORMATS
    from vibrodrive.store.place import check_replaced
    from vibrodrive.store.tables import ENDING

    paths: dict[str, Path] = {}
    for path in outputs or (default,):
        ending = path.suffix.lower()
        kind = "table" if ending == ENDING else "figure" if ending in FORMATS else ""
        if not kind or kind in paths:
            allowed = f"a table ({ENDING}) or a figure ({', '.join(FORMATS)}), at most one of each"
            raise ConfigError(bad("--output", str(path), allowed))
        check_replaced(kind, path, {"configuration": config})
        paths[kind] = path
    return paths.get("table"), paths.get("figure")


def refuse_axes(plan: Plan) -> None:
    """Refuse a configuration of several motions. Raises ConfigError."""
    from vibrodrive.model.variables import POINT

    for name, values in plan.axes.items():
        if len(values) > 1:
            if name == POINT:
                raise ConfigError(f"sweep.points = {len(values)} points: must be one point (lists with one value)")
            several = f"{len(values)} values from {values[0]:g} to {values[-1]:g}"
            raise ConfigError(f"sweep.{name} = {several}: must be one number (--set {name}={values[0]:g})")


def judge_slip(settings: Config, always: bool = False) -> None:
    """Print a warning of likely mistakes, and of tables for other commands.

    Without `always`, A and B are judged only if they are those of a scene.
    """
    from vibrodrive.model.slips import unlikely

    plan, command = settings.plan(), click.get_current_context().command.name
    unread = [t for t in ("trajectory", "orbits") if getattr(settings, t) and t != command]
    of_scene = not SCENE.keys().isdisjoint((*settings.arguments, *plan.varied))
    sentences = unlikely(plan, always or of_scene)
    sentences += [f"[{table}] is not read by `vibrodrive {command}`" for table in unread]
    if sentences:
        say(f"warning: {'; '.join(sentences)}")


def say(message: str) -> None:
    click.echo(message, err=True)


def same_command() -> str:
    return shlex.join(["vibrodrive", *(a for a in sys.argv[1:] if a != "--overwrite")])


def leave(code: int, message: str) -> NoReturn:
    """Exit immediately, without waiting for other threads. Committed results are already on the disk."""
    try:
        text = f"vibrodrive: {message}\n".encode(sys.getfilesystemencoding(), "replace")
        os.write(2, text)  # in a signal handler sys.stderr may be in use
    finally:
        os._exit(code)


@contextmanager
def in_one_line(before: str = "") -> Iterator[None]:
    """Turn a TypeError or ValueError of a function into an error of one line, which begins with `before`.

    Errors of this program have their own line and exit code.
    """
    try:
        yield
    except VibrodriveError:
        raise
    except (TypeError, ValueError) as error:
        raise click.ClickException(f"{before}{error}") from error


@contextmanager
def working(name: str) -> Iterator[None]:
    """Show the time that has passed, and that of compilations. Turn a TypeError or ValueError into one line."""
    from vibrodrive.jit.compilation import compilation
    from vibrodrive.jobs.progress import Show, duration, under_way

    show = Show(sys.stderr, name)
    with in_one_line(), under_way(name, show):
        yield
    if compilation.seconds >= 1:
        show.say(f"kernels compiled in {duration(compilation.seconds)}")
