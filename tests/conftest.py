"""What holds for every test: kernels compiled once before the workers start, and no test of them without the JIT.

The tests are a package, so `from tests.support.reference import reference` works from the repository root.
"""

from __future__ import annotations

import os
import signal
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from time import monotonic

import pytest

COMPILES = os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile before pytest-xdist starts its workers: each of them would compile the same kernels at the same time."""
    config = session.config
    if not COMPILES or hasattr(config, "workerinput") or not getattr(config.option, "numprocesses", None):
        return
    terminal = config.pluginmanager.get_plugin("terminalreporter")
    began = monotonic()
    terminal.write("kernels, once for all workers (a minute, where none are on disk) … ", flush=True)
    compile_kernels()
    terminal.write_line(f"{monotonic() - began:.0f} s")


def compile_kernels() -> None:
    """Call every kernel that several tests use, or load it from disk: on two cores, in processes of their own."""
    methods = ("certified", "muller", "fixed")
    sweeps = [(_sweep, m, eps, record) for m in methods for eps in (0.0, 2e-4) for record in ("summary", "section")]
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        for done in [pool.submit(*call) for call in [*sweeps, *((_simulate, m) for m in methods), (_orbits,)]]:
            done.result()


SHORT = {"transient": 1, "periods": 1}


def _of(method: str) -> dict[str, object]:
    return {"method": method} | ({} if method == "certified" else {"dtau": 0.1})


def _sweep(method: str, eps: float, record: str) -> None:
    import vibrodrive as vd

    vd.sweep(A=[3.04], eps=[eps], **_of(method), record=record, threads=1, **SHORT)


def _simulate(method: str) -> None:
    import vibrodrive as vd

    vd.simulate(A=3.04, **_of(method), **SHORT).sample(4)


def _orbits() -> None:
    import vibrodrive as vd
    from vibrodrive.periodic.attractors import attractors

    vd.orbits(A=3.04, max_period=2)
    attractors([3.04], limit=100)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave out what is marked `jit` when Numba does not compile: it would run for hours."""
    if COMPILES:
        return
    skip = pytest.mark.skip(reason="needs compiled kernels")
    for item in items:
        if "jit" in item.keywords:
            item.add_marker(skip)


HANDLED = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
HANDLERS = {s: signal.getsignal(s) for s in HANDLED}


@pytest.fixture(autouse=True)
def _signal_handlers():
    """Each test leaves the handlers of signals as they were at the beginning: the command line sets its own."""
    yield
    for s, handler in HANDLERS.items():
        signal.signal(s, handler)


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Run a command of the program in an empty directory; returns (exit code, stdout, stderr)."""
    from vibrodrive import cli

    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["vibrodrive", *arguments])
        with pytest.raises(SystemExit) as end:
            cli.main(arguments)
        return end.value.code or 0, *capsys.readouterr()

    return call
