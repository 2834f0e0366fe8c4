"""Figures of trajectories show the chosen periods, name the settings, and show an irregular motion as a density."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from tests.support.fake import UNITLESS
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures.curves import SPOTS, count_passes
from vibrodrive.model.choices import Method, Status

SWITCH = np.dtype([("period", "i8"), ("phase", "f8"), ("before", "i1"), ("after", "i1"), ("xi", "f8"), ("dxi", "f8")])


def motion(periods, irregular=False, **arguments):
    """Return a simulated `Trajectory`, ξ = 2 + sin τ. If it is irregular, each period has a different amplitude."""
    size = 1.0 + (np.arange(periods) * math.sqrt(2) % 1 if irregular else np.zeros(periods))
    switches = np.zeros(2 * periods, SWITCH)
    switches["period"] = np.repeat(np.arange(periods), 2)
    switches["phase"] = np.tile([0.5, 2.5], periods)
    switches["xi"] = 2 + np.repeat(size, 2)

    def sample(n):
        tau = np.arange(periods * n + 1) * (2 * math.pi / n)
        now = size[np.minimum(np.arange(periods * n + 1) // n, periods - 1)]
        return SimpleNamespace(tau=tau, xi=2 + now * np.sin(tau), dxi=now * np.cos(tau))

    section = np.stack([np.full(periods, 2.0), size], axis=1)
    known = {"A": 3.0, "B": 0.1, "eps": 0.0, "eta": 101.0, "dtau": None, "method": int(Method.CERTIFIED)}
    known |= {"transient": 1000, "periods": periods, "xi0": 0.0, "dxi0": 0.0, "tau0": 0.0} | arguments
    return SimpleNamespace(
        switches=switches, section=section, sample=sample, arguments=known, status=Status.OK, **UNITLESS
    )


def test_trajectory_names_its_settings_and_shows_the_first_periods():
    long = motion(1500, method=int(Method.FIXED), dtau=0.1)
    long.status = Status.TOO_CLOSE
    phase, time = figures.trajectory_figure(long).axes
    said = phase.get_title(loc="right")
    for part in ("fixed", r"\Delta\tau = 0.1", "periods 1001–2500", r"\xi_0 = 0", "too close to a decision"):
        assert part in said
    assert time.get_title(loc="right") == "first 10 of 1500 periods shown"
    assert time.get_xlim() == pytest.approx((0, 20 * math.pi))
    assert time.lines[0].get_xdata().max() < 20 * math.pi + 1e-6
    assert figures.trajectory_figure(long, shown=None).axes[1].get_xlim()[1] == pytest.approx(3000 * math.pi)


@pytest.mark.parametrize(("periods", "irregular", "image"), [(100, True, True), (30, True, False), (900, False, False)])
def test_only_long_irregular_motions_are_drawn_as_density(periods, irregular, image):
    fig = figures.phase_curve(motion(periods, irregular))
    assert bool(fig.axes[0].get_images()) == image
    names = [t.get_text() for t in fig.legends[0].get_texts()]
    assert ("spot passed in 1 of 100 periods" in names) == image


def test_pixel_counts_each_period_once():
    """In period 0 the motion passes a horizontal line twice, forwards and backwards. In period 1 it passes half of this
    line once."""
    points = np.array([[0.0, 1.0], [4.0, 1.0], [0.0, 1.0], [np.nan, np.nan], [0.0, 1.0], [2.0, 1.0]])
    counts = count_passes(points, np.array([0, 0, 0, 0, 1, 1]), np.array([0.0, 0.0]), np.array([4.0, 2.0]))
    (row,) = np.flatnonzero(counts.any(axis=1))
    assert row == SPOTS[1] // 2
    half = SPOTS[0] // 2
    assert (counts[row, : half - 1] == 2).all()
    assert (counts[row, half + 1 : -1] == 1).all()


def test_jumps_and_zero_lines_are_above_the_density():
    (ax,) = figures.phase_curve(motion(100, True)).axes
    (image,) = ax.get_images()
    assert all(line.get_zorder() > image.get_zorder() for line in ax.lines)
