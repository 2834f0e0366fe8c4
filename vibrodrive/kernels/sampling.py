"""Evaluation of the closed form between the switches of a trajectory at equidistant instants."""

import numpy as np

from vibrodrive.jit.compile import array, jit
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import motion, setup, switch
from vibrodrive.kernels.arguments import SWITCH
from vibrodrive.kernels.codes import CERTIFIED, DOWN, IMPACT, REST, STICK, UP

_EXAMPLE = (
    array(2), array(2, np.int64), array(2), array(1, SWITCH), array(1, np.int64), 0, array(1, np.int64), array(2),
    array(1, np.int8),
)  # fmt: skip


@jit(like=_EXAMPLE, _nrt=False)
def sample_segments(lanes_w, lanes_k, points, rows, sampling, count, under_way, out, state):
    """Evaluate the closed form between the switches `rows` (SWITCH, written by `single`) at the next `count` instants.

    Instant m is m / per_period excitation periods after the beginning of the record.

    points float64 (1, columns): parameters and initial values of the motion
    sampling int64 (3,): method, transient, number of instants in an excitation period (per_period)
    under_way int64 (2,): number of the next instant, and row of the switch before it; initially 0 and -1
    out float64 (n, 3), state int8 (n,): results: ξ, ξ' and H, and the state, at each instant

    Return True if all n instants are done.
    """
    w, k = lanes_w[0], lanes_k[0]
    method, transient, per_period = sampling[0], sampling[1], sampling[2]
    first, row = under_way[0], under_way[1]
    if first == 0:
        setup.set_parameters(w, k, 0, points, 0, method)
    start, phi0 = k[r.PERIOD0] + transient, w[r.PHI0]
    last = min(first + count, out.shape[0])
    for m in range(first, last):
        n = start + m // per_period
        phi = phi0 + TWO_PI * float(m % per_period) / float(per_period)
        if phi >= TWO_PI:
            phi -= TWO_PI
            n += 1
        while row + 1 < rows.shape[0] and (
            row < 0 or rows[row + 1]["period"] < n or (rows[row + 1]["period"] == n and rows[row + 1]["phase"] <= phi)
        ):
            row += 1
            period, phase = rows[row]["period"], rows[row]["phase"]
            before, now = int(rows[row]["before"]), int(rows[row]["after"])
            at_obstacle = before == IMPACT or now == IMPACT or now == REST
            x = 0.0 if at_obstacle else rows[row]["xi"]
            v = rows[row]["dxi"] if before == now and row == 0 else 0.0
            p, q, theta, pf, qf = motion.evaluate_excitation(w, 0, period, phase, 0.0)
            switch.commit_time(w, k, 0, True, period, phase, 0.0, 0.0, p, q)
            switch.commit_time_fast(w, 0, True, theta, pf, qf, 0.0)
            force = motion.adhesive_force(w, 0, q, qf)
            left = method == CERTIFIED and (before == STICK or before == REST)
            segment = switch.begin(
                switch.direction(now), x, v, force, left, method != CERTIFIED,
                w[r.B], w[r.INVERSE], motion.Field(p, q, pf, qf),
            )  # fmt: skip
            switch.commit_segment(w, 0, True, segment, 0.0, 0.0)
            switch.commit_segment_fast(w, 0, True, segment)
            switch.commit_state(k, 0, True, now)
        h = motion.time_until(w, k, 0, n, phi)
        now = k[r.STATE]
        x, v = w[r.X0], 0.0
        if now == UP or now == DOWN:
            x, v = motion.state_at(w, 0, h, w[r.AF] > 0.0)
        out[m, 0] = x
        out[m, 1] = v
        out[m, 2] = motion.force_at(w, 0, h)
        state[m] = now
    under_way[0], under_way[1] = last, row
    return last == out.shape[0]
