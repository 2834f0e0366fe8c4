"""Every parameter and every quantity of a scene is one in every call: a number, an axis, along `points`, in TOML.

The tables PARAMETERS and SCENE generate these tests, so a new row is tested by being there.
"""

import inspect
import math

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.model.choices import ACTS_ON
from vibrodrive.model.config import parse
from vibrodrive.model.names import AXES, PARAMETERS, SCENE, SCENE_AXES, TURN
from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.physical import Scene, measure
from vibrodrive.model.plan import make_plan
from vibrodrive.model.quantities import QUANTITIES
from vibrodrive.model.results import Results
from vibrodrive.model.toml import as_toml
from vibrodrive.store.compare import compare

MACHINE = {"a0": 0.8e-3, "omega0": 150.0, "mu": 0.6, "alpha": 3.4, "mass": 250.0, "g": 9.81}
PLAIN = {"A": 3.04, "B": 0.2, "method": "muller", "dtau": 0.1}


def values_of(name):
    """Return three allowed values, within the axis of the explorer."""
    low, high, *_ = AXES[name].axis
    return np.linspace(0.7 * low + 0.3 * high, 0.3 * low + 0.7 * high, 3)


def beside(name):
    """Return the other arguments of a call with this parameter."""
    if name in SCENE_AXES:
        return {key: value for key, value in MACHINE.items() if key != name and (key, name) != ("omega0", "frequency")}
    return {key: value for key, value in PLAIN.items() if key != name}


def numbers(name, value):
    """Return all parameters of the motion at this value, by their definitions."""
    known = {**{p: row.default for p, row in PARAMETERS.items()}, **beside(name), name: value}
    if name in SCENE_AXES:
        omega0 = known.get("omega0") or TURN * known["frequency"]
        angle = math.radians(known["alpha"])
        known["A"] = omega0**2 * known["a0"] / (known["mu"] * known["g"] * math.cos(angle))
        known["B"] = math.tan(angle) / known["mu"]
    return [known[column] for column in COLUMNS]


def toml(name, entry, table):
    """Return a configuration with the entry in this table, and the other arguments as numbers."""
    homes = {"physical": [], "model": [], "switching": [], "run": [], "sweep": [], "sweep.points": []}
    for key, value in beside(name).items():
        home = "switching" if key == "method" else AXES[key].table if key != "g" else "physical"
        homes[home].append(f"{key} = {value!r}".replace("'", '"'))
    homes[table].append(f"{name} = {entry}")
    return "".join(f"[{home}]\n" + "\n".join(lines) + "\n" for home, lines in homes.items() if lines)


def plans(name):
    """Yield (way, plan) for all ways to give three values of a parameter."""
    values, others = values_of(name), beside(name)
    listed = f"[{', '.join(map(repr, values.tolist()))}]"
    spread = f"{{start = {values[0].item()!r}, stop = {values[-1].item()!r}, num = 3}}"
    yield "axis", make_plan({name: values, **others})
    yield "axis, written last", make_plan(dict(reversed({name: values, **others}.items())))
    yield "points", make_plan({"points": {name: values}, **others})
    for table in ("sweep", "sweep.points"):
        for entry in (listed, spread):
            yield f"{table} {entry}", parse(toml(name, entry, table)).plan()
    yield "option", parse(toml(name, values[0].item(), AXES[name].table), [f"{name}={listed}"]).plan()
    if name in SCENE_AXES:
        machine = Scene(**MACHINE | ({name: 1.1 * MACHINE[name]} if name in MACHINE else {}))  # this value is replaced
        yield "axis of a scene", make_plan({"scene": machine, name: values})
        yield "points of a scene", make_plan({"scene": machine, "points": {name: values}})


@pytest.mark.parametrize("name", AXES)
def test_each_way_to_give_a_parameter_gives_the_same_motions(name):
    wanted = [numbers(name, value) for value in values_of(name).tolist()]
    rows, orders = np.array([]), set()
    for way, plan in plans(name):
        found = plan.points(0, plan.n_points)
        np.testing.assert_allclose(found, wanted, rtol=1e-15, err_msg=way)
        assert found.tobytes() == (rows if rows.size else found).tobytes(), way
        rows = found
        orders.add((*plan.axes, *plan.scalars))
        for k, value in enumerate(values_of(name).tolist()):
            one = make_plan({name: value, **beside(name)})
            assert one.points(0, 1).tobytes() == found[k : k + 1].tobytes(), way
            for key, number in plan.single(k).scalars.items():
                assert number == one.scalars[key] or math.isnan(number), (way, key)
        again = parse(as_toml(plan)).plan()
        assert compare(plan, again) == [], way
        assert list(again.scalars) == list(plan.scalars), way
    assert len(orders) == 2, "along an axis and along points: files of equal sweeps are equal"


@pytest.mark.parametrize("name", AXES)
def test_each_way_to_give_a_parameter_has_the_same_units(name):
    found = {way: Results.uncomputed(plan) for way, plan in plans(name)}
    for way, results in found.items():
        for quantity, row in QUANTITIES.items():
            unit = results.measure(quantity)
            one = [measure(row, results.plan.single(k).scalars) for k in range(3)]
            assert {unit.si} == {single.si for single in one}, (way, quantity)
            got = np.broadcast_to(np.asarray(unit.one, float), results.shape)
            assert got.tolist() == [single.one for single in one], (way, quantity)
        assert (results.measure("energy").si != "1") == (name in SCENE_AXES), way
        axis, places = next(iter(results.axes.items()))
        scalars = results.select(**{axis: places[1]}).scalars
        assert scalars[name] == values_of(name)[1], way
        assert [scalars["A"], scalars["B"]] == pytest.approx(numbers(name, values_of(name)[1])[:2], rel=1e-15), way


SHORT = {"transient": 10, "periods": 6}
CALLS = {
    vd.simulate: (lambda motion: tuple(motion.arguments[column] for column in COLUMNS), SHORT),
    vd.limit: (lambda found: (found.A, found.B, found.k2, found.scene), SHORT | {"eta": 5.0}),  # found soon
    vd.orbits: (lambda found: [(one.A, one.B, one.scene) for one in found], {}),
    vd.impact_map: (lambda found: (found.A, found.B), {}),
    vd.plot.cobweb: (lambda figure: figure.axes[0].get_title(loc="right"), {}),
}
"""What each call of one motion computes from its parameters, and arguments that make it short."""

GENTLE = MACHINE | {"a0": 0.4e-3}  # at this amplitude a limit is found in short motions


def called(function, **given):
    """Return what a call computes from the arguments that it has."""
    told, short = CALLS[function]
    known = inspect.signature(function).parameters
    return told(function(**{key: value for key, value in (short | given).items() if key in known}))


@pytest.mark.jit
@pytest.mark.parametrize("name", SCENE)
@pytest.mark.parametrize("function", CALLS, ids=lambda f: f.__name__)
def test_each_call_takes_a_machine_as_a_scene_and_by_its_quantities(function, name):
    """All ways to give a quantity of the scene give the same result, that of the A and B of the scene."""
    given = {key: value for key, value in GENTLE.items() if (key, name) != ("omega0", "frequency")}
    given |= {"frequency": 24.0} if name == "frequency" else {}
    scene = Scene(**given)
    other = Scene(**given | {name: 1.01 * given[name]})
    found = called(function, scene=scene)
    assert found != called(function, scene=other) or (name == "mass" and function is not vd.orbits)
    if name in inspect.signature(function).parameters:
        assert called(function, **given) == called(function, scene=other, **{name: given[name]}) == found
        with pytest.raises(TypeError, match=rf"^{name} = .*: must be "):
            function(scene=other, **{name: [given[name]]})
    plain = called(function, A=scene.A, B=scene.B)
    if function in (vd.impact_map, vd.plot.cobweb, vd.simulate):
        assert found == plain
    level = {key: value for key, value in given.items() if key != "a0"} | {"A": scene.A}
    if "a0" in inspect.signature(function).parameters:
        again = called(function, **level)
        assert again[:2] == found[:2] or function is vd.orbits, "A, with a scene for B and the units"
    with pytest.raises(ValueError, match=r"^A = .*: must be left out, because it follows from the scene$"):
        function(A=3.0, scene=scene)


@pytest.mark.jit
@pytest.mark.parametrize("name", PARAMETERS)
@pytest.mark.parametrize("function", CALLS, ids=lambda f: f.__name__)
def test_each_call_takes_the_parameters_that_its_result_depends_on(function, name):
    """A parameter that has no meaning for a call is refused by name, also with a scene. The others are one number."""
    known, value = inspect.signature(function).parameters, values_of(name)[1].item()
    undisturbed = {vd.orbits, vd.impact_map, vd.plot.cobweb}
    assert (name in known) == (name in ("A", "B") or function not in undisturbed)
    allowed = f"^{name} = .*: must be (one number|left out, because its)" if name in known else f"^argument = '{name}'"
    with pytest.raises((TypeError, ValueError), match=allowed):
        function(**beside_in(function, name), **{name: [value, value]})


def beside_in(function, name):
    """Return the other arguments that a call has."""
    known = inspect.signature(function).parameters
    return {key: number for key, number in beside(name).items() if key in known}


@pytest.mark.parametrize("name", [n for n in AXES if n not in ACTS_ON])
def test_a_parameter_is_given_once(name):
    """As a number and along points, or in two tables, it is refused by name."""
    values = values_of(name)
    with pytest.raises(ValueError, match=f"^{name} = .*: must be left out, because points already gives {name}"):
        make_plan({name: 1.0, "points": {name: values}, **beside(name)})
    text = toml(name, values[0].item(), AXES[name].table)
    twice = text.replace("[sweep.points]\n", "") + f"[sweep.points]\n{name} = [{values[0].item()!r}]\n"
    with pytest.raises(ValueError, match=rf"\.{name} = .*: must be left out, because \[.*\] already gives {name}$"):
        parse(twice)


def test_g_varies_nowhere():
    for given in ({"g": [9.8, 9.9]}, {"points": {"g": [9.8, 9.9]}}):
        with pytest.raises(
            (TypeError, ValueError), match=r"^(g = \[9\.8, 9\.9\]: must be|key of points = 'g': must be)"
        ):
            make_plan({**{key: value for key, value in MACHINE.items() if key != "g"}, **given})
    with pytest.raises(ValueError, match=r"key of points = 'g'"):
        parse("[sweep.points]\ng = [9.8]\n")
    assert {*SCENE} - {*SCENE_AXES} == {"g"}
