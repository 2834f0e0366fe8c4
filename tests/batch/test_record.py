"""Each parameter changes results, and the choice of records does not."""

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.model.names import PARAMETERS
from vibrodrive.model.records import check_record
from vibrodrive.periodic.continuation import bisect

pytestmark = pytest.mark.jit

RUN = dict(transient=50, periods=12)


def test_impact_at_the_phase_of_the_orbit_is_not_the_impact_of_the_orbit():
    """A mass falls so that its first impact has the last bit of the phase of all later ones, but another speed.

    After this impact the mass rests, so the motion repeats itself from then on, but this impact does not.
    """
    run, start = dict(transient=0, periods=12), dict(A=1.5, tau0=4.0)
    (orbit,) = vd.simulate(1.5, transient=50, periods=1).impacts

    def falls(xi0):
        return vd.simulate(**start, xi0=xi0, **run).impacts

    _, xi0 = bisect(lambda xi0: falls(xi0)["phase"][0] < orbit["phase"], 0.1, 0.5)
    impacts = falls(xi0)
    assert set(impacts["phase"]) == {orbit["phase"]}
    assert abs(impacts["speed"][0] - orbit["speed"]) > 0.01
    swept = vd.sweep(**start, xi0=xi0, **run, record="impacts")
    assert swept.impact_speed[: len(impacts)].tolist() == impacts["speed"].tolist()


@pytest.mark.parametrize("record", ["summary", ("impacts",), ["summary", "section"], ("section", "impacts", "summary")])
def test_record_does_not_change_other_results(record):
    plain = vd.sweep(A=np.linspace(1, 3.3, 40), eps=[0.0, 1e-4], **RUN)
    other = vd.sweep(A=np.linspace(1, 3.3, 40), eps=[0.0, 1e-4], **RUN, record=record)
    for name in ("status", "margin", "switches", *(["section"] if "section" in record else [])):
        assert np.array_equal(getattr(plain, name), getattr(other, name), equal_nan=True)
    assert plain.record == ("section",)
    assert other.record == check_record(record)


POINT = {"A": 3.04, "B": 0.1, "eps": 1e-3, "method": "muller", "dtau": 0.05, "tol": 1e-9, "transient": 0, "periods": 3}
OTHERS = {"A": 3.1, "B": 0.15, "eps": 2e-3, "dtau": 0.04, "tol": 0.1}


@pytest.mark.parametrize("name", PARAMETERS)
def test_each_parameter_changes_some_result(name):
    other = OTHERS.get(name, (PARAMETERS[name].default or 0.0) + 0.5)
    one, two = (vd.simulate(**(POINT | change)) for change in ({}, {name: other}))
    assert not np.array_equal(one.section, two.section)
