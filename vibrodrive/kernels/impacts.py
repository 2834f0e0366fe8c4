"""The main impacts of a record, written down while it is computed: a section of the motion that is its own.

A disturbed mass touches the obstacle many times where the undisturbed one lands once. Main is an impact that no faster
one follows or precedes within half an excitation period: an impact within π of the last one written takes its place
if it is faster, and is a touch beside it if it is not. So a record of P periods has at most 2P main impacts.

Written are its time (period, phase), its speed, and how many switches of the record came before it. A batch of switches
notes what ends in each lane, when and how fast, and the impacts are written when it is known which switches were
taken. A motion that repeats itself (recurrence.py) has its impacts copied with its sections.
"""

from __future__ import annotations

import math

from vibrodrive.jit.compile import inline
from vibrodrive.jit.trig import PI
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import IMPACT, S1
from vibrodrive.kernels.lane import STRIDE
from vibrodrive.kernels.motion import time_between
from vibrodrive.kernels.switch import in_record

TIME, PHASE, SPEED, BEFORE = 0, 1, 2, 3
"""Columns of an impact: its whole periods since τ = 0 and its phase, its speed -ξ', the switches before it."""


@inline
def count_switches(k, i, row):
    """Switches into all five states that are counted from `row` on."""
    total = 0
    for state in range(5):
        total += k[row + state * STRIDE + i]
    return total


@inline
def write_impact(k, i, period, phi, speed, before, impacts):
    """An impact of the record: a new main one, or one in the place of the last, or a touch beside it."""
    row, slot = k[r.POINT + i], k[r.IMPACTS + i]
    if slot > 0:
        since = time_between(int(impacts[row, slot - 1, TIME]), impacts[row, slot - 1, PHASE], 0.0, period, phi)
        if since <= PI:
            slot -= 1
            if speed <= impacts[row, slot, SPEED]:
                return
    if slot < impacts.shape[1]:
        impacts[row, slot, TIME] = float(period)
        impacts[row, slot, PHASE] = phi
        impacts[row, slot, SPEED] = speed
        impacts[row, slot, BEFORE] = float(before)
        k[r.IMPACTS + i] = slot + 1


@inline
def note_end(w, k, i, which, period, phi, x, v):
    """The end of a state that a batch comes to in lane i: the switching function `which` is zero there.

    Behind a wait whose end is known beforehand the lane goes on from a later instant.
    """
    k[r.ENDED + i] = which
    k[r.END_PERIOD + i] = period
    w[r.END_PHI + i] = phi
    w[r.END_GAP + i] = x
    w[r.END_SPEED + i] = -v


@inline
def keep_impact(w, k, i, transient, impacts):
    """Write the impact, if it is one of the record, with which a batch has taken lane i over a switch."""
    period, phi = k[r.END_PERIOD + i], w[r.END_PHI + i]
    if k[r.ENDED + i] == S1 and in_record(w, k, i, period, phi, transient):
        waited = period != k[r.PERIOD + i] or phi != w[r.PHI + i]
        before = count_switches(k, i, r.SWITCHES) - (3 if waited else 2)
        write_impact(k, i, period, phi, w[r.END_SPEED + i], before, impacts)


@inline
def set_reference_impact(w, k, i, impacts):
    """The last main impact so far belongs to the state of reference (recurrence.py)."""
    row, count = k[r.POINT + i], k[r.IMPACTS + i]
    k[r.REFERENCE_IMPACTS + i] = count
    if count > 0:
        k[r.REFERENCE_IMPACT_PERIOD + i] = int(impacts[row, count - 1, TIME])
        w[r.REFERENCE_IMPACT_PHI + i] = impacts[row, count - 1, PHASE]
        w[r.REFERENCE_IMPACT_SPEED + i] = impacts[row, count - 1, SPEED]


@inline
def impacts_repeat(w, k, i, cycle, impacts):
    """Whether the main impacts go on as they have since the reference, `cycle` periods ago.

    They do if the last of them is then and now the same, for it decides which of the next ones is main; or if there
    was none.
    """
    landed = k[r.SWITCHES + IMPACT * STRIDE + i] > k[r.REFERENCE_SWITCHES + IMPACT * STRIDE + i]
    if impacts.shape[1] == 0 or not landed:
        return True
    row, last = k[r.POINT + i], k[r.IMPACTS + i] - 1
    return (
        k[r.REFERENCE_IMPACTS + i] > 0
        and int(impacts[row, last, TIME]) - k[r.REFERENCE_IMPACT_PERIOD + i] == cycle
        and impacts[row, last, PHASE] == w[r.REFERENCE_IMPACT_PHI + i]
        and impacts[row, last, SPEED] == w[r.REFERENCE_IMPACT_SPEED + i]
    )


@inline
def copy_impacts(k, i, cycles, cycle, switches, impacts):
    """Repeat the main impacts since the reference `cycles` times; `switches` is how many switches a cycle has.

    The last one written may yet be replaced by a faster one. It moves on by all cycles; what became of it at the
    reference takes its place.
    """
    row, count = k[r.POINT + i], k[r.IMPACTS + i]
    more = count - k[r.REFERENCE_IMPACTS + i]
    if impacts.shape[1] == 0 or more == 0:
        return
    last = min(count - 1 + cycles * more, impacts.shape[1] - 1)
    period, phase, speed, before = impacts[row, count - 1]
    for slot in range(count - 1, last):
        impacts[row, slot, TIME] = impacts[row, slot - more, TIME] + float(cycle)
        impacts[row, slot, PHASE] = impacts[row, slot - more, PHASE]
        impacts[row, slot, SPEED] = impacts[row, slot - more, SPEED]
        impacts[row, slot, BEFORE] = impacts[row, slot - more, BEFORE] + float(switches)
    impacts[row, last, TIME] = period + float(cycles * cycle)
    impacts[row, last, PHASE] = phase
    impacts[row, last, SPEED] = speed
    impacts[row, last, BEFORE] = before + float(cycles * switches)
    k[r.IMPACTS + i] = last + 1


@inline
def end_impacts(k, i, impacts):
    """NaN behind the last main impact."""
    row = k[r.POINT + i]
    for slot in range(k[r.IMPACTS + i], impacts.shape[1]):
        for column in range(4):
            impacts[row, slot, column] = math.nan
