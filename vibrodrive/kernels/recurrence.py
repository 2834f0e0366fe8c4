"""ε = 0: a motion that returns to an earlier state repeats itself, so its cycles are copied.

After an impact the motion depends only on the phase of the impact; after a rest on nothing, because the mass leaves at
a known phase with ξ = ξ' = ξ'' = 0. So a certified motion that rests twice returns exactly, and so does, finally, a
motion whose distance from a stable orbit has shrunk below the last bit. From then on each cycle equals its predecessor
to the bit: no decision depends on the number of periods passed.

Whenever the mass leaves the obstacle its state is compared with a reference state (cycle detection after Brent 1980).
If they are equal, the section points of the cycle in between are copied as often as complete cycles fit into the rest
of the record, its switches are counted as often, and the lane continues after them; the last part of a cycle is
computed. A new reference is set at every certified rest, and after a number of departures (which grows by a quarter
each time) without a return to the old one. A summary follows from one cycle of switches (history.py); section and main
impacts are copied after it is written. If only summaries are recorded, the trajectory ends there.

Equal phases do not suffice for equal bits: the guesses from which the next searches start must also be equal. A
certified rest therefore clears them. Nothing is copied for 1 - B < LEAST_FALL, where slides are searched by steps and
certified steps depend on the margin so far. Muller's path also returns, because its grid begins at each switch and only
the grid points around a zero determine the start of its refinement; but it ends a rest at a refined phase, not at a
known one. On a fixed grid the motion depends on the number of the grid point, which never returns.
"""

from __future__ import annotations

from vibrodrive.jit.compile import inline, part
from vibrodrive.kernels import codes, history, motion, record, switch, undisturbed
from vibrodrive.kernels import lane as r

FIRST_WINDOW = 16
"""Departures after which the first reference is replaced, unless the mass rests earlier."""

GUESSES = (r.BEGAN_UP, r.LASTED_UP, r.RATE_UP, r.BEGAN_DOWN, r.LASTED_DOWN, r.RATE_DOWN)
DECISIVE = (r.PHI, r.A0, *GUESSES)
"""Quantities that determine the motion after a departure, in the order of their rows at the reference."""


@inline
def clear_reference(w, k, i):
    """Clear the reference at the start of a motion."""
    undisturbed.clear_guesses(w, i)
    w[r.REFERENCE_PHI + i] = -1.0  # no phase
    k[r.SINCE + i] = 0
    k[r.WINDOW + i] = FIRST_WINDOW


@inline
def at_reference(w, i, guessed):
    """Return whether all quantities that determine the motion are as at the reference."""
    same = True
    for n in range(len(DECISIVE) if guessed else len(DECISIVE) - len(GUESSES)):
        same = same and w[DECISIVE[n] + i] == w[r.REFERENCE_PHI + n * r.STRIDE + i]
    return same


@inline
def set_reference(w, k, i, impacts, recorder):
    """Make the present state the reference."""
    for n in range(len(DECISIVE)):
        w[r.REFERENCE_PHI + n * r.STRIDE + i] = w[DECISIVE[n] + i]
    for state in range(5):
        k[r.REFERENCE_SWITCHES + state * r.STRIDE + i] = k[r.SWITCHES + state * r.STRIDE + i]
    w[r.REFERENCE_WORK + i] = w[r.WORK + i]
    k[r.REFERENCE_PERIOD + i] = k[r.PERIOD + i]
    k[r.REFERENCE_SECTIONS + i] = k[r.SECTIONS + i]
    k[r.SINCE + i] = 0
    if impacts is not None:
        record.set_reference_impact(w, k, i, impacts)
    if recorder is not None:
        history.set_reference_history(k, i)


@inline
def copy_cycles(k, i, cycles, cycle, section, impacts):
    """Copy section points, impacts and numbers of switches of the cycle since the reference, of `cycle` points."""
    row, count = switch.section_row(k, i, section), k[r.SECTIONS + i]
    for m in range(count, count + cycles * cycle):
        section[row, m, 0] = section[row, m - cycle, 0]
        section[row, m, 1] = section[row, m - cycle, 1]
    k[r.SECTIONS + i] += cycles * cycle
    if impacts is not None:
        switches = record.count_switches(k, i, r.SWITCHES) - record.count_switches(k, i, r.REFERENCE_SWITCHES)
        record.copy_impacts(k, i, cycles, cycle, switches, impacts)
    for state in range(5):
        more = k[r.SWITCHES + state * r.STRIDE + i] - k[r.REFERENCE_SWITCHES + state * r.STRIDE + i]
        switch.count_more(k, i, state, cycles * more)


@part
def detect_recurrence(w, k, i, guessed, extent, section, impacts, recorder):
    """Skip the known cycles if lane i, which has just left the obstacle, is at its reference.

    guessed: whether the bits of a switch depend on the start of its search. Returns False if all results are known.
    """
    rested = w[r.A0 + i] == 0.0 and w[r.PHI + i] == w[r.PHI_UP + i]  # after an impact H > 1
    if not at_reference(w, i, guessed):
        if rested or k[r.SINCE + i] >= k[r.WINDOW + i]:
            k[r.WINDOW + i] += 0 if rested else k[r.WINDOW + i] // 4
            set_reference(w, k, i, impacts, recorder)
        return True
    start = k[r.PERIOD0 + i] + extent.transient
    end = start + extent.periods
    period, count = k[r.PERIOD + i], k[r.SECTIONS + i]
    cycle, points = period - k[r.REFERENCE_PERIOD + i], count - k[r.REFERENCE_SECTIONS + i]
    cycles = 0
    # no period of the copies can cost more than the cycle: at most two switches for each search, and a hundredth of
    # its evaluations, are less than three times these
    cost = 3.0 * (w[r.WORK + i] - w[r.REFERENCE_WORK + i])
    known = cost < float(extent.budget) and 1.0 - w[r.B + i] >= undisturbed.LEAST_FALL
    summarised = True
    if recorder is not None:
        summarised = recorder.totals.shape[1] == 0 or k[r.HISTORY_KEEPS + i] == codes.NONE
        if known and not summarised and history.has_cycle(w, k, i, cycle, extent, recorder.history):
            nothing_else = impacts.shape[1] == 0 and not switch.has_rows(section, recorder.summary)
            if nothing_else:
                history.count_cycles(w, k, i, cycle, extent, recorder.history)
            history.summarise_cycle(w, k, i, cycle, end, recorder)
            summarised = True
            if nothing_else:
                k[r.SECTIONS + i] = extent.periods
                w[r.LEFT + i] = codes.ENDED_EARLY
                return False
    if known and period < start:
        cycles = (start - 1 - period) // cycle
        if recorder is not None:
            history.keep_all(k, i, cycle, extent.periods, recorder)
    elif (
        known
        and points == cycle
        and switch.in_record(w, k, i, k[r.REFERENCE_PERIOD + i], w[r.PHI + i], extent.transient)
        and (impacts is None or record.impacts_repeat(w, k, i, cycle, impacts))
        and summarised
    ):
        cycles = max(end - 1 - period, 0) // cycle  # for τ0 > 0 the record ends within period `end`
        copy_cycles(k, i, cycles, cycle, section, impacts)
    k[r.PERIOD + i] += cycles * cycle
    k[r.COUNTED + i] += cycles * cycle
    w[r.LEFT + i] = motion.time_between(k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], end, w[r.PHI0 + i])
    set_reference(w, k, i, impacts, recorder)
    return True
