"""Kernels read every parameter of a point of a sweep: a change of any parameter changes the section points."""

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.model.names import PARAMETERS

POINT = {"A": 3.04, "B": 0.1, "eps": 1e-3, "method": "muller", "dtau": 0.05, "tol": 1e-9, "transient": 0, "periods": 3}
OTHERS = {"A": 3.1, "B": 0.15, "eps": 2e-3, "dtau": 0.04, "tol": 0.1}


@pytest.mark.jit
@pytest.mark.parametrize("name", PARAMETERS)
def test_each_parameter_changes_some_result(name):
    other = OTHERS.get(name, (PARAMETERS[name].default or 0.0) + 0.5)
    one, two = (vd.simulate(**(POINT | change)) for change in ({}, {name: other}))
    assert not np.array_equal(one.section, two.section)
