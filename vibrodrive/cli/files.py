"""`vibrodrive info`: show a result file, check it, and print its numbers."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from vibrodrive.cli.common import FILE, say
from vibrodrive.cli.plot import left_out
from vibrodrive.model.figure import DIMENSIONLESS


@click.command()
@click.argument("file", type=FILE)
@click.option("--check", is_flag=True, help="Read the complete file and check it; exit code 1 if a part is damaged.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON, for other programs.")
@click.option("--csv", "as_csv", is_flag=True, help="Print the numbers of the points instead, as a table (CSV).")
def info(file: Path, check: bool, as_json: bool, as_csv: bool) -> None:
    """Show the contents and the progress of a result file, or its numbers.

    Output: on stdout the computed share, the axes, the settings, the size, and the versions of the program and of its
    libraries; on stderr the parts that are damaged, with what to do. An incomplete file is not an error.

    With --csv, on stdout a line for each point: its parameters, and all numbers of which it has one, in SI units with
    [physical]. A unit is part of the name of its column. Section points and main impacts, of which a point has several,
    are tables of Python: vd.load("FILE").to_dataframe("section").
    """
    if as_csv:
        if check or as_json:
            raise click.UsageError("--csv: must be given without --check and --json")
        _print_table(file)
        return
    import numpy as np

    from vibrodrive.jobs.progress import Show
    from vibrodrive.model.size import human
    from vibrodrive.store.reader import look, verify

    show = Show(sys.stderr, file.name)
    try:
        report = (
            verify(file, lambda done, total: show.update(lambda: f"block {done} of {total}")) if check else look(file)
        )
    finally:
        show.clear()
    size, versions = file.stat().st_size, report.header.versions
    written = f"{np.datetime64(int(file.stat().st_mtime), 's')}+00:00"  # also in the year 10000
    title, faults = report.header.origin.title, report.complaints()
    if as_json:
        import json

        from vibrodrive.cli.plain import plain

        about = {"file": str(file), "title": title, "computed": report.share, **report.facts(), "versions": versions}
        about |= {"damaged": faults, "bytes": size, "written": written}
        click.echo(json.dumps(plain(about), indent=1, allow_nan=False))  # ASCII, in any locale; NaN and ∞ as null
    else:
        lines = [
            ("computed", f"{100 * report.share:.1f} %"),
            *report.lines(),
            ("size", human(size)),
            ("made by", ", ".join(f"{name} {version}" for name, version in versions.items())),
            ("written", written),
        ]
        width = max(9, *(len(name) for name, _ in lines))
        click.echo(f"{file}: {title}")
        for name, text in lines:
            click.echo(f"{name:<{width}} {text}")
    for fault in faults:
        say(f"damaged: {fault}")
    if check:
        if faults:
            raise click.exceptions.Exit(1)
        say("complete and undamaged" if report.complete else "incomplete; the computed part is undamaged")


def _print_table(file: Path) -> None:
    """Print a line for each point. Damaged blocks are left out and named in messages; the exit code is then 1."""
    from vibrodrive.store.dataset import table
    from vibrodrive.store.load import load
    from vibrodrive.store.tables import rows_of, write_lines

    damaged: list[str] = []
    with left_out(damaged):
        results = load(file)
        columns, _ = table(results.dimensionless() if results._origin.figure.get("units") == DIMENSIONLESS else results)
        share = results.computed
    write_lines(sys.stdout, columns, rows_of(columns))
    if share < 1:
        say(f"{file}: {100 * share:.1f} % computed")
    for message in damaged:
        say(message)
    if damaged:
        raise click.exceptions.Exit(1)
