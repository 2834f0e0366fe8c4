"""Margin of a trajectory: the smallest distance of any of its decisions from the opposite decision.

The distance of a decision from the opposite decision is:

* at a reversal in the air: ξ
* at an impact: the depth below 0 of the reversal that would follow without the obstacle
* at a decision by H: ||H| - 1| in the air, |H - 1| at the obstacle, which supports the mass for H < -1
* at a tangency: the distance of the extremum of the switching function from 0, on either side

If a distance is below its own rounding error, the status of the trajectory is TOO_CLOSE. The trajectory continues, but
the opposite decision is equally justified. Margins and TOO_CLOSE assume that each state starts exactly. If bounds of
errors are computed, certainty.py also considers the errors of the starts. `kernels/__init__.py` explains the terms.
"""

from vibrodrive.jit.branchless import choose, fma, put
from vibrodrive.jit.compile import inline
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import NEVER_LEAVES, OK, S4, TOO_CLOSE

ROUNDING = 2.0**-49
"""Bound of the relative rounding error: eight units in the last place. A computed sum may be zero if it is below this
share of the sum of the magnitudes of its terms."""

SUSPECT = 1e-4
"""Share of the sum of the magnitudes of the terms of H or ξ'. If the distance of a decision exceeds this share, it
exceeds its rounding error by far, so no bound of the rounding error is computed."""


@inline
def suspect(w, i):
    """Return the distance in H or ξ' above which rounding cannot change a decision in the present segment."""
    return SUSPECT * (magnitude_scale(w, i) + abs(w[r.V0 + i]))


@inline
def set_margin(w, i, where, margin):
    """Set the margin so far to `margin`, which exceeds its rounding error. So the status is unchanged."""
    put(w, r.MARGIN + i, where, margin)


@inline
def record_margin(w, k, i, distance, bound):
    """Record a decision at `distance` from the opposite one. The rounding error of `distance` is at most `bound`.

    If `distance` is at most `bound`, the status becomes TOO_CLOSE.
    """
    if distance < w[r.MARGIN + i]:
        w[r.MARGIN + i] = distance
    if distance <= bound and k[r.STATUS + i] == OK:
        k[r.STATUS + i] = TOO_CLOSE


@inline
def gap_rounding(w, i, h):
    """Return a bound of the rounding error of ξ at h after the last switch.

    This bound is the error at the start plus the rounding of the terms added since then, which is small for small h.
    """
    return gap_rounding_with_offset(w, i, h, fma(w[r.V_OFF + i], h, w[r.X_OFF + i]))


@inline
def gap_rounding_with_offset(w, i, h, off):
    """Return the bound of `gap_rounding`, where `off` is the error of ξ at h caused by rounding errors at the start."""
    eta, inverse = w[r.ETA + i], w[r.INVERSE + i]
    second, third = start_terms(w, i)
    sums = fma(fma(fma(third, h, second), h, abs(w[r.V0 + i])), h, abs(w[r.X0 + i]))
    near = fma(ROUNDING, sums, off)
    far = far_rounding(w, i, h, off, w[r.AF + i] * inverse, inverse)
    return choose((1.0 + eta) * h < 0.7, near, far)


@inline
def start_terms(w, i):
    """Return (second, third): sums of the magnitudes of the terms of ξ'' and of ξ''' at the start of a segment.

    After a wait ξ'' is exactly 0, so `second` is 0. If ξ' ≠ 0, ξ'' may be rounded to 0, so `second` is not 0. With a
    disturbance, rounding shifts the end of a wait by up to ROUNDING · LATE. This adds LATE · |H''| to `third`.
    """
    eta = w[r.ETA + i]
    rate = w[r.A + i] + w[r.AF + i] * eta
    second = choose((w[r.A0 + i] == 0.0) & (w[r.V0 + i] == 0.0), 0.0, magnitude_scale(w, i))
    return second, fma(w[r.LATE + i], fma(w[r.AF + i] * eta, eta, w[r.A + i]), rate)


@inline
def far_rounding(w, i, h, off, fast, inverse):
    """Return `gap_rounding` for h that is not small; `fast` = A ε η, the amplitude of the disturbance in ξ'."""
    pull = abs(w[r.XC2 + i]) + 1.0 + w[r.B + i]
    speed = abs(w[r.V0 + i]) + w[r.A + i] + fast
    sums = fma(fma(pull, h, speed), h, abs(w[r.X0 + i]) + w[r.A + i])
    return fma(ROUNDING, fma(fast, inverse, sums), off)


@inline
def velocity_rounding(w, i, h):
    """Return a bound of the rounding error of ξ' at h after the last switch."""
    return velocity_rounding_with_offset(w, i, h, w[r.V_OFF + i])


@inline
def velocity_rounding_with_offset(w, i, h, off):
    """Return the bound of `velocity_rounding`, where `off` is the rounding error of ξ' at the start."""
    eta = w[r.ETA + i]
    if (1.0 + eta) * h < 0.7:
        second, third = start_terms(w, i)
        sums = abs(w[r.V0 + i]) + (second + third * h) * h
    else:
        fast = w[r.AF + i] / eta if eta > 0.0 else 0.0
        sums = abs(w[r.V0 + i]) + (abs(w[r.L + i]) + 1.0 + w[r.B + i]) * h + w[r.A + i] + fast
    return off + ROUNDING * sums


@inline
def magnitude_scale(w, i):
    """Return the sum of the magnitudes of the terms of H and ξ'. The rounding errors of H and ξ' grow with this sum."""
    return 1.0 + w[r.A + i] + w[r.AF + i] + w[r.B + i]


@inline
def record_margin_of_force(w, k, i, distance, late):
    """Record a decision by H at `distance` from its boundary. Rounding shifts the switch by at most ROUNDING · late."""
    slope = abs(w[r.P + i] + w[r.ETA + i] * w[r.PF + i])
    record_margin(w, k, i, distance, ROUNDING * (magnitude_scale(w, i) + slope * late))


@inline
def record_margin_of_start(w, k, i, v, force):
    """Record the start of a motion with ξ' = v as a decision, if |H| is 1 within rounding and v is tiny.

    In this case ξ'' may reverse the motion. Let δ be the rounding error of H. Then |ξ''| < δ, because ξ'' = H ∓ 1 and
    |H| is 1 within δ. Until H' changes the sign of ξ'', |ξ'| falls by at most δ²/2|H'|. If |H'| is below √(δ |H''|),
    |ξ'| falls by about δ²/√(δ |H''|) instead.
    """
    slope = w[r.P + i] + w[r.ETA + i] * w[r.PF + i]
    bend = w[r.A + i] + w[r.AF + i] * w[r.ETA + i] * w[r.ETA + i]
    off = ROUNDING * magnitude_scale(w, i)
    if abs(abs(force) - 1.0) <= off and v * v * (slope * slope + 3.0 * off * bend) <= 16.0 * off * off * off * off:
        record_margin(w, k, i, abs(v), abs(v))


@inline
def record_margin_of_reversal(w, k, i, h, force, acceleration):
    """Record the decision by H at the end of a slide in the air, h after the last switch. Its distance is ||H| - 1|.

    The error of the time of this end is the error of ξ' divided by ξ'' (`acceleration`).
    """
    distance = abs(abs(force) - 1.0)
    if distance < suspect(w, i):
        late = velocity_rounding(w, i, h) / (ROUNDING * abs(acceleration) + 1e-300)
        record_margin_of_force(w, k, i, distance, TWO_PI + h + late)
    else:
        record_margin(w, k, i, distance, 0.0)


@inline
def record_margin_of_impact(w, k, i, h, force, v):
    """Record the decision by H at an impact with ξ' = v, h after the last switch. Its distance is |H - 1|.

    The error of the time of the impact is the error of ξ divided by ξ'.
    """
    distance = abs(force - 1.0)
    if distance < SUSPECT * magnitude_scale(w, i):
        late = gap_rounding(w, i, h) / (ROUNDING * abs(v) + 1e-300)
        record_margin_of_force(w, k, i, distance, TWO_PI + h + late)
    else:
        record_margin(w, k, i, distance, 0.0)


@inline
def clear_tangency(w, i):
    """Clear the closest tangency at the beginning of a state."""
    w[r.DIP_DENOMINATOR + i] = 0.0


@inline
def record_margin_of_tangency(w, k, i, h):
    """Record the margin of the closest tangency (note_dip in first_zero.py).

    This margin is the smallest modulus of the switching function at its extrema before its first zero.
    """
    under = w[r.DIP_DENOMINATOR + i]
    if under > 0.0:
        near = w[r.DIP_NUMERATOR + i] / under
        if near < w[r.MARGIN + i] or near < suspect(w, i):
            force = k[r.SEARCH + i] >= S4
            record_margin(w, k, i, near, ROUNDING * magnitude_scale(w, i) if force else velocity_rounding(w, i, h))


@inline
def wait_end_distance(w, i, down):
    """Return the margin of the end of a wait at ε = 0: the smallest distance of a peak of H from its boundary."""
    distance = abs(w[r.A + i] - 1.0 - w[r.B + i])
    below = abs(w[r.A + i] - abs(1.0 - w[r.B + i]))
    return choose(down & (below < distance), below, distance)


@inline
def record_margin_of_rest(w, k, i, sticking):
    """Record a wait that never ends as a decision. The distance is that of the extrema of H from the boundaries."""
    reach = w[r.A + i] + w[r.AF + i]
    distance = abs(1.0 + w[r.B + i] - reach)
    if sticking:
        below = abs(abs(1.0 - w[r.B + i]) - reach)
        distance = below if below < distance else distance
    record_margin(w, k, i, distance, ROUNDING * magnitude_scale(w, i))
    if k[r.STATUS + i] == OK:
        k[r.STATUS + i] = NEVER_LEAVES
