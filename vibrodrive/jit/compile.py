"""One place for every option given to Numba, each with its reason.

* ``error_model="numpy"``: no zero-division branches, which would keep loops from being vectorised.
* ``nogil=True``: the writer works while a block is computed.
* ``_nrt=False`` (all but entry points that allocate): no reference counting. With it every array argument of
  every inlined formula is counted up and down, atomically: four fifths of the time of a sweep.
* ``fastmath`` stays off: it would fold NaN checks away and change bits from machine to machine.
* The cache directory carries a hash of the kernel sources, and of what they are compiled with and for. Numba notices
  a change in the file of the function it loads, not in the files of the functions that one calls: without the hash
  an edited equation could go on giving the old numbers. And two unlike machines with one home would write into the
  same index, whose files are numbered: one could be served what the other has compiled.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
import os
import re
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, wait
from contextlib import nullcontext, suppress
from functools import cache
from pathlib import Path
from time import monotonic
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core import event, externals, types
from numba.core.caching import FunctionCache
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys

_ROOT = Path(__file__).parents[__name__.count(".") - 1]
"""Folder of the whole package, wherever in it this file lies."""

_IMPORT = re.compile(rb"\n((?:from|import)\b[^\n(\\]*(?:\([^)]*\)|(?:\\\n[^\n\\]*)+)?[^\n]*)")
"""An import that is not indented, its continuation lines included. Indented ones are made when a function runs, or
for types alone: no kernel gets anything from them. To parse these lines alone takes a tenth of the time."""


def _fingerprint(root: Path = _ROOT, here: str = __name__) -> str:
    """A hash of every module with a kernel in it, of all that those import, whatever they take from there, and of those
    beside this one, whose name is `here`, in the package that lies in `root`.

    A module has a kernel in it if it imports this one.
    """
    package = here.partition(".")[0]
    paths = {_module(package, path.relative_to(root)): path for path in root.rglob("*.py")}
    sources = {name: path.read_bytes() for name, path in paths.items()}
    within = {name for name, path in paths.items() if path.name == "__init__.py"}
    homes = {here} | {name for name in within if name != package and here.startswith(f"{name}.")}
    words = [home.rpartition(".")[2].encode() for home in homes]
    near = [name for name, source in sources.items() if any(word in source for word in words)]
    imported = {name: set(_imported(name, sources, within)) for name in near}
    todo = [name for name in near if not homes.isdisjoint(imported[name])]
    todo += [name for name in sources if name.rpartition(".")[0] == here.rpartition(".")[0] and name not in todo]
    known = set(todo)
    while todo:
        name = todo.pop()
        new = (imported[name] if name in imported else set(_imported(name, sources, within))) - known
        known |= new
        todo += new
    digest = hashlib.sha256()
    for name in sorted(known):
        digest.update(name.encode() + b"\0" + sources[name])
    return digest.hexdigest()


def _module(package: str, path: Path) -> str:
    """Name of the module that lies at `path` in the package."""
    parts = path.with_suffix("").parts
    return ".".join([package, *(parts[:-1] if parts[-1] == "__init__" else parts)])


def _imported(name: str, sources: Mapping[str, bytes], within: set[str]) -> Iterator[str]:
    """The modules of the package that a module imports when it is itself imported.

    sources: of every module of the package; within: those of them that are packages.
    """
    package = name.partition(".")[0].encode()
    lines = _IMPORT.findall(b"\n" + sources[name])
    lines = [line for line in lines if package in line or line.split()[1].startswith(b".")]
    try:
        statements = ast.parse(b"\n".join(lines)).body
    except SyntaxError:  # a line of a text begins like an import, or a comment in one has a bracket
        statements = ast.parse(sources[name]).body
    for statement in statements:
        if isinstance(statement, ast.Import):
            yield from (alias.name for alias in statement.names if alias.name in sources)
        elif isinstance(statement, ast.ImportFrom):
            base = statement.module or ""
            if statement.level:
                parts = name.split(".")
                up = statement.level - (name in within)  # a package's one dot is the package itself
                base = ".".join([*parts[: len(parts) - up], *filter(None, [base])])
            for alias in statement.names:
                found = f"{base}.{alias.name}"
                if found in sources or base in sources:
                    yield found if found in sources else base


def _target() -> str:
    """What machine code depends on beside its sources: who compiles it, and for which processor."""
    versions = [numba.__version__, llvmlite.__version__, np.__version__]
    python = [sys.implementation.cache_tag or sys.version, getattr(sys, "abiflags", "")]
    return " ".join([*python, *versions, *map(str, cpu_target.target_context.codegen().magic_tuple())])


def _cache_directory() -> Path:
    """A writable directory outside the installation, which may be read-only."""
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    key = hashlib.sha256(f"{_fingerprint()} {_target()}".encode()).hexdigest()[:16]
    name = f"vibrodrive-{key}"
    user = os.getuid() if hasattr(os, "getuid") else ""  # on Windows the temporary directory is the user's own
    for base in (Path(home).expanduser(), Path(tempfile.gettempdir()) / f"vibrodrive-cache-{user}"):
        try:
            (base / name).mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError:
            continue
        if os.access(base / name, os.W_OK):
            return base / name
    return Path(tempfile.mkdtemp(prefix="vibrodrive-"))


CACHE = _cache_directory()


class Compilation(event.Listener):
    """The time this process has spent compiling: whether it compiles cannot be foretold from the files of the
    cache (Numba's keys are its own), but Numba tells when it begins and when it ends."""

    def __init__(self) -> None:
        self._depth = 0  # a kernel compiles what it calls
        self._began = self._spent = 0.0

    def on_start(self, event: Any) -> None:
        if self._depth == 0:
            self._began = monotonic()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._spent += monotonic() - self._began

    @property
    def running(self) -> bool:
        """Whether something is being compiled."""
        return self._depth > 0

    @property
    def seconds(self) -> float:
        """Spent so far, what is under way included."""
        return self._spent + (monotonic() - self._began if self.running else 0.0)


compilation = Compilation()
event.register("numba:compile", compilation)


class _Cache(FunctionCache):
    """Numba's cache on disk, without what machine code does not need: a process that compiles nothing is twice as fast.

    Before it reads a kernel Numba imports all that it could compile with, 0.2 s. It does so again before it compiles.
    """

    def load_overload(self, sig, target_context):
        rtsys.initialize(target_context)  # what machine code may call: to count references, and by name
        externals.c_math_functions.install(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def jit(function=None, **options):
    """A kernel entry point: compiled once per version, kept on disk. ``_nrt=False`` unless it allocates."""
    if function is None:
        return lambda f: jit(f, **options)
    if numba.config.DISABLE_JIT:
        return np.errstate(all="ignore")(function)  # compiled code does not warn of what overflows either
    if function.__closure__:
        # Numba looks machine code up by a name that has a number of the process that compiled it: two kernels of one
        # factory, compiled by two processes, could bear the same name, and one be called for the other
        values = "_".join(str(cell.cell_contents) for cell in function.__closure__)
        function.__qualname__ = f"{function.__qualname__}_{values}"
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(CACHE)
    try:
        dispatcher = numba.njit(error_model="numpy", nogil=True, **options)(function)
        dispatcher._cache = _Cache(dispatcher.py_func)
        return _compiled_aside(dispatcher)
    finally:
        numba.config.CACHE_DIR = before


_INNER = {
    "error_model": "numpy",
    "nogil": True,
    "_nrt": False,
    "no_cfunc_wrapper": True,  # never called from C: a fair share of compiling a formula is the way in
}


try:
    from vibrodrive.jit.pieces import Piece, compiling
except (ImportError, AttributeError):  # another Numba: slower to compile, the same numbers
    _ENCLOSED = _INNER
    compiling = nullcontext  # type: ignore[assignment]
else:
    _ENCLOSED = {"no_cpython_wrapper": True, "pipeline_class": Piece, **_INNER}
"""Called by kernels only: there is no way in from Python, which would take as long to compile again."""


SAID_AFTER = 1.0
"""Seconds of compiling after which whoever waits for it in Python reads so."""


def _say_compiling(function):
    """One line at a terminal or in a notebook, unless a thread shows progress there (jobs/progress.py)."""
    shown = any(thread.name == "watch" for thread in threading.enumerate())
    if not shown and sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules):
        with suppress(OSError, ValueError):
            name = f"{function.__module__}.{function.__name__}"
            print(f"vibrodrive: compiling {name}, once for this version, Python and processor", file=sys.stderr)


_APART = {"forceinline": False, **_ENCLOSED}
"""Said, as Numba takes it from the caller otherwise: a piece first called by a formula would be inlined everywhere."""


def _aside(work, function):
    """Return what `work`, which compiles or loads a function, returns: from a thread of its own, for the main thread.

    Ctrl-C raises KeyboardInterrupt in the main thread alone: it is answered at once, and never breaks off Numba halfway
    through its own bookkeeping. The compilation goes on behind it, and the next call finds the result.
    """
    if threading.get_ident() != threading.main_thread().ident:
        with compiling():
            return work()
    outcome = Future()

    def call():
        try:
            with compiling():
                outcome.set_result(work())
        except BaseException as error:
            outcome.set_exception(error)

    threading.Thread(target=call, name="compile", daemon=True).start()
    if not wait([outcome], SAID_AFTER).done and compilation.running:
        _say_compiling(function)
    return outcome.result()


def _compiled_aside(dispatcher):
    """A dispatcher that compiles, or loads, what it is first called for as `_aside` has it."""
    compile_for = dispatcher._compile_for_args
    dispatcher._compile_for_args = lambda *args, **kwargs: _aside(
        lambda: compile_for(*args, **kwargs), dispatcher.py_func
    )
    return dispatcher


def prepare(kernel, *signature):
    """Compile a kernel for arguments of these types, or load it, unless it is there."""
    if signature not in kernel.overloads:
        _aside(lambda: kernel.compile(signature), kernel.py_func)


def _once(dispatcher, *constant):
    """Compiled for types alone, not once more for every constant it is called with, but for arguments named `constant`.

    Other constants reach a formula when LLVM inlines it; a second compilation is a second wait for nothing.
    """
    if isinstance(dispatcher, numba.core.dispatcher.Dispatcher):
        names = inspect.getfullargspec(dispatcher.py_func).args
        template = dispatcher.get_call_template

        def for_types(args, kws):
            kept = [a if name in constant else types.unliteral(a) for name, a in zip(names, args, strict=True)]
            return template(kept, kws)

        dispatcher.get_call_template = for_types
        dispatcher.add_overload = lambda result: dispatcher.overloads.update({tuple(result.signature.args): result})
        # no machine code of it can be called: Python gets some of its own, compiled if it asks for that
        entry = cache(lambda: _compiled_aside(numba.njit(**_INNER)(dispatcher.py_func)))
        dispatcher._compile_for_args = lambda *args, **kwargs: entry()
    return dispatcher


def inline(function):
    """A formula: inlined wherever it stands, so that loops over it vectorise; compiled with its caller."""
    return _once(numba.njit(forceinline=True, **_ENCLOSED)(function))


def inline_each(*constant):
    """A formula of its own for every value of the arguments named here, which its callers have as constants."""
    return lambda function: _once(numba.njit(forceinline=True, **_ENCLOSED)(function), *constant)


def part(function):
    """A piece of a kernel that is called, not inlined: keeps the compile time of its callers short."""
    return _once(numba.njit(**_APART)(function))


def part_each(*constant):
    """A piece of its own for every value of the arguments named here: only what that one needs is compiled."""
    return lambda function: _once(numba.njit(**_APART)(function), *constant)
