"""Settings for all tests: compile kernels once before the workers start, use two threads, and set marks.

The tests are a package, so that `from tests.exact.reference import reference` works in the root of the repository.
"""

import os
import signal
import sys
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from time import monotonic

import numpy.testing  # noqa: F401  NumPy 1.26 starts a process when it is imported, which a unit test may not
import pytest
from hypothesis import settings

from build_kernels import kernels
from vibrodrive.jit.compile import Kernel, Marked
from vibrodrive.jobs.signals import SIGNALS

settings.register_profile("tests", deadline=None, derandomize=True)  # the same examples in every run
settings.load_profile("tests")

os.environ.setdefault("NUMBA_NUM_THREADS", "2")  # set before Numba is imported; tests use two threads

COMPILES = os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile before pytest-xdist starts its workers. Otherwise each worker would compile the same kernels."""
    config = session.config
    if not COMPILES or hasattr(config, "workerinput") or not getattr(config.option, "numprocesses", None):
        return
    if config.option.collectonly or config.option.markexpr == "unit":
        return
    terminal = config.pluginmanager.get_plugin("terminalreporter")
    began = monotonic()
    terminal.write("compiling kernels once for all workers (a minute if none are on disk) … ", flush=True)
    compile_kernels()
    terminal.write_line(f"{monotonic() - began:.0f} s")


def compile_kernels() -> None:
    """Compile every kernel, or load it from the cache, in two processes."""
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        for done in [pool.submit(_compile, kernel.name) for kernel in kernels()]:
            done.result()


def _compile(name: str) -> None:
    next(kernel for kernel in kernels() if kernel.name == name).prepare()


UNIT = (
    "benchmarks/", "explorer/test_view.py", "explorer/test_work.py", "figures/test_curves.py",
    "jobs/test_maps.py", "kernels/test_lane.py", "kernels/test_scheme.py", "model/",
    "stability/", "store/test_draft.py", "store/test_place.py", "store/test_store.py",
    "test_model_page.py", "test_pages.py",
)  # fmt: skip
"""Files and folders of unit tests. A test in these files is no unit test if it has a mark of NO_UNIT."""

NO_UNIT = ("jit", "slow", "browser", "integration")

HERE = Path(__file__).parent


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the unit tests, check the reasons of slow tests, and skip tests marked `jit` if Numba does not compile.

    Without compiled kernels, tests marked `jit` would run for hours.
    """
    skip = pytest.mark.skip(reason="needs compiled kernels")
    for item in items:
        if item.path.relative_to(HERE).as_posix().startswith(UNIT) and not any(m in item.keywords for m in NO_UNIT):
            item.add_marker("unit")
        if any(not mark.args for mark in item.iter_markers("slow")):
            raise pytest.UsageError(f"{item.nodeid}: the mark `slow` needs seconds and a reason")
        if not COMPILES and "jit" in item.keywords:
            item.add_marker(skip)


def pytest_report_collectionfinish(config: pytest.Config, items: list[pytest.Item]) -> list[str]:
    """List the slow tests by reason (`pytest -m slow --collect-only`)."""
    if not config.option.collectonly:
        return []
    reasons: dict[str, int] = {}
    for item in items:
        for mark in item.iter_markers("slow"):
            name = f"{item.nodeid.partition('[')[0]}: {mark.args[0]}"
            reasons[name] = reasons.get(name, 0) + 1
    return [f"{name} ({count} tests)" if count > 1 else name for name, count in reasons.items()]


@pytest.fixture
def finding(record_property):
    """Return a function that asserts that a number is at most its bound, and adds both to the table of `-m exact`."""

    def check(what: str, number: float, bound: float) -> None:
        record_property("finding", (what, float(number), float(bound)))
        assert number <= bound, what

    return check


def pytest_terminal_summary(terminalreporter, config: pytest.Config) -> None:
    """Print the table of `pytest -m exact`: each number of a comparison, and its bound."""
    reports = [report for several in terminalreporter.stats.values() for report in several]
    found = [each for report in reports for each in getattr(report, "user_properties", ())]
    rows = sorted({tuple(value) for name, value in found if name == "finding"})
    if "exact" in config.option.markexpr and rows:
        terminalreporter.section("numbers, their bounds, verdicts")
        for what, number, bound in rows:
            verdict = "holds" if number <= bound else "FAILS"
            terminalreporter.write_line(f"{number:9.3g}  {bound:7.1g}  {verdict}  {what}")


class _Guard:
    """Let a unit test fail if it calls a kernel, or what is compiled for one, or starts a process."""

    on = False

    def __init__(self) -> None:
        for owner, name in ((Marked, "__call__"), (Kernel, "prepare")):
            setattr(owner, name, self.guarded(getattr(owner, name)))
        sys.addaudithook(lambda event, _: event in self.STARTS and self.refuse("starts a process"))

    def guarded(self, method):
        def call(marked, *args):
            if self.on and marked.__dict__.get("code") is not marked.py_func:
                self.refuse(f"calls {marked.__qualname__}")
            return method(marked, *args)

        return call

    STARTS = ("subprocess.Popen", "os.fork", "os.forkpty", "os.posix_spawn", "os.system", "os.exec")

    def refuse(self, what: str) -> None:
        if self.on:
            raise RuntimeError(
                f"a unit test {what}: mark it `integration` (or `jit`), or see UNIT in tests/conftest.py"
            )


@pytest.fixture(scope="session")
def _guard():
    return _Guard()


@pytest.fixture(autouse=True)
def _units_compile_nothing_and_start_nothing(request):
    if "unit" not in request.keywords:
        yield
        return
    guard = request.getfixturevalue("_guard")
    guard.on = True
    yield
    guard.on = False


# Tests send signals to their process. In background jobs of a shell SIGINT is ignored, under nohup SIGHUP: undo both.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

HANDLERS = {s: signal.getsignal(s) for s in SIGNALS}


@pytest.fixture(autouse=True)
def _signal_handlers():
    """Restore the signal handlers after each test, because the command line sets its own."""
    yield
    for s, handler in HANDLERS.items():
        signal.signal(s, handler)


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Return a function that runs a command in an empty directory and returns (exit code, stdout, stderr)."""
    from vibrodrive import cli

    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["vibrodrive", *arguments])
        with pytest.raises(SystemExit) as end:
            cli.main(arguments)
        return end.value.code or 0, *capsys.readouterr()

    return call


@pytest.fixture
def quick(monkeypatch):
    """Replace the computation of a sweep by artificial values. Return the list of the indices of computed blocks."""
    from tests.support import fake

    computed = []

    def blocks(plan, which=None, **options):
        for block in fake.run_blocks(plan, which):
            computed.append(block.index)
            yield block

    sweep = import_module("vibrodrive.batch.sweep")
    monkeypatch.setattr(sweep, "run_blocks", blocks)
    monkeypatch.setattr(sweep, "load_kernels", lambda plan: None)
    return computed
