"""The example that varies the definition of the limit k₂ finds the usual k₂ with the usual definition."""

import numpy as np
import pytest

import vibrodrive as vd
from examples.limit_definition import CRITERIA, k2, with_free_speed, with_given_speed
from vibrodrive.stability.main_impacts import SHARE

SHORT = {"transient": 50, "periods": 60}


@pytest.mark.jit
def test_usual_share_gives_the_usual_limits():
    A = (1.3, 2.4)
    usual = vd.sweep(A=A, record="limit", **SHORT).k2.tolist()
    assert k2(with_free_speed(SHARE), A, **SHORT).tolist() == k2(CRITERIA["impacts"], A, **SHORT).tolist() == usual
    assert (k2(CRITERIA["order"], A, **SHORT) == np.inf).all(), "there is only one order if n = 1"
    assert (k2(with_given_speed(SHARE), A, **SHORT) > 0).all()
    assert np.isnan(k2(with_free_speed(SHARE), (2.8,), B=0.02, **SHORT)).all(), "there is no orbit to lose"
