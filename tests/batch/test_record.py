"""Impacts of a sweep equal those of single motions. The choice of recorded quantities changes no other result."""

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.model.records import check_record

pytestmark = pytest.mark.jit

RUN = dict(transient=50, periods=12)


def test_impacts_equal_those_of_single_motions():
    A = [0.5, 1.5, 2.65, 3.1]
    swept = vd.sweep(A=A, eps=[0.0, 2e-4], **RUN, record="impacts")
    for index in np.ndindex(swept.shape):
        motion = vd.simulate(A=A[index[0]], eps=swept.axes["eps"][index[1]], **RUN)
        n = len(motion.impacts)
        assert (swept.impact_period[index][n:] == -1).all()
        assert np.isnan(swept.impact_phase[index][n:]).all()
        for name in ("period", "phase", "speed"):
            assert getattr(swept, f"impact_{name}")[index][:n].tolist() == motion.impacts[name].tolist()
        after = motion.switches["after"]
        between = [len(after[a + 1 : b]) for a, b in zip(*(motion.impacts["row"][k:] for k in (0, 1)), strict=False)]
        assert swept.impact_states[index][1:n].tolist() == between
        assert swept.impact_states[index][0] == -1


@pytest.mark.parametrize("record", ["summary", ("impacts",), ["summary", "section"], ("section", "impacts", "summary")])
def test_record_does_not_change_other_results(record):
    plain = vd.sweep(A=np.linspace(1, 3.3, 40), eps=[0.0, 1e-4], **RUN)
    other = vd.sweep(A=np.linspace(1, 3.3, 40), eps=[0.0, 1e-4], **RUN, record=record)
    for name in ("status", "margin", "switches", *(["section"] if "section" in record else [])):
        assert np.array_equal(getattr(plain, name), getattr(other, name), equal_nan=True)
    assert plain.record == ("section",)
    assert other.record == check_record(record)
