"""`vibrodrive validate`: what is known exactly, or otherwise, held against what this installation computes."""

from __future__ import annotations

import secrets
from pathlib import Path

import click

from vibrodrive.cli.common import DIRECTORY, say, working


@click.command()
@click.option(
    "-o",
    "--output",
    type=DIRECTORY,
    default=Path("validation"),
    show_default=True,
    help="Directory for validation.json and validation.md; made if it is not there.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    help="Seed of the drawn scenes, as an earlier run shows it (default: a new one).",
)
@click.option("--only", "names", metavar="CHECK", multiple=True, help="Only this check (hash); repeatable.")
def validate(output: Path, seed: int | None, names: tuple[str, ...]) -> int:
    """Check this installation: each number with its bound and a verdict. Exit code 1 if one fails."""
    from vibrodrive.validation import run
    from vibrodrive.validation.check import Verdict

    seed = secrets.randbelow(2**32) if seed is None else seed
    with working(output.name) as show:
        judged = run.validate(seed, names, say=show.say)
        files = run.write(output, seed, judged)
    say(f"{run.counts(judged)} (seed {seed}): {' and '.join(map(str, files))}")
    return int(any(j.verdict is Verdict.FAILS for j in judged))
