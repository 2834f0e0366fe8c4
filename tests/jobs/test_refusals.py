"""Limits, orbits, curves and failures refuse invalid configurations with one sentence, before a file is made."""

import pytest
from vibrodrive.jobs.runner import run

import vibrodrive as vd
from vibrodrive.model.config import parse

A, TWO = "A=[2.5, 2.6]", ("A=[2.5, 2.6]", "B=[0.1, 0.2]")

REFUSED = [
    ("limits", ["A=2.5"], "axes = none: must be one or two of A, B and eta"),
    ("limits", ["A=2.5", "eps=[0, 1e-4]"], "axes = eps: must be one or two"),
    ("limits", [A, "tau0=[0, 1]"], "axes = A, tau0: must be one or two"),
    ("limits", [*TWO, "eta=[101.3]"], "axes = A, B, eta: must be one or two"),
    ("limits", [A, "criterion=shape"], "criterion = 'shape'"),
    ("limits", [A, "criterion=gaps"], "criterion = 'gaps'"),
    ("limits", [A, "limits.quantity=k3"], "limits.quantity = 'k3': must be one of k2"),
    ("orbits", ["A=3"], "axes = none: must be A only, or A and B"),
    ("orbits", ["A=[3]"], "A = [3.0]: must be at least two different values"),
    ("orbits", [A, "eps=1e-4"], "eps = 0.0001: must be 0, because orbits are those of the undisturbed motion"),
    ("orbits", [A, "method=fixed", "dtau=0.1"], "method = 'fixed': must be certified"),
    ("orbits", [A, "max_period=0"], "orbits.max_period = 0: must be an integer >= 1"),
    ("curves", [A, "eps=[0, 1e-4]"], "axes = A, eps: must be A only, or A and B"),
    ("curves", [A, "B=[0.1, 0.1]"], "B = [0.1, 0.1]: must be at least two different values"),
    ("curves", [*TWO, "eps=1e-4"], "eps = 0.0001: must be 0"),
    ("failures", [A], "axes = A: must be A and dtau, or A and eps"),
    ("failures", [A, "eps=[1e-5, 1e-4]"], "dtau is missing: must be given if the axes are A and eps"),
    ("failures", [A, "dtau=[0.1]"], "dtau = [0.1]: must be at least two values in ascending order"),
    ("failures", [A, "dtau=0.1", "eps=[0.0, 1e-4]"], "eps = 0.0: must be > 0"),
]


@pytest.mark.parametrize(("kind", "given", "told"), REFUSED)
def test_refusal_precedes_the_file(kind, given, told, tmp_path):
    with pytest.raises((TypeError, ValueError)) as caught:
        run(kind, parse("", given), tmp_path / "x.h5")
    assert str(caught.value).startswith(told)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())
