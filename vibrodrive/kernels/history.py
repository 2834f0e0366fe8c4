"""Storage of the switches of each trajectory in a batch, as far back as its summary needs them (summary.py).

A lane has room for ROWS switches. If it is full, the first half is added to the totals of the lane and discarded. The
rows equal those of `simulate`. After a batch of switches they are written from the values stored by `note_end`
(switch.py).

A motion that repeats itself to the bit is compared with a reference, an earlier state (recurrence.py). Its summary
follows from one cycle of its switches, and is written when the cycle is complete. A sweep that records only summaries
then ends the trajectory. For such motions switches before the record are also stored.
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
"""Number of switches for which a lane has room."""

APART = ROWS + 11
"""Distance in rows from one lane to the next. If it were a multiple of a page, the lanes would compete for the same
cache lines."""

END_OF_RECORD = 1e-9
"""Least distance of the switches of a cycle from the phase at which a record begins and ends, for a summary from this
cycle. If a switch is closer, only the motion up to the end of the record decides whether the switch belongs to the
record."""


def new_history(threads: int, wanted: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return memory (history, totals) for the lanes of each thread: switches and totals; empty if not `wanted`."""
    if not wanted:
        return np.empty((threads, r.LANES, 0, summary.COLUMNS)), np.empty((threads, r.LANES, 0))
    return np.empty((threads, r.LANES, APART, summary.COLUMNS)), np.empty((threads, r.LANES, summary.TOTALS))


@part
def assign_slots(k):
    """Let lane i store its switches in slot i, until trajectories are moved to other lanes."""
    for i in range(r.LANES):
        k[r.HISTORY_SLOT + i] = i


@inline
def clear_history(k, i, keeps):
    """Discard the switches of lane i. From now on it stores those of the record (OF_THE_RECORD) or all (ALL)."""
    k[r.HISTORY_KEEPS + i] = keeps
    k[r.HISTORY_COUNT + i] = 0
    k[r.HISTORY_ADDED + i] = 0


@inline
def keeps(w, k, i, period, phi, transient):
    """Return whether lane i must store a switch at (period, φ)."""
    of_all = k[r.HISTORY_KEEPS + i]
    return of_all == ALL or (of_all == OF_THE_RECORD and switch.in_record(w, k, i, period, phi, transient))


@inline
def write_switch(w, k, i, period, phi, event, recorder):
    """Store a switch. If there is no room for it, first add half of the switches to the totals and discard them."""
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
    """Return the parameters of lane i on which its summary depends."""
    return summary.Drive(w[r.A + i], w[r.B + i], w[r.AF + i], w[r.ETA + i], w[r.FRAC + i])


@part
def make_room(w, k, i, rows, totals):
    """Add the first half of the switches to the totals and move the others to the front. Returns their number."""
    half = ROWS // 2
    summary.add_switches(rows, k[r.HISTORY_ADDED + i], half + 1, drive_of(w, i), totals)
    drop_rows(k, i, half, rows)
    k[r.HISTORY_ADDED + i] = 1
    return half


@inline
def drop_rows(k, i, first, rows):
    """Discard the switches before row `first`."""
    count = k[r.HISTORY_COUNT + i] - first
    for row in range(count if first > 0 else 0):
        for column in range(summary.COLUMNS):
            rows[row, column] = rows[first + row, column]
    k[r.HISTORY_COUNT + i] = count
    k[r.REFERENCE_HISTORY + i] -= first


@inline
def keep_switch(w, k, i, on_grid, transient, recorder):
    """Store the switches of lane i in a batch: the end of a state, an impact before it, the end of a wait after it.

    A wait with a known end ends within the same batch (switch_undisturbed.py). It begins at the time that `note_end`
    has stored.
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
    """Set the number of switches before the reference state (recurrence.py)."""
    k[r.REFERENCE_HISTORY + i] = k[r.HISTORY_COUNT + i]


@inline
def may_follow_from_a_cycle(cycle, periods):
    """Return whether the summary of a motion that returns after `cycle` periods follows from these periods.

    The record must be long enough to contain each period that is a candidate for the period of the motion twice.
    """
    return cycle <= summary.LONGEST and 2 * cycle + 2 <= periods


@inline
def keep_all(k, i, cycle, periods, recorder):
    """From now on store all switches of a motion that has returned before its record, if they give its summary."""
    keeping = recorder.totals.shape[1] > 0 and k[r.HISTORY_KEEPS + i] == OF_THE_RECORD
    if keeping and may_follow_from_a_cycle(cycle, periods):
        clear_history(k, i, ALL)


@inline
def lies_behind(period, phase, until, phi):
    """Return whether a switch at (period, phase) comes after (until, φ)."""
    return period > until or (period == until and phase > phi)


@inline
def last_return(rows, row, cycle, until, phi):
    """Return the largest number of cycles by which the switch of a row can be shifted without exceeding (until, φ)."""
    return (until - int(rows[row, summary.PERIOD]) - (1 if rows[row, summary.PHASE] > phi else 0)) // cycle


@part
def has_cycle(w, k, i, cycle, extent, history):
    """Return whether the stored switches give the summary of a motion that equals its reference after `cycle` periods.

    This requires the last two cycles of the record to be after the reference. If true, the switches since the reference
    become the first rows. If false, only the switches of the record are stored from now on.
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

    The rows of the cycle are followed by two more cycles, up to the last switch of the record.
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
    """Count the switches of the record that follow the cycle in the first rows."""
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
    """Discard the switches before the record."""
    k[r.HISTORY_KEEPS + i] = OF_THE_RECORD
    first, count = 0, k[r.HISTORY_COUNT + i]
    while first < count and not switch.in_record(
        w, k, i, int(rows[first, summary.PERIOD]), rows[first, summary.PHASE], transient
    ):
        first += 1
    drop_rows(k, i, first, rows)


@inline
def write_summary_of(w, k, i, recorder):
    """Write the summary of the trajectory in lane i. From now on the lane stores no switches."""
    slot = k[r.HISTORY_SLOT + i]
    summary.summarise(
        recorder.history[slot], k[r.HISTORY_ADDED + i], k[r.HISTORY_COUNT + i], k[r.STATE + i], w[r.X0 + i],
        drive_of(w, i), recorder.totals[slot], recorder.summary[k[r.POINT + i]],
    )  # fmt: skip
    k[r.HISTORY_KEEPS + i] = NONE


@part
def end_history(w, k, i, transient, recorder):
    """Write the summary of the trajectory that ends in lane i, unless it has been written."""
    if recorder.totals.shape[1] > 0 and k[r.HISTORY_KEEPS + i] != NONE:
        if k[r.HISTORY_KEEPS + i] == ALL:
            keep_those_of_the_record(w, k, i, transient, recorder.history[k[r.HISTORY_SLOT + i]])
        write_summary_of(w, k, i, recorder)


@inline
def leave_slot(k, n, slot):
    """Assign `slot` to lane n. The trajectory of lane n has moved, with its own slot, to the lane that had `slot`."""
    k[r.HISTORY_SLOT + n] = slot
