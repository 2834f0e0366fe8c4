"""`vibrodrive paper`: every figure of the paper, and its claims compared with the results."""

from collections import Counter
from pathlib import Path

import click

from vibrodrive.cli.common import THREADS, directory, say, working


@click.command()
@directory("paper", "Directory of the figures, the data and the claims; created if missing.")
@click.option(
    "--only",
    "names",
    metavar="FIGURE",
    multiple=True,
    help="Compute only this figure, such as fig07, or only the claims about limits (`limits`); repeatable.",
)
@THREADS
def paper(output: Path, names: tuple[str, ...], threads: int | None) -> None:
    """Compute the figures of the paper, and check its claims.

    Output, in DIRECTORY: figNN.png, figNN.pdf and the data of each figure; claims.json and claims.md with the verdict
    on each claim.
    """
    from vibrodrive.paper.run import run_paper

    with working(output.name) as show:
        result = run_paper(output, names or None, show.say, threads)
    verdicts = Counter(judged.verdict.value for judged in result.claims)
    counts = ", ".join(f"{verdict}: {count}" for verdict, count in verdicts.items())
    say(f"Number of claims: {len(result.claims)} ({counts or 'none about these figures'})")
    say(f"{output}: {len(result.files)} files written")
