"""The share of touches that a force removes: the rise against simulated motions, shares against measured ones."""

import math

import numpy as np
import pytest

import vibrodrive as vd
from benchmarks.grazing import limit_at_distance, phases_of_touches, rises, slides_to_touch
from benchmarks.lost_touches import (
    TRANSIENT,
    Cycle,
    cycle_of,
    largest,
    measured_loss,
    predicted_losses,
    whole_beats,
)
from vibrodrive import State

GRAZING = 2.689586854288132  # n = 2, B = 0.1
MEASURED = {  # shares of 2000 touches in long motions, at A_g - 1e-3 and 1.02, 1.05, 1.2, 1.5 and 2 times k2
    (GRAZING, 0.1, vd.ETA): (0.090, 0.140, 0.270, 0.400, 0.529),
    (GRAZING, 0.1, 100.618): (0.100, 0.156, 0.292, 0.444, 0.608),
    (GRAZING, 0.1, 37 * math.sqrt(2)): (0.134, 0.210, 0.423, 0.632, 0.813),
    (4.221422238, 0.4, vd.ETA): (0.097, 0.145, 0.272, 0.410, 0.550),
    (3.230092102, 0.2, vd.ETA): (0.107, 0.166, 0.342, 0.577, 0.960),
}


@pytest.mark.jit
@pytest.mark.parametrize("eta", [vd.ETA, 37 * math.sqrt(2)])
def test_rise_is_the_difference_of_two_simulated_motions(eta):
    """A mass that sticks 0.05 above the obstacle slides as one that rests there, and turns before it touches.

    What the prediction leaves out is the way of a brief slide before the last release: with a velocity of at most 2V,
    in at most one wave of the force.
    """
    A, V, lifted, turn = GRAZING - 1e-3, 1e-3, 0.05, 2 * math.pi
    slides, _ = slides_to_touch(A, 0.1, 2)
    release, lowest = slides.times[0], slides.times[-1]
    whole = math.floor(release / turn)

    def simulated(eps, k):
        """Return ξ of the lowest point of the slide that begins k periods after the first one possible."""
        start = {"xi0": lifted, "dxi0": 0.0, "tau0": release + turn * (k - whole) - 0.5}
        found = vd.simulate(A, B=0.1, eps=eps, eta=eta, **start, transient=0, periods=2).switches
        tau = turn * (found["period"] - k + whole) + found["phase"]
        return found["xi"][(np.abs(tau - lowest) < 0.5) & (found["before"] == State.DOWN)][0]

    k = 17 * np.arange(12)
    measured = np.array([simulated(V / (eta * A), i) for i in k]) - simulated(0.0, 0)
    predicted = rises(slides, eta, V, turn * (eta * (k - whole) % 1.0))
    assert simulated(0.0, 0) == pytest.approx(lifted - slides.depth, abs=1e-9)
    assert np.ptp(measured) > 4e-3
    assert measured == pytest.approx(predicted, abs=2 * V * turn / eta)


@pytest.mark.jit
@pytest.mark.parametrize(("A", "B", "eta"), MEASURED)
def test_predicted_shares_are_the_measured_ones(A, B, eta):
    slides, _ = slides_to_touch(A - 1e-3, B, 2)
    V = limit_at_distance(slides, eta)
    shares = [predicted_losses(slides, eta, x * V, TRANSIENT, 1000)[0] for x in (1.02, 1.05, 1.2, 1.5, 2.0)]
    assert shares == pytest.approx(MEASURED[A, B, eta], abs=0.02)


@pytest.mark.jit
def test_share_at_a_grazing_of_no_table():
    """Predicted first, then measured, in a motion whose other impacts stay where they are."""
    (at,) = (b for b in vd.bifurcations((2.9, 3.0), 0.15, 2) if b.kind == "grazing")
    A, eta, touches = at.A - 1e-3, 64.77, whole_beats(64.77, 2, 500)
    slides, _ = slides_to_touch(A, 0.15, 2)
    cycle, V = cycle_of(slides), limit_at_distance(slides, eta)
    for x in (1.05, 1.5):
        predicted = predicted_losses(slides, eta, x * V, cycle.first, touches)
        motion = vd.simulate(A, B=0.15, eps=x * V / (eta * A), eta=eta, transient=1000, periods=2 * (touches + 5))
        found = measured_loss(motion.switches, cycle, touches)
        assert found.in_step == 1
        assert found.measured == pytest.approx(predicted[found.shift], abs=0.02)
        assert found.measured > 0.08


@pytest.mark.parametrize("shift", [0, 1, 2])
def test_measured_loss_counts_cycles_at_the_shift_of_the_other_impacts(shift):
    """Two impacts in three periods: a fast one at phase 6.2, which is always there, and a touch at 1.0 after a rest.

    Three of ten touches are missing, one of ten rests, and in each cycle another slow impact is at the phase of the
    touch, one period later, and is none.
    """
    cycle = Cycle(period=3, first=1000, release=6.4, rest=0.1, touch=2 * np.pi + 1.0, energy=0.1, others=[(6.2, 2.0)])
    rows = []
    for k in range(12):
        began = 2 * np.pi * (1000 + shift + 3 * k)
        rows += [(began + 6.2, State.DOWN, -2.1)]
        rows += [(began + 6.4, State.REST, 0.0)] * (k != 4)
        rows += [(began + 2 * np.pi + 1.1 - 0.02 * k, State.DOWN, -0.1)] * (k not in (2, 3, 7))
        rows += [(began + 4 * np.pi + 1.0, State.DOWN, -0.1)]
    kinds = [("period", "i8"), ("phase", "f8"), ("before", "i1"), ("after", "i1"), ("xi", "f8"), ("dxi", "f8")]
    switches = np.array(
        [
            (t // (2 * np.pi), t % (2 * np.pi), b, State.IMPACT if b == State.DOWN else State.UP, 0.0, v)
            for t, b, v in rows
        ],
        dtype=kinds,
    )
    found = measured_loss(switches, cycle, 10)
    assert found == pytest.approx((0.3, 1.0, 0.9, shift))


def test_beats_are_whole_and_differences_keep_their_sign():
    assert whole_beats(vd.ETA, 2, 2000) == 2020  # 20 beats of 202 periods
    assert whole_beats(100.5, 2, 2000) == 2000  # the same phase each time
    rows = [{"measured": [0.0, 0.1, 0.2, 0.3, 0.4, 0.9], "predicted": [0.0, 0.11, 0.22, 0.31, 0.4, 0.1]}]
    assert largest(rows) == pytest.approx(-0.02)


@pytest.mark.jit
def test_phases_are_those_of_the_force_at_the_touches():
    """At a half-integer η and n = 3 the force has two phases that alternate, half a turn apart."""
    slides, _ = slides_to_touch(3.202814239942078 - 1e-4, 0.1, 3)
    phases = phases_of_touches(slides, 100.5, np.arange(4), 1001)
    assert phases == pytest.approx([math.pi, 0.0, math.pi, 0.0])
