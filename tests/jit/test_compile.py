"""Tests of the cache of kernels, which are compiled again after a change of their sources, Python or the processor.

A message is shown during a long compilation.
"""

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
    found, packages = _sources.read(root)
    return _sources.hash_of(found, _sources.kernels(found, packages))


def test_kernels_depend_on_what_computes_only():
    """An edit of a figure, of the command line or of the page in the browser compiles nothing again."""
    found, packages = _sources.read(ROOT)
    names = {name.removeprefix("vibrodrive.") for name in _sources.kernels(found, packages)}
    assert {"kernels.engine", "kernels.codes", "jit.trig", "jit.pieces", "model.choices", "model.states"} <= names
    assert not {name for name in names if name.split(".")[0] in ("cli", "explorer", "figures", "jobs", "store")} - {
        "explorer.density"
    }


TREE = {
    "__init__.py": "",
    "jit/__init__.py": "from vibrodrive.jit.compile import inline\n",
    "jit/compile.py": '"""Options.\n\nfrom here on, and import\n"""\n',
    "kernels/engine.py": "import re\nfrom vibrodrive.jit.compile import jit\nfrom vibrodrive.kernels.step import *\n",
    "kernels/step.py": "import vibrodrive.kernels.deep.clock as clock\nfrom .zero import find as f\n",
    "kernels/zero.py": "from .. import model\nfrom . import table as t, codes\n",
    "kernels/table.py": "from ..model.states import (  # Fig. 2 (a)\n    UP,\n)\n",
    "kernels/codes.py": "from vibrodrive.model \\\n    import physical\n",
    "kernels/deep/__init__.py": "",
    "kernels/deep/clock.py": "from vibrodrive.jit import inline\nfrom ...model.units import *\n",
    "model/__init__.py": "",
    "model/states.py": "",
    "model/physical.py": "",
    "model/units.py": "",
    "apart.py": "from vibrodrive.jit import inline\n",
    "model/names.py": "from vibrodrive.kernels import engine\n",
    "figures/draw.py": "from vibrodrive.kernels.engine import x\ndef f():\n from vibrodrive.jit.compile import jit\n",
    "cli/sweep.py": "import vibrodrive.kernels.engine\nimport vibrodrive.figures.diagrams.draw\n",
}
"""Sources of a package with subpackages, by path. They contain every form of import, at any depth."""


def test_imports_are_followed_into_packages_of_packages(tmp_path):
    for name, source in TREE.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(source)

    first, deaf = fingerprint(tmp_path), []
    for name, source in TREE.items():
        (tmp_path / name).write_text(source + "\nx = 1\n")
        if fingerprint(tmp_path) == first:
            deaf.append(name)
        (tmp_path / name).write_text(source)
    assert fingerprint(tmp_path) == first
    # no kernel uses these modules; a kernel that imports a module of a package need not import the package itself
    assert deaf == ["__init__.py", "kernels/deep/__init__.py", "model/names.py", "figures/draw.py", "cli/sweep.py"]


@pytest.mark.parametrize(
    ("where", "name", "value"),
    [
        (sys.implementation, "cache_tag", "cpython-399"),
        (sys, "abiflags", "t"),
        (_jit.numba, "__version__", "9.9"),
        (_jit.llvmlite, "__version__", "9.9"),
        (np, "__version__", "9.9"),
    ],
)
def test_cache_directory_depends_on_python_and_compiler(monkeypatch, tmp_path, where, name, value):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    before = _jit._cache_directory()
    monkeypatch.setattr(where, name, value)
    assert _jit._cache_directory() != before


KERNEL = """
from vibrodrive.jit.compilation import compilation
from vibrodrive.jit.compile import jit
from vibrodrive.jit.compiler import CACHE

@jit
def double(x):
    return 2.0 * x

assert double(3.0) == 6.0
print(CACHE.name, compilation.seconds > 0)
"""


@pytest.mark.jit
def test_processors_with_one_cache_neither_share_nor_lose_kernels(monkeypatch, tmp_path):
    """Each processor compiles its own kernels once, even if several processors use the same cache folder."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(ROOT.parent))
    (tmp_path / "kernel.py").write_text(KERNEL)

    def run(**settings) -> list[str]:
        monkeypatch.delenv("NUMBA_CPU_NAME", raising=False)
        for key, value in settings.items():
            monkeypatch.setenv(key, value)
        done = subprocess.run([sys.executable, str(tmp_path / "kernel.py")], capture_output=True, text=True, check=True)
        return done.stdout.split()

    here, generic = run(), run(NUMBA_CPU_NAME="generic")
    assert (here[1], generic[1]) == ("True", "True")
    assert here[0] != generic[0]
    assert run() == [here[0], "False"]


def test_fingerprint_of_an_archive_and_of_a_frozen_program(tmp_path, monkeypatch):
    """An archive has the fingerprint of its files; a program without sources has that of the program."""
    copy = shutil.copytree(ROOT, tmp_path / "vibrodrive", ignore=shutil.ignore_patterns("__pycache__"))
    (copy / "jit" / ".#compile.py").symlink_to("nowhere")  # Emacs marks a file that is being edited
    before = fingerprint(copy)
    archive = shutil.make_archive(tmp_path / "package", "zip", tmp_path, "vibrodrive")
    shutil.rmtree(copy / "jit")
    assert fingerprint(zipfile.Path(archive, "vibrodrive/")) == before != fingerprint(copy)
    monkeypatch.setattr(sys, "executable", archive)
    assert _sources.read(tmp_path / "frozen") == ({"": Path(archive).read_bytes()}, set())


NOWHERE = """
import tempfile
tempfile._candidate_tempdir_list = list
exec(compile(KERNEL, FILE, "exec"))
"""


@pytest.mark.jit
def test_kernels_run_where_nothing_can_be_written(tmp_path):
    (tmp_path / "kernel.py").write_text(KERNEL.replace("CACHE.name", "CACHE"))
    code = f"KERNEL, FILE = {(tmp_path / 'kernel.py').read_text()!r}, {str(tmp_path / 'kernel.py')!r}\n{NOWHERE}"
    places = {"NUMBA_CACHE_DIR": "~no user of this name/"}  # as without HOME and without an entry in passwd
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **places}, capture_output=True, text=True, timeout=1200
    )
    assert (done.returncode, done.stdout) == (0, "None True\n"), done.stderr
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
    source = (
        "from vibrodrive.jit.compile import jit\ndef kernel(n):\n @jit\n def run(x):\n  return x + n\n return run\n"
    )
    (tmp_path / "kinds.py").write_text(source)

    def run(*kinds):
        return python(KINDS, tmp_path, *kinds, NUMBA_CACHE_DIR=str(tmp_path / "cache"))

    assert (run("10"), run("20")) == (2 * "[11]\n", 2 * "[21]\n")
    assert run("10", "20") == 2 * "[11, 21]\n"
