"""The command for orbits lists, writes and draws orbits and their bifurcations. Simulated motions agree with them."""

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.figures.orbits import bifurcation_diagram, cobweb
from vibrodrive.figures.plane import Exact, read_lines
from vibrodrive.jobs.orbits import check, columns, drawn, find, printed, rows
from vibrodrive.model.config import parse
from vibrodrive.model.names import NAMES
from vibrodrive.periodic.family import Family, family
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
    write_table(tmp_path / "o.csv", columns(found), rows(found))
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


def test_orbit_that_reappears_is_a_new_branch():
    (orbit,) = orbits(1.5)
    there = [[orbit], [], [orbit], [orbit]]
    branches = Family(np.array([1.4, 1.5, 1.6, 1.7]), 0.1, 1, there, []).branches()
    assert [branch.A.tolist() for branch in branches] == [[1.4], [1.6, 1.7]]


def test_figures_show_branches_marks_and_cobweb():
    found = family([2.5, 2.7], max_period=2)  # lines between two values are curves, too
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


MACHINE = {"a0": 0.8e-3, "frequency": 24.0, "mu": 0.6, "alpha": 3.4}
SPANS = {"A": (2.5, 2.7), "a0": (0.64e-3, 0.7e-3), "omega0": (132.0, 140.0), "frequency": (21.0, 22.3)}


def of_machine(x, *options, along=""):
    """Return a configuration of the machine over the axis x and, with `along`, a further axis of two values."""
    away = {"A": {"a0"}, "a0": {"a0"}}.get(x, {"frequency"}) | {along.partition(" ")[0]}
    fixed = [f"{name} = {value}" for name, value in MACHINE.items() if name not in away]
    low, high = SPANS[x]
    axes = [f"{x} = {{start = {low}, stop = {high}, num = 4}}", along]
    short = ["[run]", "transient = 100", "periods = 4", "section_phase = 2.0", "[orbits]", "max_period = 2"]
    return parse("\n".join(["[physical]", *fixed, "[sweep]", *axes, *short]), options)


@pytest.mark.parametrize("x", SPANS)
def test_orbits_of_a_machine_have_its_quantities_and_units(x, tmp_path):
    """The table, the lines and the figure are over the axis of the machine, and speeds are in m/s."""
    config = of_machine(x)
    found = find(*check(config))
    write_table(tmp_path / "o.csv", columns(found), rows(found))
    there = read_table(tmp_path / "o.csv")
    values = np.linspace(*SPANS[x], 4).tolist()
    given = {name: value for name, value in MACHINE.items() if name != ("a0" if x in "a0 A" else "frequency")}
    assert set(values) <= {float(row[x]) for row in there}, "exactly the values of the axis"
    for row in there:
        A = {"A": float(row["A"])} if x == "A" else {}
        machine = vd.Scene.quiet(**({"a0": 1.0} | given if A else given | {x: float(row[x])}))
        assert (float(row["A"]), float(row["B"])) == pytest.approx((A.get("A", machine.A), machine.B), rel=1e-13)
        if row["kind"] == "superstable orbit":
            (orbit,) = (o for o in orbits(float(row["A"]), float(row["B"]), 2) if o.kind == "superstable")
            assert float(row["speed_m_per_s"]) == pytest.approx(machine.velocity(orbit.speeds[0]), rel=1e-9)
    marks = [float(row[x]) for row in there if "orbit" not in row["kind"]]
    assert marks
    lines = printed(found).splitlines()
    assert lines[0].split()[: 1 + (x != "A")] == [x, "A"][: 1 + (x != "A")]
    assert [float(line.split()[0]) for line in lines[1:-1]] == pytest.approx(marks, abs=1e-13)
    figure = drawn(found)
    ax, scale = figure.axes[0], NAMES[x].scale
    points, *drawn_lines = ax.lines
    assert ax.get_xlabel().endswith({"a0": "mm", "omega0": "rad/s", "frequency": "Hz"}.get(x, "$A$"))
    assert ax.get_ylabel() == "velocity dx/dt in m/s"
    assert ax.get_xlim() == pytest.approx(scale * np.array(SPANS[x]))
    swept = vd.sweep(**config.arguments)
    assert points.get_ydata() == pytest.approx(swept.to_xarray().section_dxi.values.ravel(), nan_ok=True)
    stable = [line for line in drawn_lines if line.get_linestyle() == "-"]
    for place, dxi in points.get_xydata()[[0, -1]]:
        assert min(abs(np.interp(place, *line.get_data()) - dxi) for line in stable) < 1e-6
    seen = np.concatenate([line.get_xdata() for line in drawn_lines if line.get_marker() != "None"])
    assert {round(place, 9) for place in seen} <= {round(scale * mark, 9) for mark in marks}
    plain = find(*check(of_machine(x, "figure.units=dimensionless")))
    assert columns(plain) == [name.removesuffix("_m_per_s") for name in columns(found)]
    assert drawn(plain).axes[0].get_ylabel().startswith("velocity $")


@pytest.mark.parametrize(("x", "along"), [("A", "mu"), ("frequency", "mu"), ("a0", "alpha")])
def test_bifurcations_of_machines_are_lines_over_both_axes(x, along):
    values = [0.98 * MACHINE[along], MACHINE[along]]
    found = find(*check(of_machine(x, along=f"{along} = {values}")))
    assert printed(found).splitlines()[-1].endswith(f" at 2 values of {along}")
    names = columns(found)
    table = [dict(zip(names, row, strict=True)) for row in rows(found)]
    assert {row[along] for row in table} == {*values}
    ax = drawn(found).axes[0]
    ends = {
        (round(place, 9), round(up, 9)) for line in ax.lines for place, up in line.get_xydata() if len(line.get_xdata())
    }
    assert ends == {(round(NAMES[x].scale * row[x], 9), round(row[along], 9)) for row in table}
    assert "a_0" in ax.get_title(loc="right") or x in ("A", "a0")


def test_orbits_on_the_level():
    """Orbits at B = 0 are of the kind `touching` and have no multiplier. Motion begins at A = 1 and changes at 1.862.

    Beside each of these two there are two more values of A. The mass rests at 0.9 and just below 1.
    """
    found = find(*check(parse(CONFIG, ["A={start = 0.9, stop = 2.1, num = 7}", "B=0"])))
    assert printed(found).splitlines()[-1].endswith(" at 11 values of A: 9 touching")
    assert {row[0] for row in rows(found) if "orbit" in row[0]} == {"touching orbit"}
    assert all(np.isnan(row[5]) for row in rows(found) if "orbit" in row[0])
