"""A sweep is a loop of `numba.prange`. It runs on each threading layer, in several threads, and in forked children."""

import os
import subprocess
import sys
import threading
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from time import sleep

import numba
import numpy as np
import pytest
from numba import types

import vibrodrive as vd
from vibrodrive.batch import parallel, prange
from vibrodrive.batch.sweep import check_threads, run_blocks
from vibrodrive.jit.slices import Halt
from vibrodrive.jit.sources import build
from vibrodrive.kernels.arguments import Arguments, packed
from vibrodrive.kernels.engine import batch
from vibrodrive.model.plan import make_plan

TWO = int(numba.config.NUMBA_NUM_THREADS) > 1
LOOP = pytest.mark.skipif(
    not TWO or bool(getattr(batch(0, False, False), "shipped", None)),
    reason="Numba's loop runs with several threads, and with kernels that Numba has compiled",
)
POINTS = dict(A=np.linspace(1.2, 3.25, 20), transient=2, periods=3)
WAYS = [
    dict(eps=[0.0, 2e-4]),
    *(dict(eps=[0.0, 2e-4], method=method, dtau=0.1) for method in ("fixed", "muller")),
]


@pytest.mark.jit
@LOOP
@pytest.mark.parametrize("way", WAYS)
def test_sweeps_run_in_the_loop_with_the_bits_of_one_thread(way, monkeypatch):
    used = []
    monkeypatch.setattr(numba, "set_num_threads", used.append)
    monkeypatch.setattr("vibrodrive.batch.sweep.BRIEF", 0.0)
    two = vd.sweep(**POINTS, **way, threads=2)
    assert used == [2]
    one = vd.sweep(**POINTS, **way, threads=1)
    assert used == [2]
    assert all(np.array_equal(one[n], two[n]) for n in ("section", "status", "margin", "switches"))


@pytest.mark.jit
def test_brief_work_starts_no_thread(monkeypatch):
    monkeypatch.setattr(parallel, "_watch", None)
    short = dict(transient=2, periods=3)
    few = vd.sweep(A=[2.0, 3.0], eps=[0.0, 2e-4], **short)
    assert np.array_equal(few.section[1, 0], vd.simulate(A=3.0, **short).section)
    long = short | dict(transient=10**5)
    with pytest.raises(TypeError, match="NoneType"):
        vd.sweep(A=[2.0, 3.0], **long)
    with pytest.raises(TypeError, match="NoneType"):
        vd.simulate(A=2.0, **long)


@pytest.mark.jit
def test_loop_is_a_prange():
    """The function is compiled again, because the cache of Numba does not store the diagnostics of its loops."""
    assert prange.run_on_threads.dispatcher.targetoptions["parallel"]
    function = types.FunctionType(types.int64(types.int64))
    again = numba.njit(parallel=True)(prange.run_on_threads.py_func)
    again.compile((function, function, types.Array(types.int64, 2, "C")))
    (metadata,) = again.get_metadata().values()
    assert metadata["parfor_diagnostics"].count_parfors() == 1


SCRIPT = """
import os, sys, threading
import numba
import numpy as np
import vibrodrive as vd
from vibrodrive.batch import parallel, sweep

sweep.BRIEF = 0

def section(threads=2):
    return vd.sweep(A=np.linspace(3, 3.25, 50), eps=[0, 1e-4], transient=5, periods=5, threads=threads).section

one = section(1)
numba.set_num_threads(1)
assert np.array_equal(section(), one)
assert numba.get_num_threads() == 1, "a sweep keeps the number of threads that the user has set"
assert numba.threading_layer() == sys.argv[1]

found = [None] * 4
def sweep(k):
    for _ in range(5):
        found[k] = section()
threads = [threading.Thread(target=sweep, args=(k,)) for k in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert all(np.array_equal(there, one) for there in found)

def child(work):
    pid = os.fork()
    if pid == 0:
        os._exit(0 if work() else 1)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])

assert child(lambda: np.array_equal(section(), one)) == 0, "a forked child can sweep"

@numba.njit(parallel=True)
def total(n):
    s = 0
    for i in numba.prange(n):
        s += i
    return s

total(10)
print(child(lambda: total(10) == 45), flush=True)
"""


@pytest.mark.jit
@pytest.mark.parametrize("layer", ["omp", "workqueue", "tbb"])
def test_threads_and_forked_children_of_one_process_sweep(layer):
    """Sweeps run in four threads and in a forked child. With GNU's OpenMP a user's prange ends the child by SIGTERM."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, layer],
        env={**os.environ, "NUMBA_NUM_THREADS": "2", "NUMBA_THREADING_LAYER": layer},
        capture_output=True,
        text=True,
        timeout=600,
    )
    if "threading layer could be loaded" in done.stderr:
        pytest.skip(f"no {layer} here")
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) == (-15 if layer == "omp" and sys.platform == "linux" else 0)


@pytest.mark.jit
@pytest.mark.skipif(not TWO, reason="Numba has one thread")
@pytest.mark.parametrize("startable", [0, 1, 2, 9])
def test_threads_of_python_compute_the_same_even_if_few_can_be_started(monkeypatch, startable):
    """One thread waits for Ctrl-C while another computes. If no other can be started, it takes all points."""
    one, started, worker = vd.sweep(**POINTS, threads=1), [], parallel._Worker

    def start():
        if len(started) == startable:
            raise RuntimeError("can't start new thread")
        started.append(worker())
        return started[-1]

    monkeypatch.setattr("vibrodrive.batch.prange.works", lambda: False)
    monkeypatch.setattr("vibrodrive.batch.sweep.BRIEF", 0.0)
    monkeypatch.setattr(parallel, "_workers", [])
    monkeypatch.setattr(parallel, "_Worker", start)
    assert np.array_equal(vd.sweep(**POINTS, threads=2).section, one.section)
    assert len(started) == min(startable, 2)


def share(motion):
    return motion.section[:, 1].mean()


@pytest.mark.jit
@pytest.mark.parametrize("startable", [0, 1])
def test_every_call_computes_the_same_if_hardly_a_thread_can_be_started(monkeypatch, tmp_path, startable):
    """As with `ulimit -u`: a pool with fewer threads than tasks computes each task once."""
    short, start = dict(transient=60, periods=100), threading.Thread.start

    def few(thread):
        if thread in left or len(left) == startable:
            raise RuntimeError("can't start new thread")
        left.append(thread)
        start(thread)

    def computed(name):
        yield vd.sweep(**POINTS, path=tmp_path / name).section
        for record in (share, "limit"):
            left.clear()
            found = vd.sweep(A=[3.0, 3.04, 3.1], record=record, threads=2, **short)
            yield found[found.quantities[0].name]
        left.clear()
        yield np.array([vd.limit(3.04, **short, threads=1).k2])

    left = []
    wanted = list(computed("all.h5"))
    monkeypatch.setattr(threading.Thread, "start", few)
    monkeypatch.setattr(parallel, "_workers", [])
    monkeypatch.setattr(parallel, "_Worker", lambda: few(None))
    for some, every in zip(computed("few.h5"), wanted, strict=True):
        np.testing.assert_array_equal(some, every)


@pytest.mark.jit
def test_arrays_of_other_types_are_refused():
    memory, one = np.zeros((1, 2)), np.zeros(1, np.int64)
    results = np.zeros((1, 2, 2)), np.zeros(1, np.int8), np.zeros(1), np.zeros((1, 5), np.int64), np.zeros(1)
    arguments = Arguments(memory, memory.astype(np.int64), one, memory, one, one, one, *results)
    assert packed([arguments]).shape[0] == 1
    for wrong in (np.zeros((1, 2), np.float32), np.zeros(2), np.zeros((2, 4))[:, ::2]):
        with pytest.raises(TypeError, match="points"):
            packed([arguments._replace(points=wrong)])


@pytest.mark.jit
def test_number_of_threads_set_in_numba_is_the_default():
    """Numba keeps this number for each thread."""

    def ask():
        numba.set_num_threads(1)
        return check_threads(None), check_threads(TWO + 1)

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(ask).result() == (1, TWO + 1)
    assert check_threads(None) == int(numba.config.NUMBA_NUM_THREADS)


class Failing(Executor):
    """Executor in which each task fails the first `times` times, as if the worker died."""

    def __init__(self, times):
        self.times, self.submitted = times, []

    def submit(self, task, *arguments):
        ((_, start, _),) = arguments[3]
        self.submitted.append(start)
        future = Future()
        if self.submitted.count(start) > self.times:
            future.set_result(task(*arguments))
        else:
            future.set_exception(OSError("the worker died"))
        return future


@pytest.mark.jit
def test_block_is_resubmitted_three_times():
    plan = make_plan(dict(A=np.linspace(3, 3.1, 3), transient=0, periods=2))
    plan = replace(plan, tiling=(2,))
    saved = Failing(3)
    assert {block.index for block in run_blocks(plan, executor=saved)} == {0, 1}
    assert sorted(saved.submitted) == [0] * 4 + [2] * 4
    lost = Failing(4)
    with pytest.raises(OSError, match="the worker died"):
        list(run_blocks(plan, executor=lost))
    assert max(map(lost.submitted.count, lost.submitted)) == 4


class Lazy(Executor):
    """Executor of one worker that computes a task when the sweep waits."""

    _max_workers = 1

    def __init__(self):
        self.todo, self.flying, self.sizes = [], [], []

    def submit(self, task, *arguments):
        self.todo.append((Future(), task, arguments))
        self.sizes.append(len(arguments[3]))
        return self.todo[-1][0]

    def wait(self, futures, return_when):
        self.flying.append(len(futures))
        future, task, arguments = self.todo.pop(0)
        future.set_result(task(*arguments))
        return {future}, set()


@pytest.mark.jit
def test_workers_have_two_tasks_each_which_become_small(monkeypatch):
    """So a sweep of many points needs little memory for tasks, and no worker is idle at the end."""
    executor = Lazy()
    monkeypatch.setattr("vibrodrive.batch.sweep.wait", executor.wait)
    plan = replace(make_plan(dict(A=np.linspace(3, 3.1, 40), transient=0, periods=2)), tiling=(2,))
    assert sorted(block.index for block in run_blocks(plan, executor=executor)) == [*range(20)]
    assert (max(executor.flying), sum(executor.sizes)) == (2, 20)
    assert executor.sizes == sorted(executor.sizes, reverse=True)
    assert executor.sizes[0] > 2
    assert executor.sizes[-2:] == [1, 1]


class Elsewhere(Executor):
    """Executor whose workers have other sources than this process."""

    submitted = 0

    def submit(self, task, made_by, *arguments):
        self.submitted += 1
        with ThreadPoolExecutor(1) as pool:
            return pool.submit(task, "vibrodrive 0.1.0 (sources 0123456789ab)", *arguments)


def test_worker_with_other_sources_is_refused():
    """The message names both, and the block is not submitted again."""
    executor = Elsewhere()
    with pytest.raises(vd.errors.Failed, match=r"sources 0123456789ab\): must be the same") as caught:
        list(run_blocks(make_plan(dict(A=[3.0, 3.1], transient=0, periods=2)), executor=executor))
    assert build() in str(caught.value)
    assert executor.submitted == 1


def test_error_after_ctrl_c_is_not_raised_by_the_next_call():
    """An error occurs in a thread after Ctrl-C. The next call uses this thread, but must not raise the error."""

    class Pressed(Halt):
        @property
        def called(self):
            raise KeyboardInterrupt

    halt = Pressed()

    def fail():
        while not halt.flag[0]:
            sleep(0.001)
        raise ValueError("of the first call")

    with pytest.raises(KeyboardInterrupt):
        parallel._watch(fail, fail, halt)
    parallel._watch(lambda: None, fail, Halt())


@pytest.mark.jit
@LOOP
@pytest.mark.parametrize("chosen", [{}, {"OMP_WAIT_POLICY": "active"}, {"GOMP_SPINCOUNT": "7"}])
def test_idle_threads_wait_briefly_unless_the_user_has_chosen(chosen, monkeypatch):
    others = {name: value for name, value in os.environ.items() if "OMP_" not in name}
    monkeypatch.setattr(os, "environ", others | chosen)
    monkeypatch.setattr("vibrodrive.batch.sweep.BRIEF", 0.0)
    vd.sweep(**POINTS, threads=2)
    spins = None if "OMP_WAIT_POLICY" in chosen else chosen.get("GOMP_SPINCOUNT", prange.SPINS)
    assert os.environ.get("GOMP_SPINCOUNT") == spins
