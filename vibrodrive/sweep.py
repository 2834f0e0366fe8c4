"""Many points at once: blocks of a plan, computed on all cores, handed out as they finish.

Local blocks are computed by a `prange` over threads; each thread draws its next point from one atomic counter, so
cost that varies from point to point leaves no core idle. With an executor (anything with the interface of
`concurrent.futures`) each block is a task of its own. A point's bits depend on neither.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from typing import Any, NamedTuple

import numba
import numpy as np

from vibrodrive._jit import address, call, jit
from vibrodrive.engine import run
from vibrodrive.lane import new_lanes
from vibrodrive.parameters import COLUMNS, check_count
from vibrodrive.plan import IN_FLIGHT, Plan, make_plan
from vibrodrive.results import Results

RETRIES = 3
"""How often a block whose worker died is handed out again."""


Span = tuple[int, int, int]
"""A block to be computed: index, start, stop."""


class Block(NamedTuple):
    """A finished block: `section` float64 (points, periods, 2), `status` int8, `margin` float64,
    `switches` int64 (points, 5): switches into each State within the recorded window."""

    index: int  # type: ignore[assignment]  # hides tuple.index, which nobody asks of a block
    start: int
    stop: int
    section: np.ndarray
    status: np.ndarray
    margin: np.ndarray
    switches: np.ndarray


@jit(parallel=True)
def run_threads(
    where, w, k, points, order, counter, method, scan, transient, periods, budget,
    section, status, margin, counts, work, rows_int, rows_float, stored,
):  # fmt: skip
    """`run`, which lies at `where`, on several threads that share one counter."""
    for thread in numba.prange(w.shape[0]):
        arguments = (
            w[thread], k[thread], points, order, counter, method, scan, transient, periods, budget,
            section, status, margin, counts, work, rows_int, rows_float, stored,
        )  # fmt: skip
        call(where, arguments)


def compute(plan: Plan, start: int, stop: int, threads: int = 1) -> Block:
    """Points start..stop of a plan. The result depends on the plan alone, to the bit."""
    return compute_wave(plan, [(0, start, stop)], threads)[0]


def compute_wave(plan: Plan, blocks: Sequence[Span], threads: int) -> list[Block]:
    """Several blocks at once, so that all threads stay busy from one to the next."""
    points = np.concatenate([plan.points(start, stop) for _, start, stop in blocks])
    n = len(points)
    section, status = np.empty((n, plan.settings.periods, 2)), np.empty(n, np.int8)
    margin, counts = np.empty(n), np.empty((n, 5), np.int64)
    _fill(plan, points, threads, section, status, margin, counts)
    out, at = [], 0
    for index, start, stop in blocks:
        part = slice(at, at + stop - start)
        out.append(Block(index, start, stop, section[part], status[part], margin[part], counts[part]))
        at += stop - start
    return out


def _fill(
    plan: Plan,
    points: np.ndarray,
    threads: int,
    section: np.ndarray,
    status: np.ndarray,
    margin: np.ndarray,
    counts: np.ndarray,
) -> None:
    """Compute points of a plan into arrays with a row for each."""
    s, n = plan.settings, len(points)
    disturbance = points[:, COLUMNS.index("A")] * points[:, COLUMNS.index("eps")]
    # the dear ones first: what is left for the end, when lanes run empty, is cheap
    order = np.argsort(disturbance == 0.0, kind="stable")
    arguments = (
        points, order, np.zeros(1, np.int64), s.method, s.scan, s.transient, s.periods, s.budget,
        section, status, margin, counts, np.empty(n),
        np.empty((0, 3), np.int64), np.empty((0, 3)), np.zeros(1, np.int64),
    )  # fmt: skip
    w, k = new_lanes(threads)
    if threads == 1:
        run(w[0], k[0], *arguments)
    else:
        numba.set_num_threads(threads)
        run_threads(address(run, (w[0], k[0], *arguments)), w, k, *arguments)


def load_kernels(threads: int | None = None) -> None:
    """Load what a sweep runs from the disk, compiled first where it is not there yet: a sweep of no points."""
    plan = make_plan({"A": 1.0, "transient": 0, "periods": 1})
    compute(plan, 0, 0, check_threads(threads))


def check_threads(threads: int | None) -> int:
    """The number of threads to use: all by default. Raises TypeError or ValueError."""
    most = int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    return most if threads is None else check_count("threads", threads, 1, most)


def run_blocks(
    plan: Plan,
    which: Sequence[int] | None = None,
    *,
    threads: int | None = None,
    executor: Executor | None = None,
) -> Iterator[Block]:
    """Compute the blocks of a plan (all, or those whose indices are in `which`) and yield each when finished.

    The consumer works on one wave while the next is computed. Close the generator to stop early.

    Raises
    ------
    TypeError, ValueError
        for a bad number of threads.
    """
    spans = _spans(plan)
    todo = spans if which is None else [spans[i] for i in which]
    if executor is not None:
        yield from _run_remote(plan, todo, executor)
        return
    count = check_threads(threads)
    waves = list(_waves(plan, todo))
    with ThreadPoolExecutor(1, thread_name_prefix="compute") as pool:
        ahead: Future[list[Block]] | None = None
        for wave in [*waves, None]:
            finished = ahead.result() if ahead is not None else []
            ahead = pool.submit(compute_wave, plan, wave, count) if wave is not None else None
            yield from finished


def _spans(plan: Plan) -> list[Span]:
    """All blocks of a plan, in the order of its points."""
    return [(i, *span) for i, span in enumerate(plan.blocks())]


def waves_of(plan: Plan) -> list[list[Span]]:
    """All blocks of a plan, in the groups in which they are computed together."""
    return list(_waves(plan, _spans(plan)))


def _waves(plan: Plan, todo: list[Span]) -> Iterator[list[Span]]:
    most = plan.wave_points
    wave: list[Span] = []
    held = 0
    for block in todo:
        size = block[2] - block[1]
        if wave and held + size > most:
            yield wave
            wave, held = [], 0
        wave.append(block)
        held += size
    if wave:
        yield wave


def _run_remote(plan: Plan, todo: list[Span], executor: Executor) -> Iterator[Block]:
    limit = 2 * getattr(executor, "_max_workers", IN_FLIGHT // 2)
    queue = iter(todo)
    flying: dict[Future[Block], tuple[Span, int]] = {}

    def launch(block: Span, tries: int) -> None:
        flying[executor.submit(compute, plan, block[1], block[2])] = (block, tries)

    try:
        while True:
            while len(flying) < limit and (block := next(queue, None)) is not None:
                launch(block, 0)
            if not flying:
                return
            done, _ = wait(list(flying), return_when=FIRST_COMPLETED)
            for future in done:
                block, tries = flying.pop(future)
                try:
                    result = future.result()
                except Exception:
                    if tries >= RETRIES:
                        raise
                    launch(block, tries + 1)
                else:
                    yield result._replace(index=block[0])
    finally:
        for future in flying:
            future.cancel()


def sweep(*, threads: int | None = None, executor: Executor | None = None, **arguments: Any) -> Results:
    """Simulate every point of the product of the axes.

    Parameters
    ----------
    **arguments
        those of `simulate`; a sequence is an axis, in the order written. Parameters of a point (A, B, eps, eta,
        dtau, tol, xi0, dxi0, tau0, section_phase) may be axes.
    threads : int, optional
        threads to use; all by default.
    executor : concurrent.futures.Executor, optional
        computes the blocks elsewhere, e.g. ``dask.distributed.Client.get_executor()``.

    Returns
    -------
    Results
        with section (axes…, periods, 2), status, margin (axes…), switches (axes…, 5), axes.

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed.
    """
    plan = make_plan(arguments)
    if executor is not None:
        return Results.collect(plan, run_blocks(plan, executor=executor))
    results, count = Results.uncomputed(plan), check_threads(threads)
    for wave in _waves(plan, _spans(plan)):
        start, stop = wave[0][1], wave[-1][2]
        _fill(plan, plan.points(start, stop), count, *results.rows(start, stop))
    return results
