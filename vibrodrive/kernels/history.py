"""The switches of each trajectory under way, kept as far back as its summary needs them (summary.py).

A lane has room for ROWS switches. When it is full the first half is added to the lane's totals and given up. The rows
are those that `simulate` gives: a batch of switches leaves behind what one is made of (record.py), all others are
written one by one.

A motion that is known to repeat itself to the bit (recurrence.py) needs no more than one cycle of its switches: from
them follow all that come, so its summary is written as soon as they are there, and a sweep that records nothing else
ends the trajectory at once. Then switches are kept before the record begins, too.
"""

from __future__ import annotations

import numpy as np

from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import summary, switch
from vibrodrive.kernels.codes import ALL, DOWN, IMPACT, NONE, OF_THE_RECORD, REST, S1, S3, S4, STICK, UP
from vibrodrive.kernels.outputs import Switch

ROWS = 2 * summary.REACH
"""Switches that a lane has room for."""

APART = ROWS + 11
"""Rows from one lane to the next: a multiple of a page apart they would share the same lines of the cache."""

END_OF_RECORD = 1e-9
"""How close to the phase at which a record begins and ends a switch may come before only computing the motion to its
end tells whether it belongs to it."""


def new_history(threads: int, wanted: bool) -> tuple[np.ndarray, np.ndarray]:
    """Memory (history, totals) for the lanes of each thread: switches, and what they come to; none, if not wanted."""
    if not wanted:
        return np.empty((threads, r.LANES, 0, summary.COLUMNS)), np.empty((threads, r.LANES, 0))
    return np.empty((threads, r.LANES, APART, summary.COLUMNS)), np.empty((threads, r.LANES, summary.TOTALS))


@part
def assign_slots(k):
    """Lane i keeps its switches in slot i, until lanes are exchanged."""
    for i in range(r.LANES):
        k[r.HISTORY_SLOT + i] = i


@inline
def clear_history(k, i, keeps):
    """Lane i has no switches yet, and keeps from now on those of the record, or all."""
    k[r.HISTORY_KEEPS + i] = keeps
    k[r.HISTORY_COUNT + i] = 0
    k[r.HISTORY_ADDED + i] = 0


@inline
def keeps(w, k, i, period, phi, transient):
    """Whether a switch at (period, φ) is kept."""
    of_all = k[r.HISTORY_KEEPS + i]
    return of_all == ALL or (of_all == OF_THE_RECORD and switch.in_record(w, k, i, period, phi, transient))


@inline
def write_switch(w, k, i, period, phi, event, recorder):
    """Keep a switch; where there is no more room, half of them are added to the totals and given up first."""
    slot, row = k[r.HISTORY_SLOT + i], k[r.HISTORY_COUNT + i]
    rows = recorder.history[slot]
    if row == ROWS:
        row = make_room(w, k, i, rows, recorder.totals[slot])
    rows[row, summary.PERIOD] = float(period)
    rows[row, summary.PHASE] = phi
    rows[row, summary.BEFORE] = float(event.before)
    rows[row, summary.AFTER] = float(event.after)
    rows[row, summary.XI] = event.x
    rows[row, summary.DXI] = event.v
    k[r.HISTORY_COUNT + i] = row + 1


@inline
def drive_of(w, i):
    """The parameters of lane i that its summary depends on."""
    return summary.Drive(w[r.A + i], w[r.B + i], w[r.AF + i], w[r.ETA + i], w[r.FRAC + i])


@part
def make_room(w, k, i, rows, totals):
    """Add the first half of the switches to the totals; the others move to the front. Returns how many these are."""
    half = ROWS // 2
    summary.add_switches(rows, k[r.HISTORY_ADDED + i], half + 1, drive_of(w, i), totals)
    drop_rows(k, i, half, rows)
    k[r.HISTORY_ADDED + i] = 1
    return half


@inline
def drop_rows(k, i, first, rows):
    """Keep the switches from row `first` on."""
    count = k[r.HISTORY_COUNT + i] - first
    for row in range(count if first > 0 else 0):
        for column in range(summary.COLUMNS):
            rows[row, column] = rows[first + row, column]
    k[r.HISTORY_COUNT + i] = count
    k[r.REFERENCE_HISTORY + i] -= first


@inline
def keep_switch(w, k, i, on_grid, transient, recorder):
    """Keep the switches that a batch has taken: one that ends a state, an impact before it, a wait behind it.

    A wait whose end is known beforehand is over within the same batch (switch_undisturbed.py); then its beginning is
    where the slide ended, which the batch has noted (record.py).
    """
    which, ended, at = k[r.ENDED + i], k[r.END_PERIOD + i], w[r.END_PHI + i]
    period, phi, x, after = k[r.PERIOD + i], w[r.PHI + i], w[r.X0 + i], k[r.STATE + i]
    waited = ended != period or at != phi
    wait = REST if which == S1 else STICK
    if keeps(w, k, i, ended, at, transient):
        before, v = (UP if which == S3 else DOWN), 0.0
        if which >= S4:
            before = STICK if which == S4 else REST
        elif on_grid:
            v = 0.0 - w[r.END_SPEED + i]
        if which == S1:
            x_end = w[r.END_GAP + i] if on_grid else 0.0
            write_switch(w, k, i, ended, at, Switch(before, IMPACT, x_end, 0.0 - w[r.END_SPEED + i]), recorder)
            before, v = IMPACT, 0.0
        write_switch(w, k, i, ended, at, Switch(before, wait if waited else after, x, v), recorder)
    if waited and keeps(w, k, i, period, phi, transient):
        write_switch(w, k, i, period, phi, Switch(wait, after, x, 0.0), recorder)


@inline
def set_reference_history(k, i):
    """The switches so far lie before the state of reference (recurrence.py)."""
    k[r.REFERENCE_HISTORY + i] = k[r.HISTORY_COUNT + i]


@inline
def may_follow_from_a_cycle(cycle, periods):
    """Whether a motion that returns after `cycle` periods has a summary that follows from these alone.

    All periods that come into question are then seen twice in the record.
    """
    return cycle <= summary.LONGEST and 2 * cycle + 2 <= periods


@inline
def keep_all(k, i, cycle, periods, recorder):
    """A motion has returned before its record: its switches from now on tell its summary."""
    keeping = recorder.totals.shape[1] > 0 and k[r.HISTORY_KEEPS + i] == OF_THE_RECORD
    if keeping and may_follow_from_a_cycle(cycle, periods):
        clear_history(k, i, ALL)


@inline
def lies_behind(period, phase, until, phi):
    """Whether a switch at (period, phase) comes after (until, φ)."""
    return period > until or (period == until and phase > phi)


@inline
def last_return(rows, row, cycle, until, phi):
    """How many cycles the switch of a row can be moved on by without coming to lie behind (until, φ)."""
    return (until - int(rows[row, summary.PERIOD]) - (1 if rows[row, summary.PHASE] > phi else 0)) // cycle


@part
def has_cycle(w, k, i, cycle, extent, history):
    """Whether the summary of a motion that is back at its reference after `cycle` periods follows from what is kept.

    For that the last two cycles of the record must lie behind the reference. If so, the switches since then are the
    first rows; and if not, only those of the record are kept from now on.
    """
    rows, first, count = history[k[r.HISTORY_SLOT + i]], k[r.REFERENCE_HISTORY + i], k[r.HISTORY_COUNT + i]
    kept_all = k[r.HISTORY_KEEPS + i] == ALL
    more, phi = count - first, w[r.PHI0 + i]
    certain = kept_all or switch.in_record(w, k, i, k[r.REFERENCE_PERIOD + i], w[r.PHI + i], extent.transient)
    certain = (
        certain and first >= 0 and 0 < 2 * more <= summary.REACH and may_follow_from_a_cycle(cycle, extent.periods)
    )
    for row in range(first if certain else count, count):
        apart = abs(rows[row, summary.PHASE] - phi)
        certain = certain and min(apart, TWO_PI - apart) > END_OF_RECORD
    end = k[r.PERIOD0 + i] + extent.transient + extent.periods
    certain = certain and last_return(rows, first, cycle, end, phi) >= 2
    if certain:
        drop_rows(k, i, first, rows)
    elif kept_all:
        keep_those_of_the_record(w, k, i, extent.transient, rows)
    return certain


@part
def summarise_cycle(w, k, i, cycle, end, recorder):
    """Write the summary of a motion whose cycle is in the first rows, and whose record ends in period `end`.

    Behind the cycle come the switches that follow, two cycles up to the last one of the record.
    """
    rows, more, phi = recorder.history[k[r.HISTORY_SLOT + i]], k[r.HISTORY_COUNT + i], w[r.PHI0 + i]
    later = last_return(rows, 0, cycle, end, phi) * cycle
    last = more - 1
    while lies_behind(int(rows[last, summary.PERIOD]) + later, rows[last, summary.PHASE], end, phi):
        last -= 1
    for row in range(more):
        rows[row, summary.PERIOD] += float(later - 2 * cycle)
    for row in range(more + last + 1):
        event = Switch(
            int(rows[row, summary.BEFORE]), int(rows[row, summary.AFTER]), rows[row, summary.XI], rows[row, summary.DXI]
        )
        write_switch(w, k, i, int(rows[row, summary.PERIOD]) + cycle, rows[row, summary.PHASE], event, recorder)
    write_summary_of(w, k, i, recorder)


@part
def count_cycles(w, k, i, cycle, extent, history):
    """Count the switches that follow those of the cycle in the first rows, to the end of the record."""
    rows, phi, start = history[k[r.HISTORY_SLOT + i]], w[r.PHI0 + i], k[r.PERIOD0 + i] + extent.transient
    end = start + extent.periods
    before, most = last_return(rows, 0, cycle, start, phi), last_return(rows, 0, cycle, end, phi)
    for row in range(k[r.HISTORY_COUNT + i]):
        period, phase = int(rows[row, summary.PERIOD]), rows[row, summary.PHASE]
        first = before - (1 if lies_behind(period + before * cycle, phase, start, phi) else 0)
        last = most - (1 if lies_behind(period + most * cycle, phase, end, phi) else 0)
        switch.count_more(k, i, int(rows[row, summary.AFTER]), last - (max(first, 0) if extent.transient > 0 else 0))


@part
def keep_those_of_the_record(w, k, i, transient, rows):
    """Give up what was kept before the record."""
    k[r.HISTORY_KEEPS + i] = OF_THE_RECORD
    first, count = 0, k[r.HISTORY_COUNT + i]
    while first < count and not switch.in_record(
        w, k, i, int(rows[first, summary.PERIOD]), rows[first, summary.PHASE], transient
    ):
        first += 1
    drop_rows(k, i, first, rows)


@inline
def write_summary_of(w, k, i, recorder):
    """Write the summary of the trajectory in lane i; from now on it keeps no switches."""
    slot = k[r.HISTORY_SLOT + i]
    summary.summarise(
        recorder.history[slot], k[r.HISTORY_ADDED + i], k[r.HISTORY_COUNT + i], k[r.STATE + i], w[r.X0 + i],
        drive_of(w, i), recorder.totals[slot], recorder.summary[k[r.POINT + i]],
    )  # fmt: skip
    k[r.HISTORY_KEEPS + i] = NONE


@part
def end_history(w, k, i, transient, recorder):
    """Write the summary of the trajectory that ends in lane i, unless it is written."""
    if recorder.totals.shape[1] > 0 and k[r.HISTORY_KEEPS + i] != NONE:
        if k[r.HISTORY_KEEPS + i] == ALL:
            keep_those_of_the_record(w, k, i, transient, recorder.history[k[r.HISTORY_SLOT + i]])
        write_summary_of(w, k, i, recorder)


@inline
def leave_slot(k, n, slot):
    """The trajectory of lane n has moved, with its slot, to a lane that had `slot`: the next one here has that."""
    k[r.HISTORY_SLOT + n] = slot
