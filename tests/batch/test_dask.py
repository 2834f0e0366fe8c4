"""A sweep on a Dask cluster gives the bits of a local sweep, even if a worker dies and its blocks are repeated."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import vibrodrive as vd
from tests.support.process import LIMIT, ROOT, contents, sweeping
from vibrodrive.jobs import sweep as job
from vibrodrive.store.reader import look, verify

distributed = pytest.importorskip("distributed")

CONFIG = """
[sweep]
A = {start = 3.0, stop = 3.25, num = 20}
eps = [0.0, 1e-4]
[run]
transient = 50
periods = 30000
"""
"""Configuration of a sweep with 40 points in five blocks, each of which takes some tenths of a second."""

ARGUMENTS = {"A": np.linspace(3.0, 3.25, 20), "eps": [0.0, 1e-4], "transient": 50, "periods": 30000}


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    path = tmp_path_factory.mktemp("local") / "c.h5"
    vd.sweep(**ARGUMENTS, threads=1, path=path)
    return contents(path)


@pytest.fixture
def scene(tmp_path):
    with sweeping(tmp_path, CONFIG) as found:
        yield found


def start(module, *arguments):
    return subprocess.Popen(
        [sys.executable, "-m", f"distributed.cli.{module}", *arguments],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def start_scheduler(folder):
    """Return a scheduler and the file with its address."""
    file = folder / "scheduler.json"
    options = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file))
    process, limit = start("dask_scheduler", *options), time.monotonic() + LIMIT
    while not (file.exists() and file.stat().st_size) and time.monotonic() < limit:
        time.sleep(0.05)
    return process, file


def start_worker(address, folder):
    options = ("--nthreads", "1", "--no-dashboard", "--no-nanny", "--local-directory", str(folder))
    return start("dask_worker", address, *options)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Yield (address, processes, folder) of a real scheduler on this machine and its two workers."""
    folder = tmp_path_factory.mktemp("cluster")
    scheduler, file = start_scheduler(folder)
    processes = [scheduler]
    try:
        with distributed.Client(scheduler_file=str(file), timeout=LIMIT) as client:
            address = client.scheduler.address
            processes += [start_worker(address, folder) for _ in range(2)]
            client.wait_for_workers(2, timeout=LIMIT)
        yield address, processes, folder
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.mark.jit
@pytest.mark.slow("8 s: a new worker replaces the killed one and loads the kernels")
def test_sweep_survives_a_killed_worker(cluster, local, scene):
    address, processes, folder = cluster
    worker = processes.pop()
    worker.send_signal(signal.SIGSTOP)  # so that the worker dies before its block is finished
    process = scene.start("--dask", address)
    scene.wait_for_blocks(process)
    assert not look(scene.file).complete
    worker.kill()
    worker.wait()
    scene.end(process)
    assert verify(scene.file).sound
    assert contents(scene.file) == local
    processes.append(start_worker(address, folder))


@pytest.mark.jit
def test_sweep_stopped_on_a_cluster_resumes_locally(cluster, local, scene):
    worker = cluster[1][-1]
    worker.send_signal(signal.SIGSTOP)  # so that some blocks are unfinished when the command receives SIGTERM
    try:
        process = scene.start("--dask", cluster[0])
        scene.wait_for_blocks(process)
        process.send_signal(signal.SIGTERM)
        scene.end(process, 130)
    finally:
        worker.send_signal(signal.SIGCONT)
    assert not look(scene.file).complete
    scene.end(scene.start())
    assert contents(scene.file) == local


def test_unreachable_address_prints_one_line_and_leaves_no_file(run, tmp_path, monkeypatch):
    monkeypatch.setattr(job, "REACH_SECONDS", 0.5)
    (tmp_path / "c.toml").write_text(CONFIG)
    code, _, err = run("sweep", "c.toml", "--dask", "tcp://127.0.0.1:1")
    assert code == 2
    assert [line for line in err.splitlines() if "127.0.0.1:1" in line and line.startswith("vibrodrive: ")]
    assert "Traceback" not in err
    assert [p.name for p in tmp_path.iterdir()] == ["c.toml"]


def test_cluster_without_workers_is_reported(tmp_path, scene):
    scheduler, file = start_scheduler(tmp_path)
    try:
        process = scene.start("--dask", json.loads(file.read_text())["address"])
        line = process.stderr.readline()
        process.send_signal(signal.SIGINT)
        scene.end(process, 130)
    finally:
        scheduler.kill()
        scheduler.wait()
    assert line.endswith(": the cluster has no workers; the sweep waits for them\n")
