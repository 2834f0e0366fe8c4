"""Refusals: one sentence with the key, the value and the allowed values, before anything is computed.

A wrong argument, key or option never causes a message of Python or NumPy, a hang, or a result. VALUES contains wrong
values for each kind of argument, SENTENCES one sentence of each kind, with the call or the configuration.
"""

import decimal
import inspect
import math
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib.figure import Figure

import vibrodrive as vd
from tests.support import fake
from vibrodrive.batch.block import gather
from vibrodrive.figures.drawing import choose_configured
from vibrodrive.figures.style import save
from vibrodrive.model.config import parse, read
from vibrodrive.model.parameters import real_array
from vibrodrive.model.plan import make_plan

SHORT = dict(transient=1, periods=3)
JUDGED = dict(transient=20, periods=10)
SCENE = dict(a0=0.004, omega0=150.0, mu=0.6, alpha=10.0, mass=250.0)
IN_SI = vd.Scene(**SCENE)
CLIENT = SimpleNamespace(submit=len, get_executor=len)  # of Dask: its `submit` returns other futures

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

VALUES = {
    "simulate A": ("A", lambda v: vd.simulate(A=v, **SHORT), NUMBER),
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
    "sweep executor": ("executor", lambda v: vd.sweep(A=[3], executor=v), [
        *OPTIONAL, 3, ThreadPoolExecutor, CLIENT, SimpleNamespace(submit=lambda *_: 3)
    ]),
    "select": ("A", lambda v: swept().select(A=v), [*NUMBER, 99, 2.9, 3.05, 3.1 + 1e-12]),
    "select nearest": ("A", lambda v: swept().select(A=v, method="nearest", tolerance=0.01), [*NUMBER, 3.05, 2.98]),
    "select a nearest one": ("A", lambda v: swept().select("nearest", A=v), [None, "3", math.nan, math.inf]),
    "select method": ("method", lambda v: swept().select(A=3, method=v), TEXT[1:]),
    "select tolerance": ("tolerance", lambda v: swept().select("nearest", v, A=3), [*NOT_NUMBERS, -1.0, math.nan]),
    "select exactly within": ("tolerance", lambda v: swept().select(A=3, tolerance=v), [0.1]),
    "points": ("points", lambda v: vd.sweep(A=3, points=v, **SHORT), [
        3, "eps", [], {}, {"eps": [0, 1e-4], "xi0": [1]}, [("eps", [0.0])]
    ]),
    "points.eps": (r"points\.eps", lambda v: vd.sweep(A=3, points={"eps": v}, **SHORT), [0.1, None, [], [[1]], [-1.0]]),
    "key of points": ("key of points", lambda v: vd.sweep(A=3, points={v: [1.0]}, **SHORT), ["g", "periods", 3]),
    "load": ("path", vd.load, [*(v for v in NUMBER if not (isinstance(v, str) and v)), 3, "a\0b", "a\nb"]),
    "limit A": ("A", lambda v: vd.limit(v, **JUDGED), NUMBER),
    "limit disturbance": ("disturbance", lambda v: vd.limit(3.04, v, **JUDGED), [*TEXT, "B", "tau0"]),
    "limit method": ("method", lambda v: vd.limit(3.04, method=v, **JUDGED), TEXT[1:]),
    "limit dtau": ("method", lambda v: vd.limit(3.04, "dtau", v, **JUDGED), ["certified"]),
    "limit eps": ("eps", lambda v: vd.limit(3.04, eps=v, **JUDGED), [*OPTIONAL, 1e-4]),
    "limit periods": ("periods", lambda v: vd.limit(3.04, transient=20, periods=v), [*COUNT, 1, 10**12]),
    "limit threads": ("threads", lambda v: vd.limit(3.04, threads=v, **JUDGED), [*OPTIONAL, 0, 10**6]),
    "orbits A": ("A", vd.orbits, NUMBER),
    "orbits max_period": ("max_period", lambda v: vd.orbits(3.04, max_period=v), COUNT),
    "bifurcations A": ("A", vd.bifurcations, [None, *NOT_NUMBERS, *OUTSIDE, [], 3, (3.1, 3), (3, 3), (1, 2, 3)]),
    "bifurcations from": ("A", lambda v: vd.bifurcations((v, 3.0)), NUMBER),
    "bifurcations to": ("A", lambda v: vd.bifurcations((3.0, v)), NUMBER),
    "bifurcations step": ("step", lambda v: vd.bifurcations((2.5, 2.51), step=v), [*OPTIONAL, 0.0, -1.0, 1e-9]),
    "impact_map A": ("A", vd.impact_map, NUMBER),
    "impacts": ("phi", vd.impact_map(3.04), [None, *NOT_NUMBERS, *OUTSIDE, range(10**15), [1.0, math.nan], 1e13]),
    "Scene omega0": ("omega0", lambda v: vd.Scene(**{**SCENE, "omega0": v}), [*NUMBER[1:], 0]),  # None means missing
    "Scene a0": ("a0", lambda v: vd.Scene(**{**SCENE, "a0": v}), NUMBER),
    "Scene mass": ("mass", lambda v: vd.Scene(**{**SCENE, "mass": v}), [*NUMBER[1:], 0]),
    "Scene alpha": ("alpha", lambda v: vd.Scene(**{**SCENE, "alpha": v}), [*NUMBER[1:], 90]),
    "beyond doubles": ("A", lambda v: vd.simulate(A=vd.Scene.quiet(**{**SCENE, **v}).A), [
        {"omega0": 1e300}, {"a0": 1e300, "omega0": 1e9}, {"mu": 1e-300, "alpha": 0.0}, {"mu": 5e-324, "g": 5e-324}
    ]),
    "length": ("xi", IN_SI.length, [None, *NOT_NUMBERS, range(10**15)]),
}  # fmt: skip
"""By the name of a test: the key that the message names, the call, and the refused values."""


def swept():
    return vd.sweep(A=[3.0, 3.1], eps=[0.0], **SHORT)


def refusal(call, *arguments):
    """Return the sentence with which a call is refused."""
    with pytest.raises((AttributeError, TypeError, ValueError)) as caught:
        print(call(*arguments))  # this line is printed only if no error was raised
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.integration
@pytest.mark.parametrize("name", VALUES)
def test_wrong_values_are_named_with_the_allowed_values(name):
    key, call, values = VALUES[name]
    for value in values:
        told = refusal(call, value)
        assert re.match(rf"{key}(\[\d+\])? = .+: must be .+$", told), (type(value), told)
        assert len(told) < 300


ONE = "[sweep]\nA = 3.04\n"
WHOLE = "[physical]\na0 = 1e-3\nomega0 = 150\nmu = 0.6\nalpha = 3\n"
NO_OMEGA0 = WHOLE.replace("omega0 = 150\n", "")
POINTS = "[sweep]\neps = 0.0\n[sweep.points]\nA = {start = 1, stop = 2, num = 5}\n"
RANGE = "[sweep]\nA = {start = 1, stop = 2, %s}\n"
NUMBERS = "must be a number >= 0 and <= 1e+09"
FROM_SCENE = "must be left out, because it follows from the scene"

CONFIGURATIONS = [
    ("[modl]\nB = 1\n", "table = 'modl': must be one of title, model, physical, … Did you mean model?"),
    ("B = 1\n", "table = 'B': must be one of … orbits. It is a key of [model] or [sweep]"),
    ("model = 3\n", "model = 3: must be a table [model]"),
    ("[model]\nbeta = 1\n", "key of [model] = 'beta': must be one of A, B, … Did you mean eta?"),
    ("[model]\nA = [1, 2]\n", f"A = [1, 2]: {NUMBERS}"),
    ("[model]\nA = 1\n[sweep]\nA = 2\n", "sweep.A = 2: must be left out, because [model] already gives A"),
    ("[model]\nB = 0.1\n", f"A is missing: must be given, {NUMBERS[8:]}"),
    ("[sweep]\nA = '3'\n", f"sweep.A = '3': {NUMBERS}"),
    ("[sweep]\nA = 1979-05-27\n", f"sweep.A = datetime.date(1979, 5, 27): {NUMBERS}"),
    ("[sweep]\nA = []\n", "sweep.A = []: must be an axis with at least one value"),
    ("[sweep]\nA = [1, true]\n", f"sweep.A[1] = True: {NUMBERS}"),
    ("[sweep]\nperiods = 3\n", "key of [sweep] = 'periods': … points. It is a key of [run] or [trajectory]"),
    (RANGE % "nun = 3", "key of sweep.A = 'nun': must be one of start, stop, num, scale. Did you mean num?"),
    (RANGE % "step = 0.1", "sweep.A.step = 0.1: must be replaced by num, the number of values, here 11"),
    (RANGE % "step = 0.3", "sweep.A.step = 0.3: must be replaced by num, the number of values"),
    (RANGE % "step = '1'", "sweep.A.step = '1': must be replaced by num, the number of values"),
    (RANGE % "scale = 'log'", "sweep.A.num is missing: must be given, because a range needs start, stop and num"),
    (RANGE % "num = 0", "sweep.A.num = 0: must be an integer >= 1"),
    (RANGE % "num = 1", "sweep.A.num = 1: must be >= 2, because a range contains both … (one value is … A = 1.0)"),
    (RANGE.replace("2", "inf") % "num = 3", f"sweep.A.stop = inf: {NUMBERS}"),
    (RANGE % "num = 3, scale = 'cubic'", "sweep.A.scale = 'cubic': must be one of linear, log"),
    (RANGE.replace("1", "0") % "num = 3, scale = 'log'", 'sweep.A.start = 0.0: must be a number > 0 with scale = …'),
    (RANGE % f"num = {10**12}", f"sweep.A.num = {10**12}: must be small enough for memory; … TB, and … available"),
    (ONE + "[switching]\nmethod = 'fixed'\n", "dtau is missing: must be given for method = 'fixed', a number >= …"),
    (ONE + "[run]\nrecord = ['section', 'section']\n", "record = ['section', 'section']: … each of them once"),
    (ONE + "[figure]\nkind = ['pie']\n", "figure.kind = ['pie']: must be one of bifurcation, poincare, map, bands"),
    (ONE + "[figure]\ncolour = 'red'\n", "key of [figure] = 'colour': must be one of kind, …"),
    (ONE + "[figure]\nlimits = [1, 1]\n", "figure.limits = [1, 1]: must be two numbers in ascending order"),
    (ONE + "[figure]\nlimits = ['a', 'b']\n", "figure.limits = ['a', 'b']: must be two numbers in ascending order"),
    (ONE + "[trajectory]\ncurves = [['time']]\n", "trajectory.curves = [['time']]: must be a list of one or more of …"),
    (ONE + "[trajectory]\ncurves = 'phase'\n", "trajectory.curves = 'phase': must be a list of one or more of …"),
    ("title = 3\n" + ONE, "title = 3: must be a string"),
    ('title = "a\\nb"\n' + ONE, r"title = 'a\nb': must be one line, without control characters"),
    (".".join("a" * 20_000) + " = 1\n", "invalid TOML: a key must have at most 100 parts"),
    ("[sweep]\nA = 1\nA = 2\n", "invalid TOML: … (at line 3, …"),
    (RANGE.replace("1", "1,5") % "num = 3", "invalid TOML: … (at line 2, …. Write 1.5 for 1,5"),
    (f"[sweep]\nA = {'9' * 4400}\n", "invalid TOML: an integer has too many digits"),
    ("[sweep]\npoints = 3\n", "sweep.points = 3: must be a table [sweep.points]"),
    (POINTS + "B = 0.1\n", "sweep.points.B = 0.1: must be several values (give one number outside of points)"),
    (POINTS + "mu = {start = 1, stop = 2, num = 5}\n", "physical.omega0 is missing: must be given, because …"),
    (WHOLE + "[sweep.points]\nA = [1]\n", "sweep.points.A = [1]: must be left out, because [physical] already gives A"),
    (NO_OMEGA0.replace("a0 = 1e-3", "") + "[sweep.points]\nomega0 = [9]\nA = [2]\n", "physical.a0 is missing: …"),
    (POINTS + "B = [0.1]\n", "points = 5 of A, 1 of B: must be sequences of one length, …"),
    (POINTS + "B = [0.1, -1]\n", f"sweep.points.B[1] = -1: {NUMBERS}"),
    (WHOLE + "[sweep]\nmu = [0.5]\n", "sweep.mu = [0.5]: must be left out, because [physical] already gives mu"),
    (WHOLE + "[sweep]\nA = 1\n", "sweep.A = 1: must be left out, because [physical] already gives A"),
    (NO_OMEGA0 + "[sweep]\nomega0 = [1]\nB = 1\n", "sweep.B = 1: must be left out, because [physical] already gives B"),
    (NO_OMEGA0 + "[sweep]\neps = [0]\n", "physical.omega0 is missing: must be given, because a scene needs …"),
    ("[sweep]\nomega0 = [100, 200]\n", "physical.mu is missing: must be given, because a scene needs …"),
    (NO_OMEGA0.replace("a0 = 1e-3", "") + "[sweep]\nomega0 = [9]\nA = 2\n", "physical.a0 is missing: …"),
    ("[physical]\nomega0 = 9\nmu = 0.6\nalpha = 3\n", f"A is missing: must be given, {NUMBERS[8:]}"),
    (NO_OMEGA0 + "[sweep]\nomega0 = [100, 0]\n", "sweep.omega0[1] = 0: must be a finite number > 0"),
    (NO_OMEGA0 + "[sweep]\ng = [9, 10]\n", "key of [sweep] = 'g': must be one of A, B, …"),
    (WHOLE.replace("= 3", "= 90"), "physical.alpha = 90: must be an angle in degrees >= 0 and < 90"),
    (WHOLE.replace("1e-3", "-1e-3"), "physical.a0 = -0.001: must be a finite number >= 0"),
    (NO_OMEGA0 + "[sweep]\nomega0 = [1e9, 1]\n", "A = …, computed from a0 = 0.001, omega0 = 1e+09, … <= 1e+09"),
    ("[physical]\nomega0 = 1\nalpha = 3\n[sweep]\nmu = [1, 1e-12]\nA = 1\n",
     "B = …, computed from mu = 1e-12, alpha = 3: … <= 1e+09"),
]  # fmt: skip
"""Configurations and the sentences that refuse them. An ellipsis stands for any text."""

OPTIONS = [
    ("periods", "--set = 'periods': must be KEY=VALUE or TABLE.KEY=VALUE"),
    ("run.=3", "--set = 'run.=3': must be KEY=VALUE or TABLE.KEY=VALUE"),
    ("transiet=3", "key of --set = 'transiet': must be one of A, … max_period. Did you mean transient?"),
    ("zzz=3", "key of --set = 'zzz': must be one of A, … max_period"),
    ("run.peroids=3", "key of [run] = 'peroids': must be one of … record. Did you mean periods?"),
    ("run=3", "--set = 'run=3': must be TABLE.KEY=VALUE"),
    ("A=3,4", "A = '3,4': must be a number with a decimal point, or a list such as A=[0.5, 1]"),
    ("A=[3,04]", "A = '[3,04]': must be a number with a decimal point, or a list such as A=[0.5, 1]"),
    ("sweep.A = 3, .5", "sweep.A = '3, .5': must be a number with a decimal point, or a list such as sweep.A=[0.5, 1]"),
    (f"periods={'9' * 4400}", "periods = '9…9 …: must be an integer >= 1"),
    ("figure.quantity=power", "figure.quantity = 'power': must be one of … Did you mean impact_power?"),
    ("A=1\nB=2", r"--set = 'A=1\nB=2': must be one KEY=VALUE"),
    ("run.periods.x=3", "--set = 'run.periods.x=3': must be a key of a table, but periods is not a table"),
    ("title=\udcff", r"title = '\udcff': must be one line, without control characters"),
]

NAMES = ", ".join(inspect.signature(vd.simulate).parameters)

OF_ORBITS = "must be one of A, a0, omega0, frequency, alone or with one of B, mu, alpha"

CALLS = [
    (lambda: vd.simulate(3.0, 0.1), "arguments without a name = (3.0, 0.1): must be at most 1 (A); …"),
    (lambda: vd.sweep([3.0]), "arguments without a name = ([3.0],): must be none; give each by name, such as A = …"),
    (lambda: vd.simulate(transiant=3), f"argument = 'transiant': must be one of {NAMES}. Did you mean transient?"),
    (lambda: vd.limit(3.0, bogus=3), "argument = 'bogus': must be one of A, disturbance, …, g"),
    (lambda: vd.sweep(B=0.1), f"A is missing: must be given, {NUMBERS[8:]}"),
    (lambda: vd.impact_map(a0=1e-3), "omega0 is missing: must be given, because a scene needs …"),
    (lambda: vd.plot.cobweb(a0=1e-3), "argument = 'a0': must be given by a scene, as scene = vd.Scene(a0=…, …)"),
    (lambda: vd.simulate(IN_SI), "A = Scene(a0=…: must be given by name, as scene=…"),
    (lambda: vd.sweep(A=3, B=IN_SI), "B = Scene(a0=…: must be given by name, as scene=…"),
    (lambda: vd.simulate(A=[3.0, 3.1]), "A = array of length 2: must be one number (for an axis use `sweep`)"),
    (lambda: vd.limit(3, B=[0.1, 0.2]), "B = array of length 2: must be one number (for axes use `sweep` with …"),
    (lambda: vd.simulate(A=3, periods=10**12), f"periods = {10**12}: must be … take 96.0 TB, and … are available"),
    (lambda: vd.sweep(A=3.0, dtau=[0.1]), "dtau = [0.1]: must be left out with … used by fixed and muller only"),
    (lambda: vd.sweep(A=3.0, points={"dtau": [0.1]}), "dtau = [0.1]: must be left out with method = 'certified', …"),
    (lambda: vd.simulate(3.0, method="fixed", dtau=0.1, tol=1e-7), "tol = 1e-07: must be left out … by muller only"),
    (lambda: vd.limit(1.5, periods=1, transient=10), "periods = 1: must be >= 4 (4 times the period … at A = 1.5)"),
    (lambda: vd.limit(3.0, "dtau", tol=1e-9), "tol = 1e-09: must be left out with method = 'fixed', …"),
    (lambda: vd.sweep(A=3.0, record="sections"), "record = 'sections': … Did you mean section?"),
    (lambda: vd.sweep(A=3.0, record="section,impacts"), "record = … write ['section', 'impacts']"),
    (lambda: recorded().sections, "'Results' object has no attribute 'sections'. Did you mean section?"),
    (lambda: recorded().k2, 'record = \'section\': must be extended by "limit", which contains k2'),
    (lambda: recorded().error, 'record = \'section\': must be extended by "error"'),
    (lambda: recorded().plot(quantity="power"), "quantity = 'power': must be one of dxi, xi, …, because this sweep …"
     " Did you mean impact_power?"),
    (lambda: recorded().plot(quantity="energy"), "quantity = 'energy': must be one of … energy needs record = …"),
    (lambda: recorded().plot(quantity=""), "quantity = '': must be one of dxi, xi, …, because this sweep recorded se…"),
    (lambda: vd.sweep(A=3, record=len, **SHORT), "len raised: TypeError: object of type 'Trajectory' has no len()"),
    (lambda: vd.sweep(A=[3, 4], record=len, **SHORT), "len raised at all 2 points, first at A = 3: TypeError: …"),
    (lambda: recorded().plot(cmap="magna"), "cmap = 'magna': must be a Colormap …, or … magma. Did you mean magma?"),
    (lambda: recorded().plot(cmap=3), "cmap = 3: must be a Colormap of Matplotlib, or the name of one such as magma"),
    (lambda: recorded().plot("poincare", cmap="magma"), "cmap = 'magma': must be left out for a figure of kind poin…"),
    (lambda: recorded().plot(quantity="status", cmap="magma"), "cmap = 'magma': must be left out over one axis, …"),
    (lambda: recorded().plot("map", xlim=(3, 4)), "argument = 'xlim': must be one of kind, …, notes"),
    (lambda: choose_configured(recorded(), {}, {"units": "SI"}), "--units = 'SI': must be left out, because …"),
    (lambda: choose_configured(recorded(), {"units": "SI"}, {}), "figure.units = 'SI': must be left out, because …"),
    (lambda: motion().switches["tau"], "no field of name tau"),
    (lambda: recorded().select(3.0), 'method = 3.0: must be "nearest", or … the name of its axis, such as A=3.0'),
    (lambda: recorded().select(B=1), "axis = 'B': must be one of A"),
    (lambda: recorded().select(A=99), 'A = 99: must be one of the 2 values of this axis; method="nearest" … 3.1'),
    (lambda: recorded().select(A=[3.0, 3.1]), "A = [3.0, 3.1]: must be one number; to_xarray().sel(A=…) selects …"),
    (lambda: recorded().select(A=slice(3, 4)), "A = slice(3, 4, None): must be one number; to_xarray().sel(A=…) …"),
    (lambda: recorded().impact_power, "'Results' object has no attribute 'impact_power': it is energy or, in W …"),
    (lambda: recorded().plot(colour="red"), "argument = 'colour': must be one of kind, quantity, x, y, …, notes"),
    (lambda: vd.plot.map(recorded(), colour="red"), "argument = 'colour': must be one of results, quantity, x, y, …"),
    (lambda: vd.plot.limits(), "results is missing: must be given"),
    (lambda: vd.plot.map(3), "results = 3: must be the Results of a sweep, of which vd.load reads those of a file"),
    (lambda: vd.plot.bifurcation("x.h5"), "results = 'x.h5': must be the Results of a sweep, of which vd.load …"),
    (lambda: vd.plot.poincare([recorded()]), "source = [<Results … …: must be Results, a Trajectory, or a sequence …"),
    (lambda: vd.plot.limits([3]), "results = [3]: must be Results, or a sequence of them"),
    (lambda: vd.plot.phase_curve([]), "source = []: must be a Trajectory, or a sequence of them"),
    (lambda: vd.plot.poincare(recorded(), "ab"), "titles = 'ab': must be a list of 2, one for each panel"),
    (lambda: vd.plot.poincare(recorded(), reference=[1]), "reference = [1]: must be section points, ξ and ξ' in …"),
    (lambda: vd.plot.cobweb(3.04, orbit=vd.orbits(3.0)[0]), "orbit = <Orbit…: must be an Orbit … at A = 3.04, B = 0.1"),
    (lambda: motion().plot(3), "curves = 3: must be a list of one or more of phase, time, velocity, section"),
    (lambda: motion().sample(points=9), "argument = 'points': must be one of points_per_period. Did you mean …?"),
    (lambda: motion().to_dataframe(table="x"), "argument = 'table': must be one of of"),
    (lambda: motion().to_dataframe("rows"), "of = 'rows': must be one of switches, impacts, section"),
    (lambda: recorded().to_dataframe("switches"), "of = 'switches': must be one of points, section, impacts"),
    (lambda: recorded().to_dataframe("impacts"), 'record = \'section\': must be extended by "impacts"'),
    (lambda: vd.plot.map(summarised(), "kept", undisturbed=3), "undisturbed = 3: must be the gaps …"),
    (lambda: vd.own(len, unit="lenght"), "unit = 'lenght': must be one of length, … Did you mean length?"),
    (lambda: vd.own(3), "function = 3: must be a function of a motion…"),
    (lambda: vd.own("summary"), "function = 'summary': must be a function of a motion…"),
    (lambda: vd.own(len, unit=3), "unit = 3: must be a text of one line…"),
    (lambda: vd.own(len, units="m"), "argument = 'units': must be one of function, version, … Did you mean unit?"),
    (lambda: vd.sweep(A=3, record=[lambda m: 1.0, lambda m: 2.0]), "record = 'function, function': must be functi…"),
    (lambda: vd.sweep(A=3, record=vd.own(lambda m: {"a": 1.0}, label={"b": "x"}), **SHORT),
     "name in the units and labels of function = 'b': must be one of a"),
    (lambda: vd.simulat, "module 'vibrodrive' has no attribute 'simulat'. Did you mean simulate?"),
    (lambda: vd.explore(3), "config = 3: must be the name of a configuration"),
    (lambda: recorded().plot("map", limits=(10,)), "limits = (10,): must be two numbers in ascending order"),
    (lambda: vd.sweep(A=3, path="x.csv"), "path = 'x.csv': must be a result file (.h5 or .nc)"),
    (lambda: vd.sweep(A=3, path=3), "path = 3: must be the name of a result file"),
    (lambda: vd.sweep(A=3, overwrite=True), "overwrite = True: must be left out, or given together with path"),
    (lambda: recorded().plot("pie"), "kind = 'pie': must be one of …"),
    (lambda: recorded().plot(x="B"), "x = 'B': must be one of the axes A"),
    (lambda: recorded().plot(style="nature"), "style = 'nature': must be one of …"),
    (lambda: recorded().plot(width="triple"), "width = 'triple': must be one of …"),
    (lambda: recorded().plot("bifurcation", limits=(0.0, math.inf)), "limits = …: must be two numbers …"),
    (lambda: save(Figure(), Path("figure.xyz")), "… a file name ending in .png, …"),
    (lambda: vd.Scene(1e-3, 24.0), "arguments without a name = (0.001, 24.0): must be none; … such as a0 = …"),
    (lambda: vd.Scene(freq=24), "argument = 'freq': must be one of a0, omega0, … Did you mean frequency?"),
    (lambda: vd.Scene(omega0=150.0, mu=0.6, alpha=3.4), "a0 is missing: must be given"),
    (lambda: vd.Scene(a0=1e-3, omega0=150.0, mu=0.6), "alpha is missing: must be given, because a scene needs …"),
    (lambda: vd.sweep(frequency=[20, 24]), "mu is missing: must be given, because a scene needs …"),
    (lambda: vd.orbits(3.0, eps=1e-4), "argument = 'eps': must be one of A, B, max_period, scene, a0, …"),
    (lambda: vd.bifurcations((2, 3), max_perod=2), "argument = 'max_perod': … Did you mean max_period?"),
    (lambda: vd.impact_map(), f"A is missing: must be given, {NUMBERS[8:]}"),
    (lambda: vd.simulate(a0=1e-3), "omega0 is missing: must be given, because a scene needs …"),
    (lambda: vd.simulate(scene=IN_SI, frequency=[9]), "frequency = array of length 1: must be one number (…"),
    (lambda: vd.orbits(scene=IN_SI, A=3.0), f"A = 3.0: {FROM_SCENE}"),
    (lambda: vd.orbits(scene=IN_SI, mu=[0.5]), "mu = array of length 1: must be one number"),
    (lambda: vd.bifurcations((2, 3), B=[]), "B = []: must be an axis with at least one value"),
    (lambda: vd.bifurcations(scene=IN_SI), "range = none: must be one of a0, omega0, frequency as a range …"),
    (lambda: vd.bifurcations(scene=IN_SI, a0=(1, 2), omega0=(8, 9)), "range = a0, omega0: must be one of a0, …"),
    (lambda: vd.bifurcations(scene=IN_SI, frequency=(24, 20)), "frequency = (24, 20): must be two numbers in asc…"),
    (lambda: vd.bifurcations(scene=IN_SI, a0=(1, 2), mass=[5, 6]), f"axes = a0, mass: {OF_ORBITS}"),
    (lambda: vd.bifurcations(scene=IN_SI, a0=(1, 2), mu=[1], alpha=[1]), f"axes = a0, mu, alpha: {OF_ORBITS}"),
    (lambda: vd.bifurcations(scene=IN_SI, A=(2, 3)), f"A = (2.0, 3.0): {FROM_SCENE}"),
    (lambda: vd.bifurcations(scene=IN_SI, a0=(1e-3, 2e-3), B=0.2), f"B = 0.2: {FROM_SCENE}"),
    (lambda: vd.load("x.h5", kind="limits"), "argument = 'kind': must be one of path"),
    (lambda: vd.explore("a.toml", 2), "arguments without a name = ('a.toml', 2): must be at most 1 (config); …"),
    (lambda: recorded().select("nearest", 0.5, A=99), "A = 99: must be within 0.5 of one of … the nearest is 3.1"),
    (lambda: vd.Scene(a0=1, mu=1, alpha=1), "omega0 is missing: must be given, … (frequency may replace omega0)"),
    (lambda: vd.Scene(**SCENE, frequency=24), "frequency = 24: must be left out if omega0 is given"),
    (lambda: vd.sweep(scene=IN_SI, A=3.0), f"A = 3.0: {FROM_SCENE}"),
    (lambda: vd.sweep(scene=IN_SI, B=0.1), f"B = 0.1: {FROM_SCENE}"),
    (lambda: vd.sweep(scene=IN_SI, points={"B": [0.1]}), f"B = [0.1]: {FROM_SCENE}"),
    (lambda: vd.sweep(scene=3, A=3.0), "scene = 3: must be a Scene"),
    (lambda: vd.sweep(a0=1e-3, mu=0.6, alpha=3), "omega0 is missing: must be given, because a scene needs …"),
    (lambda: vd.sweep(scene=IN_SI, omega0=1, frequency=[1]), "frequency = [1.0]: must be left out if omega0 is given"),
    (lambda: vd.sweep(scene=IN_SI, frequency=[1, 0]), "frequency[1] = 0: must be a finite number > 0"),
    (lambda: vd.sweep(scene=IN_SI, omega0=9, points={"frequency": [9]}), "frequency = [9.0]: … left out if omega0 …"),
    (lambda: vd.sweep(scene=IN_SI, points={"mu": [0.5, 0]}), "points.mu[1] = 0: must be a finite number > 0"),
    (lambda: vd.sweep(A=3, points={"mu": [0.5]}), "omega0 is missing: must be given, because a scene needs …"),
]  # fmt: skip
"""Calls and the sentences that refuse them."""

SENTENCES = [
    *((lambda text=text: parse(text).plan(), told) for text, told in CONFIGURATIONS),
    *((lambda option=option: parse(ONE + "[run]\nperiods = 3\n", [option]), told) for option, told in OPTIONS),
    *CALLS,
]


def recorded():
    plan = make_plan({"A": [3.0, 3.1], **SHORT})
    return gather(plan, fake.run_blocks(plan))


def motion():
    return vd.simulate(A=3.0, **SHORT)


def summarised():
    return vd.sweep(A=[3.0, 3.1], record="summary", **SHORT)


@pytest.mark.integration
@pytest.mark.parametrize(("call", "told"), SENTENCES, ids=[told for _, told in SENTENCES])
def test_refusal_is_this_sentence(call, told):
    assert re.fullmatch(".*".join(map(re.escape, told.split("…"))), refusal(call))


@pytest.mark.integration
def test_missing_package_is_named_with_its_extra(monkeypatch):
    calls = recorded().to_xarray, recorded().to_dataframe, motion().to_dataframe
    for name in ("xarray", "pandas"):
        monkeypatch.setitem(sys.modules, name, None)
    for call in calls:
        told = rf"^{call.__name__} needs the extra `data`: pip install 'vibrodrive\[data\]'$"
        with pytest.raises(ImportError, match=told):
            call()


def test_files_that_are_no_configurations_are_refused(tmp_path, monkeypatch):
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe[sweep]")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "large.toml").write_text("#" * 999)
    (tmp_path / "result.toml").write_bytes(b"\x89HDF\r\n")
    monkeypatch.setattr("vibrodrive.model.config.MOST_BYTES", 998)
    for name, told in {
        "missing": "No such file", "binary": "must be text in UTF-8", "folder": "is a directory",
        "large": "must be at most", "result": "is a result file",
    }.items():  # fmt: skip
        path = tmp_path / f"{name}.toml"
        assert re.match(f"{re.escape(str(path))}: .*{told}", refusal(read, path))


def test_missing_configurations_are_looked_for_with_their_ending(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("quickstart", "quickstart.toml"):
        wanted = f"{name}: No such file or directory; `vibrodrive init quickstart` writes quickstart.toml"
        assert refusal(read, name) == wanted
    (tmp_path / "quickstart.toml").touch()
    assert refusal(read, "quickstart") == "quickstart: No such file or directory. Did you mean quickstart.toml?"
    assert refusal(read, "other.toml") == "other.toml: No such file or directory"


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
    assert make_plan({"points": pd.DataFrame({"A": A})}).together["A"].tolist() == [3.0, 3.1]
