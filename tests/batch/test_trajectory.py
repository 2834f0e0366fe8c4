"""Result of `simulate`: its memory and its description."""

import pytest

import vibrodrive as vd
from vibrodrive.batch.trajectory import SWITCH_ERROR
from vibrodrive.kernels.arguments import SWITCH


@pytest.mark.parametrize("method", ["certified", "fixed"])
def test_motion_uses_only_the_memory_of_its_switches(method):
    """The buffer of the computation is larger, because the number of switches is not known in advance."""
    dtau = None if method == "certified" else 0.1
    motion = vd.simulate(3.04, method=method, dtau=dtau, transient=0, periods=3)
    n = 1 + len(motion.switches)
    assert motion.switches.base.nbytes == n * SWITCH.itemsize
    assert motion.switch_errors.base.nbytes == n * SWITCH_ERROR.itemsize


def test_more_switches_than_expected_are_all_stored():
    """The motion has sixty impacts in a row, with three times as many switches as the first buffer has rows."""
    hops = {"A": 1.2207337005962078, "B": 1.5638725555830817, "eps": 2.444604789503143e-4, "eta": 196.35606314394815}
    few, many = (vd.simulate(**hops, transient=0, periods=n) for n in (1, 2))
    assert len(few.switches) > 2 * (64 + 128)
    assert (many.switches[: len(few.switches)] == few.switches).all()
    assert (many.switch_errors[: len(few.switches)] == few.switch_errors).all()


def test_motion_is_described_in_words_and_in_si_units():
    motion = vd.simulate(3.04, transient=200, periods=2)
    words = motion.describe().splitlines()
    assert words[0] == "A = 3.04, B = 0.1"
    assert words[1].startswith("OK: ")
    assert words[2].startswith(f"margin {motion.margin:.3g}: ")
    assert words[3:5] == [
        "period 2; impacts per excitation period: 0.5",
        "states: U D U D I (Up, Down, Stick, Rest, Impact)",
    ]
    scene = vd.Scene(a0=0.8e-3, frequency=24, mu=0.6, alpha=3.4)
    in_si = motion.describe(scene).splitlines()
    assert in_si[3] == "period 2 (83.33 ms); impacts per excitation period: 0.5 (12 per second)"
    speed = scene.velocity(motion.impacts["speed"][0])
    assert in_si[5] == f"mean impact speed {speed:.4g} m/s, largest {speed:.4g} m/s"
    still = vd.simulate(0.5, transient=0, periods=1).describe().splitlines()
    assert still[1].startswith("NEVER_LEAVES")
    assert len(still) == 3
    creeping, falling = (
        vd.simulate(2.4, B=B, xi0=1e9, transient=5, periods=1).describe().splitlines() for B in (0.5, 3)
    )
    short = "the record is too short for means, which need two main impacts"
    assert creeping[3:] == [f"no period up to 64; {short}"]
    assert falling[3:] == [f"period unknown, because the recorded switches span less than 64 periods; {short}"]
    with pytest.raises(TypeError, match="scene = 3"):
        motion.describe(3)
