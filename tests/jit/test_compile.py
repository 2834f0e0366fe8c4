"""Tests of the cache of kernels, which are compiled again after a change of their sources, Python or the processor.

A message is shown during a long compilation.
"""

import ast
import importlib
import os
import pkgutil
import re
import shutil
import subprocess
import sys
import time
import zipfile
from contextlib import nullcontext
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import CodeType, ModuleType, SimpleNamespace

import numpy as np
import pytest

import vibrodrive
from tests.support.process import python
from vibrodrive.jit import compile as _jit
from vibrodrive.jit import sources as _sources
from vibrodrive.jobs.progress import COMPILING

ROOT = Path(vibrodrive.__file__).parent


def modules() -> dict[str, ModuleType]:
    left_out = ["__main__", ".configs"] + ([] if find_spec("bokeh") else [".explorer."])
    names = [m.name for m in pkgutil.walk_packages(vibrodrive.__path__, "vibrodrive.")]
    return {n: importlib.import_module(n) for n in names if not any(part in n for part in left_out)}


def origins(module: ModuleType) -> dict[str, str]:
    """Return, for each name that a module imports, the module of the package that defines this name."""
    found = {}
    for statement in ast.parse(Path(module.__file__).read_text()).body:
        if isinstance(statement, ast.ImportFrom) and (statement.module or "").startswith("vibrodrive"):
            for alias in statement.names:
                inner = f"{statement.module}.{alias.name}"
                found[alias.asname or alias.name] = inner if inner in sys.modules else statement.module
    return found


def names_in(code: CodeType) -> set[str]:
    inner = [c for c in code.co_consts if isinstance(c, CodeType)]
    return set(code.co_names).union(*map(names_in, inner))


def compiled_modules() -> set[str]:
    """Return the names of modules that compiled functions use, found by the names that occur in these functions."""
    loaded = modules()
    dispatchers = [v for m in loaded.values() for v in vars(m).values() if hasattr(v, "py_func") and v.stats.cache_path]
    assert len(dispatchers) > 5
    engine, alone = loaded["vibrodrive.kernels.engine"], loaded["vibrodrive.kernels.single"]
    dispatchers += [
        engine.batch(2, False, False),
        alone.single(2, False, True),
    ]  # these kernels are compiled on request
    known: set[str] = set()
    seen: set[int] = set()

    def use(name: str) -> None:
        """Add a module, and the modules of all names that its constants use."""
        if name in known:
            return
        known.add(name)
        source = origins(loaded[name])
        for statement in ast.parse(Path(loaded[name].__file__).read_text()).body:
            if isinstance(statement, ast.Assign | ast.AnnAssign):
                for node in ast.walk(statement):
                    if isinstance(node, ast.Name) and node.id in source:
                        use(source[node.id])

    while dispatchers:
        function = dispatchers.pop().py_func
        if id(function) in seen:
            continue
        seen.add(id(function))
        use(function.__module__)
        source = origins(loaded[function.__module__])
        for name in names_in(function.__code__):
            if name in source:
                use(source[name])
            if hasattr(function.__globals__.get(name), "py_func"):
                dispatchers.append(function.__globals__[name])
    return known


def uncompiled_modules() -> set[str]:
    """Return the names of modules of the command line, the figures and the files, recognised by their imports."""
    found = set()
    for path in ROOT.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            if any(n.partition(".")[0] in ("h5py", "matplotlib", "click") for n in names):
                found.add(".".join(["vibrodrive", *path.relative_to(ROOT).with_suffix("").parts]))
    assert len(found) > 10
    return found


@pytest.fixture
def copy(tmp_path):
    """Return a function that gives the path of a module in an editable copy of the package."""
    root = tmp_path / "vibrodrive"
    shutil.copytree(ROOT, root, ignore=shutil.ignore_patterns("__pycache__"))

    def path(name: str) -> Path:
        below = root.joinpath(*name.split(".")[1:])
        return below / "__init__.py" if below.is_dir() else below.with_suffix(".py")

    path.root = root
    return path


def fingerprint(root: Path) -> str:
    """Return the hash of the sources of kernels in a copy of the package."""
    found, packages = _sources.read(root)
    return _sources.hash_of(found, _sources.kernels(found, packages))


def changing(copy, names: set[str]) -> set[str]:
    """Return the modules in `names` whose edit changes the fingerprint."""
    before, found = fingerprint(copy.root), set()
    for name in names:
        source = copy(name).read_text()
        copy(name).write_text(source + "\n# edited\n")
        if fingerprint(copy.root) != before:
            found.add(name)
        copy(name).write_text(source)
    return found


@pytest.mark.jit
def test_edit_of_compiled_modules_makes_new_kernels(copy):
    kernels = compiled_modules()
    assert {"vibrodrive.kernels.engine", "vibrodrive.jit.trig", "vibrodrive.model.choices"} <= kernels
    kernels |= {"vibrodrive.jit.compile", "vibrodrive.jit.pieces", "vibrodrive.jit.sources"}
    assert changing(copy, kernels) == kernels


def test_edit_of_other_modules_keeps_the_kernels(copy):
    assert changing(copy, uncompiled_modules()) == set()


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


def test_imports_are_followed_into_packages_of_packages(copy):
    shutil.rmtree(copy.root)
    for name, source in TREE.items():
        path = copy.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(source)

    first, deaf = fingerprint(copy.root), []
    for name, source in TREE.items():
        (copy.root / name).write_text(source + "\nx = 1\n")
        if fingerprint(copy.root) == first:
            deaf.append(name)
        (copy.root / name).write_text(source)
    assert fingerprint(copy.root) == first
    # no kernel uses these modules; a kernel that imports a module of a package need not import the package itself
    assert deaf == ["__init__.py", "kernels/deep/__init__.py", "model/names.py", "figures/draw.py", "cli/sweep.py"]


def test_fingerprint_is_fast(monkeypatch):
    """The fingerprint reads all sources but parses only lines with imports."""
    parsed, parse = [], ast.parse
    monkeypatch.setattr(ast, "parse", lambda source: parsed.append(len(source)) or parse(source))
    fingerprint(ROOT)
    assert 0 < sum(parsed) < sum(path.stat().st_size for path in ROOT.rglob("*.py")) / 10


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
from vibrodrive.jit.compile import CACHE, compilation, jit

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
        for key in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
            monkeypatch.delenv(key, raising=False)
        for key, value in settings.items():
            monkeypatch.setenv(key, value)
        done = subprocess.run([sys.executable, str(tmp_path / "kernel.py")], capture_output=True, text=True, check=True)
        return done.stdout.split()

    here, generic, plain = run(), run(NUMBA_CPU_NAME="generic"), run(NUMBA_CPU_FEATURES="")
    assert [compiled for _, compiled in (here, generic, plain)] == ["True"] * 3
    assert len({here[0], generic[0], plain[0]}) == 3
    assert run() == [here[0], "False"]


def test_fingerprint_of_an_archive_and_of_a_frozen_program(copy, tmp_path, monkeypatch):
    """An archive has the fingerprint of its files; a program without sources has that of the program."""
    (copy.root / "jit" / ".#compile.py").symlink_to("nowhere")  # Emacs marks a file that is being edited
    before = fingerprint(copy.root)
    archive = shutil.make_archive(tmp_path / "package", "zip", tmp_path, "vibrodrive")
    shutil.rmtree(copy.root / "jit")
    assert fingerprint(zipfile.Path(archive, "vibrodrive/")) == before != fingerprint(copy.root)
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
        kernel = _jit.jit(double)
        assert kernel(3.0) == 6.0
        return not kernel.stats.cache_hits, capsys.readouterr().err

    return call


@pytest.mark.jit
@pytest.mark.parametrize(
    ("ending", "harm"),
    [("nbc", "changed"), *((ending, harm) for ending in ("nbi", "nbc") for harm in ("empty", "cut", "folder"))],
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


PIECES = """
import gc, sys
import numba.core.codegen

if sys.argv[1] == "changed":
    del numba.core.codegen.JITCodeLibrary
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

print("vibrodrive.jit.pieces" in sys.modules, kernel(3.0), square(2.0, True), gc.isenabled())
"""


@pytest.mark.jit
@pytest.mark.parametrize(("numba", "private"), [("as it is", "True"), ("changed", "False")])
def test_kernels_compile_without_private_interfaces_of_numba(tmp_path, numba, private):
    """Without Numba's private interfaces kernels give the same results, and Python can still call inlined functions."""
    (tmp_path / "pieces.py").write_text(PIECES)
    run = "import runpy, sys; runpy.run_path(sys.argv.pop(1))"
    found = python(run, tmp_path / "pieces.py", numba, NUMBA_CACHE_DIR=str(tmp_path))
    assert found.split() == [private, "6.0", "4.0", "True"]


@pytest.mark.parametrize(("terminal", "shown"), [(True, False), (True, True), (False, False)])
def test_terminal_shows_the_kernel_being_compiled(monkeypatch, capsys, terminal, shown):
    """The message is printed once. It is not printed if a progress display already shows it."""
    from vibrodrive.jobs.progress import watching

    monkeypatch.setattr(_jit, "wait", lambda outcomes, seconds: SimpleNamespace(done=set()))  # a longer compilation
    monkeypatch.setattr(_jit, "compilation", SimpleNamespace(running=True))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    monkeypatch.delitem(sys.modules, "ipykernel", raising=False)
    dispatcher = SimpleNamespace(_compile_for_args=lambda: "machine code", py_func=modules)
    kernel = _jit._compiled_in_thread(dispatcher)
    with watching(lambda: None) if shown else nullcontext():
        assert kernel._compile_for_args() == "machine code"
    said = "vibrodrive: compiling tests.jit.test_compile.modules, once for this version, Python and processor\n"
    assert capsys.readouterr().err == (said if terminal and not shown else "")


def test_progress_counts_compiled_functions_and_excludes_them_from_the_rate(monkeypatch, tmp_path, capsys):
    from numba.core.event import trigger_event

    from tests.support import fake
    from vibrodrive.jobs.progress import Show
    from vibrodrive.jobs.sweep import Job, run
    from vibrodrive.model.config import read
    from vibrodrive.store.layout import Origin

    compiled = []

    def compile_kernels(plan):
        with trigger_event("numba:compile"), trigger_event("numba:compile"):  # a kernel and a function that it calls
            time.sleep(1.2)
        compiled.append(time.monotonic())

    sweep = import_module("vibrodrive.batch.sweep")
    monkeypatch.setattr(sweep, "load_kernels", compile_kernels)
    monkeypatch.setattr(sweep, "run_blocks", lambda plan, which, **_: fake.run_blocks(plan, which))
    (tmp_path / "c.toml").write_text("[sweep]\nA = [1, 2]\n[run]\ntransient = 0\nperiods = 4\n")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    job = Job(read(tmp_path / "c.toml").plan(), Origin("[sweep]\n"), tmp_path / "c.h5")
    summary = run(job, Show(sys.stderr, "c.h5"))
    computed = time.monotonic() - compiled[0]
    told = capsys.readouterr().err
    assert told.count(COMPILING) == 1
    seconds = [int(n) for n in re.findall(r"compiling: (\d+) s", told)]
    assert seconds
    assert seconds == sorted(seconds)
    assert told.index(COMPILING) < told.index("compiling: ")
    assert float(summary.rpartition(" and ")[2].removesuffix(" s to compile them")) >= 1.2
    rate = float(summary.partition("(")[2].split()[0])
    assert rate > 0.99 * 8 / computed, "the rate must exclude the time of compilation"


SWEEP_AND_SIMULATE = """
import sys, numpy as np, vibrodrive as vd
from vibrodrive.jit.fletcher import fletcher32
short = {"A": 3.04, "transient": 1, "periods": 1}
vd.sweep(**short, threads=1), vd.simulate(**short).sample(2)
fletcher32(np.arange(100.0)), vd.orbits(A=3.04, max_period=1)
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
results = [types.CompileResultWAP(k.overloads[types.int64,]) for k in kernels]
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
