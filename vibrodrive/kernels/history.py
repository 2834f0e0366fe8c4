"""The switches of each trajectory under way, kept as far back as its summary needs them (summary.py).

A lane has room for ROWS switches, one behind the other in a ring. What falls out of it has been added to the lane's
totals before. The rows are those that `simulate` gives: those of a batch of switches are made of what was known before
it, what it has noted (impacts.py) and what it has counted, all others are written one by one; a motion that repeats
itself has its rows copied with its sections.
"""

from __future__ import annotations

import numpy as np

from vibrodrive.jit.compile import inline, part
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import DOWN, IMPACT, REST, STICK, UP
from vibrodrive.kernels.impacts import NONE, count_switches
from vibrodrive.kernels.lane import LANES, STRIDE
from vibrodrive.kernels.summary import (
    AFTER,
    BEFORE,
    COLUMNS,
    DXI,
    LONGEST,
    PERIOD,
    PHASE,
    REACH,
    TOTALS,
    XI,
    add_gap,
    add_segment,
    begin_totals,
    clear_totals,
    summarise,
)

ROWS = 2 * REACH
"""Switches that a lane has room for."""

APART = ROWS + 11
"""Rows from one lane to the next: a multiple of a page apart they would share the same lines of the cache."""


def new_history(threads: int, wanted: bool) -> tuple[np.ndarray, np.ndarray]:
    """Memory (history, totals) for the lanes of each thread: switches, and what they come to; none, if not wanted."""
    if not wanted:
        return np.empty((threads, LANES, 0, COLUMNS)), np.empty((threads, LANES, 0))
    return np.empty((threads, LANES, APART, COLUMNS)), np.empty((threads, LANES, TOTALS))


@part
def assign_slots(k):
    """Lane i keeps its switches in slot i, until lanes are exchanged."""
    for i in range(LANES):
        k[r.HISTORY_SLOT + i] = i


@inline
def begin_history(k, i, totals):
    """A trajectory begins in lane i: it has no switches yet."""
    if totals.shape[1] > 0:
        k[r.HISTORY_COUNT + i] = 0
        k[r.HISTORY_ADDED + i] = 0
        clear_totals(totals[k[r.HISTORY_SLOT + i]])


@inline
def write_switch(w, k, i, period, phi, before, after, x, v, history, totals):
    """A switch of the record; where the ring is full, half of it is added to the totals first."""
    slot, count = k[r.HISTORY_SLOT + i], k[r.HISTORY_COUNT + i]
    rows = history[slot]
    if count - k[r.HISTORY_ADDED + i] >= ROWS - 1:
        add_rows(w, k, i, k[r.HISTORY_ADDED + i] + ROWS // 2, rows, totals[slot])
    row = count % ROWS
    rows[row, PERIOD] = float(period)
    rows[row, PHASE] = phi
    rows[row, BEFORE] = float(before)
    rows[row, AFTER] = float(after)
    rows[row, XI] = x
    rows[row, DXI] = v
    k[r.HISTORY_COUNT + i] = count + 1


@part
def add_rows(w, k, i, to, rows, totals):
    """Add the switches before number `to` to the totals."""
    for n in range(k[r.HISTORY_ADDED + i], to):
        add_gap(rows, n % ROWS, totals)
        if n == 0:
            begin_totals(rows, 0, totals)
        else:
            add_segment(
                rows, (n - 1) % ROWS, n % ROWS, w[r.A + i], w[r.B + i], w[r.AF + i], w[r.ETA + i], w[r.FRAC + i], totals
            )
    k[r.HISTORY_ADDED + i] = to


@part
def write_switches(w, k, n, on_grid, waits_are_known, history, totals):
    """Write the switches that a batch has counted: one that ends a state, an impact before it, a wait behind it.

    A wait whose end is known beforehand is over within the same batch (switch_undisturbed.py); then its beginning is
    where the slide ended, which the batch has noted.
    """
    for i in range(n):
        if k[r.STATE_BEFORE + i] == NONE:
            continue
        counted = count_switches(k, i, r.SWITCHES) - k[r.SWITCHES_BEFORE + i]
        if counted == 0:
            continue
        landed = k[r.SWITCHES + IMPACT * STRIDE + i] > k[r.IMPACTS_BEFORE + i]
        before, after = k[r.STATE_BEFORE + i], k[r.STATE + i]
        waited = counted - (1 if landed else 0) == 2
        period, phi, x = k[r.PERIOD + i], w[r.PHI + i], w[r.X0 + i]
        ended, at = period, phi
        if waits_are_known:
            ended, at = k[r.END_PERIOD + i], w[r.END_PHI + i]
        v = 0.0
        if on_grid and (before == UP or before == DOWN):
            v = 0.0 - w[r.END_SPEED + i]
        if landed:
            write_switch(w, k, i, ended, at, before, IMPACT, 0.0, 0.0 - w[r.END_SPEED + i], history, totals)
            before, v = IMPACT, 0.0
        if waited:
            wait = REST if landed else STICK
            write_switch(w, k, i, ended, at, before, wait, x, v, history, totals)
            before, v = wait, 0.0
        write_switch(w, k, i, period, phi, before, after, x, v, history, totals)


@inline
def may_copy_switches(k, i, totals):
    """Whether all switches since the reference (recurrence.py) are still there."""
    return totals.shape[1] == 0 or k[r.HISTORY_COUNT + i] - k[r.REFERENCE_HISTORY + i] <= REACH


@part
def copy_switches(w, k, i, cycles, cycle, history, totals):
    """Repeat the switches since the reference `cycles` times, each time a `cycle` later.

    Of a motion whose period is one that is looked for, two cycles tell all: the others are passed over by moving all
    switches so far on in time.
    """
    if totals.shape[1] == 0:
        return
    rows = history[k[r.HISTORY_SLOT + i]]
    more = k[r.HISTORY_COUNT + i] - k[r.REFERENCE_HISTORY + i]
    copied = min(cycles, 1) if cycle <= LONGEST else cycles
    for _ in range(copied * more):
        old = (k[r.HISTORY_COUNT + i] - more) % ROWS
        write_switch(
            w, k, i, int(rows[old, PERIOD]) + cycle, rows[old, PHASE], int(rows[old, BEFORE]), int(rows[old, AFTER]),
            rows[old, XI], rows[old, DXI], history, totals,
        )  # fmt: skip
    for row in range(min(k[r.HISTORY_COUNT + i], ROWS) if cycles > copied else 0):
        rows[row, PERIOD] += float((cycles - copied) * cycle)


@inline
def set_reference_history(k, i):
    """The switches so far lie before the state of reference (recurrence.py)."""
    k[r.REFERENCE_HISTORY + i] = k[r.HISTORY_COUNT + i]


@part
def end_history(w, k, i, history, totals, summary):
    """Write the summary of the trajectory that ends in lane i."""
    if totals.shape[1] > 0:
        slot = k[r.HISTORY_SLOT + i]
        summarise(
            history[slot], k[r.HISTORY_ADDED + i], k[r.HISTORY_COUNT + i], ROWS, k[r.STATE + i], w[r.X0 + i],
            w[r.A + i], w[r.B + i], w[r.AF + i], w[r.ETA + i], w[r.FRAC + i], totals[slot], summary[k[r.POINT + i]],
        )  # fmt: skip


@inline
def leave_slot(k, n, slot):
    """The trajectory of lane n has moved, with its slot, to a lane that had `slot`: the next one here has that."""
    k[r.HISTORY_SLOT + n] = slot
