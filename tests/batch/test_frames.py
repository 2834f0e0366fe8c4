"""Trajectories and lists of orbits as pandas DataFrames."""

import math

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.store.tables import rows_of

pandas = pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def motion():
    return vd.simulate(3.04, eps=1e-4, transient=3, periods=4, tau0=0.3, section_phase=-1.0)


def test_switches_are_rows_with_the_names_of_states(motion):
    table = motion.to_dataframe()
    assert table.columns.tolist() == ["tau", "period", "phase", "before", "after", "xi", "dxi"]
    assert len(table) == len(motion.switches)
    for name in ("period", "phase", "xi", "dxi"):
        np.testing.assert_array_equal(table[name], motion.switches[name])
    assert table.after.tolist() == [vd.State(k).name for k in motion.switches["after"]]
    assert table.after.cat.categories.tolist() == ["UP", "DOWN", "STICK", "REST", "IMPACT"]
    assert (table.tau.diff().dropna() >= 0).all()
    hits = table[table.after == "IMPACT"]
    assert (hits.xi == 0).all()
    assert set(motion.to_dataframe("impacts").tau) <= set(hits.tau)
    assert {"A": 3.04, "method": "certified", "status": "OK"}.items() <= table.attrs.items()
    assert "dtau" not in table.attrs, "the method certified has no grid"


@pytest.mark.parametrize("start", [{}, {"tau0": 0.3, "section_phase": -1.0}, {"tau0": 7.0, "section_phase": 7.0},
                                   {"tau0": -20.0, "section_phase": 3.0}])  # fmt: skip
def test_section_points_have_their_times(start):
    motion = vd.simulate(3.04, transient=2, periods=3, **start)
    table, dense = motion.to_dataframe("section"), motion.sample(2000)
    phase = start.get("section_phase", 0.0)
    assert np.allclose(np.cos(table.tau - phase), 1.0)
    np.testing.assert_allclose(np.interp(table.tau, dense.tau, dense.xi), table.xi, atol=1e-5)
    begin = start.get("tau0", 0.0) + 2 * math.pi * 2
    assert (table.tau > begin).all()
    assert (table.tau < begin + 3 * 2 * math.pi + 1e-9).all()


def test_motion_is_shown_in_one_line(motion):
    shown = f"<Trajectory A 3.04, B 0.1, eps 0.0001: certified, 3 + 4 periods; {len(motion.switches)} switches, "
    assert repr(motion).startswith(shown)
    assert f"; OK, margin {motion.margin:.2g}>" in repr(motion)


def test_rows_are_those_of_the_columns_beyond_a_block():
    values = np.arange(40_000)
    assert [*rows_of({"a": values, "b": -values})] == [*zip(values.tolist(), (-values).tolist(), strict=True)]
