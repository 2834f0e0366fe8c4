"""Examples in the docstrings of public names run and print the documented output."""

import doctest
import inspect
import re

import pytest

import vibrodrive as vd
from vibrodrive.cli import cli

CONSTANTS = {"ETA"}
"""Public names that are neither functions nor classes."""

NAMES = {name: getattr(vd, name) for name in vd.__all__ if name not in CONSTANTS} | {}
NAMES |= {f"plot.{name}": getattr(vd.plot, name) for name in vd.plot.__all__}

LONG = {"bifurcations", "explore", "limit", "plot", "Results", "simulate", "sweep"}
LONG |= {name for name in NAMES if name.startswith("plot.") and name != "plot.cobweb"}
"""Names with examples that take minutes without compiled kernels."""


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.jit] if n in LONG else []) for n in sorted(NAMES)])
def test_examples_give_the_shown_output(name, tmp_path, monkeypatch):
    if name == "explore":
        pytest.importorskip("tornado")
    monkeypatch.chdir(tmp_path)
    if name == "load":
        _write_sweep("fig07.h5")
    found = doctest.DocTestFinder().find(NAMES[name], name, globs={})
    assert any(test.examples for test in found), f"{name} has no example"
    runner = doctest.DocTestRunner()
    told: list[str] = []
    for test in found:
        runner.run(test, out=told.append)
    assert runner.failures == 0, "".join(told)


def test_figures_are_called_by_their_public_names():
    assert [getattr(vd.plot, name).__name__ for name in vd.plot.__all__] == vd.plot.__all__


def _write_sweep(path):
    """Write a result file for the configuration of Fig. 7 with few points."""
    few = ["A={start = 3.0, stop = 3.25, num = 2}", "transient=0", "periods=1"]
    with open("fig07.toml", "w") as file:
        file.write("[sweep]\nA = 3.0\neps = [0.0, 2e-4]\n")
    cli.main(["sweep", "fig07.toml", "-o", path, *(w for s in few for w in ("--set", s))], standalone_mode=False)


def section_of(thing, title):
    """Return a section of a docstring in NumPy's format."""
    text = inspect.getdoc(thing) or ""
    found = re.search(rf"^{title}\n-+\n(.*?)(?=^\S[^\n]*\n-+\n|\Z)", text, re.DOTALL | re.MULTILINE)
    return found[1] if found else ""


def entries(thing, *titles):
    """Return the names of the entries of sections. Several names may have one entry."""
    heads = re.findall(r"^(\S.*)$", "\n".join(section_of(thing, title) for title in titles), re.MULTILINE)
    return {name.strip(" *") for head in heads for name in head.split(" : ")[0].split(",")}


FUNCTIONS = sorted(n for n, thing in NAMES.items() if inspect.isroutine(thing))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_argument_is_explained(name):
    parameters = inspect.signature(NAMES[name]).parameters
    assert entries(NAMES[name], "Parameters") == set(parameters)


DRAWING = sorted(name for name in NAMES if name.startswith("plot."))


@pytest.mark.parametrize("name", DRAWING)
def test_every_figure_has_the_same_last_arguments(name):
    parameters = inspect.signature(NAMES[name]).parameters
    named = [p.name for p in parameters.values() if p.kind is p.KEYWORD_ONLY]
    assert named == ["ax", "style", "width", "notes"]
    assert all(parameters[name].default is None for name in named)
