"""Storage of the switches from which the summary (summary.py) of each trajectory in a batch is computed.

A lane (lane.py) holds one trajectory of the batch. It has room for ROWS switches, one in each row. If all rows are in
use, the first half of the switches is added to the totals of the lane (the sums of which summary.py makes the summary)
and discarded. The rows equal the rows of switches that `simulate` returns. After a batch of switches the rows are
written from the values that `note_end` (switch.py) has stored. The rows of a lane are one slot of the memory. If a
trajectory moves to another lane, it keeps its slot.

A motion may return to an earlier state, the reference, to the bit (recurrence.py). The summary then follows from one
cycle of the switches, and is written when the cycle is complete. A sweep that records only summaries then ends the
trajectory. For such motions the switches before the record are stored, too. `kernels/__init__.py` explains the terms.
"""

import numpy as np

from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import summary, switch
from vibrodrive.kernels.codes import ALL, DOWN, IMPACT, NONE, OF_THE_RECORD, REST, S1, S3, S4, STICK, UNKNOWN, UP
from vibrodrive.kernels.outputs import Switch

ROWS = 2 * summary.REACH  # number of switches for which a lane has room

APART = ROWS + 11
"""Distance in memory from the rows of one lane to those of the next, in rows. If it were a multiple of a page, the
lanes would compete for the same cache lines."""

END_OF_RECORD = 1e-9
"""Least distance of each switch of a cycle from the phase at which a record begins and ends. If a switch is closer,
rounding decides whether it belongs to the record. The motion must then be computed up to the end of the record."""


def new_history(threads: int, wanted: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return (history, totals): memory for switches and totals of the lanes of each thread; empty if not `wanted`."""
    if not wanted:
        return np.empty((threads, r.LANES, 0, summary.COLUMNS)), np.empty((threads, r.LANES, 0))
    return np.empty((threads, r.LANES, APART, summary.COLUMNS)), np.empty((threads, r.LANES, summary.TOTALS))


@part
def assign_slots(k):
    """Let each lane i store its switches in slot i of the memory. `leave_slot` changes this."""
    for i in range(r.LANES):
        k[r.HISTORY_SLOT + i] = i


@inline
def clear_history(k, i, keeps):
    """Discard the switches of lane i. `keeps` states which switches the lane stores from now on (codes.py)."""
    k[r.HISTORY_KEEPS + i] = keeps
    k[r.HISTORY_COUNT + i] = 0
    k[r.HISTORY_ADDED + i] = 0


@inline
def keeps(w, k, i, period, phi, transient):
    """Return whether lane i must store a switch at (period, phi)."""
    of_all = k[r.HISTORY_KEEPS + i]
    return of_all == ALL or (of_all == OF_THE_RECORD and switch.in_record(w, k, i, period, phi, transient))


@inline
def write_switch(w, k, i, period, phi, event, recorder):
    """Store a switch. If there is no room for it, first add half of the stored switches to the totals."""
    slot, row = k[r.HISTORY_SLOT + i], k[r.HISTORY_COUNT + i]
    rows = recorder.history[slot]
    if row == ROWS:
        row = make_room(w, k, i, rows, recorder.totals[slot], recorder.grid)
    rows[row, summary.PERIOD] = float(period)
    rows[row, summary.PHASE] = phi
    rows[row, summary.BEFORE] = float(event.before)
    rows[row, summary.AFTER] = float(event.after)
    rows[row, summary.XI] = event.x
    rows[row, summary.DXI] = event.v
    k[r.HISTORY_COUNT + i] = row + 1


@inline
def drive_of(w, i, grid):
    """Return the parameters of lane i on which its summary depends."""
    step = w[r.DTAU + i] if grid else UNKNOWN
    return summary.Drive(w[r.A + i], w[r.B + i], w[r.AF + i], w[r.ETA + i], w[r.FRAC + i], step)


@part
def make_room(w, k, i, rows, totals, grid):
    """Add the first half of the switches to the totals, and move the others to the front. Return their number."""
    half = ROWS // 2
    summary.add_switches(rows, k[r.HISTORY_ADDED + i], half + 1, drive_of(w, i, grid), totals)
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
    """Store the switches that a batch has applied in lane i.

    These switches are the end of a state (two switches if it ends with an impact) and the end of a wait that follows. A
    wait with a known end ends in the same batch (switch_undisturbed.py). `note_end` has stored the time at which this
    wait begins.
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
    """Store the number of switches up to the present state, which becomes the reference (recurrence.py)."""
    k[r.REFERENCE_HISTORY + i] = k[r.HISTORY_COUNT + i]


@inline
def cycle_suffices(cycle, periods):
    """Return whether the summary of a motion that returns after `cycle` periods may follow from one cycle.

    This requires that `cycle` is at most LONGEST (the search for a period ends there), and that the record is longer
    than two cycles.
    """
    return cycle <= summary.LONGEST and 2 * cycle + 2 <= periods


@inline
def keep_all(k, i, cycle, periods, recorder):
    """Store all switches from now on, if the summary may follow from one cycle. The record has not begun yet."""
    keeping = recorder.totals.shape[1] > 0 and k[r.HISTORY_KEEPS + i] == OF_THE_RECORD
    if keeping and cycle_suffices(cycle, periods):
        clear_history(k, i, ALL)


@inline
def is_after(period, phase, until, phi):
    """Return whether (period, phase) is after (until, phi)."""
    return period > until or (period == until and phase > phi)


@inline
def last_return(rows, row, cycle, until, phi):
    """Return the largest number of cycles by which the switch in `row` can be shifted without passing (until, phi)."""
    return (until - int(rows[row, summary.PERIOD]) - (1 if rows[row, summary.PHASE] > phi else 0)) // cycle


@part
def has_cycle(w, k, i, cycle, extent, history):
    """Return whether the summary follows from the switches since the reference, `cycle` periods ago.

    This requires that all these switches are stored (at most REACH / 2), that their phases differ by more than
    END_OF_RECORD from the phase at which the record ends, and that the last two cycles of the record are after the
    reference. If the result is true, these switches become the first rows. Otherwise the lane stores only switches of
    the record from now on.
    """
    rows, first, count = history[k[r.HISTORY_SLOT + i]], k[r.REFERENCE_HISTORY + i], k[r.HISTORY_COUNT + i]
    kept_all = k[r.HISTORY_KEEPS + i] == ALL
    more, phi = count - first, w[r.PHI0 + i]
    certain = kept_all or switch.in_record(w, k, i, k[r.REFERENCE_PERIOD + i], w[r.PHI + i], extent.transient)
    certain = certain and first >= 0 and 0 < 2 * more <= summary.REACH and cycle_suffices(cycle, extent.periods)
    for row in range(first if certain else count, count):
        apart = abs(rows[row, summary.PHASE] - phi)
        certain = certain and min(apart, TWO_PI - apart) > END_OF_RECORD
    end = k[r.PERIOD0 + i] + extent.transient + extent.periods
    certain = certain and last_return(rows, first, cycle, end, phi) >= 2
    if certain:
        drop_rows(k, i, first, rows)
    elif kept_all:
        keep_record_only(w, k, i, extent.transient, rows)
    return certain


@part
def summarise_cycle(w, k, i, cycle, end, recorder):
    """Write the summary of a motion from one cycle, which is in the first rows. The record ends in period `end`.

    Two copies of the cycle are appended. The second copy ends with the last switch of the record.
    """
    rows, more, phi = recorder.history[k[r.HISTORY_SLOT + i]], k[r.HISTORY_COUNT + i], w[r.PHI0 + i]
    later = last_return(rows, 0, cycle, end, phi) * cycle
    last = more - 1
    while is_after(int(rows[last, summary.PERIOD]) + later, rows[last, summary.PHASE], end, phi):
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
    """Count the switches of the record that are copies of the switches in the first rows, which are one cycle."""
    rows, phi, start = history[k[r.HISTORY_SLOT + i]], w[r.PHI0 + i], k[r.PERIOD0 + i] + extent.transient
    end = start + extent.periods
    before, most = last_return(rows, 0, cycle, start, phi), last_return(rows, 0, cycle, end, phi)
    for row in range(k[r.HISTORY_COUNT + i]):
        period, phase = int(rows[row, summary.PERIOD]), rows[row, summary.PHASE]
        first = before - (1 if is_after(period + before * cycle, phase, start, phi) else 0)
        last = most - (1 if is_after(period + most * cycle, phase, end, phi) else 0)
        switch.add_count(k, i, int(rows[row, summary.AFTER]), last - (max(first, 0) if extent.transient > 0 else 0))


@part
def keep_record_only(w, k, i, transient, rows):
    """Discard the switches before the record. Store only switches of the record from now on."""
    k[r.HISTORY_KEEPS + i] = OF_THE_RECORD
    first, count = 0, k[r.HISTORY_COUNT + i]
    while first < count and not switch.in_record(
        w, k, i, int(rows[first, summary.PERIOD]), rows[first, summary.PHASE], transient
    ):
        first += 1
    drop_rows(k, i, first, rows)


@inline
def write_summary_of(w, k, i, recorder):
    """Write the summary of the trajectory in lane i. The lane stores no more switches."""
    slot = k[r.HISTORY_SLOT + i]
    summary.summarise(
        recorder.history[slot], k[r.HISTORY_ADDED + i], k[r.HISTORY_COUNT + i], k[r.STATE + i], w[r.X0 + i],
        drive_of(w, i, recorder.grid), recorder.totals[slot], recorder.summary[k[r.POINT + i]],
    )  # fmt: skip
    k[r.HISTORY_KEEPS + i] = NONE


@part
def end_history(w, k, i, transient, recorder):
    """Write the summary of the trajectory that ends in lane i, if it has not been written yet."""
    if recorder.totals.shape[1] > 0 and k[r.HISTORY_KEEPS + i] != NONE:
        if k[r.HISTORY_KEEPS + i] == ALL:
            keep_record_only(w, k, i, transient, recorder.history[k[r.HISTORY_SLOT + i]])
        write_summary_of(w, k, i, recorder)


@inline
def leave_slot(k, n, slot):
    """Assign `slot` to lane n. The trajectory of lane n has moved, with its own slot, to the lane that used `slot`."""
    k[r.HISTORY_SLOT + n] = slot
