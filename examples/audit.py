"""Check the switching times of your own program: compare each switch with the certified switch from the same state.

    python -m examples.audit mine.csv --A 3.04   # in the root of a clone

The first line of `mine.csv` has the names of the columns: tau, xi, dxi, state. Each further line has one switch.
`state` is the state that begins at this switch (UP, DOWN, STICK or REST). `xi` and `dxi` are ξ and ξ' at the beginning
of this state; after an impact both are 0. Each line is judged separately: the certified motion starts from the state of
the previous line. So an error counts only at the line at which it occurs.
"""

import argparse
import csv
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import vibrodrive as vd
from vibrodrive import State

RIGHT, MISSED, OTHER = "right", "missed", "another state"
"""Verdicts: the right switch (possibly late or early); an earlier switch was missed; a different state begins or
ends."""


@dataclass(frozen=True)
class Switch:
    """The beginning of a state: its time τ, and ξ and ξ' at this time (dimensionless)."""

    tau: float
    xi: float
    dxi: float
    state: str


@dataclass(frozen=True)
class Judged:
    """A switch, its verdict, and its delay (negative if the switch is too early, NaN if the verdict is not RIGHT)."""

    switch: Switch
    verdict: str
    late: float


def audit(switches: Sequence[Switch], A: float, B: float = 0.1, eps: float = 0.0, eta: float = vd.ETA) -> list[Judged]:
    """Judge every switch except the first, from the state that begins at the previous switch."""
    return [_judge(a, b, {"A": A, "B": B, "eps": eps, "eta": eta}) for a, b in pairwise(switches)]


def _judge(start: Switch, found: Switch, model: dict[str, float]) -> Judged:
    """Compare the switch `found` with the certified switch after `start`.

    The certified motion is computed beyond `found`.

    An error of `start` counts only at the line of `start`. If `start` is below the obstacle, or too early for its
    state, the certified motion starts at the obstacle and rests until this state begins.
    """
    periods = 2 + int((found.tau - start.tau) / (2.0 * np.pi))
    scene = {**model, "xi0": max(start.xi, 0.0), "dxi0": start.dxi, "tau0": start.tau}
    rows = vd.simulate(**scene, transient=0, periods=periods).switches
    if len(rows) and State(rows["before"][0]).name != start.state == State(rows["after"][0]).name:
        rows = rows[1:]
    if not len(rows) or State(rows["before"][0]).name != start.state:
        return Judged(found, OTHER, np.nan)
    rows = rows[rows["after"] != State.IMPACT]  # an impact is instantaneous: the next row is the switch
    times = 2.0 * np.pi * rows["period"] + rows["phase"]
    if len(rows) > 1 and times[1] <= found.tau:
        return Judged(found, MISSED, np.nan)
    if not len(rows) or State(rows["after"][0]).name != found.state:
        return Judged(found, OTHER, np.nan)
    return Judged(found, RIGHT, found.tau - times[0])


def read(path: str) -> list[Switch]:
    """Read the switches of a file. Raises OSError, KeyError (a missing column) and ValueError (an invalid number)."""
    with open(path, newline="") as file:
        return [
            Switch(float(row["tau"]), float(row["xi"]), float(row["dxi"]), row["state"].strip())
            for row in csv.DictReader(file)
        ]


def report(judged: Iterable[Judged]) -> str:
    """Return as text the number of each verdict, the delay of the right switches, and the first wrong switch."""
    judged = list(judged)
    counts = Counter(j.verdict for j in judged)
    lines = [f"{len(judged)} switches: " + ", ".join(f"{counts[v]} {v}" for v in (RIGHT, MISSED, OTHER))]
    late = np.array([j.late for j in judged if j.verdict == RIGHT])
    if len(late):
        lines.append(f"late by {np.median(late):.2g} (median), from {late.min():.2g} to {late.max():.2g}")
    wrong = next((j for j in judged if j.verdict != RIGHT), None)
    if wrong is not None:
        lines.append(f"first at τ = {wrong.switch.tau:.6f}, {wrong.switch.state}: {wrong.verdict}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare your switching times with certified switching times.")
    parser.add_argument("file", help="CSV file with the columns tau, xi, dxi, state, and one line per switch")
    parser.add_argument("--A", type=float, required=True)
    parser.add_argument("--B", type=float, default=0.1)
    parser.add_argument("--eps", type=float, default=0.0)
    parser.add_argument("--eta", type=float, default=vd.ETA)
    arguments = parser.parse_args()
    print(report(audit(read(arguments.file), arguments.A, arguments.B, arguments.eps, arguments.eta)))


if __name__ == "__main__":
    main()
