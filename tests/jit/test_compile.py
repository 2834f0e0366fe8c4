"""Tests of the cache of kernels, which are compiled again after a change of their sources, Python or the processor.

A message is shown during a long compilation.
"""

import ast
import os
import re
import shutil
import subprocess
import sys
import time
import zipfile
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numba.core.event import trigger_event

import vibrodrive as vd
from build_kernels import _marked, kernels
from tests.support import fake
from tests.support.process import python
from vibrodrive.jit import compiler as _jit
from vibrodrive.jit import sources as _sources
from vibrodrive.jit.compile import jit
from vibrodrive.jobs.progress import COMPILING, Show
from vibrodrive.jobs.sweep import Job, run
from vibrodrive.model.plan import make_plan
from vibrodrive.store.layout import Origin

ROOT = Path(vd.__file__).parent


def fingerprint(root: Path) -> str:
    """Return the hash of the sources of kernels in a copy of the package."""
    found = _sources.read(root)
    return _sources.hash_of(found, filter(_sources.is_compiled, found))


def imports_of(source: bytes) -> set[str]:
    """Return the modules, and the names in modules, that a module imports when it is imported itself."""
    names = set()
    for statement in ast.parse(source).body:
        if isinstance(statement, ast.Import):
            names |= {alias.name for alias in statement.names}
        elif isinstance(statement, ast.ImportFrom):
            assert statement.level == 0, "relative"
            names |= {f"{statement.module}.{alias.name}" for alias in statement.names} | {statement.module}
    return names


def test_machine_code_depends_on_the_named_modules_only():
    """These are all modules with kernels, and what they import. An edit of a figure compiles nothing again."""
    found = _sources.read(ROOT)
    named = {name for name in found if _sources.is_compiled(name)}
    assert {kernel.__module__ for kernel in (*kernels(), *_marked())} < named
    used = {each for name in named for each in imports_of(found[name]) if each in found and found[each].strip()}
    assert used - named == {"vibrodrive.version"}, "whose number changes no machine code"
    assert {f"vibrodrive.{each}" for each in _sources.COMPILED} <= set(found)


@pytest.mark.parametrize(
    ("where", "name", "value"),
    [
        (sys.implementation, "cache_tag", "cpython-399"),
        (sys, "abiflags", "t"),
        (_jit.numba, "__version__", "9.9"),
        (_jit.llvmlite, "__version__", "9.9"),
        (np, "__version__", "9.9"),
        (_jit, "processor", lambda: ("x86_64", "generic", "")),
    ],
)
def test_cache_directory_depends_on_python_compiler_and_processor(monkeypatch, tmp_path, where, name, value):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    before = _jit._cache_directory()
    monkeypatch.setattr(where, name, value)
    assert _jit._cache_directory() != before


def test_fingerprint_of_an_archive_and_of_a_frozen_program(tmp_path, monkeypatch):
    """An archive has the fingerprint of its files; a program without sources has that of the program."""
    copy = shutil.copytree(ROOT, tmp_path / "vibrodrive", ignore=shutil.ignore_patterns("__pycache__"))
    (copy / "jit" / ".#compile.py").symlink_to("nowhere")  # Emacs marks a file that is being edited
    before = fingerprint(copy)
    archive = shutil.make_archive(tmp_path / "package", "zip", tmp_path, "vibrodrive")
    shutil.rmtree(copy / "jit")
    assert fingerprint(zipfile.Path(archive, "vibrodrive/")) == before != fingerprint(copy)
    monkeypatch.setattr(sys, "executable", archive)
    assert _sources.read(tmp_path / "frozen") == {"": Path(archive).read_bytes()}


FACTORY = "from vibrodrive.jit.compile import jit\ndef kernel(n):\n @jit\n def run(x):\n  return x + n\n return run\n"

NOWHERE = """
import sys, tempfile
tempfile._candidate_tempdir_list = list
sys.path.insert(0, sys.argv[1])
from kinds import kernel
from vibrodrive.jit.compiler import CACHE
print(CACHE, kernel(3)(4))
"""


@pytest.mark.jit
def test_kernels_run_where_nothing_can_be_written(tmp_path):
    (tmp_path / "kinds.py").write_text(FACTORY)
    places = {"NUMBA_CACHE_DIR": "~no user of this name/"}  # as without HOME and without an entry in passwd
    done = subprocess.run(
        [sys.executable, "-c", NOWHERE, tmp_path], env=os.environ | places, capture_output=True, text=True, timeout=1200
    )
    assert (done.returncode, done.stdout) == (0, "None 7\n"), done.stderr
    assert done.stderr.startswith("vibrodrive: kernels are compiled without the cache ([Errno 2] No usable temporary")
    assert done.stderr.count("\n") == 1


def test_directory_of_the_cache_is_found(monkeypatch, tmp_path):
    """A directory that cannot be made or written is replaced by one that only this user can write."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (tmp_path / "file").touch()
    monkeypatch.setattr("tempfile.tempdir", str(elsewhere))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    path = _jit._cache_directory()
    assert (path.parent, path.stat().st_mode & 0o777) == (elsewhere, 0o700)
    if hasattr(os, "getuid"):
        other = os.getuid() + 1
        monkeypatch.setattr(os, "getuid", lambda: other)  # then this user is the stranger who has made the directory
        with pytest.raises(PermissionError, match="belongs to another user"):
            _jit._cache_directory()


def double(x):
    return 2.0 * x


@pytest.fixture
def computing(tmp_path, monkeypatch, capsys):
    """Return a function that runs a kernel as a new process would, and returns (was it compiled, text on stderr)."""
    monkeypatch.setattr(_jit, "CACHE", tmp_path)

    def call() -> tuple[bool, str]:
        monkeypatch.setattr(_jit, "_reasons", [])
        kernel = jit(double)
        assert kernel(3.0) == 6.0
        return not kernel.dispatcher.stats.cache_hits, capsys.readouterr().err

    return call


@pytest.mark.jit
@pytest.mark.parametrize(
    ("ending", "harm"),
    [("nbc", "changed"), ("nbc", "cut"), ("nbi", "empty"), ("nbi", "folder")],
)
def test_damaged_file_of_the_cache_is_replaced(computing, tmp_path, ending, harm):
    """Damaged machine code must not run: one changed byte could change results."""
    assert computing() == (True, "")
    assert computing() == (False, "")
    (path,) = tmp_path.rglob(f"*.{ending}")
    content = path.read_bytes()
    middle = len(content) // 2
    path.unlink()
    if harm == "folder":
        path.mkdir()
    else:
        changed = content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]
        path.write_bytes({"empty": b"", "cut": content[:middle], "changed": changed}[harm])
    compiled, said = computing()
    assert compiled
    assert re.fullmatch(rf"vibrodrive: kernels are compiled without the cache in {tmp_path} \(.+\)\n", said)
    if harm != "folder":
        assert computing() == (False, "")


@pytest.mark.jit
@pytest.mark.parametrize("step", ["_open_for_write", "_load_index"])
def test_disk_that_fails_costs_the_cache_only(computing, monkeypatch, step):
    def fails(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(f"numba.core.caching.IndexDataCacheFile.{step}", fails)
    for _ in range(2):
        compiled, said = computing()
        assert compiled
        assert said.count("\n") == 1
        assert "No space left on device" in said


OTHER_NUMBA = """
import builtins, sys
from types import ModuleType
import llvmlite.ir, numba
found = builtins.__import__
hidden = tuple(sys.argv[1].split())

def without(module):
    kept = ModuleType(module.__name__)
    kept.__dict__.update({name: value for name, value in vars(module).items() if name not in hidden})
    return kept

def hide(name, globals=None, locals=None, wanted=(), level=0):
    ours = wanted and globals.get("__name__", "").startswith("vibrodrive.")
    if ours and name.startswith(hidden):
        raise ImportError(name)
    module = found(name, globals, locals, wanted, level)
    if ours and name in ("numba", "llvmlite"):
        module = without(module)
        for part in {"types", "ir"} & {*wanted}:
            setattr(module, part, without(getattr(module, part)))
    return module
builtins.__import__ = hide
"""
"""Hide from the package what the words of the first argument name: modules of Numba whose names begin so, and names in
`numba.types` and `llvmlite.ir`."""

PRIVATE = "numba.core numba.np CompileResultWAP FunctionType instructions"
"""All private names of Numba and llvmlite that the package uses, as OTHER_NUMBA hides them"""

PIECES = (
    OTHER_NUMBA
    + """
import gc
from vibrodrive.jit.compile import inline, jit, part

@inline
def square(x, up):
    return x * x if up else -x

@part
def both(x):
    return square(x, True) + square(x, False)

@jit(_nrt=False)
def kernel(x):
    return both(x)

results = kernel(3.0), square(2.0, True)
used = [name for name in ("caching", "pieces") if f"vibrodrive.jit.{name}" in sys.modules]
print(used, *results, gc.isenabled(), sum(kernel.dispatcher.stats.cache_hits.values()))
"""
)


@pytest.mark.jit
@pytest.mark.parametrize(
    ("hidden", "used"),
    [
        ("nothing", ["caching", "pieces"]),
        ("numba.core.event", ["caching", "pieces"]),
        ("numba.core.caching", ["pieces"]),
        ("numba.core.codegen", ["caching"]),
        ("numba.core.registry", ["caching"]),
        ("numba.core", []),
        (PRIVATE, []),
    ],
)
def test_kernels_compile_without_private_interfaces_of_numba(tmp_path, hidden, used):
    """Results are the same, Python can call inlined functions, and a second process loads the kernel from the disk."""
    (tmp_path / "pieces.py").write_text(PIECES)
    run = "import runpy, sys; runpy.run_path(sys.argv.pop(1))"
    for loaded in (0, 1):
        found = python(run, tmp_path / "pieces.py", hidden, NUMBA_CACHE_DIR=str(tmp_path))
        assert found == f"{used} 6.0 4.0 True {loaded}\n"


SWEPT = dict(A=[3 + k / 90 for k in range(9)], eps=2e-4, transient=50, periods=20, method="fixed", dtau=0.02)
WITHOUT = (
    OTHER_NUMBA
    + f"""
import vibrodrive as vd
from vibrodrive.batch import parallel, prange, sweep
sweep.BRIEF, threads, run = 0.0, [], parallel._run
parallel._run = lambda calls, count, *more: (threads.append(count), run(calls, count, *more))
r = vd.sweep(**{SWEPT}, threads=2)
print([name for name in sys.modules if name in ("vibrodrive.jit.caching", "vibrodrive.jit.pieces")])
print(prange._FUNCTION, len(prange.run_on_threads.dispatcher.overloads), max(threads))
print((r.section.tobytes() + r.margin.tobytes()).hex())
"""
)


@pytest.mark.jit
@pytest.mark.release
@pytest.mark.slow("60 s: all parts of a sweep are compiled without the private interfaces of Numba")
def test_a_sweep_without_private_interfaces_of_numba_has_the_same_bits(tmp_path):
    r = vd.sweep(**SWEPT)
    found = python(WITHOUT, PRIVATE, NUMBA_CACHE_DIR=str(tmp_path), VIBRODRIVE_CODE="numba")
    assert found == f"[]\nNone 0 2\n{(r.section.tobytes() + r.margin.tobytes()).hex()}\n"


@pytest.mark.parametrize(
    ("terminal", "shown", "says"), [(True, False, True), (True, True, False), (False, False, False)]
)
def test_terminal_shows_the_kernel_being_compiled(monkeypatch, capsys, terminal, shown, says):
    """The message is printed once. It is not printed if a progress display already shows it."""
    from vibrodrive.jobs.progress import watching

    monkeypatch.setattr(_jit, "wait", lambda outcomes, seconds: SimpleNamespace(done=set()))  # a longer compilation
    monkeypatch.setattr(_jit, "compilation", SimpleNamespace(running=True, said_after=1.0))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    monkeypatch.delitem(sys.modules, "ipykernel", raising=False)
    dispatcher = SimpleNamespace(_compile_for_args=lambda: "machine code", py_func=double)
    kernel = _jit._compiled_in_thread(dispatcher)
    with watching(lambda: None) if shown else nullcontext():
        assert kernel._compile_for_args() == "machine code"
    said = "vibrodrive: compiling tests.jit.test_compile.double, once for this version, Python and processor, usually"
    assert capsys.readouterr().err == (f"{said} in 3 to 15 s\n" if says else "")


def test_rate_of_a_sweep_excludes_the_time_of_compilation(monkeypatch, tmp_path, capsys):
    compiled = []

    def compile_kernels(plan):
        with trigger_event("numba:compile"), trigger_event("numba:compile"):  # a kernel and a function that it calls
            time.sleep(1.2)
        compiled.append(time.monotonic())

    monkeypatch.setattr("vibrodrive.batch.sweep.load_kernels", compile_kernels)
    monkeypatch.setattr("vibrodrive.batch.sweep.run_blocks", lambda plan, which, **_: fake.run_blocks(plan, which))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    job = Job(make_plan({"A": [1, 2], "transient": 0, "periods": 4}), Origin("[sweep]\n"), tmp_path / "c.h5")
    run(job, Show(sys.stderr, "c.h5"), after=0.0)
    computed = time.monotonic() - compiled[0]
    said = capsys.readouterr().err
    assert said.count(COMPILING) == 1
    summary = said.splitlines()[-1]
    assert float(summary.rpartition(" and ")[2].removesuffix(" s to compile them")) >= 1.2
    assert float(summary.partition("(")[2].split()[0]) > 0.99 * 8 / computed


SWEEP_AND_SIMULATE = """
import sys, vibrodrive as vd
short = {"A": 3.04, "transient": 1, "periods": 1}
vd.sweep(**short, threads=1), vd.simulate(**short).sample(2)
vd.orbits(A=3.04, max_period=1)
print("numba.cpython.randomimpl" in sys.modules)
"""


@pytest.mark.jit
def test_cached_kernel_loads_without_the_compiler():
    python(SWEEP_AND_SIMULATE)  # the first run may compile kernels
    assert python(SWEEP_AND_SIMULATE) == "False\n"


KINDS = """
import ctypes, sys
sys.path.insert(0, sys.argv[1])
from kinds import kernel
from numba import types
kernels = [kernel(int(k)) for k in sys.argv[2:]]
print([k(1) for k in kernels])
results = [types.CompileResultWAP(k.dispatcher.overloads[types.int64,]) for k in kernels]
print([ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(r.__wrapper_address__())(1) for r in results])
"""


@pytest.mark.jit
def test_kernels_of_one_factory_from_two_processes_are_distinguished(tmp_path):
    (tmp_path / "kinds.py").write_text(FACTORY)

    def run(*kinds):
        return python(KINDS, tmp_path, *kinds, NUMBA_CACHE_DIR=str(tmp_path / "cache"))

    assert (run("10"), run("20")) == (2 * "[11]\n", 2 * "[21]\n")
    assert run("10", "20") == 2 * "[11, 21]\n"
