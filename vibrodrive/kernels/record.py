"""Output of a trajectory: section points, numbers of switches, main impacts and, for a single trajectory, switches.

`emit_sections` writes the section points of a single lane. For a batch of switches, `write_next_points` writes section
points before the switches are applied (switch_disturbed.py), or `write_points` writes them afterwards (switch.py). The
section points of a motion that repeats itself are copied (recurrence.py). `finish` sets the points that a motion has
not reached to NaN.

**Main impacts.** A disturbed mass touches the obstacle many times where the undisturbed mass has one impact. A main
impact has no faster impact within half an excitation period before or after it. If an impact follows the last main
impact within π, there are two cases. A faster impact replaces this main impact. A slower impact is a touch and is not
written. Therefore a record of P periods has at most 2P main impacts.

Each main impact is written with its time (period, phase), its speed, and the number of switches of the record before
it. A batch of switches stores the end of each state. The impacts are written as soon as it is known which switches are
applied. The impacts of a motion that repeats itself are copied together with its section points.

`kernels/__init__.py` explains the terms.
"""

import math

from vibrodrive.jit.atomic import publish
from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import PI
from vibrodrive.kernels import certainty, history, motion, switch
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import DOWN, IMPACT, INFINITY, S1, UP

TIME, PHASE, SPEED, BEFORE = 0, 1, 2, 3
"""Columns of a row of `impacts`: periods since τ = 0, phase, speed -ξ', number of switches of the record before it."""


@inline
def count_switches(k, i, row):
    """Return the total number of switches into the five states, whose numbers are in five rows from `row` on."""
    total = 0
    for state in range(5):
        total += k[row + state * r.STRIDE + i]
    return total


@inline
def write_impact(k, i, period, phi, speed, before, impacts):
    """Write an impact of the record as a new main impact, or in place of the last one. A touch is not written.

    `before` is the number of switches of the record before this impact.
    """
    row, slot = k[r.POINT + i], k[r.IMPACTS + i]
    if slot > 0:
        since = motion.time_between(int(impacts[row, slot - 1, TIME]), impacts[row, slot - 1, PHASE], 0.0, period, phi)
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
def keep_impact(w, k, i, transient, impacts):
    """Write the impact that a batch of switches has applied in lane i, if it belongs to the record."""
    period, phi = k[r.END_PERIOD + i], w[r.END_PHI + i]
    if k[r.ENDED + i] == S1 and switch.in_record(w, k, i, period, phi, transient):
        waited = period != k[r.PERIOD + i] or phi != w[r.PHI + i]
        before = count_switches(k, i, r.SWITCHES) - (3 if waited else 2)
        write_impact(k, i, period, phi, w[r.END_SPEED + i], before, impacts)


@inline
def set_reference_impact(w, k, i, impacts):
    """Store the number of main impacts so far, and the last main impact, with the reference (recurrence.py)."""
    row, count = k[r.POINT + i], k[r.IMPACTS + i]
    k[r.REFERENCE_IMPACTS + i] = count
    if count > 0:
        k[r.REFERENCE_IMPACT_PERIOD + i] = int(impacts[row, count - 1, TIME])
        w[r.REFERENCE_IMPACT_PHI + i] = impacts[row, count - 1, PHASE]
        w[r.REFERENCE_IMPACT_SPEED + i] = impacts[row, count - 1, SPEED]


@inline
def impacts_repeat(w, k, i, cycle, impacts):
    """Return whether the next main impacts will repeat the main impacts since the reference, `cycle` periods ago.

    This is true in two cases. In the first case there has been no impact since the reference. In the second case the
    last main impact now is the same as the last main impact at the reference, `cycle` periods later, because the last
    main impact determines which of the next impacts are main impacts.
    """
    landed = k[r.SWITCHES + IMPACT * r.STRIDE + i] > k[r.REFERENCE_SWITCHES + IMPACT * r.STRIDE + i]
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
    """Copy the main impacts since the reference `cycles` times; `switches` is the number of switches of a cycle.

    The last main impact is not final, because a faster impact may still replace it. So it is moved to the end of all
    cycles. The main impact that was the last one at the reference is final now, and a copy of it is written instead.
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
    """Write NaN after the last main impact."""
    row = k[r.POINT + i]
    for slot in range(k[r.IMPACTS + i], impacts.shape[1]):
        for column in range(4):
            impacts[row, slot, column] = math.nan


@inline
def write_point(w, k, i, count, hs, section):
    """Write section point number `count`, hs after the last switch, by eqs. (3)-(5)."""
    x, v = w[r.X0 + i], 0.0
    if k[r.STATE + i] == UP or k[r.STATE + i] == DOWN:
        if w[r.AF + i] > 0.0:
            x, v = motion.state_at(w, i, hs, True)
        else:
            x, v = motion.section_at(w, i, hs)
    row = switch.section_row(k, i, section)
    section[row, count, 0] = x
    section[row, count, 1] = v


@inline
def emit_sections(w, k, i, h, transient, section, errors, end):
    """Write the section points up to h after the last switch. The state ends at h, with the errors `end`."""
    count = k[r.SECTIONS + i]
    while count < section.shape[1]:
        hs = switch.section_due(w, k, i, count, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], transient)
        if hs > h:
            break
        write_point(w, k, i, count, hs, section)
        if errors is not None:
            certainty.write_section_error(w, k, i, count, hs, h, end, errors)
        count += 1
    k[r.SECTIONS + i] = count


@part
def emit_rest(w, k, i, transient, section, errors, end):
    """Write the remaining section points of the record, in which no switch follows."""
    emit_sections(w, k, i, INFINITY, transient, section, errors, end)


@inline
def write_row(w, k, i, row, event, rows):
    """Write a switch at the present time into row `row`, if `rows` has this row."""
    if row < rows.shape[0]:
        rows[row]["period"] = k[r.PERIOD + i]
        rows[row]["phase"] = w[r.PHI + i]
        rows[row]["before"] = event.before
        rows[row]["after"] = event.after
        rows[row]["xi"] = event.x
        rows[row]["dxi"] = event.v


@inline
def record(w, k, i, event, transient, impacts, recorder, log, errors, end):
    """Count a switch of the record, and write it as a main impact and as a row, if such outputs are needed.

    Row 0 is the last switch of the transient, because the record begins in the state that follows this switch.
    """
    recorded = switch.in_record(w, k, i, k[r.PERIOD + i], w[r.PHI + i], transient)
    if recorded:
        if impacts is not None and event.after == IMPACT and impacts.shape[1] > 0:
            write_impact(k, i, k[r.PERIOD + i], w[r.PHI + i], -event.v, count_switches(k, i, r.SWITCHES), impacts)
        switch.count_into(k, i, event.after)
    if recorder is not None:
        period, phi = k[r.PERIOD + i], w[r.PHI + i]
        if recorder.totals.shape[1] > 0 and history.keeps(w, k, i, period, phi, transient):
            history.write_switch(w, k, i, period, phi, event, recorder)
    if log is not None:
        row = log.stored[0] if recorded else 0
        write_row(w, k, i, row, event, log.rows)
        if errors is not None:
            certainty.write_switch_error(w, i, row, event.before, end, errors)
        log.stored[0] += 1 if recorded else 0


@part
def finish(w, k, i, extent, section, impacts, recorder, errors, outcome):
    """Write the results of a point. Set section points that the motion has not reached, and unused impacts, to NaN."""
    row, line = k[r.POINT + i], switch.section_row(k, i, section)
    for m in range(k[r.SECTIONS + i], section.shape[1]):
        section[line, m, 0] = math.nan
        section[line, m, 1] = math.nan
    if impacts is not None:
        end_impacts(k, i, impacts)
    if recorder is not None:
        history.end_history(w, k, i, extent.transient, recorder)
    if errors is not None:
        certainty.end_errors(w, k, i, extent.periods, errors)
    for state in range(5):
        outcome.counts[row, state] = k[r.SWITCHES + state * r.STRIDE + i]
    outcome.margin[row] = w[r.MARGIN + i]
    outcome.work[row] = w[r.WORK + i]
    publish(outcome.status, row, k[r.STATUS + i])  # last, because other threads then use the results of the point
