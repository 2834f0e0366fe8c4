"""Copying of cycles at ε = 0: a motion that returns to an earlier state repeats itself.

After an impact, the motion depends only on the phase of the impact. After the mass has rested at the obstacle, the
motion is always the same, because the mass leaves at a known phase with ξ = ξ' = ξ'' = 0. So a certified motion that
rests twice returns to the same state exactly. A motion that approaches a stable orbit returns exactly as soon as its
distance from the orbit is below the last bit. After the return, each cycle equals the cycle before to the bit, because
no decision depends on the number of periods since the start.

A departure is a switch at which the mass leaves the obstacle. At each departure the state is compared with a reference,
the state at an earlier departure (cycle detection after Brent 1980). If the two states are equal, the motion between
them is a cycle. The section points of this cycle are copied, and its switches are counted, once for each complete cycle
that fits into the rest of the record. The lane then continues after these cycles and computes the remaining motion. A
new reference is set at each departure after a certified rest. It is also set after a number of departures without a
return. This number grows by a quarter each time.

A summary follows from the switches of one cycle (history.py). The section points and main impacts are copied after the
summary is written. If only summaries are recorded, the trajectory ends as soon as the summary is written.

Equal phases do not suffice for equal bits. The searches start from guesses (undisturbed.py), which must also be equal.
Therefore a certified rest clears the guesses. Nothing is copied for 1 - B < LEAST_FALL (0.01, undisturbed.py). Then the
ends of slides are searched for by steps, and the certified steps depend on the smallest margin so far.

With Muller's method a motion also returns to the same bits, because its grid begins at each switch, and the refinement
of a zero depends only on the grid points around this zero. But a rest ends at a refined phase, not at a known phase, so
the motions after two rests may differ. With a fixed grid, the motion depends on the number of the grid point, which
never returns. `kernels/__init__.py` explains the terms.
"""

from vibrodrive.jit.compile import inline, part
from vibrodrive.kernels import codes, history, motion, record, switch, undisturbed
from vibrodrive.kernels import lane as r

FIRST_WINDOW = 16
"""Number of departures after which the first reference is replaced. It is replaced earlier if the mass rests."""

GUESSES = (r.BEGAN_UP, r.LASTED_UP, r.RATE_UP, r.BEGAN_DOWN, r.LASTED_DOWN, r.RATE_DOWN)
DECISIVE = (r.PHI, r.A0, *GUESSES)
"""Quantities that determine the motion after a departure. The lane rows from REFERENCE_PHI on store these quantities of
the reference in this order."""


@inline
def clear_reference(w, k, i):
    """Clear the reference at the start of a motion."""
    undisturbed.clear_guesses(w, i)
    w[r.REFERENCE_PHI + i] = -1.0  # no phase
    k[r.SINCE + i] = 0
    k[r.WINDOW + i] = FIRST_WINDOW


@inline
def at_reference(w, i, guessed):
    """Return whether the quantities that determine the motion equal those of the reference.

    The guesses are compared only if `guessed` is true.
    """
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
    """Copy the section points and impacts since the reference `cycles` times, and count the switches of these cycles.

    A cycle lasts `cycle` excitation periods and has `cycle` section points.
    """
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
        switch.add_count(k, i, state, cycles * more)


@part
def detect_recurrence(w, k, i, guessed, extent, section, impacts, recorder):
    """If the state of lane i equals its reference, copy the cycles that follow. The mass has just left the obstacle.

    `guessed` is true if the bits of a switch depend on the guess from which its search starts. Return False if all
    results of the trajectory are known.
    """
    rested = w[r.A0 + i] == 0.0 and w[r.PHI + i] == w[r.PHI_UP + i]  # after an impact without a rest, A0 > 0
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
    # upper bound of the cost of a copied period: a search with n evaluations costs at most n/100 plus two switches,
    # which is less than 3n
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
        cycles = max(end - 1 - period, 0) // cycle  # if τ0 > 0, `period` may be `end`
        copy_cycles(k, i, cycles, cycle, section, impacts)
    k[r.PERIOD + i] += cycles * cycle
    k[r.COUNTED + i] += cycles * cycle
    w[r.LEFT + i] = motion.time_between(k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], end, w[r.PHI0 + i])
    set_reference(w, k, i, impacts, recorder)
    return True
