"""Statuses print as names and otherwise behave like numbers; values of NumPy become values of JSON."""

import pickle

import numpy as np
import pytest

from vibrodrive.model.choices import Method, Status
from vibrodrive.model.states import State
from vibrodrive.model.statuses import Statuses, count_statuses


@pytest.fixture
def statuses():
    return np.array([[0, 1], [2, -1]], np.int8).view(Statuses)


def test_members_print_their_names_and_are_numbers():
    assert (str(Status.TOO_CLOSE), f"{State.REST}", str(Method.FIXED)) == ("TOO_CLOSE", "REST", "FIXED")
    assert (Status.TOO_CLOSE + 1, np.int8(1) == Status.TOO_CLOSE, int(State.REST)) == (2, True, 3)


def test_members_equal_their_names_and_keep_the_hash_of_their_numbers():
    assert (Status.OK == "OK", Status.OK == "ok", Status.OK == "BUDGET", Status.OK == "") == (True, True, False, False)
    assert (Status.OK != "OK", Status.OK != "ok", Status.OK != "BUDGET", Status.OK != 0) == (False, False, True, False)
    assert (State.IMPACT == "IMPACT", Method.CERTIFIED == "certified") == (True, True)
    for member in (*Status, *State, *Method):
        assert hash(member) == hash(int(member))
        assert {int(member): "found"}[member] == "found"
        assert pickle.loads(pickle.dumps(member)) is member


def test_members_are_made_of_names_and_numbers():
    assert Status("OK") is Status("ok") is Status(0) is Status.OK
    assert (State("UP"), Method("certified")) == (State.UP, Method.CERTIFIED)
    for wrong in ("OKAY", 99, None, ""):
        with pytest.raises(ValueError, match=rf"^status = {wrong!r}: must be one of OK, TOO_CLOSE, .*, NOT_COMPUTED$"):
            Status(wrong)


def test_texts_of_arrays_are_names(statuses):
    for kind in (str, "U20", object):
        assert statuses.astype(kind).tolist() == [["OK", "TOO_CLOSE"], ["BUDGET", "NOT_COMPUTED"]]
    assert np.isin(statuses.astype(str), ["OK", "BUDGET"]).tolist() == [[True, False], [True, False]]
    assert (statuses.astype(float).sum(), type(statuses.astype(np.int64))) == (2.0, Statuses)
    assert statuses[0, :1].reshape(()).astype(str) == "OK"


def test_arrays_equal_names(statuses):
    assert (statuses == "OK").tolist() == (statuses == Status.OK).tolist() == [[True, False], [False, False]]
    assert (statuses == "not_computed").tolist() == [[False, False], [False, True]]
    assert (statuses != "BUDGET").tolist() == (statuses != Status.BUDGET).tolist()
    assert not (statuses == "OKAY").any()
    assert (statuses == ["OK", "NOT_COMPUTED"]).tolist() == [[True, False], [False, True]]
    assert (statuses[0, 1] == "TOO_CLOSE", bool(statuses[0, :1].reshape(()) == "OK")) == (True, True)
    for array in (statuses == "OK", statuses != np.array(["OK"])):
        assert type(array) is np.ndarray


def test_each_status_has_words_and_advice():
    assert len({status.words for status in Status}) == len({status.advice for status in Status}) == len(Status)


def test_arrays_show_names(statuses):
    assert str(statuses) == "[[OK, TOO_CLOSE],\n [BUDGET, NOT_COMPUTED]]"
    assert repr(statuses[0]) == "Statuses([OK, TOO_CLOSE])"
    assert statuses[0, 1] is Status.TOO_CLOSE
    assert str(np.array([9], np.int8).view(Statuses)) == "[status 9]", "an unknown status must print as a number"
    one = np.array(1, np.int8).view(Statuses)
    assert (str(one), f"{one}", repr(one), f"{one:d}") == ("TOO_CLOSE", "TOO_CLOSE", "Statuses(TOO_CLOSE)", "1")
    assert count_statuses(statuses) == {"NOT_COMPUTED": 1, "OK": 1, "TOO_CLOSE": 1, "BUDGET": 1}


def test_operations_on_statuses_return_plain_arrays(statuses):
    for array in (statuses == Status.OK, statuses != statuses, statuses + 1, np.isin(statuses, (0, 1))):
        assert type(array) is np.ndarray
    assert (statuses == Status.OK).tolist() == [[True, False], [False, False]]
    assert (statuses.sum(), type(statuses.max())) == (2, np.int8)
    statuses[:] = Status.BUDGET
    assert type(pickle.loads(pickle.dumps(statuses))) is Statuses
    assert np.asarray(statuses).tolist() == [[2, 2], [2, 2]]
    out = statuses.copy()
    np.add(statuses, 1, out=out)
    assert out.tolist() == [[3, 3], [3, 3]]
