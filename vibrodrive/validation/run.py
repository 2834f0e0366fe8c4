"""Table of all checks, and the files with their results: validation.json and validation.md."""

import platform
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from vibrodrive import verdicts
from vibrodrive.model.parameters import bad
from vibrodrive.store.layout import versions
from vibrodrive.validation import (
    bouncing_ball,
    certainty,
    clocks,
    digits,
    energy,
    fingerprint,
    grazing,
    identity,
    peers,
)
from vibrodrive.validation.check import Check, Verdict, judge
from vibrodrive.verdicts import Judged

CHECKS = (
    Check("hash", "The hash of a small sweep equals that of other machines", fingerprint.small_sweep),
    Check("digits", "Switches of fixed scenes compared with a 50-digit reference", digits.fixed_scenes, ("mpmath",)),
    Check("drawn", "Random scenes compared with the 50-digit reference", digits.drawn_scenes, ("mpmath",), drawn=True),
    Check("bounds", "Error bounds compared with the reference", certainty.bounds_of_drawn, ("mpmath",), drawn=True),
    Check("grazing", "Flights that graze the obstacle at ±1e-3 to ±1e-15", grazing.grazing_ladder, ("mpmath",)),
    Check("million", "Phase after a million periods", clocks.million_periods, ("mpmath",)),
    Check("energy", "Energy balance: excitation = friction + impacts", energy.energy_balance),
    Check("skip", "Skipping grid points gives the same bits as visiting all grid points", identity.skip_is_literal),
    Check("threads", "One thread gives the same bits as two threads", identity.one_thread_is_two),
    Check("resume", "A resumed sweep has the same bits as an uninterrupted one", identity.resumed_is_uninterrupted),
    Check("ball", "B → ∞: the laws of the inelastic bouncing ball", bouncing_ball.findings),
    Check("scipy", "Comparison with scipy's events", peers.scipy_events, ("scipy",)),
    Check("heyoka", "Comparison with heyoka's events", peers.heyoka_events, ("heyoka",)),
)
"""Checks in the order of execution."""


def validate(
    seed: int,
    only: Sequence[str] = (),
    say: Callable[[str], None] = lambda line: None,
) -> list[Judged]:
    """Run the checks with the ids in `only`, by default all. After each check `say` is called with a line of text.

    Raises ValueError for an unknown id.
    """
    ids = [check.id for check in CHECKS]
    for name in only:
        if name not in ids:
            raise ValueError(bad("only", name, "one of " + ", ".join(ids)))
    judged = []
    for check in CHECKS:
        if not only or check.id in only:
            judged.append(judge(check, seed))
            say(f"{judged[-1].verdict}: {check.title}" + (f" ({judged[-1].text})" if judged[-1].text else ""))
    return judged


def write(folder: Path, seed: int, judged: Sequence[Judged]) -> list[Path]:
    """Write validation.json and validation.md to a directory, which is created if missing. Raises OSError."""
    about: dict[str, Any] = {
        "versions": versions(),
        "system": f"{platform.system()} {platform.machine()}",
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "seed": seed,
    }
    made = ", ".join(f"{name} {version}" for name, version in about["versions"].items())
    page = [
        "# Validation",
        "",
        f"{counts(judged)}. Written by `vibrodrive validate --seed {seed}`, {about['created']}.",
        f"{made}; {about['system']}.",
        "",
        *verdicts.table(["check", "verdict", "number", "bound"], judged),
    ]
    return verdicts.write(folder, "validation", {**about, "checks": [j.document() for j in judged]}, page)


def counts(judged: Sequence[Judged]) -> str:
    """Return one line with the number of each verdict, such as `Number of checks: 12 (holds: 10, …)`."""
    return verdicts.counts(judged, "checks", Verdict)
