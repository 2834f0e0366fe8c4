"""Ctrl-C ends any work. No computation continues in the background, and the session remains usable.

Without Ctrl-C the sweeps, motions and limits of this file would take longer than LIMIT seconds. benchmarks/interrupt.py
measures the time from Ctrl-C to the end of a computation.
"""

import faulthandler
import gc
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from tempfile import TemporaryDirectory
from time import monotonic, process_time, sleep

import numpy as np
import pytest

import vibrodrive as vd
from tests.support.process import python

pytestmark = pytest.mark.jit

LIMIT = 600.0
"""Time in seconds after which the process of a test is ended if the test hangs."""

A = np.linspace(3.0, 3.25, 2000)
LONG = dict(A=A, eps=2e-4, transient=10_000_000, periods=10)


def on_threads():
    with ThreadPoolExecutor(2) as pool:
        vd.sweep(**LONG, executor=pool)


def into_a_file():
    with TemporaryDirectory() as folder:
        vd.sweep(**LONG, path=os.path.join(folder, "x.h5"))


CASES = {
    "simulate": lambda: vd.simulate(A=3.04, periods=5, transient=10**9),
    "simulate disturbed": lambda: vd.simulate(A=3.04, periods=5, eps=1e-4, transient=10**9),
    "simulate on a grid": lambda: vd.simulate(A=3.04, periods=5, method="muller", dtau=1e-6, transient=10**9),
    "sweep": lambda: vd.sweep(**LONG),
    "sweep on one thread": lambda: vd.sweep(**LONG, threads=1),
    "sweep on two threads": lambda: vd.sweep(**LONG, threads=2),
    "sweep on an executor": on_threads,
    "sweep into a file": into_a_file,
    "limit": lambda: vd.limit(3.04, transient=10**9, periods=100),
    "orbits": lambda: vd.orbits(4.5, max_period=13),
    "impact map": lambda: vd.impact_map(3.0, B=0.0)(np.linspace(0.6, 0.7, 600_000)),
    "sampling": lambda: MOTION.sample(20_000),
}

MOTION = None


def motion():
    return vd.simulate(A=3.04, transient=10, periods=1000)


@pytest.fixture(scope="module", autouse=True)
def prepared() -> None:
    """Compile all kernels, because first calls take longer. Store in MOTION a motion to compare after each Ctrl-C."""
    global MOTION
    MOTION = motion()
    MOTION.sample(1)
    vd.simulate(A=3.04, eps=1e-4, transient=0, periods=1)
    for method in ("fixed", "muller"):
        vd.simulate(A=3.04, method=method, dtau=1e-2, transient=0, periods=1)
    vd.sweep(A=[3.0, 3.04], eps=[0.0, 1e-4], transient=0, periods=1)
    vd.limit(3.04, transient=20, periods=10)
    vd.orbits(3.04)
    vd.impact_map(3.04)(1.0)


def interrupt(work) -> None:
    """Send SIGINT 0.3 s after the start of `work`, which must raise KeyboardInterrupt."""
    timer = threading.Timer(0.3, os.kill, [os.getpid(), signal.SIGINT])
    faulthandler.dump_traceback_later(LIMIT, exit=True)
    gc.collect()
    gc.disable()  # in callbacks of the collector and of weak references Python ignores a KeyboardInterrupt
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
    finally:
        faulthandler.cancel_dump_traceback_later()
        gc.enable()
        timer.cancel()
        timer.join()


@pytest.mark.parametrize("name", CASES)
def test_ctrl_c_ends_a_computation(name):
    before = threading.active_count()
    interrupt(CASES[name])
    ended = monotonic() + LIMIT
    while threading.active_count() > before and monotonic() < ended:  # a thread may be about to end
        sleep(0.01)
    assert threading.active_count() <= before  # a thread of an earlier test may have ended
    used = process_time()
    sleep(0.1)
    assert process_time() - used < 0.05, "no computation continues"
    assert motion() == MOTION


def test_executor_processes_end_their_tasks():
    """Running and queued blocks end, so that the executor can be used again."""
    with ProcessPoolExecutor(2) as pool:
        list(pool.map(abs, [1, 2]))
        interrupt(lambda: vd.sweep(**LONG, executor=pool))
        here = vd.sweep(A=[3.0, 3.04], periods=3, executor=pool)
        assert np.array_equal(here.section, vd.sweep(A=[3.0, 3.04], periods=3).section)


FIRST = """
import os, signal, threading, time
import vibrodrive as vd
vd.simulate
from vibrodrive.jit.compilation import compilation
def press():
    while not compilation.running:
        time.sleep(0.01)
    time.sleep(0.5)
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=press).start()
try:
    vd.simulate(A=3.04)
except KeyboardInterrupt:
    print("still compiling" if compilation.running else "compiled")
"""


def test_ctrl_c_during_compilation(tmp_path):
    """KeyboardInterrupt is raised immediately. The process ends normally although the compiler is still running."""
    assert python(FIRST, NUMBA_CACHE_DIR=str(tmp_path), VIBRODRIVE_CODE="numba") == "still compiling\n"
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
