"""The command for orbits lists, writes and draws orbits and their bifurcations. Simulated motions agree with them."""

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.figures.orbits import bifurcation_diagram, cobweb
from vibrodrive.figures.plane import Exact, read_lines
from vibrodrive.jobs.orbits import COLUMNS, check, find, printed, rows
from vibrodrive.model.config import parse
from vibrodrive.periodic.family import Family, family, section
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.search import orbits
from vibrodrive.store.tables import read_table, write_table

pytestmark = pytest.mark.jit  # these tests run hundreds of searches

CONFIG = "[sweep]\nA = {start = 2.9, stop = 3.25, num = 36}\n"

A = np.linspace(2.9, 3.25, 36)


@pytest.fixture(scope="module")
def found():
    return find(*check(parse(CONFIG)))


def test_every_bifurcation_is_printed(found):
    lines = printed(found).splitlines()
    assert lines[-1].startswith("5 bifurcations; orbits of up to 3 periods")
    assert [line.split()[1] for line in lines[1:-1]] == ["border", "period", "fold", "border", "grazing"]


def test_table_holds_every_orbit_and_bifurcation(found, tmp_path):
    write_table(tmp_path / "o.csv", COLUMNS, rows(found))
    there = read_table(tmp_path / "o.csv")
    assert set(A) <= {float(row["A"]) for row in there}
    expected = [
        (f"{o.kind} orbit", str(o.period), o.multiplier, o.phases[0], o.speeds[0], o.word) for o in orbits(float(A[14]))
    ]
    numbers = ("multiplier", "phase", "speed")
    assert expected == [
        (row["kind"], row["period"], *(float(row[name]) for name in numbers), row["word"])
        for row in there
        if float(row["A"]) == A[14]
    ]
    ends = [row for row in there if "orbit" not in row["kind"]]
    sides = [[float(row[f"multiplier_{side}"] or "nan") for side in ("below", "above")] for row in ends]
    assert np.array_equal(sides, [[b.multiplier_below, b.multiplier_above] for b in found.bifurcations], equal_nan=True)
    assert read_lines(tmp_path / "o.csv") == [
        Exact(b.kind, b.orbit.period, b.orbit.impacts, b.A, b.B) for b in found.bifurcations
    ]


def test_brute_force_agrees_with_the_stable_branches():
    found = family([2.95, 3.0, 3.05], max_period=2)
    motion = vd.sweep(A=found.A, transient=2000, periods=6, section_phase=2.0).section
    for there, points in zip(found.orbits, motion, strict=True):
        (stable,) = (o for o in there if abs(o.multiplier) < 1)
        apart = np.abs(points[:, None] - section(stable, 2.0)).max(axis=2)
        assert apart.min(axis=1).max() < 1e-9


def test_orbit_that_reappears_is_a_new_branch():
    (orbit,) = orbits(1.5)
    there = [[orbit], [], [orbit], [orbit]]
    branches = Family(np.array([1.4, 1.5, 1.6, 1.7]), 0.1, 1, there, []).branches()
    assert [branch.A.tolist() for branch in branches] == [[1.4], [1.6, 1.7]]


def test_figures_show_branches_marks_and_cobweb():
    found = family(np.linspace(2.5, 2.7, 21), max_period=2)
    brute = vd.sweep(A=[2.55, 2.65], transient=2000, periods=2, section_phase=2.0)
    figure = bifurcation_diagram(found, brute)
    points, *lines = figure.axes[0].lines
    names = [t.get_text() for t in figure.legends[0].get_texts()]
    marks = ["period doubling", "border collision", "grazing"]
    assert sorted(names) == sorted(["stable orbit", "unstable orbit", "simulated", *marks])
    stable = [line for line in lines if line.get_linestyle() == "-"]
    assert len({line.get_linestyle() for line in lines}) > 1
    for A, dxi in points.get_xydata():
        assert min(abs(np.interp(A, *line.get_data()) - dxi) for line in stable) < 1e-3, "both have one section phase"
    phase, image = cobweb(3.2, 0.1, orbits(3.2, 0.1, 4)[-1]).axes[0].lines[-1].get_data()
    assert len(phase) == 3
    assert image == pytest.approx(ImpactMap(3.2)(phase).phase, abs=1e-9)


def test_orbits_on_the_level():
    """Orbits at B = 0 are of the kind `touching` and have no multiplier. Motion begins at A = 1 and changes at 1.862.

    Beside each of these two there are two more values of A. The mass rests at 0.9 and just below 1.
    """
    found = find(*check(parse(CONFIG, ["A={start = 0.9, stop = 2.1, num = 7}", "B=0"])))
    assert printed(found).splitlines()[-1].endswith(" at 11 values of A: 9 touching")
    assert {row[0] for row in rows(found) if "orbit" in row[0]} == {"touching orbit"}
    assert all(np.isnan(row[5]) for row in rows(found) if "orbit" in row[0])
