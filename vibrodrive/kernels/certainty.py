"""Bounds of the errors of a motion, propagated from switch to switch (docs/certified.md).

The acceleration of a slide, ξ'' = H(τ) - s, depends only on the time τ. So the error E of ξ' is constant along a slide,
except for the rounding of the closed form. If ξ has the error X at the start of the slide, its error is X + E h at the
time h later. E and X have two parts each. The first part is the effect of a common cause, the error of the time of the
last impact. This part has a sign (V_SHARE, X_SHARE), because several effects of the common cause may cancel. The second
part is a bound of all other errors (V_MORE, X_MORE).

A slide ends at a zero of ξ or ξ'. The error of the time of a zero of ξ is the error of ξ divided by ξ'. The error of
the time of a zero of ξ' is the error of ξ' divided by ξ''. After an impact, ξ and ξ' are exactly 0, so only the error
of its time remains. A wait (sticking or resting) ends when H reaches 1 or -1, so the error of the time of this end does
not depend on earlier errors.

A motion is uncertain after the first decision that the errors may have changed. Its status then changes from OK to
TOO_CLOSE. All bounds are infinite from the switch before this decision on. The period of this switch is stored as
CERTAIN_UNTIL, which is infinite as long as all decisions are certain.

These functions never change the motion. In kernels without bounds `errors` is None, and this code is not compiled.
`kernels/__init__.py` explains the terms.
"""

import math
from typing import NamedTuple

from vibrodrive.jit.branchless import choose, fma
from vibrodrive.jit.compile import inline, part
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import margins, motion, switch
from vibrodrive.kernels.codes import CERTIFIED, IMPACT, INFINITY, OK, S1, S2, S4, STRETCHED, TOO_CLOSE, UP

HALF_LAST_BIT = 2.0**-51  # half the last bit of a phase: the largest rounding error of φ


UNDERFLOW = 1e-300  # upper bound of the rounding error of a subnormal ξ or ξ', which has fewer bits


class End(NamedTuple):
    """Errors at the end of a segment.

    late : bound of the error of the time of the end
    share, more : the two parts of this error, that is the effect of the common cause and a bound of the rest. If the
    state continues in a new segment, these are the two parts of the error of ξ' instead
    x, v : bounds of the errors of ξ and ξ' just before the end
    x_share, x_more : the two parts of the error of ξ after the end
    jump : bound of an additional error of ξ' at instants less than `late` from the end. At these instants the exact
        motion may be in one of the two states while the computed motion is in the other
    """

    late: float
    share: float
    more: float
    x: float
    v: float
    x_share: float
    x_more: float
    jump: float


class Off(NamedTuple):
    """Error of a number in two parts: the signed effect of the common cause, and a bound of all other errors."""

    share: float
    more: float


NO_END = End(*8 * [0.0])
LOST = End(*8 * [INFINITY])


@inline
def certain(w, i):
    """Return whether all decisions so far are certain."""
    return w[r.CERTAIN_UNTIL + i] == INFINITY


@inline
def start_errors(w, k, i):
    """Set all errors to zero: the start of a motion is exact."""
    for row in (r.V_SHARE, r.X_SHARE, r.V_MORE, r.X_MORE, r.SHIFT, r.BENT, r.BEGUN_LATE, r.BEGUN_JUMP):
        w[row + i] = 0.0
    w[r.CERTAIN_UNTIL + i] = INFINITY
    mark_uncertain(w, k, i)


@inline
def lose_certainty(w, k, i):
    """Mark the motion as uncertain from the last switch on. Return infinite errors for the end of the present state."""
    if certain(w, i):
        w[r.CERTAIN_UNTIL + i] = float(k[r.PERIOD + i])
    if k[r.STATUS + i] == OK:
        k[r.STATUS + i] = TOO_CLOSE
    return LOST


@inline
def mark_uncertain(w, k, i):
    """Mark the motion as uncertain if its status is TOO_CLOSE: rounding may have changed a decision."""
    if k[r.STATUS + i] == TOO_CLOSE and certain(w, i):
        w[r.CERTAIN_UNTIL + i] = float(k[r.PERIOD + i])


@inline
def delay(value, slope, bend):
    """Return a bound of the distance to a zero of a function f, or inf if f may have no zero.

    Requires |f| <= value and |f'| >= slope at the present instant, and |f''| <= bend at all instants near it.
    """
    square = fma(slope, slope, -2.0 * bend * value)
    if slope > 0.0 and square > 0.0:
        return 2.0 * value / (slope + math.sqrt(square))
    return INFINITY


@inline
def change_of_force(w, i):
    """Return a bound of |H'| at all times."""
    return fma(w[r.AF + i], w[r.ETA + i], w[r.A + i])


@inline
def change_nearby(w, i, p, pf, d):
    """Return a bound of |H'| within the time d of an instant at which A cos φ = p and AF cos θ = pf."""
    eta, most = w[r.ETA + i], change_of_force(w, i)
    here = fma(margins.ROUNDING, most, abs(fma(eta, pf, p)))
    return switch.smaller(most, fma(fma(w[r.AF + i] * eta, eta, w[r.A + i]), d, here))


@inline
def rounding_of_slide(w, i, h):
    """Return (gap, velocity): bounds of the rounding errors of ξ and ξ' by the closed form at h.

    If ηh is large, the bounds of margins.py contain the full amplitude A. With a disturbance, h may be small although
    ηh is large. The slow part is then of the order of h, and the bounds computed here are smaller.
    """
    if (1.0 + w[r.ETA + i]) * h < 0.7 or w[r.AF + i] == 0.0:
        return margins.gap_rounding_with_offset(w, i, h, 0.0) + UNDERFLOW, margins.velocity_rounding_with_offset(
            w, i, h, 0.0
        ) + UNDERFLOW
    fast = w[r.AF + i] * w[r.INVERSE + i]
    slow = 2.0 * w[r.A + i] * switch.smaller(h, 1.0)
    pull = abs(w[r.L + i]) + 1.0 + w[r.B + i]
    speed = abs(w[r.V0 + i]) + w[r.A + i] + fast
    gap = fma(fma(pull, h, speed), h, abs(w[r.X0 + i]) + slow + 3.0 * fast * w[r.INVERSE + i])
    return margins.ROUNDING * gap, margins.ROUNDING * (fma(pull, h, abs(w[r.V0 + i])) + slow + 2.0 * fast)


@inline
def turning_error(w, k, i, h):
    """Return (turned, bent) in a slide, h after the last switch: bounds of two errors at its beginning.

    turned : error of ξ' by the error of the instant at which H is ±1 and a slide after a wait begins, at most SHIFT
    bent : error of ξ''. On a grid the slide begins at an instant at which H differs from ±1. There `begin` (switch.py)
        may correct ξ'' by a change of the slope L, and BENT bounds the rounding error of this correction
    """
    turned = (
        switch.smaller(change_nearby(w, i, w[r.P + i], w[r.PF + i], h) * h, margins.magnitude_scale(w, i))
        * w[r.SHIFT + i]
    )
    return turned, abs(w[r.L + i] + (w[r.B + i] + switch.direction(k[r.STATE + i]))) + w[r.BENT + i]


@inline
def velocity_error(w, k, i, h):
    """Return (share, more), the two parts of the error of ξ' in a slide, h after the last switch."""
    turned, bent = turning_error(w, k, i, h)
    _, rounding = rounding_of_slide(w, i, h)
    return Off(w[r.V_SHARE + i], w[r.V_MORE + i] + turned + bent * h + rounding)


@inline
def gap_error(w, k, i, h):
    """Return (share, more), the two parts of the error of ξ in a slide, h after the last switch."""
    turned, bent = turning_error(w, k, i, h)
    off = w[r.X_MORE + i] + (w[r.V_MORE + i] + turned + 0.5 * bent * h) * h
    rounding, _ = rounding_of_slide(w, i, h)
    return Off(fma(w[r.V_SHARE + i], h, w[r.X_SHARE + i]), off + rounding)


@part
def judge_tangency(w, k, i):
    """Mark the motion as uncertain if a minimum of |ξ'| before the end of a slide is so small that the slide may end
    there.

    The minimum is too small if it is below twice the error of ξ'. The reason for the factor is that the minimum is
    extrapolated from an instant near it.
    """
    under = w[r.DIP_DENOMINATOR + i]
    if certain(w, i) and under > 0.0 and not switch.waits(k[r.STATE + i]) and k[r.SEARCH + i] != S1:
        share, more = velocity_error(w, k, i, w[r.CURSOR + i])
        if w[r.DIP_NUMERATOR + i] <= 2.0 * (abs(share) + more) * under:
            lose_certainty(w, k, i)


@part
def end_of_record(w, k, i):
    """Return the errors at the end of the record, which are 0 if the state certainly continues up to this end.

    Otherwise, if the slide began from rest, `jump` bounds the error of ξ'. If not, mark the motion as uncertain.
    """
    mark_uncertain(w, k, i)
    if not certain(w, i) or switch.waits(k[r.STATE + i]):
        return NO_END
    h = w[r.LEFT + i]
    x, v = motion.state_at(w, i, h, w[r.AF + i] > 0.0)
    v_share, v_more = velocity_error(w, k, i, h)
    x_share, x_more = gap_error(w, k, i, h)
    near, wrong = abs(x_share) + x_more, abs(v_share) + v_more
    if abs(v) > wrong and (k[r.STATE + i] == UP or x > near):
        return NO_END
    if w[r.V0 + i] == 0.0:  # the slide began from rest at most `late` ago: this bound holds even if the slide has ended
        late = h + w[r.BEGUN_LATE + i]
        return End(late, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0 * margins.magnitude_scale(w, i) * late)
    return lose_certainty(w, k, i)


@inline
def check_certainty(w, k, i, errors):
    """If errors are computed, mark the motion as uncertain after a doubtful decision (`mark_uncertain`)."""
    if errors is not None:
        mark_uncertain(w, k, i)


@inline
def record_end(w, k, i, errors):
    """Return the result of `end_of_record`, or NO_END if errors are not computed."""
    if errors is not None:
        return end_of_record(w, k, i)
    return NO_END


@inline
def segment_end(w, k, i, method, event, h, side, there, errors):
    """Return the result of `end_of_segment`, or NO_END if errors are not computed."""
    if errors is not None:
        return end_of_segment(w, k, i, method, event, h, side, there)
    return NO_END


@inline
def pass_on(w, k, i, method, event, end, errors):
    """If errors are computed, set the errors of the state that has just begun (`pass_errors_on`)."""
    if errors is not None:
        pass_errors_on(w, k, i, method, event, end)


@part
def end_of_segment(w, k, i, method, event, h, side, there):
    """Return the errors at the end of the present segment, h after the last switch; `there` is the computed arrival.

    `event` and `side` are those of `end_of_search` in event.py. Mark the motion as uncertain if the state may not end
    there, or if the next state may be another one. Call this function before the next state is stored in the lane.
    """
    mark_uncertain(w, k, i)
    if not certain(w, i):
        return LOST
    if switch.waits(k[r.STATE + i]):
        return end_of_wait(w, k, i, method, event, h, side, there)
    v = there.v
    v_off, x_off = velocity_error(w, k, i, h), gap_error(w, k, i, h)
    force = motion.adhesive_force(w, i, there.q, there.qf)
    if event == S1:
        return end_by_impact(w, k, i, v_off, x_off, force, there)
    if event >= S2:
        return end_by_reversal(w, k, i, event, v_off, x_off, force, there)
    rounded = choose(w[r.AF + i] > 0.0, 0.0, HALF_LAST_BIT)
    a = abs(force - switch.direction(k[r.STATE + i]))
    return End(
        0.0, v_off.share, fma(a, rounded, v_off.more), abs(x_off.share) + x_off.more, abs(v_off.share) + v_off.more,
        x_off.share, fma(abs(v), rounded, x_off.more), 0.0,
    )  # fmt: skip


@inline
def end_by_impact(w, k, i, v_off, x_off, force, there):
    """Return the errors at an impact. The errors `x_off` of ξ and `v_off` of ξ' become an error of its time."""
    x, v, wrong = there.x, there.v, abs(v_off.share) + v_off.more
    off = abs(x_off.share) + x_off.more + abs(x)
    speed = abs(v) - wrong
    usual = margins.magnitude_scale(w, i)
    bend = usual
    if speed > 0.0:
        # the zero is within the time 2 off / speed, in which |ξ''| is at most `bend`
        bend = switch.smaller(
            usual, fma(change_of_force(w, i), 2.0 * off / speed, abs(force + 1.0) + margins.ROUNDING * usual)
        )
    late = delay(off, speed, bend) + choose(w[r.AF + i] > 0.0, 0.0, HALF_LAST_BIT)
    if not is_decided(w, i, abs(force - 1.0), late, there):
        return lose_certainty(w, k, i)
    faster = fma(bend, late, wrong)
    return End(late, 0.0, late, abs(x), faster, 0.0, 0.0, abs(v) + faster)


@inline
def end_by_reversal(w, k, i, event, v_off, x_off, force, there):
    """Return the errors at the end of a slide in the air, where ξ' = 0; `v_off`, `x_off` are the errors of ξ' and ξ."""
    x, v = there.x, there.v
    (v_share, v_more), (x_share, x_more) = v_off, x_off
    a = force - switch.direction(k[r.STATE + i])
    steep = abs(a) - margins.ROUNDING * margins.magnitude_scale(w, i)
    off = abs(v_share) + v_more + abs(v)
    # the zero is within the time 2 off / steep, in which |H'| is at most `bend`
    bend = change_nearby(w, i, there.p, there.pf, choose(steep > 0.0, 2.0 * off / choose(steep > 0.0, steep, 1.0), 1.0))
    before = delay(off, steep, bend)
    late = before + choose(w[r.AF + i] > 0.0, 0.0, HALF_LAST_BIT)
    if not is_decided(w, i, abs(abs(force) - 1.0), late, there):
        return lose_certainty(w, k, i)
    x_more += (off + fma(bend * late, late, abs(a) * late)) * late
    if event == S2 and x <= abs(x_share) + x_more:
        return lose_certainty(w, k, i)
    more = (off / steep - abs(v_share / a)) + 0.5 * bend * before * before / steep + (late - before)
    jump = fma(bend * late, late, 2.0 * (abs(a) + 1.0) * late)
    return End(late, -v_share / a, more, abs(x_share) + x_more, abs(v), x_share, x_more, jump)


@inline
def is_decided(w, i, distance, late, there):
    """Return whether H, at `distance` from 1 or -1, certainly does not reach this value within the time `late`."""
    change = change_nearby(w, i, there.p, there.pf, late)
    return late < INFINITY and distance > fma(change, late, margins.ROUNDING * margins.magnitude_scale(w, i))


@inline
def difference(a, b):
    """Return (d, error): d is a - b rounded, and d + error is exactly a - b."""
    d = a - b
    back = a - d
    return d, (a - (d + back)) + (back - b)


@inline
def lost_bits(a, b, down):
    """Return a bound of the rounding error of A - 1 - B or, if `down`, of A - |1 - B|.

    release.py computes the phases at which waits end from these differences.
    """
    short, first = difference(choose(down, 1.0, a), choose(down, b, 1.0))
    _, second = difference(choose(down, a, short), choose(down, abs(short), b))
    return abs(first) + abs(second)


@inline
def end_of_wait(w, k, i, method, event, h, side, there):
    """Return the errors at the end of a wait, where H = ±1. These errors do not depend on the earlier motion.

    In a certified motion at ε = 0 the wait ends at a known phase (release.py). The rounding error of the arcsine and
    the square root in this phase is below 2 HALF_LAST_BIT; `lost_bits` bounds the remaining error. In other motions the
    wait ends at a zero that a search has found.
    """
    x_share, x_more = w[r.X_SHARE + i], w[r.X_MORE + i]
    if event < S4:
        return End(0.0, 0.0, 0.0, abs(x_share) + x_more, 0.0, x_share, x_more, 0.0)
    usual = margins.magnitude_scale(w, i)
    if method == CERTIFIED and w[r.AF + i] == 0.0:
        if h <= 0.0 or margins.wait_end_distance(w, i, side > 0.0) <= margins.ROUNDING * usual:
            return lose_certainty(w, k, i)
        late = 2.0 * HALF_LAST_BIT + delay(lost_bits(w[r.A + i], w[r.B + i], side > 0.0), abs(there.p), w[r.A + i])
    else:
        period = k[r.PERIOD + i] + int(there.turned)
        p, q, _, pf, qf = motion.evaluate_excitation(w, i, period, there.phi, there.low)
        off = abs(motion.adhesive_force(w, i, q, qf) + choose(side > 0.0, 1.0, -1.0)) + margins.ROUNDING * usual
        rate = change_of_force(w, i)
        steep = abs(p + w[r.ETA + i] * pf) - margins.ROUNDING * rate
        late = delay(off, steep, fma(w[r.AF + i] * w[r.ETA + i], w[r.ETA + i], w[r.A + i]))
    if late == INFINITY:
        return lose_certainty(w, k, i)
    jump = 2.0 * change_of_force(w, i) * late * late
    return End(late, 0.0, late, abs(x_share) + x_more, 0.0, x_share, x_more, jump)


@part
def pass_errors_on(w, k, i, method, event, end):
    """Set the errors of the state that has just begun. `end` has the errors at the end of the state before."""
    w[r.X_SHARE + i], w[r.X_MORE + i] = end.x_share, end.x_more
    w[r.BEGUN_LATE + i], w[r.BEGUN_JUMP + i] = end.late, end.jump
    w[r.SHIFT + i], w[r.BENT + i] = 0.0, 0.0
    w[r.V_SHARE + i], w[r.V_MORE + i] = 0.0, 0.0
    if event == STRETCHED:
        w[r.V_SHARE + i], w[r.V_MORE + i] = end.share, end.more
        return
    if switch.waits(k[r.STATE + i]):
        return
    late = end.late
    bend = change_nearby(w, i, w[r.P + i], w[r.PF + i], late)
    second = 0.5 * bend * late * late
    a = w[r.A0 + i]
    w[r.V_MORE + i] = second + choose(event >= S4, 0.0, margins.ROUNDING * margins.magnitude_scale(w, i) * late)
    if event >= S4:
        w[r.SHIFT + i] = choose(method == CERTIFIED, late, 0.0)
        corrected = (method != CERTIFIED) & (a == 0.0)
        w[r.BENT + i] = choose(corrected, margins.ROUNDING * margins.magnitude_scale(w, i), 0.0)
    elif event == S1:  # the new common cause is the error of the time of this impact
        w[r.V_SHARE + i] = a * late
        w[r.X_MORE + i] += 0.5 * abs(a) * late * late
    else:
        w[r.V_SHARE + i] = -a * end.share
        w[r.V_MORE + i] += abs(a) * end.more
        w[r.X_MORE + i] += 0.5 * abs(a) * late * late
    w[r.X_MORE + i] += second * late


@part
def write_section_error(w, k, i, count, hs, h, end, errors):
    """Write the bounds of the errors of section point number `count`, hs after the last switch.

    The state or the record ends at h, with the errors `end`.
    """
    x = v = INFINITY
    if certain(w, i):
        x, v = abs(w[r.X_SHARE + i]) + w[r.X_MORE + i], 0.0
        usual, moved = margins.magnitude_scale(w, i), margins.ROUNDING * (2.0 + hs)
        if not switch.waits(k[r.STATE + i]):
            x_share, x_more = gap_error(w, k, i, hs)
            v_share, v_more = velocity_error(w, k, i, hs)
            # the rounding errors of `section_at` and of hs itself do not decrease with hs
            fast = w[r.AF + i] * w[r.INVERSE + i]
            wave = w[r.A + i] + fast
            speed = abs(w[r.V0 + i]) + wave + (abs(w[r.L + i]) + 1.0 + w[r.B + i]) * hs
            x = abs(x_share) + x_more + margins.ROUNDING * fma(fast, w[r.INVERSE + i], w[r.A + i]) + speed * moved
            v = abs(v_share) + v_more + margins.ROUNDING * wave + usual * moved
        if hs <= w[r.BEGUN_LATE + i] + moved:
            v += w[r.BEGUN_JUMP + i]
            x += 2.0 * w[r.BEGUN_JUMP + i] * (w[r.BEGUN_LATE + i] + moved)
        if min(h, w[r.LEFT + i]) - hs <= end.late + moved:
            v += end.jump
            x += 2.0 * end.jump * (end.late + moved)
    rows = errors.section
    slot = min(count, rows.shape[1] - 1)
    row = k[r.POINT + i]
    rows[row, slot, 0] = max(rows[row, slot, 0], x)
    rows[row, slot, 1] = max(rows[row, slot, 1], v)


@inline
def write_switch_error(w, i, row, before, end, errors):
    """Write the bounds of the errors of a switch into row `row`; `end` has the errors at the end of state `before`.

    With a disturbance the row lacks the low-order part of φ (motion.py). At ε = 0 there is none.
    """
    off = errors.rows
    if row < off.shape[0]:
        known = certain(w, i)
        off[row, 0] = choose(known, end.late + choose(w[r.AF + i] > 0.0, HALF_LAST_BIT, 0.0), INFINITY)
        off[row, 1] = choose(known, choose(before == IMPACT, 0.0, end.x), INFINITY)
        off[row, 2] = choose(known, choose(before == IMPACT, 0.0, end.v), INFINITY)


@inline
def end_errors(w, k, i, periods, errors):
    """Set the bounds of section points that the motion has not reached to NaN. Copy CERTAIN_UNTIL to `errors.until`."""
    rows, row = errors.section, k[r.POINT + i]
    for m in range(k[r.SECTIONS + i], periods):
        slot = min(m, rows.shape[1] - 1)
        rows[row, slot, 0] = math.nan
        rows[row, slot, 1] = math.nan
    errors.until[row] = w[r.CERTAIN_UNTIL + i]
