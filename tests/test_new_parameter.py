"""A new parameter is a row of the table and its type in the signatures: everything else then knows it.

A copy of the package gets the parameter `zeta`, as its next author would add one. No kernel uses it.
"""

import shutil
from pathlib import Path

import pytest

import vibrodrive as vd
from tests.support.process import ROOT, python

ROW = '    "zeta": Name("damping ζ", "ζ", "z", "model", 0.25, 0.0, 2.0, axis=(0.0, 1.0, LINEAR)),\n'
PLACES = {
    "names.py": ('}  # fmt: skip\n"""Dimensionless', ROW),
    "keywords.py": ("    budget: int\n", "    zeta: One\n"),
}
"""Files of model/ that get the parameter: the text that follows it, and the line."""

KNOWN = """
import inspect, sys
import numpy as np
import vibrodrive as vd
from benchmarks.tables import keys
from click.testing import CliRunner
from vibrodrive.cli import cli
from vibrodrive.explorer.controls import build, title_of
from vibrodrive.explorer.motion import limit_plans
from vibrodrive.explorer.view import View, adapted, read_address, view_of
from vibrodrive.figures.texts import conditions_of
from vibrodrive.model.config import parse

short, old = {"transient": 1, "periods": 2}, sys.argv[1]
assert "zeta : float, 0 to 2, default 0.25\\n    damping ζ." in inspect.getdoc(vd.simulate)
for function in (vd.simulate, vd.sweep, vd.limit):
    assert inspect.signature(function).parameters["zeta"].default == 0.25
assert vd.simulate(1.5, zeta=0.5, **short).arguments["zeta"] == 0.5
assert vd.limit(1.5, eta=5.0, transient=10, periods=6, zeta=0.5).k2 > 0.0
for function in (vd.simulate, vd.limit):
    try:
        function(1.5, zeta=3)
    except ValueError as error:
        assert str(error) == "zeta = 3: must be a number >= 0 and <= 2", error
try:
    vd.orbits(1.5, zeta=1.0)
except TypeError as error:
    assert str(error).startswith("argument = 'zeta': must be one of A, "), error

assert vd.load(old).scalars["zeta"] == 0.25
assert vd.sweep(A=[1.5, 1.6], path=old, **short).shape == (2,)  # resumed
run, toml = CliRunner().invoke, "[sweep]\\nA = 1.5\\nzeta = [0.0, 0.5]\\n[run]\\ntransient = 1\\nperiods = 2\\n"
assert run(cli, ["info", old]).output.count("zeta = 0.25") == 1
open("new.toml", "w").write(toml)
assert run(cli, ["sweep", "new.toml", "--set", "zeta=[0.5, 1, 2]"]).exit_code == 0
over = vd.load("new.h5")
assert over.axes["zeta"].tolist() == [0.5, 1.0, 2.0]
assert over.select(zeta=1.0).scalars["zeta"] == over.to_xarray().sel(zeta=1.0).zeta == 1.0
assert conditions_of(over.select(zeta=1.0))[-1] == "$z = 1$"
assert "| `zeta` | damping ζ | 0 to 2 | 0.25 |" in keys({})

view = view_of(parse(toml))
assert (view.x, view.low, view.high) == ("zeta", 0.0, 0.5)
plain = View.read({"zeta": 0.75})
assert (plain.address(), plain.plan().scalars["zeta"]) == ("zeta=0.75", 0.75)
assert "ζ = 0.75" in title_of(plain)[1] and "ζ" not in title_of(View())[1]
assert limit_plans(plain.motion_plan())["eps"].scalars["zeta"] == 0.75
across = adapted(plain.state() | {"x": "zeta"}, "x")
assert (across.low, across.high) == (0.0, 1.0)
assert title_of(across)[0].endswith("against damping ζ (ζ)")
assert '"name": "zeta"' in build(across)
"""


@pytest.mark.jit
def test_a_row_and_a_type_make_a_parameter(tmp_path):
    pytest.importorskip("tornado")
    pytest.importorskip("xarray")
    old = tmp_path / "old.h5"
    vd.sweep(A=[1.5, 1.6], transient=1, periods=2, path=old)
    copy = shutil.copytree(ROOT / "vibrodrive", tmp_path / "vibrodrive", ignore=shutil.ignore_patterns("__pycache__"))
    for name, (after, line) in PLACES.items():
        path = Path(copy) / "model" / name
        text = path.read_text()
        assert text.count(after) == 1
        path.write_text(text.replace(after, line + after))
    code = f"import os\nos.chdir({str(tmp_path)!r})\n{KNOWN}"
    python(code, old, PYTHONPATH=f"{tmp_path}:{ROOT}", NUMBA_NUM_THREADS="1")
