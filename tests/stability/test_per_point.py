"""Records that need several motions a point, or a function of a motion: `limit`, `failures`, numbers of one's own."""

import copy
import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import h5py
import numpy as np
import pytest

import vibrodrive as vd
from tests.test_products import settling
from vibrodrive.model.own import Own
from vibrodrive.model.reasons import How
from vibrodrive.stability.failures import count_failures

SHORT = {"transient": 50, "periods": 40}
LIMIT_COLUMNS = ("k2", "last_kept", "share_kept", "half_kept")

pytestmark = pytest.mark.jit


def summary(motion):
    return {"own": motion.margin}


def another():
    def settling(motion):
        return {"last": 0.0, "total": 0.0}

    return settling


def test_record_limit_equals_the_limit_at_each_point():
    eta = 10.0  # with a slow ripple a limit is found soon
    r = vd.sweep(A=[1.5, 3.04], B=[0.1, 0.2], eta=eta, record="limit", **SHORT)
    for at, A in enumerate((1.5, 3.04)):
        for to, B in enumerate((0.1, 0.2)):
            k = vd.limit(A, B=B, eta=eta, **SHORT)
            assert all(getattr(r, name)[at, to] == getattr(k, name) for name in LIMIT_COLUMNS)
            assert r.velocity[at, to] == k.k2 * (A * eta)
            assert r.orbit_period[at, to] == k.n
            assert r.status[at, to] == vd.Status.OK
    assert How(r.how[0, 0]) == How.GAPS
    spent = vd.sweep(A=[1.5], budget=8, record="limit", **SHORT)
    assert How(spent.how[0]) == How.BUDGET


def test_a_grid_method_without_a_step_has_its_limit_in_the_step():
    r = vd.sweep(A=[3.04], method="fixed", record="limit", **SHORT)
    k = vd.limit(3.04, "dtau", **SHORT)
    assert (r.k2[0], r.last_kept[0], r.velocity[0]) == (k.k2, k.last_kept, k.k2)
    disturbed = vd.sweep(A=[3.04], eps=[0.0, 1e-5], method="fixed", record="limit", **SHORT)
    assert disturbed.orbit_period.tolist() == [[2, 2]], "the orbit is that of the undisturbed motion"
    assert disturbed.k2.tolist() == [[k.k2, vd.limit(3.04, "dtau", eps=1e-5, **SHORT).k2]]
    with_step = vd.sweep(A=[3.04], method="fixed", dtau=1e-4, record="limit", **SHORT)
    assert with_step.k2[0] == vd.limit(3.04, "eps", "fixed", dtau=1e-4, **SHORT).k2


def test_motion_that_settles_slowly_has_a_limit():
    """Beside a period doubling a transient of a few thousand periods would be too short."""
    (orbit,) = (o for o in vd.orbits(2.604, max_period=2) if o.kind == "stable")
    assert -1.0 < orbit.multiplier < -0.999
    r = vd.sweep(A=[2.604], record="limit", **SHORT)
    assert (r.status[0], r.orbit_period[0]) == (vd.Status.OK, orbit.period)


@pytest.mark.parametrize(
    ("arguments", "status"),
    [
        ({"A": [2.8], "B": 0.02}, vd.Status.NO_ORBIT),  # chaotic
        ({"A": [3.1], "periods": 14}, vd.Status.TOO_SHORT),  # four periods of the orbit are 16
        ({"A": [3.04], "budget": 1}, vd.Status.BUDGET),
    ],
)
def test_points_without_a_limit_have_a_status_of_their_own(arguments, status):
    r = vd.sweep(record="limit", **(SHORT | arguments))
    assert r.status[0] == status
    assert np.isnan(r.k2[0])
    assert r.how[0] == -1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"eps": 1e-4, "record": "limit"}, "eps = 0.0001: must be left out"),
        ({"eps": [0.0, 1e-4], "record": "limit"}, r"eps = \[0.0, 0.0001\]: must be left out"),
        ({"section_phase": [0.0, 1.0], "record": "limit"}, "limits do not depend on the section"),
        ({"eta": [50.0, 60.0], "method": "fixed", "record": "limit"}, "limits in dtau do not depend on eta"),
        ({"record": ["limit", "section"]}, '"limit" alone'),
        ({"eps": 1e-4, "record": "impulses"}, "eps = 0.0001: must be left out, because every disturbance"),
        ({"eta": [50.0, 60.0], "record": "impulses"}, r"eta = \[50.0, 60.0\]: must be one number"),
        ({"method": "fixed", "dtau": 0.1, "record": "impulses"}, "method = 'fixed': must be certified with record"),
        ({"record": ["impulses", "summary"]}, '"impulses" alone'),
        ({"method": "fixed", "record": "always"}, "method = 'fixed': must be certified with record = \"always\""),
        ({"eps": 1e-4, "record": "always"}, "eps = 0.0001: must be left out, because every ε"),
        ({"record": ["failures", settling], "method": "fixed", "dtau": 0.1}, '"failures" alone'),
        ({"record": "failures"}, "method = 'certified': must be fixed or muller"),
        ({"record": "failures", "method": "fixed"}, "dtau is missing"),
        ({"record": [settling, settling]}, "must be functions of different names"),
        ({"record": [3]}, "or functions of a motion"),
        ({"record": lambda motion: {"section": 1.0}}, "a name of function = 'section': must be a name of its own"),
        ({"record": lambda motion: {"digests": 1.0}}, "a name of function = 'digests': must be a name of its own"),
        ({"record": lambda motion: {"section_xi": 1.0}}, "because this one is taken"),
        ({"record": lambda motion: {"impact": 1.0}}, "because this one is taken"),
        ({"record": lambda motion: {"title": 1.0}}, "because this one is taken"),
        ({"record": lambda motion: {"motion_period": 1.0}}, "because this one is taken"),
        ({"record": lambda motion: {"_x": 1.0}}, "must be a name as of a variable in Python"),
        ({"record": lambda motion: {"e\u0301": 1.0}}, "must be a name as of a variable in Python"),
        ({"record": lambda motion: {}}, "function = {}: must be a number, or numbers by name"),
        ({"record": summary}, "a function that has not the name of a record"),
        ({"record": lambda motion: "no number"}, "function raised: TypeError"),
    ],
)
def test_what_cannot_be_recorded_is_refused(arguments, words):
    with pytest.raises((TypeError, ValueError), match=words):
        vd.sweep(A=1.5, **(SHORT | arguments))


def test_a_point_alone_has_the_limit_that_it_has_among_others():
    arguments = {"A": np.linspace(1.2, 3.1, 35), "record": "limit", "eta": 5.0, "transient": 10, "periods": 10}
    together = vd.sweep(**arguments)
    assert len(together.plan.blocks()) > 1
    single = [vd.sweep(**(arguments | {"A": A})) for A in arguments["A"][[0, 17, 34]]]
    assert np.array_equal([r.k2.item() for r in single], together.k2[[0, 17, 34]], equal_nan=True)


def test_record_failures_counts_the_failures_of_each_motion():
    r = vd.sweep(A=[1.5, 3.04], dtau=[1e-3, 0.1], eps=5e-4, method="muller", record="failures", transient=5, periods=5)
    for at, A in enumerate((1.5, 3.04)):
        for to, dtau in enumerate((1e-3, 0.1)):
            motion = vd.simulate(A, dtau=dtau, eps=5e-4, method="muller", transient=5, periods=5)
            counts = r.judged[at, to], r.missed[at, to], r.late[at, to], r.wrong[at, to]
            assert counts == count_failures(motion)
            assert r.switches[at, to].sum() == len(motion.switches)
    assert r.missed.sum() > 0


def test_a_function_of_a_motion_is_a_record():
    arguments = {"A": [1.5, 3.04], "eps": [0.0, 1e-4], **SHORT}
    r = vd.sweep(**arguments, record=["summary", settling])
    for at, A in enumerate(arguments["A"]):
        for to, eps in enumerate(arguments["eps"]):
            motion = vd.simulate(A, eps=eps, **SHORT)
            assert r.total[at, to] == len(motion.switches)
            assert r.last[at, to] == motion.impacts["period"][-1]
    assert np.array_equal(r.impacts, vd.sweep(**arguments, record="summary").impacts)


def test_a_point_at_which_a_function_raises_is_nan(tmp_path):
    def picky(motion):
        if motion.arguments["A"] > 3:
            raise RuntimeError("too large")
        return 1

    told = r"1 point with the status RAISED: picky at A = 3.04: RuntimeError: too large"
    for path in (None, tmp_path / "picky.h5"):
        with pytest.warns(UserWarning, match=told):
            r = vd.sweep(A=[3.04, 1.5], record=vd.own(picky, version="1"), **SHORT, path=path)
    assert r.status.tolist() == [vd.Status.RAISED, vd.Status.OK]
    assert np.array_equal(r.picky, [np.nan, 1.0], equal_nan=True)
    cut = vd.sweep(A=[3.04], record=lambda motion: len(motion.switches), budget=1, **SHORT)
    assert cut.status.tolist() == [vd.Status.BUDGET], "the status of the motion is kept"


class Silent(Exception):
    def __str__(self):
        raise ZeroDivisionError


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (RuntimeError("one\n\x1b[2Jtwo\u2028three"), "RuntimeError: one [2Jtwo three"),
        (RuntimeError(10_000 * "x"), f"RuntimeError: {184 * 'x'} …"),
        (RuntimeError(10_000 * "word "), f"RuntimeError: {36 * 'word '}word …"),
        (KeyError(), "KeyError"),
        (Silent(), "tests.stability.test_per_point.Silent: <exception str() failed>"),
    ],
    ids=["lines", "long word", "many words", "no message", "no text"],
)
def test_the_exception_of_a_function_is_told_in_one_short_line(error, told):
    def picky(motion):
        if motion.arguments["A"] > least:
            raise error
        return 1

    least = 3.0
    with pytest.warns(UserWarning, match="RAISED") as caught:
        vd.sweep(A=[3.04, 1.5], record=picky, **SHORT)
    assert [str(w.message) for w in caught] == [f"1 point with the status RAISED: picky at A = 3.04: {told}"]
    least = 0.0
    with pytest.raises(ValueError, match="raised") as refused:
        vd.sweep(A=[3.04, 1.5], record=picky, **SHORT)
    assert str(refused.value) == f"picky raised at all 2 points, first at A = 3.04: {told}"


def test_results_are_pickled_without_their_functions():
    """A lambda cannot be pickled, and who reads the pickle need not have the function."""
    r = vd.sweep(A=[1.5, 3.04], record=["section", vd.own(lambda motion: {"x": motion.margin}, unit="length")], **SHORT)
    for other in (pickle.loads(pickle.dumps(r)), copy.deepcopy(r)):
        assert other.x.tobytes() == r.x.tobytes()
        assert other.section.tobytes() == r.section.tobytes()
        assert [one.outline for one in other.record] == [one.outline for one in r.record]
        assert other.record[1].rows == r.record[1].rows
        with pytest.raises(vd.errors.Failed, match="must be computed by a call that gives the function"):
            vd.sweep(A=[1.5], record=other.record, **SHORT)


def test_a_name_with_a_combining_mark_is_read_again(tmp_path):
    name = "x\u0304"  # no letter has this mark in one character
    record = vd.own(lambda motion: {name: motion.margin}, version="1")
    vd.sweep(A=1.5, record=record, **SHORT, path=tmp_path / "x.h5")
    assert vd.load(tmp_path / "x.h5")[name] == vd.sweep(A=1.5, record=record, **SHORT)[name]


def test_a_fault_of_the_program_is_no_result_of_a_point(tmp_path, monkeypatch):
    path, called, record = tmp_path / "x.h5", [], vd.own(settling, version="1")

    def fails(own, motion, numbers=Own.numbers):
        called.append(motion)
        return numbers(own, motion) if len(called) == 1 else 1 / 0  # the first call gives the names

    with monkeypatch.context() as patch:
        patch.setattr(Own, "numbers", fails)
        with pytest.raises(
            vd.errors.Failed, match=r"by zero; 0 of .*; repeat .*\(…, record=vd.own\(settling, version=\"1\"\), path"
        ):
            vd.sweep(A=[1.5, 3.04], record=record, **SHORT, path=path)
    assert vd.load(path).computed == 0.0
    assert vd.sweep(A=[1.5, 3.04], record=record, **SHORT, path=path).computed == 1.0


def test_a_file_is_resumed_by_the_version_that_the_author_of_a_function_gives(tmp_path):
    """Whatever else the function reads: two functions of one version are one function, and those of two are not."""
    path = tmp_path / "x.h5"
    with pytest.raises(
        TypeError, match=r'record = .settling.: must be vd\.own\(settling, version="1"\) with path; cha'
    ):
        vd.sweep(A=[1.5, 3.04], record=settling, **SHORT, path=path)
    assert not path.exists(), "refused before anything is computed"
    vd.sweep(A=[1.5, 3.04], record=vd.own(settling, version="of (1)"), **SHORT, path=path)
    with h5py.File(path) as file:
        assert file.attrs["record"].decode() == "settling (version of (1))"
    assert vd.sweep(A=[1.5, 3.04], record=vd.own(another(), version="of (1)"), **SHORT, path=path).computed == 1.0
    told = r"record is .settling: last, total \(version of \(1\)\). in the file and .settling: last, total \(version 2"
    with pytest.raises(vd.errors.Different, match=told):
        vd.sweep(A=[1.5, 3.04], record=vd.own(settling, version="2"), **SHORT, path=path)


SCENE = {"a0": 8e-4, "mu": 0.6, "alpha": 3.4, "frequency": [22.0, 24.0]}


def test_a_function_has_units_and_labels_in_tables_files_and_figures(tmp_path):
    units = {"last": "degree", "total": "velocity"}
    record = vd.own(settling, version="1", unit=units, label={"total": "speed of it all"})
    for r in (
        vd.sweep(**SCENE, record=record, **SHORT),
        vd.sweep(**SCENE, record=record, **SHORT, path=tmp_path / "x.h5"),
    ):
        r.plot(quantity="total")
        data = r.to_xarray()
        assert (data.total.attrs["units"], data.total.attrs["long_name"]) == ("m s-1", "speed of it all")
        assert data["last"].attrs["units"] == "degree"
        scenes = [vd.Scene(**SCENE | {"frequency": f}) for f in SCENE["frequency"]]
        assert data.total.values == pytest.approx([s.velocity(n) for s, n in zip(scenes, r.total, strict=True)])
        assert r.to_dataframe().columns.tolist()[1:3] == ["last_degree", "total_m_per_s"]
        assert r.plot(quantity="total").axes[0].get_ylabel() == "speed of it all in m/s"
        assert r.plot(quantity="last").axes[0].get_ylabel() == "last of the function settling in degree"
        assert r.dimensionless().plot(quantity="total").axes[0].get_ylabel() == "speed of it all, dimensionless"
    record = vd.own(settling, version="1")
    assert vd.sweep(**SCENE, record=record, **SHORT, path=tmp_path / "x.h5").computed == 1.0, "a label is no number"


@pytest.mark.slow("6 s: a process that loads the kernels")
def test_a_function_that_cannot_be_sent_to_processes_is_refused():
    with (
        ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor,
        pytest.raises(TypeError, match="record = 'function': must be a function at the top of a module"),
    ):
        vd.sweep(A=[1.2, 1.3], **SHORT, record=lambda motion: 1.0, executor=executor)
