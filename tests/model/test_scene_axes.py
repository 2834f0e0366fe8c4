"""Axes in SI units: every point has the A and B that `Scene` computes for this point, bit for bit."""

import itertools

import numpy as np
import pytest

from vibrodrive.model.choices import Status
from vibrodrive.model.config import parse
from vibrodrive.model.names import SCENE_AXES, TURN
from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.physical import Scene
from vibrodrive.model.plan import make_plan
from vibrodrive.model.results import Results
from vibrodrive.model.toml import as_toml
from vibrodrive.store.compare import compare

SCENE = {"a0": 0.8e-3, "omega0": 150.0, "mu": 0.6, "alpha": 3.4, "mass": 250.0, "g": 9.81}

VALUES = {
    "a0": np.linspace(0.0, 1e-3, 7),
    "omega0": np.geomspace(100.0, 200.0, 9),
    "frequency": np.linspace(20.0, 30.0, 4),
    "mu": np.array([0.55, 0.6, 0.7]),
    "alpha": np.linspace(0.0, 12.0, 5),
    "mass": np.array([200.0, 300.0]),
}


def listed(values):
    return "[" + ", ".join(map(repr, values.tolist())) + "]"


def text(*names, scene=SCENE, more=""):
    """Return a configuration with some quantities as axes, in this order, and the others in [physical]."""
    absent = {*names, *(["omega0"] if "frequency" in names else [])}
    fixed = "".join(f"{key} = {value!r}\n" for key, value in scene.items() if key not in absent)
    swept = "".join(f"{name} = {listed(VALUES[name])}\n" for name in names)
    return f"[physical]\n{fixed}[sweep]\n{swept}{more}[run]\ntransient = 3\nperiods = 4\n"


@pytest.mark.parametrize(
    "names",
    [
        *(pair for pair in itertools.permutations(SCENE_AXES, 2) if {*pair} != {"omega0", "frequency"}),
        *((name,) for name in SCENE_AXES),
    ],
)
def test_each_point_has_exactly_the_numbers_of_its_scene(names):
    plan = parse(text(*names)).plan()
    assert list(plan.axes) == list(names)
    points = plan.points(0, plan.n_points)
    given = [dict(zip(names, v, strict=True)) for v in itertools.product(*map(VALUES.get, names))]
    for values in given:
        if "frequency" in values:
            values["omega0"] = TURN * values.pop("frequency")
    scenes = [Scene.quiet(**(SCENE | values)) for values in given]
    assert points[:, COLUMNS.index("A")].tolist() == [scene.A for scene in scenes]
    assert points[:, COLUMNS.index("B")].tolist() == [scene.B for scene in scenes]
    assert plan.points(1, 2).tobytes() == points[1:2].tobytes()  # a block of one point gives the same point


def test_constant_parameters_stay_scalars():
    scalars = parse(text("omega0", "a0")).plan().scalars
    assert scalars["B"] == Scene.quiet(**SCENE).B
    assert "A" not in scalars
    assert {name: scalars[name] for name in ("mu", "alpha", "mass", "g")} == {
        name: SCENE[name] for name in ("mu", "alpha", "mass", "g")
    }
    assert scalars.keys() & {"A", "B"} == {"B"}
    assert parse(text("alpha")).plan().scalars.keys().isdisjoint({"A", "B"})
    both = parse(text("mass")).plan().scalars  # the mass changes forces but not the motion
    assert (both["A"], both["B"]) == (Scene.quiet(**SCENE).A, Scene.quiet(**SCENE).B)


def test_scene_of_numbers_in_the_sweep_table_equals_a_physical_table():
    one = parse("[sweep]\na0 = 0.8e-3\nomega0 = 150\nmu = 0.6\nalpha = 3.4\n")
    other = parse("[physical]\na0 = 0.8e-3\nomega0 = 150\nmu = 0.6\nalpha = 3.4\n")
    assert one.physical == other.physical
    assert one.arguments == other.arguments
    assert parse(text("omega0")).physical is None  # the sweep has no single scene


def test_options_move_a_quantity_between_the_tables():
    plain = "[physical]\na0 = 0.8e-3\nomega0 = 150\nmu = 0.6\nalpha = 3.4\n"
    plan = parse(plain, ["omega0={start = 100, stop = 200, num = 5}"]).plan()
    assert plan.axes["omega0"].tolist() == [100.0, 125.0, 150.0, 175.0, 200.0]
    assert parse(text("omega0"), ["omega0=160"]).plan().scalars["A"] == Scene.quiet(**(SCENE | {"omega0": 160.0})).A
    assert parse(text("omega0"), ["physical.omega0=160"]).plan().axes == {}
    in_hertz = parse(plain, ["frequency=24"]).plan()
    assert "omega0" not in in_hertz.scalars
    assert in_hertz.scalars["frequency"] == 24.0, "stored as given"
    assert in_hertz.scalars["A"] == Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4).A
    over = parse(text("omega0"), ["frequency={start = 20, stop = 30, num = 3}"]).plan()
    assert over.axes["frequency"].tolist() == [20.0, 25.0, 30.0]
    assert parse(text("frequency"), ["omega0=[150]"]).plan().axes["omega0"].tolist() == [150.0]


def test_scene_of_a_call_is_the_scene_of_a_configuration():
    """Its quantities replace A and B; an argument replaces a quantity; a file made of the plan gives the plan again."""
    machine = Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4, mass=250.0)
    for written, table, sweep in (
        ({"eps": [0.0, 1e-4]}, "a0 = 0.8e-3\nfrequency = 24\nalpha = 3.4\n", "eps = [0, 1e-4]"),
        ({"omega0": [100.0, 150.0]}, "a0 = 0.8e-3\nalpha = 3.4\n", "omega0 = [100, 150]"),
        ({"frequency": [20.0, 24.0], "alpha": 0.0}, "a0 = 0.8e-3\nalpha = 0\n", "frequency = [20, 24]"),
    ):
        plan = make_plan({"scene": machine, **written})
        other = parse(f"[physical]\nmu = 0.6\nmass = 250\n{table}[sweep]\n{sweep}\n").plan()
        again = parse(as_toml(plan)).plan()
        assert compare(plan, other) == compare(plan, again) == []
        assert list(plan.scalars) == list(other.scalars) == list(again.scalars), "files of equal sweeps are equal"
    alone = make_plan({"scene": Scene.quiet(omega0=150.0, mu=0.6, alpha=3.4), "A": [1.5, 2.0]})
    assert alone.scalars["B"] == machine.B, "a scene without a0 gives B and the units"


def test_select_keeps_the_numbers_of_the_scene():
    plan = parse(text("omega0", "alpha")).plan()
    results = Results.uncomputed(plan)
    results.status[:] = Status.OK
    part = results.select(omega0=110.0, method="nearest")
    assert list(part.axes) == ["alpha"]
    assert part.scalars["omega0"] == VALUES["omega0"][1]
    assert part.scalars.keys().isdisjoint({"A", "B"})
    one = part.select(alpha=3.0)
    scene = Scene.quiet(**(SCENE | {"omega0": VALUES["omega0"][1], "alpha": 3.0}))
    assert (one.scalars["A"], one.scalars["B"]) == (scene.A, scene.B)
    with pytest.raises(ValueError, match=r"^omega0 = 300: must be one of the .* would select 200"):
        results.select(omega0=300)
