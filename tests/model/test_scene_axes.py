"""Axes in SI units: every point has the A and B that `Scene` computes for this point, bit for bit."""

import itertools

import numpy as np
import pytest

from vibrodrive.model.config import parse
from vibrodrive.model.names import SCENE_AXES, TURN
from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.physical import Scene

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
