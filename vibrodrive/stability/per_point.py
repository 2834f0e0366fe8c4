"""Records of a sweep that need several motions a point, or a function of a motion: limits, failures, own numbers.

Each point is independent of the others, so that a block is computed alike in this process, on an executor, and after
an interruption. This module yields the same blocks as `run_blocks` of batch/sweep.py.
"""

from __future__ import annotations

import keyword
from collections.abc import Callable, Collection, Generator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from pickle import PicklingError
from unicodedata import normalize

import numpy as np

from vibrodrive.batch import sweep
from vibrodrive.batch.trajectory import Trajectory, follow
from vibrodrive.errors import Failed
from vibrodrive.jit.slices import Halt
from vibrodrive.model.block import Block
from vibrodrive.model.choices import Status
from vibrodrive.model.names import NAMES
from vibrodrive.model.own import Own
from vibrodrive.model.parameters import COLUMNS, bad, real_number
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import FAILURES, IMPACTS, IN_FILES, LIMIT, RECORDS, SECTION, quantities
from vibrodrive.model.results import ATTRIBUTES, Results
from vibrodrive.model.states import State
from vibrodrive.stability.criterion import IMPACTS as KEEPS_IMPACTS
from vibrodrive.stability.criterion import parse_criterion
from vibrodrive.stability.failures import count_failures
from vibrodrive.stability.limit import LimitSearch

TAKEN = {*NAMES, *dir(Results), *RECORDS, *ATTRIBUTES, *IN_FILES}
"""Names that a number of a function cannot have, because results and files use them."""


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
        raise TypeError(bad("record", str(functions(plan)[0]), allowed)) from error


def compute_wave(
    plan: Plan, blocks: Sequence[sweep.Span], threads: int, halt: Halt, give: Callable[[Block], None]
) -> None:
    """Compute blocks, and call `give` with each of them when it is finished."""
    WAVES.get(plan.record[0], _take_in_turn)(plan, blocks, threads, halt, give)


def _take_in_turn(
    plan: Plan, blocks: Sequence[sweep.Span], threads: int, halt: Halt, give: Callable[[Block], None]
) -> None:
    """Compute one block after the other."""
    for index, start, stop in blocks:
        give(compute(plan, start, stop, threads, halt)._replace(index=index))


def _empty(plan: Plan, index: int, start: int, stop: int) -> Block:
    """Return a block without results."""
    n = stop - start
    return Block(
        index, start, stop, np.full((n, plan.settings.periods, 2), np.nan) if SECTION in plan.record else None,
        np.full(n, int(Status.OK), np.int8), np.full(n, np.nan), np.full((n, len(State)), -1),
        {q.name: np.full(n, q.fill, q.dtype) for q in quantities(plan.record)},
    )  # fmt: skip


def _find_limits(
    plan: Plan, blocks: Sequence[sweep.Span], threads: int, halt: Halt, give: Callable[[Block], None]
) -> None:
    """Find the limits at the points of some blocks. Call `give` with each block when its last limit is found."""
    owner = {at: span for span in blocks for at in range(span[1], span[2])}
    empty = {span: _empty(plan, *span) for span in blocks}
    left = {span: span[2] - span[1] for span in blocks}
    for point, found in LimitSearch(plan, parse_criterion(KEEPS_IMPACTS), threads, halt).run(list(owner)):
        span = owner[point]
        block, at = empty[span], point - span[1]
        block.status[at] = found.status
        values = {"orbit_period": found.n, "how": found.code}
        for name, column in block.records.items():
            column[at] = values[name] if name in values else getattr(found, name)
        left[span] -= 1
        if not left[span]:
            give(empty.pop(span))


WAVES = {LIMIT: _find_limits, FAILURES: _take_in_turn}
"""Function that computes the blocks of each record of PER_POINT; `_take_in_turn` computes functions of a motion."""


def compute(plan: Plan, start: int, stop: int, threads: int = 1, halt: Halt | None = None) -> Block:
    """Compute the points from `start` to `stop` - 1 of a plan. The result depends on the plan only, to the bit."""
    n, halt = stop - start, halt or Halt()
    block = _empty(plan, 0, start, stop)
    of_motion = tuple(name for name in plan.record if not isinstance(name, Own) and name != FAILURES)
    if of_motion:
        plain = sweep.compute(replace(plan, record=of_motion), start, stop, threads, halt)
        block = plain._replace(records={**block.records, **plain.records})
    with ThreadPoolExecutor(min(threads, n)) as pool:
        raised = list(pool.map(lambda at: _take_numbers(plan, block, at, halt), range(n)))
    return block._replace(raised=tuple(one for one in raised if one is not None))


def motion_at(plan: Plan, at: int, halt: Halt | None = None) -> Trajectory:
    """Return the motion at a point of a plan, computed as by `simulate`."""
    return follow(Plan({}, dict(zip(COLUMNS, plan.points(at, at + 1)[0].tolist(), strict=True)), plan.settings), halt)


def _take_numbers(plan: Plan, block: Block, at: int, halt: Halt) -> str | None:
    """Follow the motion at point `at` of a block, and write what the records take of it. Return what a function raised.

    A function that raises leaves NaN, and the other points are computed all the same.
    """
    motion = motion_at(plan, block.start + at, halt)
    block.status[at], block.margin[at] = motion.status, motion.margin
    block.switches[at] = np.bincount(motion.switches["after"], minlength=len(State))
    if FAILURES in plan.record:
        for name, count in count_failures(motion)._asdict().items():
            block.records[name][at] = count
    for own in functions(plan):
        found = numbers_of(own, motion)
        if isinstance(found, Exception):
            block.status[at] = Status.RAISED
            return f"{own} at {place(plan, block.start + at)}: {type(found).__name__}: {found}"
        for name, value in found.items():
            block.records[name][at] = value
    return None


def functions(plan: Plan) -> list[Own]:
    """Return the functions among the records of a plan."""
    return [one for one in plan.record if isinstance(one, Own)]


def numbers_of(own: Own, motion: Trajectory) -> dict[str, float] | Exception:
    """Return the numbers of a function by name, or the exception that it raised, also for a result without numbers.

    Any other exception is a fault of this program, and never the result of a point.
    """
    if own.function is None:
        raise Failed(f"record = {str(own)!r}: must be computed by a call that gives the function")
    allowed = f"a number, or numbers by name, as the result of {own}"
    try:
        found = own.function(motion)
        named = found if isinstance(found, Mapping) else {str(own): found}
        values = {str(name): real_number(str(name), value, allowed) for name, value in named.items()}
        if not values:
            raise TypeError(bad(str(own), found, allowed))
        if own.numbers and set(values) != set(own.numbers):
            raise ValueError(bad("names", list(values), f"{', '.join(own.numbers)}, as at the first point"))
        return values
    except Exception as error:
        return error


def with_names(plan: Plan) -> Plan:
    """Return a plan whose functions have the names of their numbers, which one call of each function tells.

    Raises ValueError if a function raises at all points, with its first exception, and if a name is not usable.
    """
    if all(own.numbers for own in functions(plan)):
        return plan
    named: list[str] = []
    record = []
    for one in plan.record:
        if isinstance(one, Own):
            one = one.returning(tuple(_first_names(plan, one)))
            for name in one.numbers:
                _check_name(one, name, {*named, *plan.axes, *plan.together})
                named.append(name)
        record.append(one)
    return replace(plan, record=tuple(record))


def _check_name(own: Own, name: str, others: Collection[str]) -> None:
    """Refuse a name of a number that results or files could not have. Raises ValueError."""
    if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_") or name != normalize("NFKC", name):
        allowed = "a name as of a variable in Python, such as settling_time"
    elif name in TAKEN or name in others:
        allowed = "a name of its own, such as settling_time, because this one is taken"
    else:
        return
    raise ValueError(bad(f"a name of {own}", name, allowed))


def _first_names(plan: Plan, own: Own) -> list[str]:
    """Return the names of the numbers of a function, from the first point at which it does not raise."""
    first: tuple[int, Exception] | None = None
    for at in range(plan.n_points):
        found = numbers_of(own, motion_at(plan, at))
        if not isinstance(found, Exception):
            return list(found)
        first = first or (at, found)
    assert first is not None, "a plan has points"
    at, why = first
    raise ValueError(
        f"{own} raised at all {plan.n_points} points, first at {place(plan, at)}: {type(why).__name__}: {why}"
    ) from why


def place(plan: Plan, at: int) -> str:
    """Return the values of a point on the axes as text."""
    index = np.unravel_index(at, plan.shape) if plan.axes else ()
    return ", ".join(f"{name} = {axis[k]:g}" for (name, axis), k in zip(plan.axes.items(), index, strict=True)) or (
        "the one point"
    )


def load_kernels(plan: Plan) -> None:
    """Load or compile the kernels of a plan, before its time is measured."""
    short = replace(plan.settings, transient=0, periods=1)
    if LIMIT not in plan.record:
        motion = motion_at(replace(plan, settings=short), 0)
        if FAILURES in plan.record:
            count_failures(motion)
        return
    axes = {**plan.axes, plan.sought: np.array([0.0, 1e-3] if plan.sought == "eps" else [0.1])}
    sweep.load_kernels(replace(plan, axes=axes, settings=short, record=(SECTION, IMPACTS)))
