"""Checks of different computations that must give the same results, bit for bit."""

import tempfile
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from vibrodrive.batch.sweep import check_threads, collect, run_blocks
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.model.results import Results
from vibrodrive.store.every_kind import load
from vibrodrive.store.layout import Origin
from vibrodrive.store.writer import open_writer
from vibrodrive.validation.check import Finding
from vibrodrive.verdicts import NotApplicable

NAMES = ("section", "status", "margin", "switches")


def differing(one: Results, other: Results) -> int:
    """Return the number of values that are not equal in every bit."""
    total = 0
    for name in NAMES:
        a, b = (np.ascontiguousarray(getattr(r, name)) for r in (one, other))
        unsigned = f"u{a.dtype.itemsize}"
        total += int((a.view(unsigned) != b.view(unsigned)).sum())
    return total


def skip_is_literal() -> list[Finding]:
    """Compare a scan that skips grid points with a scan that visits all grid points."""
    found = []
    span: dict[str, Any] = {"A": np.linspace(1.2, 3.25, 40), "eps": [0.0, 2e-4], "transient": 5, "periods": 10}
    for method, dtau in (("fixed", 0.1), ("fixed", 1e-3), ("muller", 0.1), ("muller", 1e-3)):
        run = span | {"method": method, "dtau": dtau}
        skip, literal = (collect(make_plan({**run, "scan": scan})) for scan in ("skip", "literal"))
        found.append(Finding(f"{method}, Δτ = {dtau:g}: differing values", differing(skip, literal), 0))
    return found


def one_thread_is_two() -> list[Finding]:
    """Compare a sweep on one thread with the same sweep on two threads."""
    if check_threads(None) < 2:
        raise NotApplicable("needs two threads")
    run: dict[str, Any] = {"A": np.linspace(1.0, 3.25, 150), "eps": [0.0, 2e-4], "transient": 20, "periods": 20}
    return [Finding("differing values", differing(*(collect(make_plan(run), threads=n) for n in (1, 2))), 0)]


def resumed_is_uninterrupted() -> list[Finding]:
    """Compare a sweep that is interrupted and resumed in a file with the same sweep in memory."""
    run: dict[str, Any] = {"A": np.linspace(3.0, 3.25, 700), "eps": [0.0, 1e-4, 2e-4], "transient": 5, "periods": 5}
    plan = make_plan(run)
    half = range(len(plan.blocks()) // 2)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        path = Path(folder) / "sweep.h5"
        left = _write(path, plan, half)
        _write(path, plan)
        return [
            Finding("blocks that the interruption has lost", len(half) - left, 0),
            Finding("differing values", differing(load(path), collect(plan)), 0),
        ]


def _write(path: Path, plan: Plan, which: Iterable[int] | None = None) -> int:
    """Compute blocks of a plan into a file, by default all missing blocks. Return the number of blocks in the file."""
    with closing(open_writer(path, plan, Origin(""))) as writer:
        writer.check()
        missing = writer.missing() if which is None else list(which)
        for block in run_blocks(plan, missing):
            writer.write(block)
    return int(writer.done.sum())
