"""What a motion is off by, from its start on: a bound that is carried from switch to switch (docs/certainty.md).

In absolute time a slide is linear in its errors: ξ'' = H(τ) - s depends on τ alone. So the computed ξ' is off by the
same amount all along a slide, but for what rounding adds, and ξ by X + E h. Either consists of a share of one common
cause, the instant of the last impact, which keeps its sign and may cancel (V_SHARE, X_SHARE), and of a bound of all
else (V_MORE, X_MORE). The end of the slide is off by the error there over the slope; an impact leaves nothing but
that, and the end of a wait not even that.

A decision that an error may have turned ends the certainty: the trajectory is TOO_CLOSE, and from the period on in
which the state began that has met it (CERTAIN_UNTIL), all errors are infinite.

Nothing here changes the motion. Kernels that do not ask for it pass None for `errors`, and have none of it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from vibrodrive.jit.branchless import choose, fma
from vibrodrive.jit.compile import inline, part
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import margins, motion, switch
from vibrodrive.kernels.codes import CERTIFIED, IMPACT, INFINITY, OK, S1, S2, S4, STRETCHED, TOO_CLOSE, UP

HALF_LAST_BIT = 2.0**-51
"""Half the last bit of a phase: what is lost where φ is rounded."""


UNDERFLOW = 1e-300
"""More than is lost where a gap or a velocity is too small for a double to have all its bits."""


class End(NamedTuple):
    """What the end of a segment is off by: its instant, by `late`, of which share · (a common cause), and the rest by
    `more`; ξ and ξ' just before it by x, v; what goes on with ξ (x_share, x_more). A point within `late` of it may
    belong to the other state, and its ξ' be off by `jump`."""

    late: float
    share: float
    more: float
    x: float
    v: float
    x_share: float
    x_more: float
    jump: float


class Off(NamedTuple):
    """What a number is off by: its share of the common cause, and a bound of the rest."""

    share: float
    more: float


NO_END = End(*8 * [0.0])
LOST = End(*8 * [INFINITY])


@inline
def certain(w, i):
    """Whether no decision so far can have been wrong."""
    return w[r.CERTAIN_UNTIL + i] == INFINITY


@inline
def start_errors(w, k, i):
    """A motion begins where it is told to: nothing is off."""
    for row in (r.V_SHARE, r.X_SHARE, r.V_MORE, r.X_MORE, r.SHIFT, r.BEGUN_LATE, r.BEGUN_JUMP):
        w[row + i] = 0.0
    w[r.CERTAIN_UNTIL + i] = INFINITY
    heed_status(w, k, i)


@inline
def lose_certainty(w, k, i):
    """What comes after the last switch may not be so. Returns what its end is off by, then."""
    if certain(w, i):
        w[r.CERTAIN_UNTIL + i] = float(k[r.PERIOD + i])
    if k[r.STATUS + i] == OK:
        k[r.STATUS + i] = TOO_CLOSE
    return LOST


@inline
def heed_status(w, k, i):
    """Where rounding alone leaves a decision open, certainty ends too."""
    if k[r.STATUS + i] == TOO_CLOSE and certain(w, i):
        w[r.CERTAIN_UNTIL + i] = float(k[r.PERIOD + i])


@inline
def delay(value, slope, bend):
    """How far from an instant a function has its zero, if its size there is at most `value`, that of its derivative at
    least `slope`, and that of its second derivative at most `bend`; inf where it may have none."""
    square = fma(slope, slope, -2.0 * bend * value)
    if slope > 0.0 and square > 0.0:
        return 2.0 * value / (slope + math.sqrt(square))
    return INFINITY


@inline
def change_of_force(w, i):
    """A bound of |H'|."""
    return fma(w[r.AF + i], w[r.ETA + i], w[r.A + i])


@inline
def change_nearby(w, i, p, pf, d):
    """A bound of |H'| within d of an instant at which A cos φ = p and AF cos θ = pf."""
    eta, most = w[r.ETA + i], change_of_force(w, i)
    here = fma(margins.ROUNDING, most, abs(fma(eta, pf, p)))
    return switch.smaller(most, fma(fma(w[r.AF + i] * eta, eta, w[r.A + i]), d, here))


@inline
def rounding_of_slide(w, i, h):
    """(ξ, ξ'): what the rounding of the closed form adds at h.

    With a disturbance its slow part is as small as h, however large ηh, where margins.py allows for the whole of A.
    """
    if (1.0 + w[r.ETA + i]) * h < 0.7 or w[r.AF + i] == 0.0:
        return margins.gap_rounding_beside(w, i, h, 0.0) + UNDERFLOW, margins.velocity_rounding_beside(
            w, i, h, 0.0
        ) + UNDERFLOW
    fast = w[r.AF + i] * w[r.INVERSE + i]
    slow = 2.0 * w[r.A + i] * switch.smaller(h, 1.0)
    pull = abs(w[r.L + i]) + 1.0 + w[r.B + i]
    speed = abs(w[r.V0 + i]) + w[r.A + i] + fast
    gap = fma(fma(pull, h, speed), h, abs(w[r.X0 + i]) + slow + 3.0 * fast * w[r.INVERSE + i])
    return margins.ROUNDING * gap, margins.ROUNDING * (fma(pull, h, abs(w[r.V0 + i])) + slow + 2.0 * fast)


@inline
def velocity_error(w, k, i, h):
    """(share, bound of the rest) of what ξ' is off by at h after the last switch, sliding.

    What started at the end of a wait is computed from the instant at which H is ±1 (`begin`), SHIFT off at most. On a
    grid its ξ'' may be put right by the slope.
    """
    turned = (
        switch.smaller(change_nearby(w, i, w[r.P + i], w[r.PF + i], h) * h, margins.magnitude_scale(w, i))
        * w[r.SHIFT + i]
    )
    bent = abs(w[r.L + i] + (w[r.B + i] + switch.direction(k[r.STATE + i])))
    _, rounding = rounding_of_slide(w, i, h)
    return Off(w[r.V_SHARE + i], w[r.V_MORE + i] + turned + bent * h + rounding)


@inline
def gap_error(w, k, i, h):
    """(share, bound of the rest) of what ξ is off by at h after the last switch, sliding."""
    turned = (
        switch.smaller(change_nearby(w, i, w[r.P + i], w[r.PF + i], h) * h, margins.magnitude_scale(w, i))
        * w[r.SHIFT + i]
    )
    bent = abs(w[r.L + i] + (w[r.B + i] + switch.direction(k[r.STATE + i])))
    off = w[r.X_MORE + i] + (w[r.V_MORE + i] + turned + 0.5 * bent * h) * h
    rounding, _ = rounding_of_slide(w, i, h)
    return Off(fma(w[r.V_SHARE + i], h, w[r.X_SHARE + i]), off + rounding)


@part
def judge_tangency(w, k, i):
    """A search for the end of a slide has met something: how close did ξ' come to 0 before?

    Twice the error: how far a dip stayed from 0 is known from close by, not from its bottom.
    """
    under = w[r.DIP_DENOMINATOR + i]
    if certain(w, i) and under > 0.0 and not switch.waits(k[r.STATE + i]) and k[r.SEARCH + i] != S1:
        share, more = velocity_error(w, k, i, w[r.CURSOR + i])
        if w[r.DIP_NUMERATOR + i] <= 2.0 * (abs(share) + more) * under:
            lose_certainty(w, k, i)


@part
def end_of_record(w, k, i):
    """What the record's end is off by, if the state may have ended just before it."""
    heed_status(w, k, i)
    if not certain(w, i) or switch.waits(k[r.STATE + i]):
        return NO_END
    h = w[r.LEFT + i]
    x, v = motion.state_at(w, i, h, w[r.AF + i] > 0.0)
    v_share, v_more = velocity_error(w, k, i, h)
    x_share, x_more = gap_error(w, k, i, h)
    near, wrong = abs(x_share) + x_more, abs(v_share) + v_more
    if abs(v) > wrong and (k[r.STATE + i] == UP or x > near):
        return NO_END
    if w[r.V0 + i] == 0.0:  # whatever has happened since it was at rest
        late = h + w[r.BEGUN_LATE + i]
        return End(late, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0 * margins.magnitude_scale(w, i) * late)
    return lose_certainty(w, k, i)


@inline
def heed(w, k, i, errors):
    """`heed_status`, where errors are wanted."""
    if errors is not None:
        heed_status(w, k, i)


@inline
def record_end(w, k, i, errors):
    """`end_of_record`, where errors are wanted."""
    if errors is not None:
        return end_of_record(w, k, i)
    return NO_END


@inline
def segment_end(w, k, i, method, event, h, side, there, errors):
    """`end_of_segment`, where errors are wanted."""
    if errors is not None:
        return end_of_segment(w, k, i, method, event, h, side, there)
    return NO_END


@inline
def pass_on(w, k, i, method, event, end, errors):
    """`pass_errors_on`, where errors are wanted."""
    if errors is not None:
        pass_errors_on(w, k, i, method, event, end)


@part
def end_of_segment(w, k, i, method, event, h, side, there):
    """Return what the state under way is off by at its end, h, with ξ and ξ' as computed in `there`.

    By that is judged, before anything is committed, if it ends there at all and if what follows is certain.
    """
    heed_status(w, k, i)
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
    """A slide ends by an impact: what is left of all that ξ and ξ' are off by is the instant."""
    x, v, wrong = there.x, there.v, abs(v_off.share) + v_off.more
    off = abs(x_off.share) + x_off.more + abs(x)
    speed = abs(v) - wrong
    usual = margins.magnitude_scale(w, i)
    bend = usual
    if speed > 0.0:
        # as far as the zero can be from there, if |ξ''| is no more than this
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
    """A slide ends by ξ' = 0, in the air."""
    x, v = there.x, there.v
    (v_share, v_more), (x_share, x_more) = v_off, x_off
    a = force - switch.direction(k[r.STATE + i])
    steep = abs(a) - margins.ROUNDING * margins.magnitude_scale(w, i)
    off = abs(v_share) + v_more + abs(v)
    # as far as the zero can be from there, if |H'| is no more than this
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
    """Whether H, at a distance from its boundary, is on the same side of it at any instant that close."""
    change = change_nearby(w, i, there.p, there.pf, late)
    return late < INFINITY and distance > fma(change, late, margins.ROUNDING * margins.magnitude_scale(w, i))


@inline
def difference(a, b):
    """(a - b as rounded, what is lost by that), exactly."""
    d = a - b
    back = a - d
    return d, (a - (d + back)) + (back - b)


@inline
def lost_bits(a, b, down):
    """What rounding has done to A - 1 - B, or `down` to A - |1 - B|, on which the ends of waits depend (release.py)."""
    short, first = difference(choose(down, 1.0, a), choose(down, b, 1.0))
    _, second = difference(choose(down, a, short), choose(down, abs(short), b))
    return abs(first) + abs(second)


@inline
def end_of_wait(w, k, i, method, event, h, side, there):
    """A wait ends where H = ±1, whatever was before: at a known phase, at ε = 0, or where it is found.

    The arcsine and its root are good to three last bits of φ, beside what is lost before (release.py).
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
    """What the state that has just begun at the end of another is off by."""
    w[r.X_SHARE + i], w[r.X_MORE + i] = end.x_share, end.x_more
    w[r.BEGUN_LATE + i], w[r.BEGUN_JUMP + i] = end.late, end.jump
    w[r.SHIFT + i] = 0.0
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
    elif event == S1:  # from now on its instant is the common cause
        w[r.V_SHARE + i] = a * late
        w[r.X_MORE + i] += 0.5 * abs(a) * late * late
    else:
        w[r.V_SHARE + i] = -a * end.share
        w[r.V_MORE + i] += abs(a) * end.more
        w[r.X_MORE + i] += 0.5 * abs(a) * late * late
    w[r.X_MORE + i] += second * late


@part
def write_section_error(w, k, i, count, hs, h, end, errors):
    """The bounds of section point number `count`, hs after the last switch; the next one, or the end of the record,
    comes after h."""
    x = v = INFINITY
    if certain(w, i):
        x, v = abs(w[r.X_SHARE + i]) + w[r.X_MORE + i], 0.0
        usual, moved = margins.magnitude_scale(w, i), margins.ROUNDING * (2.0 + hs)
        if not switch.waits(k[r.STATE + i]):
            x_share, x_more = gap_error(w, k, i, hs)
            v_share, v_more = velocity_error(w, k, i, hs)
            # the closed form of `section_at`, and hs itself, are rounded as if hs were not small
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
    """The bounds of a switch in a row of `single`: `end` is that of the state that it has ended."""
    off = errors.rows
    if row < off.shape[0]:
        known = certain(w, i)
        off[row, 0] = choose(known, end.late + HALF_LAST_BIT, INFINITY)
        off[row, 1] = choose(known, choose(before == IMPACT, 0.0, end.x), INFINITY)
        off[row, 2] = choose(known, choose(before == IMPACT, 0.0, end.v), INFINITY)


@inline
def end_errors(w, k, i, periods, errors):
    """Bounds of section points never reached are NaN."""
    rows, row = errors.section, k[r.POINT + i]
    for m in range(k[r.SECTIONS + i], periods):
        slot = min(m, rows.shape[1] - 1)
        rows[row, slot, 0] = math.nan
        rows[row, slot, 1] = math.nan
    errors.until[row] = w[r.CERTAIN_UNTIL + i]
