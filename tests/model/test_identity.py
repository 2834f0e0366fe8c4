"""A function is the same if its source and all values that it uses are the same, and another one otherwise."""

import functools
import subprocess
import sys
import threading

import numpy as np
import pytest

from tests.support.process import ROOT
from vibrodrive.model import identity
from vibrodrive.model.identity import Unknown, digest_of

FACTOR = 2.0
TABLE = np.arange(3.0)
LOG: list[float] = []
COUNT = {"calls": 0}
LOCK = threading.Lock()


def double(x):
    return FACTOR * x


def looked_up(m):
    return TABLE[0] + double(m.margin)


def logged(m):
    LOG.append(m.margin)
    COUNT["calls"] += 1
    return m.margin


def locked(m):
    with LOCK:
        return m.margin


def default(m, k=0, *, scale=1.0):
    return scale * m.margin + k


def factory(k, table=()):
    def inner(m):
        return m.margin + k + len(table)

    return inner


def counting():
    calls = 0

    def inner(m):
        nonlocal calls
        calls += 1
        return m.margin

    return inner


def decorated(k):
    def wrap(function):
        @functools.wraps(function)
        def scaled(m):
            return k * function(m)

        return scaled

    return wrap


class Reads:
    LIMIT = 1.0

    def __init__(self, k=0):
        self.k, self.calls, self.log = k, 0, []

    def __call__(self, m):
        self.calls += 1
        self.log.append(m)
        return FACTOR * self.k

    @staticmethod
    def helper(m):
        return FACTOR

    @functools.cached_property
    def slow(self):
        return 1.0


def calls_static(m):
    return Reads.helper(m) + Reads.LIMIT


def like_a_list(m):
    return threading.append(m)  # a module with a function of this name


class Weighted:
    def __init__(self, weight, parts):
        self.weight, self.parts = weight, parts

    def __call__(self, m):
        return self.weight * m.margin

    def method(self, m):
        return self.weight


def sha(function):
    return digest_of(function)[0]


pair = lambda m: m.margin, lambda m: -m.margin

DIFFERENT = {
    "partial": (functools.partial(default, k=0), functools.partial(default, k=1)),
    "nested partial": tuple(functools.partial(functools.partial(default, k=k), scale=2.0) for k in (1, 2)),
    "closure": (factory(1), factory(2)),
    "array in a closure": (factory(1, np.arange(3)), factory(1, np.array([0, 1, 3]))),
    "kind of array": (factory(1, np.arange(3)), factory(1, np.arange(3.0))),
    "mask": (factory(1, np.ma.array([1, 2], mask=[0, 1])), factory(1, np.ma.array([1, 2], mask=[1, 0]))),
    "dict in a closure": (factory(1, {"a": [1]}), factory(1, {"a": [2]})),
    "set in a closure": (factory(1, {"a", "b"}), factory(1, {"a", "c"})),
    "instance": (Weighted(1.0, []), Weighted(2.0, [])),
    "list in an instance": (Weighted(1.0, [1]), Weighted(1.0, [2])),
    "method": (Weighted(1.0, []).method, Weighted(2.0, []).method),
    "decorator": (decorated(1)(double), decorated(2)(double)),
    "wrapper": (functools.lru_cache(factory(1)), functools.lru_cache(factory(2))),
    "two lambdas in a line": pair,
    "tuple in a lambda": (lambda m: sum((1, 2)), lambda m: sum((1, 3))),
    "set in a lambda": (lambda m: m in {1, 2, 3}, lambda m: m in {1, 2, 4}),
    "keyword in a lambda": (lambda m: dict(a=1), lambda m: dict(b=1)),
    "state of an instance that works": (Reads(1), Reads(2)),
    "state of a generator": (factory(1, np.random.default_rng(1)), factory(1, np.random.default_rng(2))),
}


@pytest.mark.parametrize("what", DIFFERENT)
def test_functions_with_different_values_are_different(what):
    one, other = DIFFERENT[what]
    assert sha(one) != sha(other)
    assert sha(one) == sha(one)


def test_default_is_part_of_a_function(monkeypatch):
    before = sha(default)
    monkeypatch.setattr(default, "__defaults__", (1,))
    changed = sha(default)
    monkeypatch.setattr(default, "__kwdefaults__", {"scale": 2.0})
    assert len({before, changed, sha(default)}) == 3


@pytest.mark.parametrize(("name", "value"), [("FACTOR", 3.0), ("TABLE", np.arange(4.0)), ("double", factory(1))])
def test_what_a_function_reads_at_the_top_of_its_module_is_part_of_it(name, value, monkeypatch):
    before = sha(looked_up)
    assert set(digest_of(looked_up)[1]) == {"TABLE", "FACTOR"}
    monkeypatch.setitem(looked_up.__globals__, name, value)
    assert sha(looked_up) != before


@pytest.mark.parametrize("function", [Reads(1), Reads(1).helper, calls_static])
def test_what_methods_and_classes_read_is_part_of_them(function, monkeypatch):
    before = sha(function)
    monkeypatch.setitem(globals(), "FACTOR", 3.0)
    assert sha(function) != before


def test_class_attribute_is_part_of_what_reads_it(monkeypatch):
    before = sha(calls_static), sha(Reads())
    monkeypatch.setattr(Reads, "LIMIT", 2.0)
    assert not {*before} & {sha(calls_static), sha(Reads())}


def test_what_an_instance_does_to_itself_is_not_part_of_it():
    one = Reads(1)
    before = sha(one)
    one(1)
    assert one.slow
    assert (one.calls, sha(one)) == (1, before)


def test_module_that_looks_like_a_list_is_part_of_a_function(monkeypatch):
    before = sha(like_a_list)
    monkeypatch.setitem(globals(), "threading", np)
    assert sha(like_a_list) != before


def test_body_of_a_decorator_is_part_of_its_function():
    def wrap(body):
        space = {"functools": functools}
        inner = f"    @functools.wraps(g)\n    def scaled(m):\n        return {body} * g(m)\n"
        exec(f"def deco(g):\n{inner}    return scaled", space)
        return space["deco"](double)

    assert sha(wrap(2)) != sha(wrap(3))


def test_what_a_function_changes_itself_is_not_part_of_it(monkeypatch):
    before = sha(logged)
    monkeypatch.setitem(globals(), "LOG", [1.0])
    monkeypatch.setitem(globals(), "COUNT", {"calls": 7})
    assert sha(logged) == before
    count = counting()
    before = sha(count)
    count(type("Motion", (), {"margin": 1.0}))
    assert sha(count) == before


@pytest.mark.integration
def test_equal_functions_are_the_same_in_another_process():
    """Also with another order of sets, and in a program that imports the module under another name."""
    code = "from tests.model.test_identity import *; print(sha(looked_up), *(sha(f) for f, _ in DIFFERENT.values()))"
    found = [
        subprocess.run(
            [sys.executable, "-c", code], cwd=ROOT, env={"PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)},
            capture_output=True, text=True, check=True,
        ).stdout
        for seed in ("1", "2")
    ]  # fmt: skip
    assert found[0] == found[1]
    assert found[0].split() == [sha(looked_up), *(sha(one) for one, _ in DIFFERENT.values())]


@pytest.mark.parametrize(
    ("function", "what"),
    [
        (locked, "LOCK in locked, a lock"),
        (factory(threading.Lock()), "k in inner, a lock"),
        (Weighted(1.0, {"open": threading.Lock()}), "its contents"),
    ],
)
def test_what_cannot_be_compared_is_named(function, what):
    with pytest.raises(Unknown, match=what):
        digest_of(function)


def test_a_function_of_no_module_counts_as_the_users():
    space: dict = {"k": 1}
    exec("def f(m): return k", space)
    before = sha(space["f"])
    space["k"] = 2
    assert sha(space["f"]) != before


def test_cycles_end():
    found = []
    found.append(found)
    assert sha(factory(1, found)) == sha(factory(1, found))


def test_libraries_count_by_name():
    digest = identity._Digest("tests")
    assert digest._library("numpy.linalg")
    assert digest._library("json")
    assert digest._library("vibrodrive.model.plan")
    assert not digest._library(__name__)
    assert not digest._library("__main__")
