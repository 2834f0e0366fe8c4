"""Are the switching times of your own program right? Each is held against the certified one from the same state.

    python -m examples.audit mine.csv --A 3.04   # in the root of a clone

`mine.csv` has a line of titles, then one switch a line: tau, xi, dxi, state. The state is the one that begins there
(UP, DOWN, STICK or REST), ξ and ξ' are those it begins with: after an impact 0 and 0. Each line is judged by itself:
the certified motion starts from what the line before says, so that an error is counted once, where it was made.
"""

from __future__ import annotations

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
"""Verdicts: the next switch, if late or early; one before it was missed; another state begins, or was to be left."""


@dataclass(frozen=True)
class Switch:
    """A state begins: at τ, with ξ and ξ' (dimensionless)."""

    tau: float
    xi: float
    dxi: float
    state: str


@dataclass(frozen=True)
class Judged:
    """A switch, its verdict, and how late it came (NaN unless it is right; negative: too early)."""

    switch: Switch
    verdict: str
    late: float


def audit(switches: Sequence[Switch], A: float, B: float = 0.1, eps: float = 0.0, eta: float = vd.ETA) -> list[Judged]:
    """Judge every switch but the first, from the state that the one before it began."""
    return [_judge(a, b, {"A": A, "B": B, "eps": eps, "eta": eta}) for a, b in pairwise(switches)]


def _judge(start: Switch, found: Switch, model: dict[str, float]) -> Judged:
    """The certified switch after `start` against the one found.

    The motion is followed to beyond the one found. What `start` overshot or came too early is on its own line: from
    below the obstacle it starts at it, and waits until its state begins.
    """
    periods = 2 + int((found.tau - start.tau) / (2.0 * np.pi))
    scene = {**model, "xi0": max(start.xi, 0.0), "dxi0": start.dxi, "tau0": start.tau}
    rows = vd.simulate(**scene, transient=0, periods=periods).switches
    if len(rows) and State(rows["before"][0]).name != start.state == State(rows["after"][0]).name:
        rows = rows[1:]
    if not len(rows) or State(rows["before"][0]).name != start.state:
        return Judged(found, OTHER, np.nan)
    rows = rows[rows["after"] != State.IMPACT]  # over at once: what follows it is the switch
    times = 2.0 * np.pi * rows["period"] + rows["phase"]
    if len(rows) > 1 and times[1] <= found.tau:
        return Judged(found, MISSED, np.nan)
    if not len(rows) or State(rows["after"][0]).name != found.state:
        return Judged(found, OTHER, np.nan)
    return Judged(found, RIGHT, found.tau - times[0])


def read(path: str) -> list[Switch]:
    """The switches of a file. Raises OSError, KeyError (a title is missing) and ValueError (no number)."""
    with open(path, newline="") as file:
        return [
            Switch(float(row["tau"]), float(row["xi"]), float(row["dxi"]), row["state"].strip())
            for row in csv.DictReader(file)
        ]


def report(judged: Iterable[Judged]) -> str:
    """Counts, the lateness of the right ones, and the first that is not right."""
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
    parser = argparse.ArgumentParser(description="Hold switching times of your own against certified ones.")
    parser.add_argument("file", help="tau, xi, dxi, state: a line a switch, under a line of titles")
    parser.add_argument("--A", type=float, required=True)
    parser.add_argument("--B", type=float, default=0.1)
    parser.add_argument("--eps", type=float, default=0.0)
    parser.add_argument("--eta", type=float, default=vd.ETA)
    arguments = parser.parse_args()
    print(report(audit(read(arguments.file), arguments.A, arguments.B, arguments.eps, arguments.eta)))


if __name__ == "__main__":
    main()
