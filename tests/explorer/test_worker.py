"""The worker runs one task at a time, the most urgent request first. A separate process finds exact orbits."""

import os
import threading
from time import monotonic, sleep

import numpy as np
import pytest

pytest.importorskip("bokeh")

import vibrodrive as vd
from vibrodrive.explorer import exact
from vibrodrive.explorer.aside import SeparateProcess
from vibrodrive.explorer.worker import Rank, Slot, Worker
from vibrodrive.jit.slices import Halt, Halted

LIMIT = 600.0
"""Seconds after which a test stops waiting for an event."""


@pytest.fixture
def failures():
    return []


@pytest.fixture
def worker(failures):
    found = Worker(lambda slot, error: failures.append((slot, error)))
    yield found
    found.close()


def finished(worker):
    end = monotonic() + LIMIT
    while not worker.idle():
        assert monotonic() < end
        sleep(0.002)


def until_halted(halt):
    while not halt.called:
        sleep(0.001)
    raise Halted


def test_only_the_last_request_is_answered_one_at_a_time(worker):
    answered, running, most, begun, go_on = [], [], [], threading.Event(), threading.Event()

    def task(k):
        def work(halt):
            running.append(k)
            most.append(len(running))
            begun.set()
            go_on.wait(LIMIT)
            running.remove(k)
            if halt.called:
                raise Halted
            answered.append(k)

        return work

    worker.request(Slot(0, Rank.PICTURE), task(0))
    assert begun.wait(LIMIT)
    for k in range(1, 200):
        worker.request(Slot(0, Rank.PICTURE), task(k))
    go_on.set()
    finished(worker)
    assert answered == [199]
    assert most == [1, 1]


@pytest.mark.parametrize(
    ("running", "later"),
    [(Slot(0, Rank.EXACT), Slot(1, Rank.MOTION)), (Slot(0, Rank.PICTURE), Slot(1, Rank.PICTURE))],
    ids=["more urgent task", "later task of another page"],
)
def test_urgent_task_halts_and_restarts_the_running_task(worker, running, later):
    told, begun = [], threading.Event()

    def long(halt):
        told.append("running")
        begun.set()
        if told.count("running") == 1:
            until_halted(halt)

    worker.request(running, long)
    assert begun.wait(LIMIT)
    worker.request(later, lambda halt: told.append("later"))
    finished(worker)
    assert told == ["running", "later", "running"]


def test_follow_up_task_runs_after_its_task(worker):
    told = []

    def picture(halt):
        worker.follow(halt, Slot(0, Rank.MOTION), lambda halt: told.append("motion"))
        told.append(("picture", halt.called))

    worker.request(Slot(0, Rank.PICTURE), picture)
    finished(worker)
    assert told == [("picture", False), "motion"]


def test_halted_task_adds_no_follow_up_task(worker):
    told, begun = [], threading.Event()

    def picture(halt):
        begun.set()
        while not halt.called:
            sleep(0.001)
        worker.follow(halt, Slot(0, Rank.EXACT), lambda halt: told.append("old"))

    worker.request(Slot(0, Rank.PICTURE), picture)
    assert begun.wait(LIMIT)
    worker.cancel(0)
    finished(worker)
    assert told == []

    def other(halt):
        worker.request(Slot(0, Rank.EXACT), lambda halt: told.append("new"))
        worker.follow(halt, Slot(0, Rank.EXACT), lambda halt: told.append("old"))

    worker.request(Slot(0, Rank.PICTURE), other)
    finished(worker)
    assert told == ["new"]


def test_cancelled_task_does_not_restart(worker):
    told, begun = [], threading.Event()

    def long(halt):
        told.append("long")
        begun.set()
        until_halted(halt)

    worker.request(Slot(0, Rank.EXACT), long)
    assert begun.wait(LIMIT)
    worker.cancel(0, Rank.EXACT)
    worker.request(Slot(0, Rank.MOTION), lambda halt: told.append("motion"))
    finished(worker)
    assert told == ["long", "motion"]


def test_less_urgent_task_runs_later(worker):
    told, begun, go_on = [], threading.Event(), threading.Event()

    def picture(halt):
        begun.set()
        go_on.wait(LIMIT)
        told.append(("picture", halt.called))

    worker.request(Slot(0, Rank.PICTURE), picture)
    assert begun.wait(LIMIT)
    worker.request(Slot(0, Rank.EXACT), lambda halt: told.append("exact"))
    go_on.set()
    finished(worker)
    assert told == [("picture", False), "exact"]


def test_closed_page_has_no_tasks(worker):
    begun = threading.Event()
    told = []

    def long(halt):
        begun.set()
        until_halted(halt)

    worker.request(Slot(7, Rank.PICTURE), long)
    worker.request(Slot(8, Rank.EXACT), lambda halt: told.append("other"))
    assert begun.wait(LIMIT)
    worker.request(Slot(7, Rank.EXACT), lambda halt: told.append("gone"))
    worker.cancel(7)
    finished(worker)
    assert told == ["other"]


def test_failed_task_is_reported_and_the_worker_continues(worker, failures):
    told = []
    worker.request(Slot(0, Rank.PICTURE), lambda halt: 1 / 0)
    finished(worker)
    worker.request(Slot(0, Rank.PICTURE), lambda halt: told.append("next"))
    finished(worker)
    assert [type(error) for _, error in failures] == [ZeroDivisionError]
    assert told == ["next"]


def test_pause_ends_with_the_next_request(worker):
    begun, told = threading.Event(), []

    def resting(halt):
        begun.set()
        worker.pause(halt, 10 * LIMIT)
        told.append("rested")

    worker.request(Slot(0, Rank.PICTURE), resting)
    assert begun.wait(LIMIT)
    worker.request(Slot(0, Rank.PICTURE), lambda halt: told.append("next"))
    finished(worker)
    assert told == ["next"]


def test_request_replaces_tasks_of_other_ranks(worker, failures):
    """A new request cancels the older tasks of its page in one step, so that a cancelled task cannot add a request."""
    begun, ended, done = threading.Event(), threading.Event(), []

    def exact(halt):
        begun.set()
        while not halt.called:
            sleep(0.002)
        worker.follow(halt, Slot(1, Rank.EXACT), lambda halt: done.append("follows"))
        ended.set()

    worker.request(Slot(1, Rank.EXACT), exact)
    assert begun.wait(LIMIT)
    worker.request(Slot(1, Rank.MOTION), lambda halt: done.append("motion"))
    worker.request(Slot(2, Rank.EXACT), lambda halt: done.append("another page"))
    worker.request(Slot(1, Rank.PICTURE), lambda halt: done.append("picture"), (Rank.EXACT, Rank.MOTION))
    finished(worker)
    assert ended.is_set()
    assert sorted(done) in (["another page", "motion", "picture"], ["another page", "picture"])
    assert failures == []


@pytest.fixture(scope="module")
def aside():
    found = SeparateProcess(os.getpid)
    yield found
    found.close()


def test_frozen_program_does_not_start_itself_again(monkeypatch):
    """`sys.executable` is then the program, so each copy would start the next."""
    monkeypatch.setattr("vibrodrive.explorer.aside.FROZEN", True)
    aside = SeparateProcess(os.getpid)
    aside.start()
    assert aside._process is None
    with pytest.raises(RuntimeError, match="which a frozen program cannot start"):
        aside.call(Halt(), os.getpid)


def test_process_returns_results_and_errors(aside):
    assert aside.call(Halt(), divmod, 7, 2) == (3, 1)
    with pytest.raises(ValueError, match="B = -1"):
        aside.call(Halt(), exact.multiplier_at, 3.04, -1, 2, np.zeros(1))
    assert aside.call(Halt(), abs, -5) == 5


def test_halted_search_ends_its_process(aside):
    assert aside.call(Halt(), abs, -1) == 1
    process, halt = aside._process, Halt()
    threading.Timer(0.3, halt.call).start()
    with pytest.raises(Halted):
        aside.call(halt, sleep, LIMIT)
    assert process.returncode is not None
    assert aside.call(Halt(), abs, -2) == 2


def test_halt_ends_a_waiting_call_but_not_the_warm_up(tmp_path):
    """The warm-up (first task of the process) ends when the test writes to a pipe, after the first call was halted."""
    gate, there = tmp_path / "gate", tmp_path / "there"
    os.mkfifo(gate)
    aside, halt = SeparateProcess(gate.read_bytes), Halt()
    last_resort = threading.Timer(LIMIT, gate.write_bytes, [b""])
    last_resort.start()
    try:
        threading.Timer(0.2, halt.call).start()
        with pytest.raises(Halted):
            aside.call(halt, there.touch)
        process = aside._process
        threading.Thread(target=gate.write_bytes, args=[b""]).start()
        assert aside.call(Halt(), abs, -2) == 2
        assert aside._process is process
        assert not there.exists()
    finally:
        last_resort.cancel()
        aside.close()


def test_killed_process_is_restarted(aside):
    aside.call(Halt(), abs, -1)
    aside._process.kill()
    aside._process.wait()
    assert aside.call(Halt(), abs, -3) == 3


@pytest.mark.jit
def test_multiplier_equals_that_of_the_orbit(aside):
    motion = vd.simulate(3.04, transient=500, periods=4)
    (stable,) = (o for o in vd.orbits(3.04, max_period=2) if o.kind == "stable")
    assert exact.multiplier_at(3.04, 0.1, 2, motion.impacts["phase"]) == stable.multiplier
    assert np.isnan(exact.multiplier_at(3.04, 0.1, 2, motion.impacts["phase"] + 0.1))


@pytest.mark.jit
def test_orbits_and_bifurcations_of_a_window():
    lines, marks = exact.orbit_lines(2.55, 2.65, 0.1, 2, "impact_speed", 0.0)
    (doubling,) = (m for m in marks if m.kind == "period doubling")
    assert doubling.x == vd.bifurcations((2.55, 2.65), max_period=2)[0].A
    kinds = {(exact.STABLE, 1), (exact.UNSTABLE, 1), (exact.STABLE, 2)}
    assert {(line.kind, line.period) for line in lines} == kinds
    for line in lines:
        assert len(line.x) == len(line.y)


@pytest.mark.jit
def test_curves_of_phases_are_cut_at_a_full_turn_and_follow_one_impact():
    lines, _ = exact.orbit_lines(2.6, 2.8, 0.1, 2, "impact_phase", 0.0)
    steps = np.concatenate([np.abs(np.diff(line.y)) for line in lines])
    assert np.nanmax(steps) < 0.3
    assert any(np.nanmin(line.y) < 0.1 and np.nanmax(line.y) > 6.2 for line in lines)
