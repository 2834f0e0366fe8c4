"""`vibrodrive validate`: check this installation against known results."""

import secrets
from pathlib import Path

import click

from vibrodrive.cli.common import directory, say, working


@click.command()
@directory("validation", "Directory of validation.json and validation.md; created if missing.")
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    help="Seed of the random parameters and starts, to repeat an earlier run (default: a new seed).",
)
@click.option(
    "--only",
    "names",
    metavar="CHECK",
    multiple=True,
    help="Run only this check, such as hash; repeatable. The message about an unknown name lists all names.",
)
def validate(output: Path, seed: int | None, names: tuple[str, ...]) -> int:
    """Check this installation against known results.

    The checks compare results with a reference of 50 digits, with published laws and with other solvers. They also
    check the balance of energy, and compare the bits of results that must be equal.

    Output: validation.json and validation.md, with each number, its bound and a verdict. Exit code 1 if a check fails.
    """
    from vibrodrive.validation import run
    from vibrodrive.validation.check import Verdict

    seed = secrets.randbelow(2**32) if seed is None else seed
    with working(output.name) as show:
        judged = run.validate(seed, names, say=show.say)
        files = run.write(output, seed, judged)
    say(f"{run.counts(judged)}; seed {seed}; {' and '.join(map(str, files))} written")
    return int(any(j.verdict is Verdict.FAILS for j in judged))
