"""Limits of stability (k₂) over one or two axes in a file. A resumed run gives the same results."""

import math

import numpy as np
import pytest

from vibrodrive.errors import Different
from vibrodrive.jobs import limits as job
from vibrodrive.jobs.limits import boxes, table
from vibrodrive.jobs.runner import run
from vibrodrive.model.config import parse
from vibrodrive.model.plan import make_plan
from vibrodrive.stability.limit import Limit
from vibrodrive.stability.questions import limit
from vibrodrive.store.every_kind import load
from vibrodrive.store.layout import quiet

pytestmark = pytest.mark.jit

CONFIG = """
title = "A few limits"
[sweep]
A = [2.5, 2.8, 3.04]
[run]
transient = 60
periods = 60
"""

TWO = CONFIG.replace("A = [2.5, 2.8, 3.04]", "eta = [20.3, 50.5, 101.3]\nA = [1.5, 2.8]")

SCENE = "[physical]\na0 = 0.8e-3\nomega0 = 150.0\nmu = 0.6\nalpha = 3.4\n[sweep]\neta = [50.5, 101.3]\n"


def computed(text, path, progress=quiet, *, overwrite=False, **sought):
    """Compute the limits of a configuration into a file and return them. `sought`: keys of the table [limits]."""
    config = parse(text, [f"limits.{name}={value}" for name, value in sought.items()])
    return run("limits", config, path, progress, overwrite=overwrite)[0]


class Stop(Exception):
    pass


@pytest.fixture
def invented(monkeypatch):
    """Replace the computation of limits by a formula. Return the list of (disturbance, method, axes) of the calls."""
    asked = []

    def found(disturbance, method, criterion, arguments):
        plan = make_plan({**arguments, "method": method, "dtau": 0.1})
        asked.append((disturbance, method, {name: values.tolist() for name, values in plan.axes.items()}))
        for i in range(plan.n_points):
            at = plan.arguments(i)
            own = at["eta"] if disturbance == "eps" else 1.0
            k2 = (at["A"] + 10 * at["B"]) / own / (2 if method == "muller" else 1)
            point = {name: at[name] for name in ("A", "B", "eta")}
            yield (
                i,
                Limit(
                    **point, disturbance=disturbance, method=method, criterion=criterion, k2=k2, last_kept=2 * k2, n=3
                ),
            )

    def limits(arguments, disturbance, method, criterion, threads=None):
        return found(disturbance, method, criterion, arguments)

    monkeypatch.setattr(job, "each_limit", limits)
    return asked


def stopped_after(count):
    def progress(known, total):
        if known == count:
            raise Stop

    return progress


def assert_equal(one, other):
    for name, values in one.numbers.items():
        assert np.array_equal(values, other.numbers[name], equal_nan=True), name
    for name in ("n", "done", "how"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


def test_file_of_limits_resumes(tmp_path):
    whole = computed(CONFIG, tmp_path / "whole.h5")
    assert whole.done.all()
    with pytest.raises(Stop):
        computed(CONFIG, tmp_path / "part.h5", stopped_after(4))
    part = load(tmp_path / "part.h5")
    assert part.done.sum() == 4
    assert np.isnan(part.numbers["k2"][~part.done]).all()
    assert np.isnan(part.numbers["velocity"][~part.done]).all()
    seen = []
    again = computed(CONFIG, tmp_path / "part.h5", lambda known, total: seen.append((known, total)))
    assert seen == [(k, 9) for k in (5, 6, 7, 8, 9)]
    assert_equal(whole, again)
    one = limit(2.8, "dtau", "fixed", transient=60, periods=60)
    assert whole.numbers["k2"][1, 1] == whole.numbers["velocity"][1, 1] == one.k2
    assert whole.n[1, 1] == one.n == 2
    assert whole.how[1, 1] == one.how


def test_interrupted_limits_over_two_axes_equal_uninterrupted(tmp_path):
    whole = computed(TWO, tmp_path / "whole.h5")
    assert whole.done.all()
    assert list(whole.axes) == ["eta", "A"]
    for count in (1, 3, 5, 6, 8, 11, 17):
        with pytest.raises(Stop):
            computed(TWO, tmp_path / "part.h5", stopped_after(count))
    assert load(tmp_path / "part.h5").done.sum() == 17
    assert_equal(whole, computed(TWO, tmp_path / "part.h5"))
    for c, (kind, path) in enumerate((("eps", "certified"), ("dtau", "fixed"), ("dtau", "muller"))):
        one = limit(2.8, kind, path, eta=50.5, transient=60, periods=60)
        found = {name: whole.numbers[name][c, 1, 1] for name in ("k2", "last_kept", "velocity")}
        assert found == {"k2": one.k2, "last_kept": one.last_kept, "velocity": one.velocity}


def test_boxes_cover_each_missing_limit_once():
    missing = np.array([[0, 0, 0], [0, 1, 1], [1, 1, 1], [1, 1, 1], [0, 1, 1]], dtype=bool)
    found = [tuple(where.tolist() for where in box) for box in boxes(missing)]
    assert sorted(found) == [([1, 4], [1, 2]), ([2, 3], [0, 1, 2])]
    rng = np.random.default_rng(3)
    for shape in ((7,), (4, 5), (5, 4)):
        some = rng.random(shape) < 0.4
        covered = np.zeros(shape, dtype=int)
        for box in boxes(some):
            covered[np.ix_(*box)] += 1
        assert (covered == some).all(), "each missing limit must be covered once, and no other limit"
    assert not list(boxes(np.zeros((2, 3), dtype=bool)))
    assert not list(boxes(np.zeros(3, dtype=bool)))


def test_limits_in_dtau_without_eps_are_searched_for_one_eta(tmp_path, invented):
    found = computed(TWO, tmp_path / "x.h5")
    eta = [values["eta"] for _, _, values in invented]
    assert eta == [[20.3, 50.5, 101.3], [20.3], [20.3]]
    assert found.done.all()
    assert (found.numbers["k2"][1:] == found.numbers["k2"][1:, :1]).all()
    assert np.ptp(found.numbers["k2"][0], axis=0).min() > 0
    invented.clear()
    disturbed = TWO + "[model]\neps = 1e-4\n"
    computed(disturbed, tmp_path / "y.h5")
    assert [len(values["eta"]) for _, _, values in invented] == [3, 3, 3]


def test_velocities_are_stored_in_one_unit_and_in_mm_s_for_a_scene(tmp_path, invented):
    found = computed(SCENE, tmp_path / "x.h5")
    A, eta = found.fixed["A"], found.axes["eta"]
    assert abs(A - 3.0645) < 1e-4
    k2, last = found.numbers["k2"], found.numbers["last_kept"]
    assert np.allclose(found.numbers["velocity"], k2 * [eta * A, [1, 1], [1, 1]], rtol=1e-15)
    assert np.allclose(found.numbers["velocity_last"], last * [eta * A, [1, 1], [1, 1]], rtol=1e-15)
    # mu g cos(alpha) / omega0 in mm/s, by hand
    assert found.mm_s == pytest.approx(0.6 * 9.80665 * math.cos(math.radians(3.4)) / 150.0 * 1e3, rel=1e-8)


def test_table_has_a_line_for_each_point(tmp_path, invented):
    found = computed(TWO, tmp_path / "x.h5")
    head, *lines, note = table(found).splitlines()
    assert head.split() == ["eta", "A", "n", "k2(eps)", "V(eps)", "V(fixed)", "k2(muller)"]
    assert len(lines) == 6
    # at A = 2.8, eta = 50.5: k2(eps) = 3.8 / 50.5, V = 3.8 * 2.8; k2(fixed) = 3.8 and k2(muller) = 1.9
    assert lines[3].split() == ["50.5", "2.8", "3", "0.07525", "10.64", "3.8", "1.9"]
    assert "k2(eps) eta A" in note
    found.numbers["kept_below"][0, 1, 1] = 0.0  # at the smallest value tried the structure is lost
    assert table(found).splitlines()[4].split() == ["50.5", "2.8", "3", "<0.07525", "<10.64", "3.8", "1.9"]
    head, *lines, _ = table(computed(SCENE, tmp_path / "y.h5")).splitlines()
    assert head.split("  ")[-1].strip() == "fixed, mm/s"
    assert float(lines[0].split()[-1]) == pytest.approx(39.158 * float(lines[0].split()[-4]), rel=1e-3)


def test_table_shows_unknown_values_as_dashes(tmp_path, invented):
    with pytest.raises(Stop):
        computed(CONFIG, tmp_path / "x.h5", stopped_after(1))
    lines = table(load(tmp_path / "x.h5")).splitlines()
    assert lines[1].split()[-2:] == ["-", "-"]
    assert lines[2].split() == ["2.8", *"-----"]


def test_another_configuration_is_refused(tmp_path, invented):
    with pytest.raises(ValueError, match="criterion"):
        limit(2.5, criterion="shape")
    computed(CONFIG, tmp_path / "x.h5")
    with pytest.raises(Different, match=r"another configuration: A is \[2[.]5, 2[.]8, 3[.]04\] in the file and"):
        computed(CONFIG.replace("2.8", "2.9"), tmp_path / "x.h5")
    with pytest.raises(Different, match="criterion is 'impacts' in the file and 'word' in the configuration"):
        computed(CONFIG, tmp_path / "x.h5", criterion="word")
    computed(TWO, tmp_path / "two.h5")
    swapped = TWO.replace("eta = [20.3, 50.5, 101.3]\nA = [1.5, 2.8]", "A = [1.5, 2.8]\neta = [20.3, 50.5, 101.3]")
    with pytest.raises(Different, match=r"the axes are \(eta, A\) in the file and \(A, eta\) in"):
        computed(swapped, tmp_path / "two.h5")
    computed(swapped, tmp_path / "two.h5", overwrite=True)
    assert list(load(tmp_path / "two.h5").axes) == ["A", "eta"]
