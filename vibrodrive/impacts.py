"""Impact instants of many trajectories at once: what a section can't tell and a limit needs.

The loop is the engine's, with every lane's switches looked through as they come and only the fast impacts
kept: a disturbed motion makes tens of switches a period, of which one matters.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from vibrodrive import lane as r
from vibrodrive._jit import inline, jit
from vibrodrive.counter import next_index
from vibrodrive.engine import finish, load, settle
from vibrodrive.lane import LANES, ROWS_K, ROWS_W
from vibrodrive.locate import NOTHING, search_all
from vibrodrive.parameters import Method, State
from vibrodrive.plan import Settings

CERTIFIED, IMPACT = int(Method.CERTIFIED), int(State.IMPACT)

SCRATCH = 64
"""Switches one visit of a lane may make: an impact, waits that end at once, and a good deal to spare."""

ROOM = 2
"""Fast impacts kept per period: two of them cannot be closer than a flight that gathers their speed."""


class Landings(NamedTuple):
    """Motions of n points.

    section : float64 (n, periods, 2), as of a sweep
    status : int8 (n,)
    count : int64 (n,), fast impacts; those beyond ROOM a period are counted, not kept
    period, phase : int64 and float64 (n, ROOM · periods), when they happened
    """

    section: np.ndarray
    status: np.ndarray
    count: np.ndarray
    period: np.ndarray
    phase: np.ndarray

    def times(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Whole periods and phases of point k's fast impacts, in order."""
        kept = min(int(self.count[k]), self.period.shape[1])
        return self.period[k, :kept], self.phase[k, :kept]


def landings(
    points: np.ndarray, speed: np.ndarray, settings: Settings, threads: int | None = None
) -> Landings:
    """Follow every point and keep its impacts faster than `speed` (n,) after the transient.

    `points` are rows as of Plan.points: float64 (n, columns). The result does not depend on `threads`.
    """
    n, room = len(points), ROOM * settings.periods
    found = Landings(
        section=np.empty((n, settings.periods, 2)),
        status=np.zeros(n, np.int8),
        count=np.zeros(n, np.int64),
        period=np.zeros((n, room), np.int64),
        phase=np.zeros((n, room)),
    )
    points = np.ascontiguousarray(points, dtype=np.float64)
    speed = np.ascontiguousarray(speed, dtype=np.float64)
    counter = np.zeros(1, np.int64)
    counts = np.zeros((n, len(State)), np.int64)
    spare = np.empty(n), np.empty(n)
    s = settings

    def work(_: int) -> None:
        run_landings(
            points, counter, s.method, s.scan, s.transient, s.periods, s.budget, speed,
            found.section, found.status, *spare, counts, found.count, found.period, found.phase,
        )  # fmt: skip

    threads = min(threads or os.cpu_count() or 1, max(1, n))
    if threads == 1:
        work(0)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(work, range(threads)))
    return found


@inline
def keep_fast(k, i, speed, rows_int, rows_float, stored, count, period, phase):
    """Move the fast impacts among the rows just recorded for lane i to its point's own rows."""
    row = k[r.POINT + i]
    for m in range(min(stored[0], rows_int.shape[0])):
        if rows_int[m, 2] == IMPACT and -rows_float[m, 2] > speed[row]:
            at = count[row]
            if at < period.shape[1]:
                period[row, at] = rows_int[m, 0]
                phase[row, at] = rows_float[m, 0]
            count[row] = at + 1
    stored[0] = 0


@jit
def run_landings(
    points, counter, method, scan, transient, periods, budget, speed,
    section, status, margin, work, counts, count, period, phase,
):  # fmt: skip
    """The engine's loop over all points that `counter` hands out; arrays as in Landings."""
    w = np.zeros(ROWS_W * LANES)
    k = np.zeros(ROWS_K * LANES, dtype=np.int64)
    rows_int = np.zeros((SCRATCH, 3), dtype=np.int64)
    rows_float = np.zeros((SCRATCH, 3))
    stored = np.zeros(1, dtype=np.int64)
    grid = method != CERTIFIED
    n = 0
    more = True
    while True:
        while more and n < LANES:
            row = next_index(counter)
            if row >= points.shape[0]:
                more = False
                break
            going = load(
                w, k, n, points, row, method, scan, transient, periods, budget,
                section, counts, rows_int, rows_float, stored,
            )  # fmt: skip
            keep_fast(k, n, speed, rows_int, rows_float, stored, count, period, phase)
            if going:
                n += 1
            else:
                finish(w, k, n, section, status, margin, work)
        if n == 0:
            break
        fast = False
        for i in range(n):
            fast = fast or w[r.AF + i] > 0.0
        search_all(w, n, fast, grid)
        i = 0
        while i < n:
            if w[r.MET + i] == NOTHING:
                i += 1
                continue
            going = settle(
                w, k, i, method, scan, transient, periods, budget,
                section, counts, rows_int, rows_float, stored,
            )  # fmt: skip
            keep_fast(k, i, speed, rows_int, rows_float, stored, count, period, phase)
            if going:
                i += 1
                continue
            finish(w, k, i, section, status, margin, work)
            n -= 1
            for q in range(ROWS_W):
                w[q * LANES + i] = w[q * LANES + n]
            for q in range(ROWS_K):
                k[q * LANES + i] = k[q * LANES + n]
