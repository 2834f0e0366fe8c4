"""The command line. Only this module prints, and only this module exits.

Exit codes: 0 done · 1 failed at work, or a file is not whole · 2 refused before any work · 130 interrupted.
Commands import what they need when they run, so that `--help` is instant.
"""

from __future__ import annotations

import os
import shlex
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vibrodrive.config import Config
    from vibrodrive.plan import Plan
    from vibrodrive.store_read import Report

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


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="vibrodrive", message="%(prog)s %(version)s")
def cli() -> None:
    """Parameter sweeps of a friction-impact oscillator, every switching point located with a guarantee."""


@cli.command()
@click.argument("config", type=FILE)
@click.option("-o", "--output", type=FILE, help="Result file (default CONFIG with the ending .h5, here).")
@SET
@METHOD
@THREADS
@click.option("--dask", metavar="ADDRESS", help="Compute on a Dask cluster (tcp://scheduler:8786).")
@click.option("--plot", "plotted", is_flag=True, help="Draw the result when it is complete.")
@click.option("--dry-run", is_flag=True, help="Say what it would take, and compute nothing.")
@click.option("--overwrite", is_flag=True, help="Replace the result file instead of resuming it.")
def sweep(
    config: Path,
    output: Path | None,
    overrides: tuple[str, ...],
    method: str | None,
    threads: int | None,
    dask: str | None,
    plotted: bool,
    dry_run: bool,
    overwrite: bool,
) -> None:
    """Compute the sweep that CONFIG describes, into a file. A file that is there is resumed."""
    from vibrodrive.progress import Show
    from vibrodrive.size import refuse_large_block

    settings = _read(config, overrides, method)
    plan = settings.plan()
    path = output or Path(config.stem + ".h5")
    refuse_large_block(plan, threads or os.cpu_count() or 1)
    if dry_run:
        _dry_run(plan, path, threads)
        return
    from vibrodrive.runner import Job, Stopped, run
    from vibrodrive.store_layout import Origin

    origin = Origin(settings.text, settings.overrides, settings.title)
    show = Show(sys.stderr, path.name)
    try:
        show.say(run(Job(plan, origin, path, threads, dask, overwrite), show))
    except Stopped as stopped:
        _leave(130, f"{stopped}; resume with: {_same_command()}")
    _tell_statuses(path)
    if plotted:
        _draw(path, path.with_suffix(".png"), {})


def _dry_run(plan: Plan, path: Path, threads: int | None) -> None:
    from vibrodrive import estimate
    from vibrodrive.progress import duration
    from vibrodrive.size import block_bytes, file_bytes, human, refuse_large_file

    periods = plan.settings.transient + plan.settings.periods
    click.echo(f"points   {plan.n_points}")
    click.echo(
        f"periods  {plan.n_points * periods:.3g} ({periods} a point, {plan.settings.periods} recorded)"
    )
    click.echo(f"file     {human(file_bytes(plan))}")
    workers = threads or os.cpu_count() or 1
    click.echo(f"memory   {human(BASE_MEMORY + 2 * workers * block_bytes(plan))}")
    refuse_large_file(plan, path)
    click.echo(f"time     {duration(estimate.seconds(plan, threads))}")


BASE_MEMORY = 200_000_000
"""Interpreter, NumPy, Numba and the compiled kernels."""


@cli.command()
@click.argument("file", type=FILE)
@click.option("-o", "--output", type=FILE, help="Figure: .png, .pdf or .svg (default FILE with .png).")
@click.option("--kind", type=click.Choice(["bifurcation", "poincare"]), help="Which diagram.")
@click.option("--quantity", type=click.Choice(["dxi", "xi"]), help="Velocity or gap at the section.")
@click.option("--follow", is_flag=True, help="Draw again and again until the sweep is complete.")
def plot(file: Path, output: Path | None, kind: str | None, quantity: str | None, follow: bool) -> None:
    """Draw the diagram of a result file, finished or not."""
    options = {k: v for k, v in {"kind": kind, "quantity": quantity}.items() if v is not None}
    target = output or file.with_suffix(".png")
    _check_figure(target)
    share = _draw(file, target, options)
    while follow and share < 1:
        share = _draw(file, target, options, unless=share)


def _draw(file: Path, target: Path, options: dict[str, Any], unless: float = -1.0) -> float:
    """Draw a file and return the share that is computed; wait for more than `unless` of it."""
    import time

    from vibrodrive import config, figures
    from vibrodrive.store_read import load, look

    while (report := look(file)).share <= unless:
        time.sleep(FOLLOW_SECONDS)
    origin = report.header.origin
    wanted = config.parse(origin.config, origin.overrides).figure | options
    _save(figures.from_results(load(file), **wanted), target)
    if not report.complete:
        _say(f"{file}: {100 * report.share:.1f} % computed")
    _say(f"{target} drawn")
    return report.share


FOLLOW_SECONDS = 1.0


def _check_figure(target: Path) -> None:
    """Refuse what cannot be drawn or written before anything is computed."""
    from vibrodrive.parameters import bad
    from vibrodrive.style import FORMATS

    if target.suffix.lower() not in FORMATS:
        raise click.ClickException(bad("figure", str(target), "a file name ending in " + ", ".join(FORMATS)))
    if not target.absolute().parent.is_dir():
        raise click.ClickException(bad("figure", str(target), "in a directory that exists"))


def _save(figure: Figure, target: Path) -> None:
    """Write a figure so that whoever looks at it meanwhile sees the old one or the new one."""
    from vibrodrive import figures

    draft = target.with_name(f".{target.stem}.part{target.suffix}")
    try:
        figures.save(figure, draft)
        os.replace(draft, target)
    finally:
        draft.unlink(missing_ok=True)


@cli.command()
@click.argument("file", type=FILE)
def info(file: Path) -> None:
    """Say what a result file holds and how far it is."""
    from vibrodrive.parameters import Method, Scan
    from vibrodrive.size import human
    from vibrodrive.store_read import look

    report = look(file)
    header, plan = report.header, report.header.plan
    s = plan.settings
    click.echo(f"{file}: {header.origin.title}")
    click.echo(f"computed  {100 * report.share:.1f} % ({report.done.sum()} of {len(report.done)} blocks)")
    for name, values in plan.axes.items():
        click.echo(f"axis      {name} = {values[0]:g} to {values[-1]:g}, {len(values)} values")
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


@cli.command()
@click.argument("file", type=FILE)
def verify(file: Path) -> None:
    """Read everything in a result file and check that it is whole. Exit 1 if it is not."""
    from vibrodrive import config
    from vibrodrive.progress import Show
    from vibrodrive.store import compare
    from vibrodrive.store_read import verify as verified

    show = Show(sys.stderr, file.name)
    report = verified(file, lambda k, n: show.update(lambda: f"block {k} of {n}"))
    show.clear()
    header = report.header
    differences = compare(header, config.parse(header.origin.config, header.origin.overrides).plan())
    click.echo("configuration: SHA-256 fits" + (", but not what was laid out" if differences else ""))
    click.echo(f"blocks: {report.done.sum()} of {len(report.done)} computed")
    for name, points in report.statuses.items():
        click.echo(f"status {name}: {points} points")
    _complain(report)
    for what in differences:
        _say(f"{file}: the configuration and the file differ: {what}")
    if not report.sound or differences:
        raise click.exceptions.Exit(1)
    click.echo("every computed block is whole" if not report.complete else "complete and whole")


def _complain(report: Report) -> None:
    for k, fault in sorted(report.faults.items()):
        _say(f"damaged: {report.place(k)}: {fault}; the same sweep command computes it again")
    for what in report.general:
        _say(f"damaged: {what}")


@cli.command()
@click.argument("config", type=FILE)
@click.option(
    "-o", "--output", type=FILE, help="Figure: .png, .pdf or .svg (default CONFIG with .png, here)."
)
@SET
@METHOD
def trajectory(config: Path, output: Path | None, overrides: tuple[str, ...], method: str | None) -> None:
    """Follow one motion and draw its phase curve and its course in time."""
    import numpy as np

    from vibrodrive.config import ConfigError
    from vibrodrive.parameters import Status, bad

    settings = _read(config, overrides, method)
    drawn = dict(settings.trajectory)
    arguments = dict(settings.arguments)
    for name, value in arguments.items():
        if isinstance(value, np.ndarray):
            if len(value) > 1:
                several = f"{len(value)} values from {value[0]:g} to {value[-1]:g}"
                raise ConfigError(bad(f"sweep.{name}", several, f"one number (--set {name}={value[0]:g})"))
            arguments[name] = float(value[0])
    if "periods" in drawn:
        arguments["periods"] = drawn.pop("periods")
    target = output or Path(config.stem + ".png")
    _check_figure(target)
    settings.plan()
    from vibrodrive import figures, simulate

    motion = simulate(**arguments)
    _save(figures.trajectory_figure(motion, **drawn), target)
    _say(f"{target} drawn: {len(motion.switches)} switches, closest decision {motion.margin:.2g} away")
    if motion.status != Status.OK:
        _say(f"{Status(motion.status).name}: {Status(motion.status).advice}")


def _read(config: Path, overrides: tuple[str, ...], method: str | None) -> Config:
    from vibrodrive import config as configuration

    flags = (f"switching.method={method}",) if method else ()
    return configuration.read(config, (*overrides, *flags))


def _tell_statuses(path: Path) -> None:
    """Say which points did not simply go well."""
    from vibrodrive.parameters import Status
    from vibrodrive.store_read import look

    for name, points in look(path).statuses.items():
        if name != Status.OK.name:
            advice = Status[name].advice if name in Status.__members__ else "unknown"
            _say(f"{points} points {name}: {advice}")


def _say(message: str) -> None:
    click.echo(message, err=True)


def _same_command() -> str:
    return shlex.join(["vibrodrive", *(a for a in sys.argv[1:] if a != "--overwrite")])


def _leave(code: int, message: str) -> NoReturn:
    """End at once, whatever other threads are doing; everything that matters is on the disk."""
    try:
        os.write(
            2, f"vibrodrive: {message}\n".encode()
        )  # the stream may be in use: this may be a signal handler
    finally:
        os._exit(code)


def _on_signal(signum: int, frame: object) -> None:
    _leave(130, f"stopped by {signal.Signals(signum).name}; start again with: {_same_command()}")


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit."""
    for signum in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if not (signum == signal.SIGHUP and signal.getsignal(signum) == signal.SIG_IGN):  # nohup
            signal.signal(signum, _on_signal)
    code, message = _run(lambda: cli.main(arguments, "vibrodrive", standalone_mode=False))
    if message:
        print(f"vibrodrive: {message}", file=sys.stderr)
    sys.exit(code)


def _run(command: Callable[[], object]) -> tuple[int, str]:
    """Exit code and complaint of a command, every foreseeable error in one line."""
    try:
        result = command()
    except click.exceptions.Exit as end:
        return end.exit_code, ""
    except click.Abort:
        return 130, "interrupted"
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


def _expected(error: Exception) -> int | None:
    """Exit code of an error that has a line of its own; None for what should not happen."""
    if isinstance(error, OSError):
        refused = (FileNotFoundError, PermissionError, IsADirectoryError, NotADirectoryError)
        return 2 if isinstance(error, refused) else 1
    from vibrodrive.config import ConfigError
    from vibrodrive.runner import Failed
    from vibrodrive.size import TooLarge
    from vibrodrive.store import Busy, Different, NoResult
    from vibrodrive.store_layout import Damaged

    if isinstance(error, (Failed, Damaged)):
        return 1
    if isinstance(error, (ConfigError, TooLarge, Busy, Different, NoResult)):
        return 2
    return None


def _text(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split())
