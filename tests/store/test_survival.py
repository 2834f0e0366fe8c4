"""A sweep survives kills, a second writer and signals without loss, with one line on stderr.

The processes run the real command line with simulated blocks (tests.support.fake) that need no computation, so that
the writer can be tested many times.
"""

import os
import signal
import time

import numpy as np
import pytest

from tests.support import fake
from tests.support.process import LIMIT, contents, sweeping
from vibrodrive.jobs.signals import catch
from vibrodrive.store.draft import draft_of
from vibrodrive.store.reader import look, verify

CONFIG = """
[sweep]
B = {start = 0.0, stop = 1.0, num = 30}
A = {start = 3.0, stop = 3.25, num = 1031}
[run]
transient = 0
periods = 20
"""
"""Configuration with 60 blocks. Every second block has fewer points."""

STAND_IN = """
import sys
from importlib import import_module
from tests.support import fake
delay = float(sys.argv.pop(1))
sweep = import_module("vibrodrive.batch.sweep")
def run_blocks(plan, which, **options):
    print("computing", flush=True)
    yield from fake.run_blocks(plan, which, delay=delay)
sweep.run_blocks = run_blocks
sweep.load_kernels = lambda plan: None
from vibrodrive.cli import main
main(sys.argv[1:])
"""


@pytest.fixture
def scene(tmp_path):
    with sweeping(tmp_path, CONFIG) as found:
        yield found


def assert_resumes(scene, undisturbed):
    """Assert that the file is sound and that the sweep ends as one without interruption. Return its messages."""
    assert verify(scene.file).sound
    err = scene.end(start(scene, delay=0))
    assert not draft_of(scene.file).exists()
    assert contents(scene.file) == undisturbed
    return err


def start(scene, *options, delay=0.005, before="", **popen):
    """Start the command line with simulated blocks."""
    return scene.start(*options, front=["-c", before + STAND_IN, str(delay)], **popen)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Return the results of a sweep without interruption."""
    path = tmp_path_factory.mktemp("undisturbed") / "c.h5"
    fake.write(path, CONFIG)
    return contents(path)


ANNOUNCED = signal.SIGHUP, signal.SIGUSR1, signal.SIGUSR2, signal.SIGXCPU
"""A closed terminal, and what batch systems (SGE, LSF, Slurm, limits of the CPU time) send before they kill a job."""


@pytest.mark.parametrize("ignored", ANNOUNCED)
def test_ignored_announcement_stays_ignored(ignored):
    signal.signal(ignored, signal.SIG_IGN)  # as under nohup, or by `trap '' USR1`; a fixture restores it
    catch(signal.default_int_handler)
    handled = [s for s in ANNOUNCED if signal.getsignal(s) is signal.default_int_handler]
    assert handled == [s for s in ANNOUNCED if s != ignored]
    assert signal.getsignal(ignored) is signal.SIG_IGN
    assert signal.getsignal(signal.SIGTERM) is signal.default_int_handler


def assert_one_line(err, *words):
    lines = [line for line in err.splitlines() if line.startswith("vibrodrive: ")]
    assert len(lines) == 1, err
    assert "Traceback" not in err
    assert [w for w in words if w not in lines[0]] == []


def test_kill_at_a_random_time_leaves_a_file_that_resumes(scene, undisturbed):
    """Written blocks survive each kill undamaged. The final file equals the file of an uninterrupted sweep."""
    random = np.random.default_rng()
    committed, struck = 0, 0
    while struck < 5:
        process = start(scene, delay=0.02)
        if struck % 4:  # three of four kills happen while blocks are written, the fourth also before
            while not scene.file.exists() and process.poll() is None:
                time.sleep(0.002)
        time.sleep(random.uniform(0, 0.7))
        struck += process.poll() is None
        process.kill()
        process.communicate()
        if scene.file.exists():
            report = verify(scene.file)
            assert report.sound
            assert report.done.sum() >= committed
            committed = report.done.sum()
            if report.complete:
                scene.file.unlink()
                committed = 0
    assert_resumes(scene, undisturbed)


@pytest.mark.parametrize("announced", ANNOUNCED[:2])
def test_signal_ends_a_sweep_with_the_command_to_resume(scene, undisturbed, announced):
    process = start(scene, "--overwrite", delay=0.3)
    scene.wait_for_blocks(process)
    process.send_signal(announced)
    err = scene.end(process, 130)
    assert_one_line(err, announced.name, "of 60 blocks", "resume with: vibrodrive sweep c.toml")
    assert "--overwrite" not in err
    done = look(scene.file).done.sum()
    assert 0 < done < 60
    assert f"resumed with {done} of 60 blocks" in assert_resumes(scene, undisturbed)


IN_A_WRITE = """
import os, signal
from vibrodrive.store.lock import Lock
write, written = Lock.write, []
def interrupted(lock, content, at):
    written.append(at)
    if len(written) == 90:
        os.kill(os.getpid(), signal.SIGINT)
    write(lock, content, at)
Lock.write = interrupted
"""


IN_A_BLOCK = """
from tests.support import fake
def block(plan, k, whole=fake.block):
    if k == 7:
        raise MemoryError("no memory for block 7")
    return whole(plan, k)
fake.block = block
"""


@pytest.mark.parametrize(
    ("before", "ends", "words"),
    [(IN_A_WRITE, 130, ["SIGINT"]), (IN_A_BLOCK, 1, ["no memory for block 7", "7 of 60 blocks are in the file"])],
    ids=["interrupt in a write", "failed computation"],
)
def test_blocks_before_the_end_are_kept(scene, undisturbed, before, ends, words):
    err = scene.end(start(scene, delay=0.01, before=before, preexec_fn=lambda: os.close(0)), ends)  # a lock may be 0
    done = look(scene.file).done.sum()
    assert 0 < done < 60
    assert_one_line(err, f"{done} of 60 blocks", *words)
    assert_resumes(scene, undisturbed)


def test_one_of_several_processes_writes_until_a_signal(scene, undisturbed):
    """The signal does not wait for the end of a block."""
    processes = [start(scene, delay=10 * LIMIT) for _ in range(2)]
    limit = time.monotonic() + LIMIT
    while sum(p.poll() is None for p in processes) > 1 and time.monotonic() < limit:
        time.sleep(0.01)
    writing = [p for p in processes if p.poll() is None]
    assert len(writing) == 1
    for process in processes:
        if process not in writing:
            assert_one_line(scene.end(process, 2), "another process is writing this file")
    assert writing[0].stdout.readline() == "computing\n"
    writing[0].send_signal(signal.SIGINT)
    assert_one_line(scene.end(writing[0], 130), "SIGINT", "0 of 60 blocks")
    assert_resumes(scene, undisturbed)
    assert sorted(p.name for p in scene.folder.iterdir()) == ["c.h5", "c.toml"]
