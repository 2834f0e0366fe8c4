"""The signatures of the public functions contain all keywords and defaults; a call keeps the order of its keywords."""

import inspect
import math
import pickle
from dataclasses import fields

import pytest

import vibrodrive as vd
from vibrodrive.model.choices import Method
from vibrodrive.model.keywords import Machine, Parameters
from vibrodrive.model.names import PARAMETERS, SCENE, SETTINGS, Settings

FUNCTIONS = [vd.simulate, vd.sweep, vd.limit]
OWN = {
    vd.simulate: dict.fromkeys(["A", "scene", *SCENE]),
    vd.sweep: {
        **dict.fromkeys(["A", "scene", *SCENE]),
        "record": "section",
        "points": None,
        "path": None,
        "overwrite": False,
        "threads": None,
        "executor": None,
    },
    vd.limit: {
        **dict.fromkeys(["A", "scene", "method", "threads", *SCENE]),
        "disturbance": "eps",
        "criterion": "impacts",
        "periods": 1500,
    },
}


def defaults_of_the_model():
    """Return the defaults of the arguments of `make_plan`, as a signature shows them."""
    known = {name: p.default for name, p in PARAMETERS.items()}
    known |= {"A": inspect.Parameter.empty, "dtau": None, "tol": None}
    assert math.isnan(PARAMETERS["dtau"].default)
    for field in fields(Settings):
        known[field.name] = Settings().words[field.name]
    return known


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.__name__)
def test_signatures_show_every_keyword_and_its_default(function):
    shown = inspect.signature(function).parameters
    assert {name: p.default for name, p in shown.items()} == {
        **defaults_of_the_model(),
        **OWN[function],
    }
    assert not [name for name, p in shown.items() if p.kind in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
    assert all(p.annotation is not p.empty for p in shown.values())


@pytest.mark.parametrize("function", [vd.orbits, vd.bifurcations, vd.impact_map], ids=lambda f: f.__name__)
def test_every_call_takes_the_quantities_of_a_scene(function):
    shown = inspect.signature(function).parameters
    assert list(shown)[-len(SCENE) - 1 :] == ["scene", *SCENE]
    assert all(shown[name].default is None for name in ("scene", *SCENE))


def test_types_and_table_have_the_same_names():
    assert {"A", *Parameters.__annotations__} == {*PARAMETERS, *SETTINGS} - {"method"}
    assert [*Machine.__annotations__] == ["scene", *SCENE]


def test_help_says_of_each_keyword_type_range_default_meaning_and_unit():
    told = inspect.getdoc(vd.sweep)
    assert "B : float or sequence of float, 0 to 1e9, default 0.1\n    incline over friction B = tan α / μ." in told
    assert "a0 : float or sequence of float, optional\n    amplitude a0 of the excitation in m." in told
    told = inspect.getdoc(vd.limit)
    assert "periods : int, default 1500\n    excitation periods recorded." in told
    assert "dtau : float, 1e-12 to 1e6, optional\n    step Δτ of the grid" in told


@pytest.mark.integration
def test_omitted_arguments_have_the_default_of_the_signature():
    motion = vd.simulate(A=1.5, transient=0, periods=1)
    shown = {name: p.default for name, p in inspect.signature(vd.simulate).parameters.items()}
    shown |= {"A": 1.5, "transient": 0, "periods": 1, "method": Method.CERTIFIED}
    for name in ("scene", *SCENE):  # its A and B are arguments
        del shown[name]
    assert motion.arguments | {"dtau": None, "tol": None} == shown
    assert motion.arguments["tol"] == 1e-7
    assert vd.simulate(1.5, transient=0, periods=1, tol=None, dtau=None) == motion
    assert all(pickle.loads(pickle.dumps(function)) is function for function in FUNCTIONS)
