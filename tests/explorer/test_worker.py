"""The worker runs one task at a time: that of the page that asked last."""

import threading
from time import monotonic, sleep

import pytest

from vibrodrive.explorer.engine import Worker
from vibrodrive.jit.slices import Halted

LIMIT = 600.0
"""Seconds after which a test stops waiting for an event."""


class Log:
    """A worker, the tasks that have run, and one task that runs until it is halted the first time."""

    def __init__(self):
        self.told, self.failures, self.begun = [], [], threading.Event()
        self.waits = []
        self.worker = Worker(
            lambda page, error: self.failures.append((page, type(error))), lambda *pages: self.waits.append(pages)
        )

    def long(self, halt):
        self.told.append("long")
        self.begun.set()
        if self.told.count("long") == 1:
            self.worker.pause(halt, LIMIT)

    def note(self, what):
        return lambda halt: self.told.append(what)

    def finished(self):
        end = monotonic() + LIMIT
        while not self.worker.idle():
            assert monotonic() < end
            sleep(0.002)
        return self.told


@pytest.fixture
def log():
    found = Log()
    found.worker.request(0, found.long)
    assert found.begun.wait(LIMIT)
    yield found
    found.worker.close()


def test_newest_request_of_a_page_replaces_the_others(log):
    for k in range(200):
        log.worker.request(0, log.note(k))
    assert log.finished()[0] == "long"
    assert (log.told[-1], log.told.count("long")) == (199, 1)


def test_request_of_another_page_interrupts_the_task_which_starts_again_unless_cancelled(log):
    log.worker.request(1, log.note("other"))
    assert log.finished() == ["long", "other", "long"]
    assert log.waits == [(0, 1)], "who waits is told for whom"
    log.told.clear()
    log.worker.request(0, log.long)
    while not log.told:
        sleep(0.002)
    log.worker.cancel(0)
    log.worker.request(1, log.note("other"))
    assert log.finished() == ["long", "other"]


def test_tasks_that_last_take_turns(log, monkeypatch):
    monkeypatch.setattr("vibrodrive.explorer.engine.TURN", 0.001)
    turns, enough = [], threading.Event()

    def endless(page):
        def task(halt):
            turns.append(page)
            if turns.count(0) > 2 < turns.count(1):
                enough.set()
            log.worker.pause(halt, LIMIT)

        return task

    for page in range(2):
        log.worker.request(page, endless(page))
    assert enough.wait(LIMIT)
    assert (0, 1) in log.waits
    assert (1, 0) in log.waits


def test_failed_task_is_reported_and_the_worker_continues(log):
    def halted(halt):
        raise Halted

    log.worker.cancel(0)
    for task in (lambda halt: 1 / 0, halted, log.note("next")):
        log.worker.request(3, task)
        log.finished()
    assert (log.told, log.failures) == (["long", "next"], [(3, ZeroDivisionError)])
