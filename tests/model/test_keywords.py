"""The signatures of the public functions contain all keywords and defaults; a call keeps the order of its keywords."""

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
from vibrodrive.model.choices import Method
from vibrodrive.model.names import PARAMETERS, SCENE, Settings

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
    assert all(pickle.loads(pickle.dumps(function)) is function for function in FUNCTIONS)


@pytest.mark.integration
@pytest.mark.parametrize("names", [["A", "eps", "xi0"], ["xi0", "A", "eps"]])
def test_axes_are_in_the_order_written(names):
    r = vd.sweep(**{name: np.linspace(0.0, 0.01, k + 1) for k, name in enumerate(names)}, transient=0, periods=1)
    assert (list(r.axes), r.shape) == (names, (1, 2, 3))


SCRIPT = """\
import numpy as np
import vibrodrive as vd

A = np.linspace(3.0, 3.25, 10)
motion = vd.simulate(3.04, eps=0, B=0.1, eta=vd.ETA, method="certified", dtau=None, tol=None)
r = vd.sweep(A=A, eps=[0, 2e-4], dtau=(1e-3, 1e-2), method="muller", threads=2, executor=None)
k = vd.limit(3.04, "dtau", method="fixed", periods=100, threads=1)
found: float = k.k2 + motion.margin + r.margin[0, 0, 0]
r = vd.sweep(points={"A": A, "eps": [1e-4] * 10}, record=["section", "summary"])
lengths: list[int] = list(r.to_xarray().sizes.values()) + [len(motion.to_dataframe("impacts"))]
r.select("nearest", tolerance=0.1, eps=0.0).plot("poincare", ax=None).savefig("figure.png")
vd.load("limits.h5", kind="limits")  # wrong: kind
vd.simulate(A=3.04, periods="many")  # wrong: periods
vd.simulate(A=3.04, bogus=3)  # wrong: bogus
vd.simulate(A=[3.0, 3.1])  # wrong: "A"
vd.sweep(A=A, periods=[1, 2])  # wrong: periods
vd.sweep(A)  # wrong: positional
vd.limit(3.04, "eta")  # wrong: argument 2
vd.limit(3.04).k3  # wrong: k3
text: str = r.section  # wrong: ndarray
vd.sweep(points=[3.0, 3.1])  # wrong: points
r.select(A=3.0, method="closest")  # wrong: method
r.plot(colour="red")  # wrong: colour
motion.to_dataframe("rows")  # wrong: argument 1
motion.plot("phase", "time")  # wrong: "plot"
vd.plot.bifurcation(r, limits=3)  # wrong: limits
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
