"""Comparison of the decisions of kernels with the table of transitions in Fig. 2, and completeness of this table."""

import math

import pytest

import vibrodrive as vd
from benchmarks.paper.drawing import TRANSITIONS
from vibrodrive.kernels.codes import S1, S2, S3, S4, S5
from vibrodrive.kernels.switch import decide, terminating_function

FUNCTIONS = {"S1": S1, "S2": S2, "S3": S3, "S4": S4, "S5": S5}
ENDED_BY = {vd.State.UP: ["S3"], vd.State.DOWN: ["S1", "S2"], vd.State.STICK: ["S4"], vd.State.REST: ["S5"]}

FORCES = {
    "H > 1": (math.nextafter(1, 2), 1.5, math.inf),
    "H <= 1": (1.0, 0.0, -1.0, -7.0, -math.inf),
    "H < -1": (math.nextafter(-1, -2), -1.5, -math.inf),
    "|H| <= 1": (1.0, 0.3, -1.0),
    "H = 1": (1.0,),
    "H = -1": (-1.0,),
    "": (1.0,),
}


@pytest.mark.jit
def test_decisions_agree_with_the_table():
    from numba import njit

    decides = njit(lambda which, side, force: decide(which, side, force))
    for state, name, condition, after in TRANSITIONS:
        # after an impact, H at the zero of S1 decides
        which = FUNCTIONS.get(name, S1)
        if after == vd.State.IMPACT:
            continue  # the zero of S1 itself
        side = 1.0 if condition == "H = -1" else -1.0
        for force in FORCES[condition]:
            assert decides(which, side, force) == after, (state, name, condition, force)


@pytest.mark.jit
def test_ends_of_states_agree_with_the_table():
    from numba import njit

    ends = njit(lambda state: terminating_function(state))
    for state, names in ENDED_BY.items():
        assert ends(int(state)) == FUNCTIONS[names[-1]]  # a slide down searches S2 and tests ξ for S1


def test_table_is_complete():
    """The table has each state with the functions that end it, and an impact with H > 1 and H <= 1."""
    for state, names in ENDED_BY.items():
        assert sorted({name for s, name, _, _ in TRANSITIONS if s == state}) == names
    for state, *forbidden in ((vd.State.IMPACT, "H > 1", "H <= 1"),):
        assert [c for s, _, c, _ in TRANSITIONS if s == state] == forbidden
