"""Main loop of a sweep: for a batch of trajectories, search for switches, apply these, and record them.

The kernel that `batch` returns advances up to `LANES` trajectories, one in each lane (lane.py). Each pass of its loop
advances the search in every lane (first_zero.py; undisturbed.py at ε = 0). Then the pass applies the ordinary switches
that the searches have found (switch_undisturbed.py, switch_disturbed.py; on a grid switch_grid.py,
switch_grid_disturbed.py). A switch is ordinary if three conditions hold: rounding cannot change its decision, it is
within the record and the budget, and at most one section point precedes it. The searches and the application of
ordinary switches are loops over lanes that vectorise. All other switches are processed one lane at a time (event.py).

The cycles of a motion that repeats itself are copied (recurrence.py). If the trajectory of a lane ends, the lane begins
the next point in the same pass. Lanes are independent, so the bits of a trajectory depend only on its point. Single
trajectories have another loop (single.py). `kernels/__init__.py` explains the terms.
"""

from functools import cache

from vibrodrive.jit.atomic import is_set, next_index
from vibrodrive.jit.branchless import choose, full, wide
from vibrodrive.jit.compile import inline, inline_each, jit, part_each
from vibrodrive.kernels import (
    arguments,
    codes,
    event,
    first_zero,
    history,
    muller,
    record,
    recurrence,
    setup,
    switch,
    switch_disturbed,
    switch_grid,
    switch_grid_disturbed,
    switch_undisturbed,
    undisturbed,
)
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.outputs import Outcome, Recorder, extent_of

STEPS, STEPS_ON_GRID, EVALUATIONS = 3, 4, 2
"""Numbers of steps of a search before its outcome is checked. STEPS: with a disturbance, without a grid. STEPS_ON_GRID:
with a disturbance, on a grid. EVALUATIONS: at ε = 0. Most searches end within these steps, and a check costs more
than a step."""


@part_each("grid")
def search_undisturbed(w, k, n, grid):
    """Advance the searches in the lanes 0..n-1 at ε = 0: those in a bracket together, the others one by one.

    undisturbed.py explains brackets.
    """
    if undisturbed.search_brackets(w, k, n, EVALUATIONS) < n:
        for i in range(n):
            if w[r.SEARCH_MODE + i] == codes.STEPPED:
                if grid:
                    first_zero.search_on_grid(w[i:], 1, False, 1)
                else:
                    first_zero.search_stepwise(w[i:], 1, 1)
            elif w[r.SEARCH_MODE + i] == codes.AT_ONCE:
                w[r.OUTCOME + i] = codes.ZERO


@part_each("fast")
def follow_up(w, k, n, fast, on_grid, extent, section, impacts, recorder):
    """Complete a batch of switches: write section points, store impacts and switches, check for recurrences.

    A recurrence is the return of a motion to an earlier state (recurrence.py). Return the number of trajectories that
    end because all their results follow from a recurrence.
    """
    ended = 0
    points = recorder is None or switch.has_rows(section, recorder.summary)
    for i in range(n):
        if points and not fast:
            switch.write_points(w, k, i, section)
        if recorder is not None and k[r.LEFT_OVER + i] & codes.KEEP_SWITCH:
            if impacts.shape[1] > 0:
                record.keep_impact(w, k, i, extent.transient, impacts)
            if recorder.totals.shape[1] > 0:
                history.keep_switch(w, k, i, on_grid, extent.transient, recorder)
        if (
            not fast
            and k[r.LEFT_OVER + i] & codes.CHECK_RECURRENCE
            and not recurrence.detect_recurrence(w, k, i, not on_grid, extent, section, impacts, recorder)
        ):
            switch.set_remaining_work(k, i, codes.UNUSUAL)
            ended += 1
    return ended


@inline
def list_unusual(k, todo, n):
    """Write the numbers of the lanes that `process_event` must process into the list `todo`."""
    m = 0
    for i in range(n):
        todo[m] = i
        m += 1 if k[r.LEFT_OVER + i] == codes.UNUSUAL else 0


@part_each("grid", "disturbed", "fixed")
def apply_switches(w, k, n, grid, disturbed, fixed, extent):
    """Apply the ordinary switches in the lanes 0..n-1. Return the number of lanes that `event.py` must process."""
    wide()
    if grid and disturbed and not fixed:
        muller.refine_lanes(w, n)
    left = 0
    for i in range(full(n)):
        if disturbed:
            if grid:
                switch_grid_disturbed.apply_switch_on_grid_disturbed(w, k, i, fixed, extent)
            else:
                switch_disturbed.apply_switch_disturbed(w, k, i, extent)
        elif grid:
            switch_grid.apply_switch_on_grid(w, k, i, fixed, extent)
        else:
            switch_undisturbed.apply_switch_undisturbed(w, k, i, extent)
        left += choose((i < n) & (k[r.LEFT_OVER + i] == codes.UNUSUAL), 1, 0)
    return left


@inline_each("grid", "disturbed", "fixed")
def take_switches(w, k, n, grid, disturbed, fixed, extent, section):
    """Advance the searches in the lanes 0..n-1, and apply the ordinary switches.

    Return the number of lanes that `event.py` must process.
    """
    if disturbed:
        if grid:
            first_zero.search_on_grid(w, n, True, STEPS_ON_GRID)
        else:
            first_zero.search_stepwise(w, n, STEPS)
        switch_disturbed.mark_points(w, k, n, extent)
        switch_disturbed.write_next_points(w, k, n, extent.transient, section)
    else:
        search_undisturbed(w, k, n, grid)
    return apply_switches(w, k, n, grid, disturbed, fixed, extent)


@inline
def close_gaps(w, k, n, todo, ended):
    """Move the trajectories of the last lanes into the lanes of ended trajectories. Return the number of lanes in use.

    The first `ended` elements of `todo` are the numbers of the lanes of ended trajectories, in ascending order. The
    loop runs over these elements in descending order, so that it never moves a trajectory that has ended.
    """
    for j in range(ended - 1, -1, -1):
        i = todo[j]
        n -= 1
        if i != n:
            slot = k[r.HISTORY_SLOT + i]
            for row in range(r.ROWS_W):
                w[row * r.STRIDE + i] = w[row * r.STRIDE + n]
            for row in range(r.ROWS_K):
                k[row * r.STRIDE + i] = k[row * r.STRIDE + n]
            history.leave_slot(k, n, slot)
    return n


@cache
def batch(method: int, disturbed: bool, recorded: bool):
    """Return the kernel of sweeps for `method`, for points with a disturbance (if `disturbed`) or without.

    Each kernel is compiled at its first call and contains only the code that it needs. If `recorded`, the kernel also
    computes impacts and summaries, and is slower.
    """
    grid, fixed = method != codes.CERTIFIED, method == codes.FIXED
    if grid and not disturbed:
        method = codes.FIXED_BRACKETED if fixed else codes.MULLER_BRACKETED
    bracketed = grid and not disturbed
    repeats = not (disturbed or fixed)

    @jit(like=(0,), _nrt=False)
    def run(address):
        """Take points by the counter and compute their trajectories, until all are done or `halt` is set."""
        a = arguments.arguments_at(address)
        w, k, todo = a.lanes_w[0], a.lanes_k[0], a.lanes_k[1]
        points, order, lanes = a.points, a.order, a.numbers[3]
        extent = extent_of(a.numbers)
        section, outcome = a.section, Outcome(a.status, a.margin, a.counts, a.work)
        impacts = a.impacts if recorded else None
        recorder = Recorder(a.history, a.totals, a.summary, grid) if recorded else None
        history.assign_slots(k)
        n, c = 0, next_index(a.counter)
        while not is_set(a.halt):
            while c < order.shape[0] and n < lanes:
                if setup.load(w, k, n, points, order[c], method, extent, section, None, None):
                    n += 1
                else:
                    record.finish(w, k, n, extent, section, impacts, recorder, None, outcome)
                c = next_index(a.counter)
            if n == 0:
                return 0
            m = take_switches(w, k, n, grid, disturbed, fixed, extent, section)
            if not disturbed or recorded:
                m += follow_up(w, k, n, disturbed, grid, extent, section, impacts, recorder)
            if m > 0:
                list_unusual(k, todo, n)
            ended = 0
            for j in range(m):
                i = todo[j]
                if bracketed and w[r.SEARCH_MODE + i] != codes.STEPPED and w[r.LEFT + i] != codes.ENDED_EARLY:
                    # repeat the search by steps; the evaluations in the bracket do not count for the budget
                    w[r.WORK + i] = w[r.WORK_BOOKED + i]
                    event.begin_search(w, k, i, k[r.STATE + i], False, method)
                    undisturbed.set_search_mode(w, i, True, codes.STEPPED)
                    continue
                going = event.process_event(w, k, i, method, extent, section, impacts, recorder, None, None)
                if repeats and going and k[r.LEFT_OVER + i] == codes.CHECK_RECURRENCE:
                    going = recurrence.detect_recurrence(w, k, i, not grid, extent, section, impacts, recorder)
                if not going:
                    record.finish(w, k, i, extent, section, impacts, recorder, None, outcome)
                    todo[ended] = i  # ended <= j: no unread element is overwritten
                    ended += 1
            n = close_gaps(w, k, n, todo, ended)
        return 0

    return run
