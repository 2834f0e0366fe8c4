"""Equality of results to the bit: compiled or in pure Python, single or batched, in one or many calls of a kernel."""

import ctypes
import json
import re
from ast import literal_eval
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.agreement import same
from tests.support.process import python
from tests.test_products import same as same_arrays
from vibrodrive.kernels.lane import LANES, LINE, STRIDE, new_lanes

RUN = """
import json, sys
import vibrodrive as vd
out = []
for a in json.loads(sys.argv[1]):
    t = vd.simulate(**a)
    out.append([t.section.tobytes().hex(), t.switches.tobytes().hex(), float(t.margin).hex(), int(t.status)])
    s = t.sample(16)
    out.append([x.tobytes().hex() for x in s[1:]])
print(json.dumps(out))
"""

CASES = [
    dict(A=3.04, transient=3, periods=4),
    dict(A=1.5, eps=5e-4, transient=1, periods=2),
    dict(A=3.0, B=1.3, xi0=4.0, tau0=1.0, transient=0, periods=4),
    dict(A=3.04, method="fixed", dtau=0.1, transient=2, periods=4),
    dict(A=3.04, method="muller", dtau=0.01, tol=1e-9, transient=1, periods=3),
    dict(A=3.04, method="muller", dtau=0.001, eps=2e-4, transient=1, periods=1),
    dict(A=1.0, transient=0, periods=2),
]


@pytest.mark.jit
def test_compiled_equals_pure_python():
    compiled, pure = (python(RUN, json.dumps(CASES), NUMBA_DISABLE_JIT=disable) for disable in "01")
    assert json.loads(compiled) == json.loads(pure)


ARGUMENTS = dict(A=np.linspace(1.0, 3.25, 150), eps=[0.0, 2e-4], transient=10, periods=10)


@pytest.mark.jit
@pytest.mark.parametrize("switching", [{}, dict(method="muller", dtau=0.01), dict(method="fixed", dtau=0.1)])
def test_bits_do_not_depend_on_slices(monkeypatch, switching):
    """If a kernel returns after every step (slices.py), the results equal those of one call."""

    def results():
        r = vd.sweep(**ARGUMENTS, **switching, threads=1)
        t = vd.simulate(A=3.04, eps=1e-4, transient=10, periods=10, **switching)
        orbits = [(o.phases.tolist(), o.multiplier) for o in vd.orbits(3.17, max_period=6)]
        after = vd.impact_map(3.04)(np.linspace(0.0, 7.0, 99))
        arrays = r.section, r.status, r.margin, r.switches, *t.sample(7), after.phase, after.periods, after.derivative
        return t, orbits, [a.tobytes() for a in arrays]

    def one_at_a_time(advance, first=0):
        while not advance(1):
            pass

    whole = results()
    sliced = ("batch.trajectory", "periodic.itineraries", "periodic.fixed_points", "periodic.impact_map")
    for module in sliced:
        monkeypatch.setattr(import_module(f"vibrodrive.{module}"), "in_slices", one_at_a_time)
    assert results() == whole


ONCE = """
import numpy as np
import vibrodrive as vd
from build_kernels import kernels
vd.simulate(A=3, B=np.float32(0.125), transient=np.int32(1), periods=np.int64(2))
vd.simulate(A=3, method="fixed", dtau=1, transient=1, periods=2).sample(3)
vd.sweep(A=np.arange(12)[::3], eps=np.float32([0, 1e-4]), transient=1, periods=1, threads=1)
vd.sweep(A=[1, 2, 3], method="muller", dtau=0.01, transient=1, periods=1, threads=2)
vd.orbits(3.04), vd.orbits(3, 0, 2), vd.impact_map(3)([1, 2]).word, vd.impact_map(3.04).breakpoints
signatures = [len(kernel.dispatcher.signatures) for kernel in kernels()]
print(sum(signatures), max(signatures))
"""


@pytest.mark.jit
def test_each_kernel_is_compiled_once():
    """Arguments are converted to int64, float64 and C order before a call, so each kernel has one signature."""
    count, most = map(int, python(ONCE, VIBRODRIVE_CODE="numba").split())
    assert count > 10
    assert most == 1


CONSTANTS = """
import sys
from importlib import import_module
import vibrodrive as vd
from numba import types
from vibrodrive.jit.compile import Marked
vd.sweep(A=[1.5, 3.04], eps=[0.0, 2e-4], transient=1, periods=1)
modules = [m for name, m in sys.modules.items() if name.startswith("vibrodrive.")]
named = [f for m in modules for f in vars(m).values() if not isinstance(f, type)]
marked = {id(f): f for f in named if isinstance(f, Marked)}.values()
formulas = [f.dispatcher for f in marked if hasattr(f.dispatcher, "nopython_signatures")]
literal = lambda s: any(isinstance(a, types.Literal) for a in s.args)
twice = {f.__name__ for f in formulas if any(map(literal, f.nopython_signatures))}
print(len(formulas), sorted(twice))
"""


@pytest.mark.jit
@pytest.mark.slow("17 s: compiles a kernel of each kind into an empty cache")
def test_no_formula_is_specialised_for_constants(tmp_path):
    """Only those decorated with `inline_each` or `part_each` (jit/compile.py) are compiled for each constant."""
    count, twice = python(CONSTANTS, NUMBA_CACHE_DIR=str(tmp_path), VIBRODRIVE_CODE="numba").split(" ", 1)
    assert int(count) > 100
    kernels = Path(vd.__file__).parent.glob("kernels/*.py")
    asked = {name for file in kernels for name in re.findall(r"_each\(.*\)\ndef (\w+)", file.read_text("utf-8"))}
    assert {"search", "process_event"} <= set(literal_eval(twice)) <= asked


@pytest.mark.jit
@pytest.mark.parametrize(
    "method",
    [
        dict(),
        dict(eps=3e-4),
        dict(method="muller", dtau=1e-5, tol=1e-7),
        dict(method="muller", dtau=3e-3, tol=1e-13),
        dict(method="muller", dtau=0.3, tol=1e-2),
    ],
)
@pytest.mark.parametrize("section_phase", [0.0, 4.0])
def test_batched_equals_single(method, section_phase):
    """For any incline and start, `simulate` equals a sweep, which advances motions together."""
    rng = np.random.default_rng(7)
    axes = {
        "A": [*rng.uniform(1, 3.3, 12), *rng.uniform(0, 30, 4), 0.9, 1.0, 1.1, 1.1000001],
        "B": [0.0, 0.1, 0.5, 0.97, 0.995, 1.2],
        "xi0": [0.0, 2.9],
        "dxi0": [0.0, -1.3, 3.5],
    }
    window = dict(**method, transient=15, periods=15, section_phase=section_phase)
    swept = vd.sweep(**axes, **window)
    for index in list(np.ndindex(*swept.status.shape))[::7]:
        point = {name: values[i] for (name, values), i in zip(axes.items(), index, strict=True)}
        assert same(swept, index, vd.simulate(**point, **window)), point


def test_lanes_are_aligned_to_cache_lines():
    for memory in new_lanes(3):
        assert not memory[:, 0].reshape(3, -1, STRIDE)[..., :LANES].any()
        assert all(part.ctypes.data % LINE == 0 for thread in memory for part in thread)


@pytest.mark.jit
@pytest.mark.parametrize("method", ["certified", "muller", "fixed"])
@pytest.mark.parametrize("n", [1, 5, 13])
def test_results_do_not_depend_on_memory_that_is_not_set(monkeypatch, method, n):
    """Each byte of a new array is 0x7F: numbers of 1e306, and indices that would end the process."""
    empty = np.empty

    def dirty(*args, **options):
        array = empty(*args, **options)
        ctypes.memset(array.ctypes.data, 0x7F, array.nbytes)
        return array

    def computed():
        window = dict(method=method, dtau=None if method == "certified" else 0.05, transient=2, periods=66)
        kinds = [("section", "impacts"), "summary", "error"]
        yield from (vd.sweep(A=np.linspace(2.9, 3.2, n), eps=[0.0, 3e-4], record=kind, **window) for kind in kinds)
        yield vd.simulate(A=3.04, eps=3e-4, **window)

    clean = [*computed()]
    monkeypatch.setattr(np, "empty", dirty)
    for one, other in zip(clean, computed(), strict=True):
        assert one == other if isinstance(one, vd.Trajectory) else same_arrays(one, other)


@pytest.mark.jit
@pytest.mark.parametrize("eps", [0.0, 3e-4])
def test_method_outside_the_engine_gives_the_same_bits(monkeypatch, eps):
    """Sweep with a method that kernels/engine.py lacks (not in IN_LANES): it computes the motions one by one."""
    arguments = dict(A=[1.5, 3.04, 3.1], eps=eps, method="muller", dtau=0.05, tol=1e-9, transient=3, periods=4)
    together = vd.sweep(**arguments)
    monkeypatch.setattr("vibrodrive.model.names.IN_LANES", ())
    monkeypatch.setattr("vibrodrive.batch.sweep.batch", None)
    apart = vd.sweep(**arguments)
    for name in ("section", "status", "margin", "switches"):
        assert np.array_equal(getattr(apart, name), getattr(together, name), equal_nan=True)


def test_memory_that_is_used_again_changes_no_bit():
    """A motion in fresh memory, one after others of other kinds, and one during another have the same bits.

    So have brief sweeps of one point, which also keep what they have returned.
    """
    from vibrodrive.batch import memory

    kinds = [dict(A=3.04), dict(A=0.5), dict(A=3.04, eps=3e-4), dict(A=2.2, method="fixed", dtau=0.01), dict(A=3.2)]
    fresh = []
    for kind in kinds:
        memory._idle.clear()
        fresh.append(vd.simulate(**kind, transient=3, periods=2))
    memory._idle.clear()
    with ThreadPoolExecutor(4) as pool:
        again = list(pool.map(lambda kind: vd.simulate(**kind, transient=3, periods=2), 20 * kinds))
    assert again == 20 * fresh
    assert 0 < sum(map(len, memory._idle.values())) <= 8  # of two sizes, and at most one for each thread
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("vibrodrive.batch.trajectory.fitting_rows", lambda periods, rows: 2)  # too few, so again with n
        assert [vd.simulate(**kind, transient=3, periods=2) for kind in kinds] == fresh
    assert {rows for _, rows in memory._idle} == {2, 80, 320}  # n depends on the motion: such memory is not kept
    memory._idle.clear()
    with ThreadPoolExecutor(4) as pool:
        swept = list(pool.map(lambda kind: vd.sweep(**kind, transient=3, periods=2, threads=1), 20 * kinds))
    assert 0 < len(memory._idle[2, 0]) <= 4  # at most one for each thread
    assert all(same(one, (), motion) for one, motion in zip(swept, again, strict=True))
    kept = again[0].section.copy()
    vd.simulate(2.5, transient=3, periods=2)
    assert np.array_equal(again[0].section, kept)
