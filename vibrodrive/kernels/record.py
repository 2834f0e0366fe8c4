"""What a trajectory leaves behind: section points, switches counted and, for a single one, written down.

A section point is written by `emit_sections` here, one lane at a time; in batches ahead of a switch by `write_ahead`
(switch_disturbed.py) or behind it by `write_points` (switch.py); and copied by `detect_recurrence` (recurrence.py).
What is never reached, `finish` sets to NaN.
"""

from __future__ import annotations

import math

from vibrodrive.jit.compile import inline, part
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.certainty import write_section_error, write_switch_error
from vibrodrive.kernels.codes import (
    DOWN,
    IMPACT,
    INFINITY,
    UP,
)
from vibrodrive.kernels.history import end_history, keeps, write_switch
from vibrodrive.kernels.impacts import count_switches, end_impacts, write_impact
from vibrodrive.kernels.lane import STRIDE
from vibrodrive.kernels.motion import section_at, state_at
from vibrodrive.kernels.switch import (
    count_into,
    in_record,
    section_due,
    section_row,
)


@inline
def write_point(w, k, i, count, hs, section):
    """Write section point number `count`, hs after the last switch: eqs. (3)-(5) there."""
    x, v = w[r.X0 + i], 0.0
    if k[r.STATE + i] == UP or k[r.STATE + i] == DOWN:
        if w[r.AF + i] > 0.0:
            x, v = state_at(w, i, hs, True)
        else:
            x, v = section_at(w, i, hs)
    row = section_row(k, i, section)
    section[row, count, 0] = x
    section[row, count, 1] = v


@inline
def emit_sections(w, k, i, h, transient, section, errors, end):
    """Write the section points that lie within h of the present time; the state ends there, off by `end`."""
    count = k[r.SECTIONS + i]
    while count < section.shape[1]:
        hs = section_due(w, k, i, count, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], transient)
        if hs > h:
            break
        write_point(w, k, i, count, hs, section)
        if errors is not None:
            write_section_error(w, k, i, count, hs, h, end, errors)
        count += 1
    k[r.SECTIONS + i] = count


@part
def emit_rest(w, k, i, transient, section, errors, end):
    """The section points that are left: nothing switches any more."""
    emit_sections(w, k, i, INFINITY, transient, section, errors, end)


@inline
def write_row(w, k, i, row, before, after, x, v, rows):
    if row < rows.shape[0]:
        rows[row]["period"] = k[r.PERIOD + i]
        rows[row]["phase"] = w[r.PHI + i]
        rows[row]["before"] = before
        rows[row]["after"] = after
        rows[row]["xi"] = x
        rows[row]["dxi"] = v


@inline
def record(
    w, k, i, before, after, x, v, transient, impacts, history, totals, rows, off, stored, end
):  # fmt: skip
    """Count the switch and, where there is room, write its row, and a main impact, if it lies after the transient.

    Row 0 is kept for the last switch before that: where the recorded window begins, its motion is under way.
    """
    recorded = in_record(w, k, i, k[r.PERIOD + i], w[r.PHI + i], transient)
    if recorded:
        if impacts is not None and after == IMPACT and impacts.shape[1] > 0:
            write_impact(k, i, k[r.PERIOD + i], w[r.PHI + i], -v, count_switches(k, i, r.SWITCHES), impacts)
        count_into(k, i, after)
    if totals is not None and totals.shape[1] > 0 and keeps(w, k, i, k[r.PERIOD + i], w[r.PHI + i], transient):
        write_switch(w, k, i, k[r.PERIOD + i], w[r.PHI + i], before, after, x, v, history, totals)
    if rows is not None:
        row = stored[0] if recorded else 0
        write_row(w, k, i, row, before, after, x, v, rows)
        if off is not None:
            write_switch_error(w, i, row, before, end, off)
        stored[0] += 1 if recorded else 0


@part
def finish(w, k, i, transient, section, impacts, history, totals, summary, status, margin, counts, work):
    """Write what a point ends with; section points never reached are NaN, as is what lies behind the last impact."""
    row, line = k[r.POINT + i], section_row(k, i, section)
    for m in range(k[r.SECTIONS + i], section.shape[1]):
        section[line, m, 0] = math.nan
        section[line, m, 1] = math.nan
    if impacts is not None:
        end_impacts(k, i, impacts)
    if totals is not None:
        end_history(w, k, i, transient, history, totals, summary)
    for state in range(5):
        counts[row, state] = k[r.SWITCHES + state * STRIDE + i]
    status[row] = k[r.STATUS + i]
    margin[row] = w[r.MARGIN + i]
    work[row] = w[r.WORK + i]
