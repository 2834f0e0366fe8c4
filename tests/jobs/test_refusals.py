"""A search for orbits refuses an invalid configuration with one sentence, before anything is computed.

tests/model/test_plan.py and tests/model/test_config.py do this for sweeps.
"""

import pytest

from vibrodrive.jobs.orbits import check
from vibrodrive.model.config import parse

A = "A=[2.5, 2.6]"

REFUSED = [
    (["A=3"], "axes = none: must be A only, or A and B"),
    ([A, "eps=[0, 1e-4]"], "axes = A, eps: must be A only, or A and B"),
    (["A=[3]"], "A = [3.0]: must be at least two different values"),
    ([A, "B=[0.1, 0.1]"], "B = [0.1, 0.1]: must be at least two different values"),
    ([A, "eps=1e-4"], "eps = 0.0001: must be 0, because orbits are those of the undisturbed motion"),
    ([A, "method=fixed", "dtau=0.1"], "method = 'fixed': must be certified"),
    ([A, "max_period=0"], "orbits.max_period = 0: must be an integer >= 1"),
]


@pytest.mark.parametrize(("given", "told"), REFUSED)
def test_refusals(given, told):
    with pytest.raises((TypeError, ValueError)) as caught:
        check(parse("", given))
    assert str(caught.value).startswith(told)
    assert "\n" not in str(caught.value)
