"""Tests of the keywords of the public functions.

The signatures contain all keywords and their defaults. Type checkers and calls refuse wrong keywords. The order of the
keywords in a call is preserved.
"""

import inspect
import math
import os
import pickle
import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import vibrodrive as vd
from tests.support import fake
from vibrodrive.model.choices import Method
from vibrodrive.model.keywords import as_written
from vibrodrive.model.names import PARAMETERS, SCENE, Settings
from vibrodrive.model.plan import make_plan
from vibrodrive.model.results import Results

ROOT = Path(__file__).parent.parent.parent
FUNCTIONS = [vd.simulate, vd.sweep, vd.limit]
OWN = {
    vd.simulate: {"A": None, "scene": None},
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
        **dict.fromkeys(["A", "scene", "method", "threads"]),
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


@pytest.mark.integration
def test_omitted_arguments_have_the_default_of_the_signature():
    motion = vd.simulate(A=1.5, transient=0, periods=1)
    shown = {name: p.default for name, p in inspect.signature(vd.simulate).parameters.items()}
    shown |= {"A": 1.5, "transient": 0, "periods": 1, "method": Method.CERTIFIED}
    del shown["scene"]  # A and B of the scene are arguments
    assert motion.arguments | {"dtau": None, "tol": None} == shown
    assert motion.arguments["tol"] == 1e-7
    assert vd.simulate(1.5, transient=0, periods=1, tol=None, dtau=None) == motion


@pytest.mark.integration
@pytest.mark.parametrize("names", [["A", "eps", "xi0"], ["xi0", "A", "eps"], ["eps", "xi0", "A"]])
def test_axes_are_in_the_order_written(names):
    r = vd.sweep(**{name: np.linspace(0.0, 0.01, k + 1) for k, name in enumerate(names)}, transient=0, periods=1)
    assert (list(r.axes), r.shape) == (names, (1, 2, 3))


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.__name__)
def test_unknown_and_missing_keywords_are_refused_in_one_form(function):
    names = ", ".join(inspect.signature(function).parameters)
    with pytest.raises(TypeError, match=rf"^argument = 'bogus': must be one of {names}$"):
        function(A=3, bogus=3)
    with pytest.raises(TypeError, match=rf"^argument = 'transiant': must be one of {names}. Did you mean transient\?$"):
        function(A=3, transiant=3)
    with pytest.raises(TypeError, match=r"^A is missing: must be given, a number >= 0 and <= 1e\+09$"):
        function(B=0.1)


def test_positional_arguments_are_limited_by_the_signature():
    with pytest.raises(
        TypeError,
        match=r"^arguments without a name = \(3\.0, 0\.1\): must be at most 1 \(A\); give the others by name$",
    ):
        vd.simulate(3.0, 0.1)
    with pytest.raises(
        TypeError,
        match=r"^arguments without a name = \(\[3\.0\],\): must be none; give each by name, such as A = …$",
    ):
        vd.sweep([3.0])
    with pytest.raises(TypeError, match="multiple values for argument 'A'"):
        vd.simulate(3.0, A=3.0)


HINTS = [
    (lambda: vd.simulate(a0=1e-3), "argument = 'a0': must be given by a scene, as scene = vd.Scene(a0=…, …)"),
    (lambda: vd.sweep(A=3.0, record="sections"), "Did you mean section?"),
    (lambda: vd.sweep(A=3.0, record=["section", "sumary"]), "Did you mean summary?"),
    (lambda: vd.sweep(A=3.0, record="section,impacts"), "write ['section', 'impacts']"),
    (lambda: recorded().sections, "'Results' object has no attribute 'sections'. Did you mean section?"),
]


def recorded():
    plan = make_plan({"A": [3.0, 3.1], "transient": 0, "periods": 1})
    return Results.collect(plan, fake.run_blocks(plan))


@pytest.mark.parametrize(("call", "told"), HINTS)
def test_wrong_name_gets_the_right_hint(call, told):
    with pytest.raises((AttributeError, TypeError, ValueError), match=re.escape(told) + "$"):
        call()
    assert not hasattr(recorded(), "_repr_png_")  # a notebook asks for such names


def test_decorated_function_receives_the_given_arguments_and_keeps_its_name():
    @as_written
    def asked(written, /, A, B=1, *, eps=2):
        """Documented."""
        return list(written.items()), (A, B, eps)

    assert asked(5, eps=6) == ([("A", 5), ("eps", 6)], (5, 1, 6))
    assert asked(eps=6, A=5) == ([("eps", 6), ("A", 5)], (5, 1, 6))
    assert (asked.__name__, asked.__doc__) == ("asked", "Documented.")
    assert all(pickle.loads(pickle.dumps(function)) is function for function in FUNCTIONS)


SCRIPT = """\
import numpy as np
import vibrodrive as vd

A = np.linspace(3.0, 3.25, 10)
motion = vd.simulate(3.04, eps=0, B=0.1, eta=vd.ETA, method="certified", dtau=None, tol=None)
motion = vd.simulate(A=3.04, method=vd.Method.FIXED, dtau=1e-3, periods=10)
r = vd.sweep(A=A, eps=[0, 2e-4], dtau=(1e-3, 1e-2), method="muller", threads=2, executor=None)
k = vd.limit(3.04, "dtau", method="fixed", periods=100, threads=1)
found: float = k.k2 + motion.margin + r.margin[0, 0, 0]
r = vd.sweep(points={"A": A, "eps": [1e-4] * 10}, record=["section", "summary"])
part = r.select(A=3.0).select("nearest", tolerance=0.1, eps=0.0)
part.plot("poincare").savefig("figure.png")
vd.plot.bifurcation(r, "xi", ax=None).savefig("figure.png")
lengths: list[int] = list(r.to_xarray().sizes.values()) + [len(motion.to_dataframe("impacts"))]
motion.plot(("phase", "time"))
vd.plot.limits([vd.load("limits.h5"), r], ax=None).savefig("figure.png")
vd.load("limits.h5", kind="limits")  # wrong: kind
vd.simulate(A=3.04, periods="many")  # wrong: periods
vd.simulate(A=3.04, bogus=3)  # wrong: bogus
vd.simulate(A=[3.0, 3.1])  # wrong: "A"
vd.simulate(A=3.04, method="newton")  # wrong: method
vd.sweep(A=A, periods=[1, 2])  # wrong: periods
vd.sweep(A=A, bogus=3)  # wrong: bogus
vd.sweep(A="3")  # wrong: "A"
vd.sweep(A)  # wrong: positional
vd.limit(3.04, "eta")  # wrong: argument 2
vd.limit(3.04, periods="many")  # wrong: periods
vd.limit(3.04, bogus=3)  # wrong: bogus
vd.limit(3.04).k3  # wrong: k3
text: str = r.section  # wrong: ndarray
vd.sweep(points=[3.0, 3.1])  # wrong: points
r.select(A=3.0, method="closest")  # wrong: method
r.select(A="3.0")  # wrong: "A"
r.plot(colour="red")  # wrong: colour
r.plot(ax="left")  # wrong: "ax"
motion.to_dataframe("rows")  # wrong: argument 1
motion.plot("phase", "time")  # wrong: "plot"
vd.plot.bifurcation(r, limits=3)  # wrong: limits
vd.plot.diagram(r)  # wrong: diagram
"""


@pytest.mark.slow("21 s: mypy reads the package")
def test_type_checker_finds_exactly_the_mistakes_of_a_script(tmp_path):
    pytest.importorskip("mypy")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    # mypy runs in the root directory, so that it uses the options of pyproject.toml. If MYPY_CACHE_DIR is set, mypy
    # uses the results in this cache.
    paths = {"MYPY_CACHE_DIR": str(tmp_path / "cache")} | os.environ
    ran = subprocess.run(
        [sys.executable, "-m", "mypy", str(script)], cwd=ROOT, env=paths, capture_output=True, text=True, check=False
    )
    told = {int(n): what for n, what in re.findall(r"script\.py:(\d+): error: (.*)$", ran.stdout, re.MULTILINE)}
    lines = enumerate(SCRIPT.splitlines(), 1)
    wrong = {number: line.split("# wrong: ")[1] for number, line in lines if "# wrong: " in line}
    assert set(told) == set(wrong), ran.stdout + ran.stderr
    for number, word in wrong.items():
        assert word.lower() in told[number].lower()


@pytest.mark.parametrize(
    ("function", "arguments", "name"),
    [
        (vd.sweep, {"dtau": [0.1, 0.01]}, "dtau"),
        (vd.sweep, {"points": {"dtau": [0.1, 0.01]}}, "dtau"),
        (vd.sweep, {"method": "fixed", "dtau": 0.1, "tol": [1e-3, 1e-9]}, "tol"),
        (vd.sweep, {"tol": 1e-7}, "tol"),
        (vd.simulate, {"dtau": 0.1}, "dtau"),
        (vd.simulate, {"method": "fixed", "dtau": 0.1, "tol": 1e-7}, "tol"),
        (vd.limit, {"dtau": 0.1}, "dtau"),
        (vd.limit, {"disturbance": "dtau", "tol": 1e-9}, "tol"),
    ],
)
def test_unused_argument_is_refused_with_the_methods_that_use_it(function, arguments, name):
    acts = {"dtau": "fixed and muller", "tol": "muller"}[name]
    with pytest.raises(ValueError, match=rf"^{name} = .*: must be left out .* used by {acts} only$"):
        function(A=3.0, **arguments)
