"""Command line: commands, exit codes, and an error message of one line for every foreseeable error.

Exit codes: 0 done · 1 the computation failed, or a file is damaged · 2 refused before any computation · 130
interrupted.
"""

import errno
import io
import os
import signal
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import NoReturn

import click

from vibrodrive.cli.common import leave, same_command, say
from vibrodrive.cli.explore import explore
from vibrodrive.cli.files import info
from vibrodrive.cli.init import init
from vibrodrive.cli.orbits import orbits
from vibrodrive.cli.plot import plot
from vibrodrive.cli.sweep import sweep
from vibrodrive.cli.trajectory import trajectory
from vibrodrive.jobs.signals import catch
from vibrodrive.model.parameters import bad
from vibrodrive.version import __version__


class _Commands(click.Group):
    """Commands by their names. click would answer `limits` by the similar name `init`, which does something else."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args[0] not in self.commands and not ctx.resilient_parsing:  # which completes words in a shell
            raise click.UsageError(bad("command", args[0], "one of " + ", ".join(self.commands)))
        return super().resolve_command(ctx, args)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, message="%(prog)s %(version)s")
def cli() -> None:
    """Simulate a mass that slides, sticks and strikes on a vibrating incline, for many parameter values.

    To begin, type `vibrodrive init quickstart` and then `vibrodrive sweep quickstart.toml --plot`. CONFIG is a
    configuration, a TOML file with the parameters; `vibrodrive init` lists those that are supplied, `vibrodrive COMMAND
    --help` the options of a command. Quantities without a unit are dimensionless. By default each switch from one state
    of the motion to the next is proved to be the first one.

    Exit codes: 0 (done), 1 (the computation failed, or a file is damaged), 2 (refused before any computation), 130
    (interrupted).
    """


for command in (init, sweep, plot, info, trajectory, orbits, explore):
    cli.add_command(command)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit."""
    again = f"start again with: {same_command()}"
    catch(lambda number, frame: leave(130, f"stopped by {signal.Signals(number).name}; {again}"))
    warnings.showwarning = lambda message, *place: say(f"warning: {message}")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # the encoding of a terminal need not contain ξ
            stream.reconfigure(errors="replace")
    arguments = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    code, message = _run(lambda: cli.main(arguments, "vibrodrive", standalone_mode=False))
    if message:
        print(f"vibrodrive: {message}", file=sys.stderr)
    sys.exit(code)


def _run(command: Callable[[], object]) -> tuple[int, str]:
    """Run a command and return (exit code, error message of one line)."""
    try:
        result = command()
    except click.exceptions.Exit as end:
        return end.exit_code, ""
    except click.Abort as end:
        if isinstance(end.__context__, EOFError):  # a defect, such as a damaged module: no command asks for input
            raise end.__context__ from None
        return 130, "interrupted"
    except click.NoSuchOption as error:
        return 2, " ".join(_no_option(error).split())
    except click.ClickException as error:
        return 2, " ".join(error.format_message().split())
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1, ""
    except Exception as error:
        code = _expected(error)
        if code is None:
            raise
        return code, _text(error)
    return (result if isinstance(result, int) else 0), ""


def _no_option(error: click.NoSuchOption) -> str:
    """Return the message for an unknown option. The name of a key is not an option but a value of --set."""
    from vibrodrive.model.config import TABLES

    key = error.option_name.lstrip("-").replace("-", "_")
    if error.ctx is None or not any(key in keys for keys in TABLES.values()):
        return error.format_message()
    settable = any(p.name == "overrides" for p in error.ctx.command.params)
    allowed = f"given as --set {key}=…" if settable else "a key of the configuration"
    return bad("option", error.option_name, allowed)


def _expected(error: Exception) -> int | None:
    """Return the exit code of a foreseeable error; None for a defect of the program."""
    from vibrodrive.errors import Damaged, Failed, Unwritable, VibrodriveError

    if isinstance(error, (Damaged, Failed, Unwritable, MemoryError)) or "start new thread" in str(error):
        return 1
    if isinstance(error, OSError):
        return 2 if error.errno in REFUSED else 1
    return 2 if isinstance(error, VibrodriveError) else None


REFUSED = {
    errno.ENOENT, errno.EACCES, errno.EPERM, errno.EROFS, errno.EISDIR, errno.ENOTDIR, errno.EEXIST,
    errno.ELOOP, errno.ENAMETOOLONG, errno.ENXIO,
}  # fmt: skip
"""Errors of the system for a path that cannot be used. They occur before any computation."""


def _text(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        if isinstance(error, FileNotFoundError) and os.path.exists(f"{error.filename}.h5"):
            return f"{error.filename}: {error.strerror}. Did you mean {error.filename}.h5?"
        return f"{error.filename}: {error.strerror}" if error.filename is not None else error.strerror
    return " ".join(str(error).split()) or type(error).__name__
