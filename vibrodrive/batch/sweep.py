"""Computation of the points of a plan (model/plan.py) on all cores, in blocks. Each finished block is yielded.

Without an executor, blocks are computed on local threads (parallel.py). An executor is any object with the interface of
`concurrent.futures`; each task then computes some blocks on one thread. Both ways give the same results to the bit. A
lane is the memory of one motion in a kernel (kernels/lane.py).
"""

import math
import os
import platform
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import closing, suppress
from dataclasses import replace
from functools import cache
from queue import SimpleQueue
from time import monotonic
from typing import Any
from uuid import uuid4

import numpy as np

from vibrodrive.batch import memory
from vibrodrive.batch.block import Block, gather
from vibrodrive.batch.parallel import BRIEF, Pool, run
from vibrodrive.batch.records import Arrays, Rows
from vibrodrive.errors import Failed
from vibrodrive.jit.slices import Halt
from vibrodrive.jit.sources import build
from vibrodrive.kernels.arguments import SWITCH, Arguments
from vibrodrive.kernels.engine import batch
from vibrodrive.kernels.history import new_history
from vibrodrive.kernels.lane import LANES, new_lanes
from vibrodrive.kernels.outputs import numbers_of
from vibrodrive.kernels.setup import fast_amplitude
from vibrodrive.kernels.single import single
from vibrodrive.model.choices import Method, Status
from vibrodrive.model.names import Settings
from vibrodrive.model.parameters import bad, check_count
from vibrodrive.model.plan import BLOCK_WORK, IN_FLIGHT, Plan
from vibrodrive.model.results import Results

RETRIES = 3
"""Number of times that a failed block is submitted again. With a larger number, a sweep can lose more workers and
continue."""

UNFINISHED = int(Status.NOT_COMPUTED)

REGISTER = 8
"""Number of lanes in the widest register, and least number of lanes of a thread. A full register costs little more than
one lane."""

TASK_SECONDS = 1.0
"""Time in seconds after which a task of an executor begins no other block. A task of a tenth of a second would take
noticeably longer, because it must be sent, and a longer task is lost if the sweep is stopped."""

Span = tuple[int, int, int]  # block to compute: index, start, stop

Wave = Callable[[Plan, Sequence[Span], int, Halt, Callable[[Block], None]], None]
"""Function like `compute_wave`: it computes several blocks of a plan on some threads, and gives each of them."""


def compute(plan: Plan, start: int, stop: int, threads: int = 1, halt: Halt | None = None) -> Block:
    """Compute the points from `start` to `stop` - 1 of a plan. The result depends on the plan only, to the bit."""
    blocks: list[Block] = []
    compute_wave(plan, [(0, start, stop)], threads, halt or Halt(), blocks.append)
    return blocks[0]


def compute_wave(
    plan: Plan,
    blocks: Sequence[Span],
    threads: int,
    halt: Halt,
    give: Callable[[Block], None],
    rows: Rows | None = None,
) -> None:
    """Compute several blocks together, so that no thread is idle at the end of a block.

    `give` is called with each block soon after its last point is finished, while other blocks are computed. `rows` are
    arrays for the results (`Results.rows`); by default new arrays are allocated. Raises Halted if `halt` is called.
    """
    points = np.concatenate([plan.points(start, stop) for _, start, stop in blocks])
    arrays = Arrays.new(plan, len(points), rows)
    arrays.status[:] = UNFINISHED
    unfinished, at = {}, 0
    for span in blocks:
        unfinished[span] = at
        at += span[2] - span[1]

    def look() -> None:
        for span, at in [*unfinished.items()]:
            if (arrays.status[at : at + span[2] - span[1]] != UNFINISHED).all():
                del unfinished[span]
                give(arrays.block(span, at))

    fill(plan.settings, points, threads, halt, arrays, look)
    look()


def compute_points(plan: Plan, numbers: np.ndarray, threads: int, halt: Halt) -> Block:
    """Compute the points with these numbers, int64 (n,), of a plan, and return them as one block."""
    arrays = Arrays.new(plan, len(numbers))
    fill(plan.settings, plan.rows(numbers), threads, halt, arrays)
    return arrays.block((0, 0, len(numbers)), 0)


def fill(
    settings: Settings,
    points: np.ndarray,
    threads: int,
    halt: Halt,
    arrays: Arrays,
    look: Callable[[], None] | None = None,
) -> None:
    """Compute `points`, float64 (n, columns), and write the results into `arrays`, which have one row for each point.

    The columns of `points` are the parameters in the order of COLUMNS (model/parameters.py). The status of a point is
    written last. `look` is called periodically meanwhile.
    """
    section, status, margin, counts, impacts, summary, errors = arrays
    s, n = settings, len(points)
    if n == 0:
        return
    bounded = errors is not None and s.method != Method.FIXED
    alone = s.one_by_one(bounded)
    low, high = _ends(points)
    (A, *_, dtau), (_, B, eps, eta, _) = low, high
    work = n * s.work(A, B, eps, eta, dtau, summary=summary is not None, bounded=bounded)
    brief = work <= BRIEF
    recorded = impacts is not None or summary is not None
    if brief and n == 1 and s.periods <= memory.FEW and section is not None and not (recorded or alone):
        a = memory.take(s.periods, 0)  # to allocate and describe arrays would take several times as long as the motion
        a.points[:], a.numbers[:] = points, numbers_of(s, REGISTER)
        run([(batch(s.method, _disturbed(low), recorded), [a])], halt, brief=True)
        section[:], status[:], margin[:], counts[:] = a.section, a.status, a.margin, a.counts
        memory.give_back(a)
        return
    threads = 1 if brief else busy_threads(threads, n, alone)
    sections = [section] * threads if section is not None else list(np.empty((threads, 1, s.periods, 2)))
    w, k = new_lanes(threads, n)
    none = [None] * threads
    history, totals = new_history(threads, summary is not None) if recorded else (none, none)
    results = status, margin, counts, np.empty(n)
    main, sums = np.empty((n, 0, 4)) if impacts is None else impacts, np.empty((n, 0)) if summary is None else summary
    extra = (
        (np.empty(0, SWITCH), np.zeros(1, np.int64), np.empty((0, 3)), *(errors[:2] if errors else ())) if alone else ()
    )

    def each(order: np.ndarray) -> list[Arguments]:
        """Return one set of arguments for each thread. The threads have separate memory and share one counter."""
        lanes = min(LANES, max(REGISTER, -(-len(order) // threads)))  # all threads have work, even for few points
        shared = points, order, np.zeros(1, np.int64), numbers_of(s, lanes)
        memories = zip(w, k, sections, history, totals, strict=True)
        return [
            Arguments(lanes_w, lanes_k, halt.flag, *shared, rows, *results, main, past, total, sums, *extra)
            for lanes_w, lanes_k, rows, past, total in memories
        ]

    if alone:
        calls = [(single(s.method, recorded, bounded), each(np.arange(n)))]
    elif (fast := _disturbed(low)) == _disturbed(high):  # all points are of one kind, because A ε η² is monotone
        calls = [(batch(s.method, fast, recorded), each(np.arange(n)))]
    else:
        # some lanes are empty during the last points, which should therefore be the cheap ones, without a disturbance;
        # in a long wave these come first, so that blocks are finished in their order
        first, disturbed = work <= threads * BLOCK_WORK, _disturbed(points.T)
        kinds = [(kind, (disturbed == kind).nonzero()[0]) for kind in (first, not first)]
        calls = [(batch(s.method, kind, recorded), each(order)) for kind, order in kinds if len(order)]
    run(calls, halt, brief=brief, look=look)


def busy_threads(threads: int, points: int, alone: bool) -> int:
    """Return how many of the threads have work, for this number of points that are computed one by one, or in lanes."""
    return min(threads, points if alone else -(-points // REGISTER))


def _ends(points: np.ndarray) -> tuple[list[float], list[float]]:
    """Return the least and the largest A, B, ε, η and Δτ of the points."""
    if len(points) == 1:
        return (row := points[0, :5].tolist()), row
    columns = points.T[:5].copy()  # along the rows of `points` NumPy takes ten times as long
    return columns.min(axis=1).tolist(), columns.max(axis=1).tolist()


def _disturbed(columns: Iterable[Any]) -> Any:
    """Return whether a point with these parameters has a disturbance; a mask if each is the column of many points."""
    A, _, eps, eta, *_ = columns
    return fast_amplitude(A, eps, eta) > 0.0


def load_kernels(plan: Plan) -> None:
    """Load or compile the kernels of a sweep by computing at most two of its points for one period.

    There are two kinds of points, with and without a disturbance. One point of each kind that the plan contains is
    computed. The `extremes` of the plan contain such points, because ε A η² is monotone in each parameter.
    """
    points = plan.extremes()
    _, kinds = np.unique(_disturbed(points.T), return_index=True)
    short = replace(plan, settings=replace(plan.settings, transient=0, periods=1))
    fill(short.settings, points[kinds], 1, Halt(), Arrays.new(short, len(kinds)))


def check_threads(threads: int | None) -> int:
    """Return the number of threads to use: `threads` or, if it is None, the number that Numba uses in this thread.

    Raises TypeError or ValueError if `threads` is not an integer between 1 and the number of threads of Numba.
    """
    most, set_by_caller = _threads_of_numba()
    return set_by_caller if threads is None else check_count("threads", threads, 1, most)


def _threads_of_numba() -> tuple[int, int]:
    """Return the number of threads that Numba has, or would have, and the number that it uses in this thread."""
    numba: Any = sys.modules.get("numba")
    if numba is None:  # nobody has called `numba.set_num_threads`
        return _cores(), _cores()
    most = int(numba.config.NUMBA_NUM_THREADS)
    try:
        numba.threading_layer()
    except ValueError:  # threads are not started, so `numba.set_num_threads` was not called; to ask would start them
        return most, most
    return most, int(numba.get_num_threads())


@cache
def _cores() -> int:
    """Return NUMBA_NUM_THREADS or, if it is not set, the number of processors that this process may use."""
    setting = os.environ.get("NUMBA_NUM_THREADS", "")
    if setting.isdecimal() and int(setting):
        return int(setting)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def check_executor(executor: Any) -> None:
    """Raise TypeError if `executor` is no object with the interface of `concurrent.futures`.

    A client of Dask also has a method `submit`, which returns other futures.
    """
    submits = callable(getattr(executor, "submit", None)) and not hasattr(executor, "get_executor")
    if isinstance(executor, type) or not submits:
        raise TypeError(bad("executor", executor, EXECUTOR))


EXECUTOR = "an Executor of concurrent.futures, such as ProcessPoolExecutor(4) or, for Dask, client.get_executor()"


def run_blocks(
    plan: Plan,
    which: Sequence[int] | None = None,
    *,
    threads: int | None = None,
    executor: Executor | None = None,
    wave: Wave = compute_wave,
) -> Generator[Block, None, None]:
    """Compute the blocks of a plan (all, or those with the indices `which`) and yield each block when it is finished.

    `wave` computes several blocks. On local threads, while the caller uses the last blocks of one wave, the next wave
    is computed. The computation ends if the generator is closed. Raises TypeError or ValueError if the number of
    threads is invalid.
    """
    all_spans = spans(plan)
    todo = all_spans if which is None else [all_spans[i] for i in which]
    if executor is not None:
        yield from _run_remote(plan, todo, executor, wave)
        return
    count = check_threads(threads)
    waves, halt = list(_waves(plan, todo)), Halt()
    results: SimpleQueue[Block | Future[None]] = SimpleQueue()  # the blocks of each wave, and then the wave itself
    with Pool(1, thread_name_prefix="compute") as pool:
        running: Future[None] | None = None
        try:
            for blocks in [*waves, None]:
                ahead = pool.submit(wave, plan, blocks, count, halt, results.put) if blocks is not None else None
                if ahead is not None:
                    ahead.add_done_callback(results.put)
                while running is not None and not isinstance(item := results.get(), Future):
                    yield item
                if running is not None:
                    running.result()
                running = ahead
        finally:
            halt.call()


def spans(plan: Plan) -> list[Span]:
    """Return (index, start, stop) for each block of a plan: its number, and the range of its points."""
    return [(i, *span) for i, span in enumerate(plan.blocks())]


def _waves(plan: Plan, todo: list[Span]) -> Iterator[list[Span]]:
    most = plan.wave_points if len(todo) > 1 else 0
    wave: list[Span] = []
    points = 0
    for block in todo:
        size = block[2] - block[1]
        if wave and points + size > most:
            yield wave
            wave, points = [], 0
        wave.append(block)
        points += size
    if wave:
        yield wave


def compute_some(plan: Plan, blocks: Sequence[Span], halt: Halt, wave: Wave = compute_wave) -> list[Block]:
    """Compute blocks as a task on one thread: the first, then twice as many together, and so on.

    The task ends before a block if TASK_SECONDS have passed; another task then computes the rest.
    """
    finished: list[Block] = []
    began, at, n = monotonic(), 0, 1
    while at < len(blocks) and (at == 0 or monotonic() - began < TASK_SECONDS):
        wave(plan, blocks[at : at + n], 1, halt, finished.append)
        at, n = at + n, 2 * n
    return finished


def _run_task(made_by: str, wave: Wave, plan: Plan, blocks: Sequence[Span], halt: Halt) -> list[Block]:
    """Return the blocks of `compute_some`, in a process of an executor.

    Raises Failed if this process has other sources than those in `made_by`, the `build` of the caller.
    """
    if made_by != build():
        versions = f"a worker on {platform.node()} computes with {build()}, the caller with {made_by}"
        raise Failed(f"{versions}: must be the same; install one of them on all machines")
    return compute_some(plan, blocks, halt, wave)


def _run_remote(plan: Plan, todo: Sequence[Span], executor: Executor, wave: Wave) -> Iterator[Block]:
    """Compute blocks on an executor, several in a task, and yield each block when it is finished.

    A task that fails is submitted again, up to RETRIES times.
    """
    workers = getattr(executor, "_max_workers", None)  # None also for executors that count their workers later
    limit = 2 * workers if isinstance(workers, int) else IN_FLIGHT
    queue = deque(todo)
    most = max(1, plan.wave_points // math.prod(plan.chunk))
    flying: dict[Future[list[Block]], tuple[list[Span], int]] = {}
    sign = None
    with suppress(OSError):  # nothing can be written: tasks that have begun then run to their ends
        sign = os.path.join(tempfile.gettempdir(), f"vibrodrive-halt-{uuid4().hex}")
    halt = Halt(sign)

    def launch(blocks: list[Span], tries: int) -> None:
        future = executor.submit(_run_task, build(), wave, plan, blocks, halt)
        if not isinstance(future, Future):
            raise TypeError(bad("executor", executor, EXECUTOR))
        flying[future] = (blocks, tries)

    try:
        while True:
            while len(flying) < limit and queue:
                size = min(most, 1 + len(queue) // (2 * limit))  # small towards the end, so that no worker is idle
                launch([queue.popleft() for _ in range(size)], 0)
            if not flying:
                return
            done, _ = wait(list(flying), return_when=FIRST_COMPLETED)
            for future in done:
                blocks, tries = flying.pop(future)
                try:
                    results = future.result()
                except Failed:  # other sources; to repeat the task cannot help
                    raise
                except Exception:
                    if tries >= RETRIES:
                        raise
                    launch(blocks, tries + 1)
                else:
                    finished = {block.index for block in results}
                    queue.extendleft(span for span in reversed(blocks) if span[0] not in finished)
                    yield from results
    finally:
        halt.call_across([future for future in flying if not future.cancel()])


def collect(
    plan: Plan,
    threads: int | None = None,
    executor: Executor | None = None,
    tell: Callable[[Block], None] = lambda block: None,
) -> Results:
    """Compute all points of a plan in memory.

    After each block `tell` is called. Raises TypeError or ValueError if the number of threads or the executor is
    invalid, or if the results do not fit into memory.
    """
    count = check_threads(threads)
    if executor is not None:
        check_executor(executor)
        with closing(run_blocks(plan, executor=executor)) as blocks:  # `closing` cancels tasks that have not started
            return gather(plan, blocks, tell)
    results, halt = Results.new(plan), Halt()

    def put(block: Block) -> None:
        results.put(block.start, block.stop, block.records)
        tell(block)

    for wave in _waves(plan, spans(plan)):
        compute_wave(plan, wave, count, halt, put, results.rows(wave[0][1], wave[-1][2]))
    return results
