"""Records of a sweep that need several motions a point, or a function of a motion: limits, failures, own numbers.

Each point is independent of the others, so that a block is computed alike in this process, on an executor, and after
an interruption. This module yields the same blocks as `run_blocks` of batch/sweep.py.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pickle import PicklingError

import numpy as np

from vibrodrive.batch import sweep
from vibrodrive.batch.block import Block
from vibrodrive.batch.parallel import Pool
from vibrodrive.batch.trajectory import Trajectory, follow
from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.model.above import above
from vibrodrive.model.choices import Status
from vibrodrive.model.names import NAMES
from vibrodrive.model.own import Own, message_of
from vibrodrive.model.parameters import COLUMNS, bad
from vibrodrive.model.plan import Plan
from vibrodrive.model.record import OfMotion
from vibrodrive.model.records import ALWAYS, IMPACTS, LIMIT, SECTION, functions
from vibrodrive.model.records import TAKEN as BY_RECORDS
from vibrodrive.model.results import ATTRIBUTES, Results
from vibrodrive.model.states import State
from vibrodrive.model.variables import along, constants
from vibrodrive.stability.always import find_always
from vibrodrive.stability.evaluate import Evaluator
from vibrodrive.stability.impulses import find_tolerated
from vibrodrive.stability.limit import LimitSearch
from vibrodrive.stability.main_impacts import ImpactCycle
from vibrodrive.stability.reach import reach
from vibrodrive.stability.structure import ReferenceOrbit

AHEAD = 4  # points for each thread whose orbits are computed together; a block may have more

TAKEN = {*BY_RECORDS, *NAMES, *dir(Results), *ATTRIBUTES}
"""Names that a number of a function cannot have, because results, figures and files use them."""


def run_blocks(
    plan: Plan,
    which: Sequence[int] | None = None,
    *,
    threads: int | None = None,
    executor: Executor | None = None,
) -> Generator[Block, None, None]:
    """Compute the blocks of a plan (all, or those with the indices `which`) and yield each block when it is finished.

    Raises TypeError if the executor needs a function that can be sent to other processes, and this one cannot.
    """
    try:
        yield from sweep.run_blocks(plan, which, threads=threads, executor=executor, wave=compute_wave)
    except (PicklingError, AttributeError) as error:
        if executor is None or "pickle" not in str(error):
            raise
        allowed = "a function at the top of a module, because this executor sends it to other processes"
        raise TypeError(bad("record", str(functions(plan.record)[0]), allowed)) from error


def compute_wave(
    plan: Plan, blocks: Sequence[sweep.Span], threads: int, halt: Halt, give: Callable[[Block], None]
) -> None:
    """Compute blocks, and call `give` with each of them when it is finished."""
    above(plan.record[-1].wave)(plan, blocks, threads, halt, give)  # a function is behind the records of its motion


def take_in_turn(
    plan: Plan, blocks: Sequence[sweep.Span], threads: int, halt: Halt, give: Callable[[Block], None]
) -> None:
    """Compute one block after the other."""
    for index, start, stop in blocks:
        give(compute(plan, start, stop, threads, halt)._replace(index=index))


def _empty(plan: Plan, index: int, start: int, stop: int) -> Block:
    """Return a block without results."""
    n = stop - start
    return Block(
        index, start, stop, np.full((n, plan.settings.periods, 2), np.nan) if plan.sectioned else None,
        np.full(n, int(Status.OK), np.int8), np.full(n, np.nan), np.full((n, len(State)), -1),
        {q.name: np.full(n, q.fill, q.dtype) for q in plan.quantities if not q.along},
    )  # fmt: skip


def find_limits(
    plan: Plan, blocks: Sequence[sweep.Span], threads: int, halt: Halt, give: Callable[[Block], None]
) -> None:
    """Find the limits at the points of some blocks. Call `give` with each block when its last limit is found."""
    owner = {at: span for span in blocks for at in range(span[1], span[2])}
    empty = {span: _empty(plan, *span) for span in blocks}
    unfinished = {span: span[2] - span[1] for span in blocks}
    for point, limit in LimitSearch(plan, threads, halt).run(list(owner)):
        span = owner[point]
        block, at = empty[span], point - span[1]
        block.status[at] = limit.status
        values = {"orbit_period": limit.n, "how": limit.code}
        for name, numbers in block.records.items():
            numbers[at] = values[name] if name in values else getattr(limit, name)
        unfinished[span] -= 1
        if not unfinished[span]:
            give(empty.pop(span))


def find_impulses(
    plan: Plan, blocks: Sequence[sweep.Span], threads: int, halt: Halt, give: Callable[[Block], None]
) -> None:
    """Find what every disturbance may be at the points of some blocks, and call `give` with each block."""

    def values(point: Mapping[str, float], cycle: ImpactCycle | None) -> tuple[float, ...]:
        if halt.called:
            raise Halted
        tolerated = find_tolerated(point["A"], point["B"], cycle)
        return tolerated.velocity, tolerated.force, tolerated.beyond

    _of_orbits(plan, blocks, threads, halt, give, values)


def find_proofs(
    plan: Plan, blocks: Sequence[sweep.Span], threads: int, halt: Halt, give: Callable[[Block], None]
) -> None:
    """Find the limits for all times at the points of some blocks, and call `give` with each block."""

    def values(point: Mapping[str, float], cycle: ImpactCycle | None) -> tuple[float, ...]:
        always = find_always(point["A"], point["B"], point["eta"], cycle, halt)
        return always.k2, always.starts_width, always.beyond

    _of_orbits(plan, blocks, threads, halt, give, values)


def _of_orbits(
    plan: Plan,
    blocks: Sequence[sweep.Span],
    threads: int,
    halt: Halt,
    give: Callable[[Block], None],
    values: Callable[[Mapping[str, float], ImpactCycle | None], tuple[float, ...]],
) -> None:
    """Call `give` with each block of the quantities whose `values` follow from the undisturbed orbits."""

    def write(block: Block, point: int, base: ReferenceOrbit | Status) -> None:
        at = point - block.start
        if isinstance(base, Status):
            block.status[at] = base
            return
        row = dict(zip(COLUMNS, plan.points(point, point + 1)[0].tolist(), strict=True))
        for q, value in zip(plan.quantities, values(row, base.cycle), strict=True):
            block.records[q.name][at] = value

    waiting = deque(_empty(plan, *span) for span in blocks)
    with Evaluator(plan, plan.sought, threads, halt) as evaluator, Pool(threads) as pool:
        while waiting:
            points: list[tuple[Block, int]] = []
            while waiting and len(points) < AHEAD * threads:
                points += [(waiting[0], point) for point in range(waiting[0].start, waiting[0].stop)]
                waiting.popleft()
            orbits = evaluator.undisturbed(np.array([point for _, point in points]))
            done = pool.map(write, *zip(*points, strict=True), orbits)
            for (block, point), _ in zip(points, done, strict=True):
                if point + 1 == block.stop:
                    give(block)


def compute(plan: Plan, start: int, stop: int, threads: int = 1, halt: Halt | None = None) -> Block:
    """Compute the points from `start` to `stop` - 1 of a plan. The result depends on the plan only, to the bit."""
    n, halt = stop - start, halt or Halt()
    block = _empty(plan, 0, start, stop)
    together = tuple(record for record in plan.record if not record.per_point)
    if together:
        plain = sweep.compute(replace(plan, record=together, stored=None), start, stop, threads, halt)
        block = plain._replace(records={**block.records, **plain.records})
    with Pool(min(threads, n)) as pool:
        raised = list(pool.map(lambda at: _take_numbers(plan, block, at, halt), range(n)))
    return block._replace(raised=tuple(text for text in raised if text is not None))


def motion_at(plan: Plan, at: int, halt: Halt | None = None) -> Trajectory:
    """Return the motion at a point of a plan, computed as by `simulate`."""
    point = dict(zip(COLUMNS, plan.points(at, at + 1)[0].tolist(), strict=True))
    return follow(Plan(constants(point), plan.settings), halt)


def _take_numbers(plan: Plan, block: Block, at: int, halt: Halt) -> str | None:
    """Follow the motion at point `at` of a block, and write what the records take of it. Return what a function raised.

    A function that raises leaves NaN, and the other points are computed all the same.
    """
    motion = motion_at(plan, block.start + at, halt)
    for array in (motion.section, motion.switches):  # no function may change what another one reads
        array.flags.writeable = False
    block.status[at], block.margin[at] = motion.status, motion.margin
    block.switches[at] = np.bincount(motion.switches["after"], minlength=len(State))
    for record in plan.record:
        if isinstance(record, OfMotion):
            numbers = record.numbers(motion)
            if isinstance(numbers, Exception):
                block.status[at] = Status.RAISED
                return f"{record} at {place(plan, block.start + at)}: {message_of(numbers)}"
            for name, value in numbers.items():
                block.records[name][at] = value
    return None


def with_names(plan: Plan) -> Plan:
    """Return a plan whose functions have the names of their numbers, which one call of each function tells.

    Raises ValueError if a function raises at all points, with its first exception, and if a name is not usable.
    """
    if all(record.returned for record in plan.record if isinstance(record, Own)):
        return plan
    taken, records = {*TAKEN, *plan.axes, *plan.together}, []
    for record in plan.record:
        if isinstance(record, Own):
            motions = ((place(plan, at), motion_at(plan, at)) for at in range(plan.n_points))
            record = record.returning(motions, taken)
            taken.update(record.returned)
        records.append(record)
    return replace(plan, record=tuple(records))


def place(plan: Plan, at: int) -> str:
    """Return the values of a point on the axes as text."""
    index = np.unravel_index(at, plan.shape) if plan.axes else ()
    return ", ".join(f"{name} = {axis[k]:g}" for (name, axis), k in zip(plan.axes.items(), index, strict=True)) or (
        "the one point"
    )


def load_kernels(plan: Plan) -> None:
    """Load or compile the kernels of a plan, before its time is measured."""
    short = replace(plan.settings, transient=0, periods=1)
    of_motion = [record for record in plan.record if isinstance(record, OfMotion)]
    if of_motion:
        motion = motion_at(replace(plan, settings=short), 0)
        for record in of_motion:
            if record.alone:
                record.numbers(motion)
        return
    searched = plan.record == (LIMIT,)
    sought = {plan.sought: np.array([0.0, 1e-3] if plan.sought == "eps" else [0.1])} if searched else {}
    variables = {**plan.variables, **along(plan.sought, sought)}
    sweep.load_kernels(replace(plan, variables=variables, settings=short, record=(SECTION, IMPACTS)))
    if not searched:  # proofs for all times begin with what every disturbance may be
        find_tolerated(2.0, 0.1, ImpactCycle(np.ones(1), np.zeros(1), np.ones(1)))
    if plan.record == (ALWAYS,):
        reach.prepare()
