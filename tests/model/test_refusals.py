"""Tests of the refusals of invalid arguments: one sentence with the key, the value and the allowed values.

A wrong argument of a public function never causes an error message of Python or NumPy, a hang, or a result.
"""

import decimal
import math
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import vibrodrive as vd
from vibrodrive.model.parameters import real_array
from vibrodrive.model.plan import make_plan

SHORT = dict(transient=1, periods=3)
JUDGED = dict(transient=20, periods=10)
SCENE = dict(a0=0.004, omega0=150.0, mu=0.6, alpha=10.0, mass=250.0)
IN_SI = vd.Scene(**SCENE)

NOT_NUMBERS = [
    True, "3", "", "x" * 500, b"3", 3 + 1j, decimal.Decimal(3), {}, {"a": 1}, set(), object(), float, len, ...,
    slice(1), iter([3.0]), np.array(["a"]), np.array([None]), np.datetime64("2020"), [None], ["a"], [[3], [3, 4]],
    np.timedelta64(3, "ns"), pd.NA, xr.Dataset({"A": 3.0}),
    xr.DataArray(3.0, attrs={"units": "mm"}),
]  # fmt: skip
MASKED = [np.ma.masked, np.ma.array(3.0, mask=True)]
OUTSIDE = [*MASKED, math.nan, math.inf, -math.inf, 10**400, -(10**400), 10**5000, Fraction(10**400, 3)]
SEQUENCES = [[], (), [3.0, 3.1], [[3.0]], np.array([]), np.zeros((20, 2)), range(3), range(10**15)]
NUMBER = [None, *NOT_NUMBERS, *OUTSIDE, *SEQUENCES, -1.0]
OPTIONAL = [*NOT_NUMBERS, *OUTSIDE, *SEQUENCES]
COUNT = [*OPTIONAL, None, 0, -1, 2.0, 2**70]
AXIS = [*NOT_NUMBERS, *OUTSIDE, [], (), [[3.0]], np.zeros((20, 2)), range(10**15), [3.0, math.nan], [3.0, "3"], -1.0]
TEXT = [None, True, 3, 3.0, math.nan, b"3", "", "newton", [], ["eps"], {}, set(), object(), np.zeros((20, 2)), str]

REFUSED = {
    "simulate A": ("A", lambda v: vd.simulate(A=v, **SHORT), NUMBER),
    "simulate B": ("B", lambda v: vd.simulate(A=3, B=v, **SHORT), [*OPTIONAL, -1.0]),
    "simulate dxi0": ("dxi0", lambda v: vd.simulate(A=3, dxi0=v, **SHORT), OPTIONAL),
    "simulate dtau": ("dtau", lambda v: vd.simulate(A=3, method="fixed", dtau=v, **SHORT), [*OPTIONAL, 0.0]),
    "simulate method": ("method", lambda v: vd.simulate(A=3, method=v), TEXT),
    "simulate periods": ("periods", lambda v: vd.simulate(A=3, periods=v), [*COUNT, 10**12]),
    "simulate budget": ("budget", lambda v: vd.simulate(A=3, budget=v), COUNT),
    "sample": ("points_per_period", lambda v: vd.simulate(A=3, **SHORT).sample(v), COUNT),
    "sample of many": ("points_per_period", lambda v: vd.simulate(A=1, periods=10**5).sample(v), [10**8]),
    "sweep A": ("A", lambda v: vd.sweep(A=v, **SHORT), [None, *AXIS]),
    "sweep eps": ("eps", lambda v: vd.sweep(A=[3, 3.1], eps=v, **SHORT), AXIS),
    "sweep threads": ("threads", lambda v: vd.sweep(A=[3], threads=v), [*OPTIONAL, 0, -1, 2.0, 10**6]),
    "sweep overwrite": ("overwrite", lambda v: vd.sweep(A=[3], overwrite=v), [3, None, "yes", np.zeros(2)]),
    "sweep record": ("record", lambda v: vd.sweep(A=[3], record=v), [
        ["section", "section"], "sections", (), [], "summary,impacts", 1, None, [1]
    ]),
    "sweep executor": ("executor", lambda v: vd.sweep(A=[3], executor=v), [*OPTIONAL, 3, ThreadPoolExecutor]),
    "select": ("A", lambda v: swept().select(A=v), [*NUMBER, 99, 2.9, 3.05, 3.1 + 1e-12]),
    "select the one": ("eps", lambda v: swept().select(eps=v), [*NUMBER, 1e-4]),
    "select nearest": ("A", lambda v: swept().select(A=v, method="nearest", tolerance=0.01), [*NUMBER, 3.05, 2.98]),
    "select method": ("method", lambda v: swept().select(A=3, method=v), TEXT[1:]),
    "select tolerance": ("tolerance", lambda v: swept().select("nearest", v, A=3), [*NOT_NUMBERS, -1.0, math.nan]),
    "select exactly within": ("tolerance", lambda v: swept().select(A=3, tolerance=v), [0.1]),
    "points": ("points", lambda v: vd.sweep(A=3, points=v, **SHORT), [
        3, "eps", [], {}, {"eps": [0, 1e-4], "xi0": [1]}, [("eps", [0.0])]
    ]),
    "points.eps": (r"points\.eps", lambda v: vd.sweep(A=3, points={"eps": v}, **SHORT), [0.1, None, [], [[1]], [-1.0]]),
    "key of points": ("key of points", lambda v: vd.sweep(A=3, points={v: [1.0]}, **SHORT), ["mu", "periods", 3]),
    "points beside": ("A", lambda v: vd.sweep(A=v, points={"A": [1.0]}, **SHORT), [3.0, [3.0]]),
    "load": ("path", vd.load, [*(v for v in NUMBER if not (isinstance(v, str) and v)), 3, "a\0b", "a\nb"]),
    "limit A": ("A", lambda v: vd.limit(v, **JUDGED), NUMBER),
    "limit B": ("B", lambda v: vd.limit(3.04, B=v, **JUDGED), [*OPTIONAL, -1.0]),
    "limit disturbance": ("disturbance", lambda v: vd.limit(3.04, v, **JUDGED), [*TEXT, "B", "tau0"]),
    "limit method": ("method", lambda v: vd.limit(3.04, method=v, **JUDGED), TEXT[1:]),
    "limit dtau": ("method", lambda v: vd.limit(3.04, "dtau", v, **JUDGED), ["certified"]),
    "limit criterion": ("criterion", lambda v: vd.limit(3.04, criterion=v, **JUDGED), [
        *TEXT[1:], "shape", "rho < 0.5", "impacts or gaps", "order and gaps"
    ]),
    "limit eps": ("eps", lambda v: vd.limit(3.04, eps=v, **JUDGED), [*OPTIONAL, 1e-4]),
    "limit periods": ("periods", lambda v: vd.limit(3.04, transient=20, periods=v), [*COUNT, 1]),
    "limit of many periods": ("periods", lambda v: vd.limit(3.04, transient=20, periods=v), [10**12]),
    "limit threads": ("threads", lambda v: vd.limit(3.04, threads=v, **JUDGED), [*OPTIONAL, 0, 10**6]),
    "orbits A": ("A", vd.orbits, NUMBER),
    "orbits max_period": ("max_period", lambda v: vd.orbits(3.04, max_period=v), COUNT),
    "bifurcations A": ("A", vd.bifurcations, [None, *NOT_NUMBERS, *OUTSIDE, [], 3, (3.1, 3.0), (1, 2, 3), range(3)]),
    "bifurcations from": ("A", lambda v: vd.bifurcations((v, 3.0)), NUMBER),
    "bifurcations to": ("A", lambda v: vd.bifurcations((3.0, v)), NUMBER),
    "bifurcations step": ("step", lambda v: vd.bifurcations((2.5, 2.51), step=v), [*OPTIONAL, 0.0, -1.0, 1e-9]),
    "impact_map A": ("A", vd.impact_map, NUMBER),
    "impacts": ("phi", vd.impact_map(3.04), [None, *NOT_NUMBERS, *OUTSIDE, range(10**15), [1.0, math.nan], 1e13]),
    "Scene omega0": ("omega0", lambda v: vd.Scene(**{**SCENE, "omega0": v}), [*NUMBER[1:], 0]),  # None means missing
    "Scene a0": ("a0", lambda v: vd.Scene(**{**SCENE, "a0": v}), NUMBER),
    "Scene mu": ("mu", lambda v: vd.Scene(**{**SCENE, "mu": v}), [*NUMBER, 0]),
    "Scene mass": ("mass", lambda v: vd.Scene(**{**SCENE, "mass": v}), [*NUMBER[1:], 0]),
    "Scene g": ("g", lambda v: vd.Scene(**{**SCENE, "g": v}), [*NUMBER, 0]),
    "Scene alpha": ("alpha", lambda v: vd.Scene(**{**SCENE, "alpha": v}), [*NUMBER, 90]),
    "beyond doubles": ("A", lambda v: vd.simulate(A=vd.Scene.quiet(**{**SCENE, **v}).A), [
        {"omega0": 1e300}, {"a0": 1e300, "omega0": 1e9}, {"mu": 1e-300, "alpha": 0.0}, {"mu": 5e-324, "g": 5e-324}
    ]),
    "length": ("xi", IN_SI.length, [None, *NOT_NUMBERS, range(10**15)]),
    "force": ("h", IN_SI.force, [None, *NOT_NUMBERS]),
}  # fmt: skip
"""By the name of a test: the key that the message names, the call, and the refused values."""


def swept():
    return vd.sweep(A=[3.0, 3.1], eps=[0.0], **SHORT)


@pytest.mark.integration
@pytest.mark.parametrize("name", REFUSED)
def test_refusal_names_the_key_the_value_and_the_allowed_values(name):
    key, call, values = REFUSED[name]
    for value in values:
        with pytest.raises((TypeError, ValueError), match=rf"^{key}(\[\d+\])? = .+: must be .+$") as caught:
            print(name, type(value), call(value))  # this line is printed only if no error was raised
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 300


@pytest.mark.integration
def test_refusal_shows_the_given_value_and_public_names_only():
    told = r'^A = array of length 2: must be one number \(for axes use `sweep` with record = "limit"\)$'
    with pytest.raises(TypeError, match=told):
        vd.limit([3, 3.1])
    with pytest.raises(TypeError, match=r"^B = array of length 2: must be one number \(for axes"):
        vd.limit(3.04, B=[0.1, 0.2])
    with pytest.raises(ValueError, match=r"^A = 99: must be one of the 2 values of this axis; method=.* 3\.1$"):
        swept().select(A=99)
    with pytest.raises(ValueError, match=r"^eps = 0\.1: must be 0\.0, the one value of this axis; method="):
        swept().select(eps=0.1)
    with pytest.raises(
        ValueError, match=r"^A = 99: must be within 0\.5 of one of the 2 values .* the nearest is 3\.1$"
    ):
        swept().select("nearest", 0.5, A=99)
    with pytest.raises(ValueError, match=r"^points = 2 of A, 1 of eps: must be sequences of one length, .*$"):
        vd.sweep(points={"A": [3, 3.1], "eps": [0]})
    with pytest.raises(ValueError, match=r"^periods = 1000000000000: must be .* take 96\.0 TB, .* are available$"):
        vd.simulate(A=3.04, periods=10**12)


class Quantity(np.ndarray):
    """An array with a unit, as in astropy: NumPy drops the unit."""

    unit = "mm"


class Measure:
    """A number or an array with a unit, as in pint: it converts itself to an array, with a warning at most."""

    units = "millimeter"

    def __init__(self, magnitude):
        self.magnitude = magnitude

    def __array__(self, dtype=None, copy=None):
        return np.asarray(self.magnitude)


LOSING = [
    (np.ma.masked_greater([0.003, 999.0], 100), r"a0\[1\] = masked: must be"),
    ([0.003, np.ma.masked], r"a0\[1\] = masked: must be"),
    ([0.003, True], r"a0\[1\] = True: must be"),
    ([0.003, "0.004"], r"a0\[1\] = '0\.004': must be"),
    ([0.003, decimal.Decimal("0.004")], r"a0\[1\] = Decimal\('0\.004'\): must be"),
    ([0.003, pd.NA], r"a0\[1\] = <NA>: must be"),
    (pd.Series([0.003, None], dtype="Float64"), r"a0\[1\] = nan: must be"),
    (np.array([3, 4], "m8[ns]"), r"a0\[0\] = .*: must be"),
    (np.array([0.8]).view(Quantity), r"a0 = Quantity\(\[0\.8\]\): must be .*, without a unit, in m$"),
    ([np.array(0.8).view(Quantity)], r"a0\[0\] = Quantity\(0\.8\): must be .*, without a unit, in m$"),
    (Measure([0.8]), r"a0 = .*: must be .*, without a unit, in m$"),
    ([Measure(0.8)], r"a0\[0\] = .*: must be .*, without a unit, in m$"),
    (xr.DataArray([0.8], attrs={"units": "mm"}), r"a0 = .*: must be .*, without a unit, in m$"),
]
"""Values of a0 in m of which a conversion to an array would lose a mask, a type or a unit, and the refusals."""


@pytest.mark.parametrize(("value", "told"), LOSING)
def test_nothing_is_lost_in_a_conversion_to_numbers(value, told):
    with pytest.raises((TypeError, ValueError), match=f"^{told}"):
        make_plan({"a0": value, "omega0": 150.0, "mu": 0.6, "alpha": 10.0})
    with pytest.raises((TypeError, ValueError), match=r"^A(\[\d\])? = .*: must be "):
        make_plan({"A": value})
    with pytest.raises((TypeError, ValueError), match=r"^points\.A(\[\d\])? = .*: must be "):
        make_plan({"points": {"A": value}})


TAKEN = [
    3.0, np.float32(3.0), np.array(3.0), np.ma.array(3.0), xr.DataArray(3.0), xr.DataArray(3, attrs={"units": "1"}),
    Fraction(3), [3.0, 3.5], (np.float32(3.0), Fraction(7, 2)), np.array([3.0, 3.5], object), np.ma.array([3.0, 3.5]),
    pd.Series([3.0, 3.5], index=[5, 7]), pd.array([3.0, 3.5]), pd.Index([3.0, 3.5]),
    xr.DataArray([3.0, 3.5], dims="A", coords={"A": [5, 7]}), [xr.DataArray(3.0), np.array(3.5)],
]  # fmt: skip


@pytest.mark.parametrize("value", TAKEN, ids=str)
def test_numbers_of_every_library_are_taken(value):
    plan = make_plan({"A": value})
    wanted = [3.0, 3.5] if np.ndim(value) else [3.0]
    assert plan.points(0, plan.n_points)[:, 0].tolist() == wanted
    assert list(plan.axes) == ["A"] * np.ndim(value)


def test_arrays_keep_their_mask_their_labels_and_their_missing_values_in_si_units():
    series = pd.Series([1.0, None], index=["a", "b"], dtype="Float64")
    assert IN_SI.length(series).isna().tolist() == [False, True]
    assert list(IN_SI.length(series).index) == ["a", "b"]
    assert IN_SI.length(np.ma.masked_greater([1.0, 9.0], 5)).mask.tolist() == [False, True]
    assert IN_SI.length(xr.DataArray([1.0], coords={"x": [3]}, dims="x")).x == 3


def test_lists_in_lists_have_a_depth():
    nested = [3.0]
    for _ in range(10_000):
        nested = [nested]
    with pytest.raises(TypeError, match=r"^A(\[0\])* = .*: must be numbers$"):
        real_array("A", nested, "numbers")


def test_points_with_labels_in_another_order_are_refused():
    """pandas and xarray align values by label, this program by position."""
    A, eps = pd.Series([3.0, 3.1], index=[5, 7]), pd.Series([0.0, 1e-4], index=[7, 5])
    for labelled in (eps, eps.to_xarray()):
        with pytest.raises(ValueError, match=r"^points\.eps = .*: must be in the order of the labels of points\.A, or"):
            make_plan({"points": {"A": A, "eps": labelled}})
    for other in (eps[A.index], eps.to_numpy(), [1e-4, 0.0]):
        assert list(make_plan({"points": {"A": A, "eps": other}}).together) == ["A", "eps"]


@pytest.mark.jit
def test_too_few_periods_are_refused():
    """The comparison omits the first and the last impact of a record. The other impacts must cover the orbit twice."""
    with pytest.raises(ValueError, match=r"^periods = 1: must be >= 4 \(4 times the period .* at A = 1.5\)$"):
        vd.limit(A=1.5, periods=1, transient=10)
    with pytest.raises(ValueError, match=r"^periods = 15: must be >= 16 \(4 times the period .* at A = 3.1\)$"):
        vd.limit(A=3.1, periods=15, transient=10)
    assert vd.limit(A=3.1, periods=16, transient=10).k2 > 1e-6
