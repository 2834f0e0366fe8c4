"""No number depends on the functions of libm or NumPy whose last bits differ between machines."""

import ast
import math
import platform
import re

import mpmath
import numba
import numpy as np
import pytest

from tests.support.process import ROOT, python
from vibrodrive.jit.trig import log
from vibrodrive.model import physical
from vibrodrive.model.spacing import geometric

WITHOUT_FMA = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"
OF_LIBM = "import math; print([f(0.01 * k) for f in (math.sin, math.tan, math.log, math.exp) for k in range(1, 9999)])"

NUMBERS = """
import numpy as np
import vibrodrive as vd
np.set_printoptions(threshold=10**9, floatmode="unique")
scene = vd.Scene(a0=0.8e-3, frequency=25.154, mu=0.6, alpha=3.4)
print(scene.A, scene.B, vd.simulate(scene=scene, transient=50, periods=30).describe())
r = vd.sweep(frequency=np.linspace(24, 26, 200), alpha=[0.0, 3.4, 60.0], a0=1e-3, mu=0.6, transient=20, periods=40,
             record="summary")
print([np.array(r[q.name]) for q in r.quantities])
print(list(vd.orbits(3.1, max_period=4)), vd.bifurcations((2.5, 2.7), max_period=1))
print(vd.limit(2.4, transient=50, periods=60))
from vibrodrive.model.spacing import geometric
print(geometric(1.3, 7.7, 2000))
"""


@pytest.mark.jit
def test_bits_are_the_same_with_the_functions_of_another_libm():
    """glibc takes other versions of its functions on processors without FMA."""
    if (platform.libc_ver()[0], platform.machine()) != ("glibc", "x86_64"):
        pytest.skip("only glibc on x86-64 can be told to take its other functions")
    if python(OF_LIBM) == python(OF_LIBM, GLIBC_TUNABLES=WITHOUT_FMA):
        pytest.skip("on this processor glibc has no other functions")
    here, there = python(NUMBERS), python(NUMBERS, GLIBC_TUNABLES=WITHOUT_FMA)
    assert here.count("\n") > 100
    assert here == there


VARY = (
    r"(math|np)\.(a?(rc)?(sin|cos|tan)h?2?|exp|exp2|expm1|log|log2|log10|log1p|pow|\w*power|hypot|cbrt|(geom|log)space)"
)
DRAWN = {"figures", "explorer"}  # what these compute is only seen
ALLOWED = {"math.atan", "Fraction(1.15) ** k"}  # for curves of figures; exact


def test_no_module_that_computes_calls_functions_that_vary():
    home, found = ROOT / "vibrodrive", set()
    for path in (p for p in home.rglob("*.py") if p.relative_to(home).parts[0] not in DRAWN):
        for node in ast.walk(ast.parse(path.read_text())):
            power = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow)
            called = isinstance(node, ast.Attribute) and re.fullmatch(VARY, ast.unparse(node))
            if called or (power and not isinstance(node.left, ast.Constant)):
                found.add(ast.unparse(node))
    assert found == ALLOWED


@numba.njit(error_model="numpy")
def compiled(x):
    return log(x)


@pytest.mark.jit
def test_logarithm_is_accurate_and_compiled_to_the_same_bits():
    draw = np.random.default_rng(1)
    values = [*10.0 ** draw.uniform(-3, 3, 2000), *10.0 ** draw.uniform(-307, 307, 50), 5e-324, 1.7e308, 1 - 2**-53]
    with mpmath.workdps(40):
        for x in map(float, values):
            assert log(x) == compiled(x)
            assert abs(log(x) - mpmath.log(x)) < 0.8 * math.ulp(log(x))
    assert (log(1.0), log(math.inf)) == (0.0, math.inf)


def test_functions_of_a_scene_and_powers_are_rounded_correctly():
    with mpmath.workdps(60):
        for degrees in [5e-324, 1e-9, 89.99999999999999, *np.random.default_rng(2).uniform(0, 90, 300).tolist()]:
            x = mpmath.mpf(math.radians(degrees))
            assert physical._cosine_and_tangent(degrees) == (float(mpmath.cos(x)), float(mpmath.tan(x)))
    assert geometric(1e-300, 1e300, 601).tolist() == [float(f"1e{k}") for k in range(-300, 301)]
