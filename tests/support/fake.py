"""Blocks with invented results, for tests of the store and of the command line.

As with kernels, the results of a point depend on this point only. `delay` is the duration of a block in seconds.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vibrodrive.batch.block import Block
from vibrodrive.model.config import parse
from vibrodrive.model.physical import measure
from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import row_of
from vibrodrive.model.records import SECTION, quantities
from vibrodrive.store.layout import Origin
from vibrodrive.store.writer import open_writer


def block(plan: Plan, k: int) -> Block:
    """Return block k of a plan. Its numbers resemble those of an orbit, and all of them differ."""
    start, stop = plan.blocks()[k]
    points = plan.points(start, stop)
    period = np.arange(1, plan.settings.periods + 1)
    phase = points[:, :1] * period + np.arange(start, stop)[:, None]
    section = np.stack([np.sin(phase), np.cos(phase)], axis=-1)
    number = np.arange(start, stop)
    switches = number[:, None] * np.arange(1, 6)
    records = {}
    for m, q in enumerate(quantities(plan.record)):
        shape = (stop - start, *((2 * plan.settings.periods,) if q.along == "impact" else ()))
        records[q.name] = (1 + m + number.reshape(-1, *[1] * (len(shape) - 1)) * np.ones(shape)).astype(q.dtype)
    status, margin = (number % 3).astype(np.int8), np.exp(-number * 0.01)
    return Block(k, start, stop, section if SECTION in plan.record else None, status, margin, switches, records)


def run_blocks(plan: Plan, which: Sequence[int] | None = None, *, delay: float = 0.0, **_: Any) -> Iterator[Block]:
    """Yield blocks like `run_blocks` of batch/sweep.py."""
    for k in range(len(plan.blocks())) if which is None else which:
        time.sleep(delay)
        yield block(plan, k)


def write(
    path: str | Path,
    plan: Plan | str,
    origin: Origin | str = "",
    which: Sequence[int] | None = None,
    of: Callable[[Plan, int], Block] | None = None,
    **options: Any,
) -> list[int]:
    """Write all or some of the blocks of the file of a sweep that are missing or damaged. Return their numbers.

    `plan` may be a configuration as text, and `of` gives a block (default: `block`).
    """
    if isinstance(plan, str):
        plan, origin = parse(plan).plan(), origin or plan
    writer = open_writer(Path(path), plan, Origin(origin) if isinstance(origin, str) else origin, **options)
    try:
        writer.check()
        todo = [k for k in writer.missing() if which is None or k in which]
        for k in todo:
            writer.write((of or block)(writer.plan, k))
    finally:
        writer.close()
    return todo


UNITLESS = {"measure": lambda quantity: measure(row_of((), quantity), {}), "scene": None}
"""What figures ask of results or a motion without a scene."""
