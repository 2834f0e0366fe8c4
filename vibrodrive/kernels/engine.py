"""The loop that a sweep runs: search, apply the switch, record, go on, many trajectories at once.

A kernel of `batch` keeps up to `LANES` trajectories under way, one in each lane (lane.py). Each pass advances the
search in every lane (first_zero.py; undisturbed.py at ε = 0) and applies the ordinary switches found
(switch_undisturbed.py, switch_disturbed.py; on a grid switch_grid.py, switch_grid_disturbed.py); both are loops over
lanes that vectorise. Everything else is processed one lane at a time (event.py). A motion that repeats itself is not
computed again (recurrence.py), and a lane whose trajectory ends takes the next point at once. No lane depends on
another, so a trajectory's bits depend on nothing but its point. What is followed by itself has a loop of its own
(single.py).
"""

from __future__ import annotations

from functools import cache

from vibrodrive.jit.atomic import is_set, next_index
from vibrodrive.jit.compile import inline, jit, part_each
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.arguments import arguments_at
from vibrodrive.kernels.codes import (
    AT_ONCE,
    CERTIFIED,
    CHECK_RECURRENCE,
    FIXED,
    FIXED_BRACKETED,
    KEEP_SWITCH,
    MULLER_BRACKETED,
    STEPPED,
    UNUSUAL,
    ZERO,
)
from vibrodrive.kernels.event import begin_search, process_event
from vibrodrive.kernels.first_zero import search_on_grid, search_stepwise
from vibrodrive.kernels.history import assign_slots, keep_switch, leave_slot
from vibrodrive.kernels.impacts import keep_impact
from vibrodrive.kernels.lane import ROWS_K, ROWS_W, STRIDE
from vibrodrive.kernels.record import finish
from vibrodrive.kernels.recurrence import ENDED_EARLY, detect_recurrence
from vibrodrive.kernels.setup import load
from vibrodrive.kernels.switch import has_rows, leave_over, write_points
from vibrodrive.kernels.switch_disturbed import apply_switches_disturbed, mark_points, write_ahead
from vibrodrive.kernels.switch_grid import apply_switches_on_grid
from vibrodrive.kernels.switch_grid_disturbed import apply_switches_on_grid_disturbed
from vibrodrive.kernels.switch_undisturbed import apply_switches_undisturbed
from vibrodrive.kernels.undisturbed import search_brackets, set_search_mode

STEPS, STEPS_ON_GRID, EVALUATIONS = 3, 4, 2
"""Steps of a search, with a disturbance and without one, before its outcome is looked at: most have ended by then, and
looking costs more than a step."""


@part_each("grid")
def search_undisturbed(w, k, n, grid):
    """Advance the searches in the lanes 0..n-1 at ε = 0: those with a bracket as a batch, the others one by one."""
    if search_brackets(w, k, n, EVALUATIONS) < n:
        for i in range(n):
            if w[r.SEARCH_MODE + i] == STEPPED:
                if grid:
                    search_on_grid(w[i:], 1, False, 1)
                else:
                    search_stepwise(w[i:], 1, 1)
            elif w[r.SEARCH_MODE + i] == AT_ONCE:
                w[r.OUTCOME + i] = ZERO


@part_each("fast")
def follow_up(
    w, k, n, fast, on_grid, transient, periods, budget, section, impacts, history, totals, summary
):  # fmt: skip
    """What a batch of switches leaves to be done: section points that were passed, what is kept, recurrences.

    Returns how many trajectories have ended by that.
    """
    ended = 0
    points = summary is None or has_rows(section, summary)
    for i in range(n):
        if points and not fast:
            write_points(w, k, i, section)
        if totals is not None and k[r.LEFT_OVER + i] & KEEP_SWITCH:
            if impacts.shape[1] > 0:
                keep_impact(w, k, i, transient, impacts)
            if totals.shape[1] > 0:
                keep_switch(w, k, i, on_grid, transient, history, totals)
        if not fast and k[r.LEFT_OVER + i] & CHECK_RECURRENCE and not detect_recurrence(
            w, k, i, not on_grid, transient, periods, budget, section, impacts, history, totals, summary
        ):  # fmt: skip
            leave_over(k, i, UNUSUAL)
            ended += 1
    return ended


@inline
def list_unusual(k, todo, n):
    """List the lanes that are left to `process_event`."""
    m = 0
    for i in range(n):
        todo[m] = i
        m += 1 if k[r.LEFT_OVER + i] == UNUSUAL else 0


@cache
def batch(method: int, disturbed: bool, recorded: bool):
    """The kernel of sweeps that finds switches by `method`, for points with a disturbance or for those without one.

    Each is compiled when it is first called, from what it needs alone. `recorded`: whether it writes impacts and
    summaries, where they are wanted; a kernel that writes sections alone is faster.
    """
    grid, fixed = method != CERTIFIED, method == FIXED
    if grid and not disturbed:
        method = FIXED_BRACKETED if fixed else MULLER_BRACKETED
    bracketed = grid and not disturbed
    repeats = not (disturbed or fixed)

    @jit(_nrt=False)
    def run(address):
        """Follow the points that the counter hands out, to their ends or until `halt` is set (arguments.py)."""
        a = arguments_at(address)
        w, k, todo = a.lanes_w[0], a.lanes_k[0], a.lanes_k[1]
        halt, points, order, counter = a.halt, a.points, a.order, a.counter
        transient, periods, budget, lanes = a.numbers[0], a.numbers[1], a.numbers[2], a.numbers[4]
        section, status, margin, counts, work = a.section, a.status, a.margin, a.counts, a.work
        if recorded:
            impacts, history, totals, summary = a.impacts, a.history, a.totals, a.summary
        else:
            impacts = history = totals = summary = None
        assign_slots(k)
        n, c = 0, next_index(counter)
        while not is_set(halt):
            while c < order.shape[0] and n < lanes:
                if load(w, k, n, points, order[c], method, transient, periods, section, None, None, None, None):
                    n += 1
                else:
                    finish(w, k, n, transient, section, impacts, history, totals, summary, status, margin, counts, work)
                c = next_index(counter)
            if n == 0:
                return 0
            if disturbed:
                if grid:
                    search_on_grid(w, n, True, STEPS_ON_GRID)
                else:
                    search_stepwise(w, n, STEPS)
                mark_points(w, k, n, transient, periods)
                write_ahead(w, k, n, transient, section)
                if grid:
                    m = apply_switches_on_grid_disturbed(w, k, n, fixed, transient, periods, budget)
                else:
                    m = apply_switches_disturbed(w, k, n, transient, periods, budget)
            else:
                search_undisturbed(w, k, n, grid)
                if grid:
                    m = apply_switches_on_grid(w, k, n, fixed, transient, periods, budget)
                else:
                    m = apply_switches_undisturbed(w, k, n, transient, periods, budget)
            if not disturbed or recorded:
                m += follow_up(
                    w, k, n, disturbed, grid, transient, periods, budget, section, impacts, history, totals, summary
                )  # fmt: skip
            if m > 0:
                list_unusual(k, todo, n)
            ended = 0
            for j in range(m):
                i = todo[j]
                if bracketed and w[r.SEARCH_MODE + i] != STEPPED and w[r.LEFT + i] != ENDED_EARLY:
                    # what was tried in vain is free, or the budget would end sooner
                    w[r.WORK + i] = w[r.WORK_BOOKED + i]
                    begin_search(w, k, i, k[r.STATE + i], False, method)
                    set_search_mode(w, i, True, STEPPED)
                    continue
                if not process_event(
                    w, k, i, method, repeats, False, transient, periods, budget, section, impacts, history, totals,
                    summary, None, None, None, None,
                ):  # fmt: skip
                    finish(w, k, i, transient, section, impacts, history, totals, summary, status, margin, counts, work)
                    todo[ended] = i  # never ahead of j
                    ended += 1
            # close the gaps from the back, so that the lane moved in is never one of the gaps itself
            for j in range(ended - 1, -1, -1):
                i = todo[j]
                n -= 1
                if i != n:
                    slot = k[r.HISTORY_SLOT + i]
                    for row in range(ROWS_W):
                        w[row * STRIDE + i] = w[row * STRIDE + n]
                    for row in range(ROWS_K):
                        k[row * STRIDE + i] = k[row * STRIDE + n]
                    leave_slot(k, n, slot)
        return 0

    return run
