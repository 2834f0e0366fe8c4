"""All Numba options, each with its reason.

An entry point (`jit`) is called from Python, or by its address. It calls parts (`part`) and formulas (`inline`); only
formulas are inlined.

* ``error_model="numpy"``: no branch for a division by zero, because such a branch would prevent vectorisation.
* ``nogil=True``: results are written to a file while the next block is computed.
* ``_nrt=False`` (except entry points that allocate): no reference counting. Otherwise atomic operations would count the
  references to each array argument of each inlined formula. This would take four fifths of the time of a sweep.
* ``fastmath`` is off: it would remove NaN checks, and the bits would depend on the machine.
* The name of the cache directory contains a hash of the kernel sources, of the compiler and of the processor. Numba
  detects a change in the file of the function that it loads, but not in the files of the functions that this function
  calls. Without the sources in the hash, old machine code could be used after an equation is edited. Without the
  processor in the hash, two different machines with the same home directory would share one index, and one machine
  could load the code of the other.
"""

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

_IMPORT = re.compile(rb"\n((?:from|import)\b[^\n(\\]*(?:\([^)]*\)|(?:\\\n[^\n\\]*)+)?[^\n]*)")
"""An import statement that is not indented, with its continuation lines. Indented imports are in functions or for type
checks, so no kernel depends on them. To parse these statements takes a tenth of the time that entire modules would
take."""


def _fingerprint(root: Path = _ROOT, here: str = __name__) -> str:
    """Return a hash of all sources on which machine code depends, for the package in the folder `root`.

    `here` is the name of this module. Modules that import this module may contain kernels. The hash includes these
    modules, the modules in the folder of this module, and all modules that any of these modules imports, directly or
    indirectly.
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
    """Return the name of the module at `path` in the package."""
    parts = path.with_suffix("").parts
    return ".".join([package, *(parts[:-1] if parts[-1] == "__init__" else parts)])


def _imported(name: str, sources: Mapping[str, bytes], within: set[str]) -> Iterator[str]:
    """Yield the names of the modules of the package that module `name` imports.

    sources : source of every module of the package, by name
    within : names of those modules that are packages
    """
    package = name.partition(".")[0].encode()
    lines = _IMPORT.findall(b"\n" + sources[name])
    lines = [line for line in lines if package in line or line.split()[1].startswith(b".")]
    try:
        statements = ast.parse(b"\n".join(lines)).body
    except SyntaxError:  # a line of a string looks like an import, or a comment in an import contains a bracket
        statements = ast.parse(sources[name]).body
    for statement in statements:
        if isinstance(statement, ast.Import):
            yield from (alias.name for alias in statement.names if alias.name in sources)
        elif isinstance(statement, ast.ImportFrom):
            base = statement.module or ""
            if statement.level:
                parts = name.split(".")
                up = statement.level - (name in within)  # in `__init__.py` one dot is the package itself
                base = ".".join([*parts[: len(parts) - up], *filter(None, [base])])
            for alias in statement.names:
                found = f"{base}.{alias.name}"
                if found in sources or base in sources:
                    yield found if found in sources else base


def _target() -> str:
    """Return the versions and the processor on which machine code depends in addition to its sources."""
    versions = [numba.__version__, llvmlite.__version__, np.__version__]
    python = [sys.implementation.cache_tag or sys.version, getattr(sys, "abiflags", "")]
    return " ".join([*python, *versions, *map(str, cpu_target.target_context.codegen().magic_tuple())])


def _cache_directory() -> Path:
    """Return a writable cache directory outside the installation, which may be read-only."""
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    key = hashlib.sha256(f"{_fingerprint()} {_target()}".encode()).hexdigest()[:16]
    name = f"vibrodrive-{key}"
    user = os.getuid() if hasattr(os, "getuid") else ""  # on Windows each user has a temporary directory of his own
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
    """Measurement of the time that this process has spent on compilation.

    Numba reports the beginning and the end of each compilation. The files of the cache do not show whether a kernel
    must be compiled, because only Numba can evaluate the keys of the cache.
    """

    def __init__(self) -> None:
        self._depth = 0  # the compilation of a kernel includes the compilation of the functions that it calls
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
        """True while a function is compiled."""
        return self._depth > 0

    @property
    def seconds(self) -> float:
        """Seconds spent on compilation so far, including a compilation in progress."""
        return self._spent + (monotonic() - self._began if self.running else 0.0)


compilation = Compilation()
event.register("numba:compile", compilation)


class _Cache(FunctionCache):
    """Numba's cache on disk, read without Numba's compiler. A process that compiles nothing then takes half the time.

    Numba imports its compiler modules (0.2 s) before it reads a kernel. This class omits this import. Numba imports
    these modules anyway before it compiles a kernel.
    """

    def load_overload(self, sig, target_context):
        rtsys.initialize(target_context)  # symbols that machine code may call: reference counts, libm
        externals.c_math_functions.install(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def jit(function=None, **options):
    """Compile an entry point of a kernel once for each version of the package, and store it in the cache on disk.

    If the entry point allocates no memory, pass ``_nrt=False``.
    """
    if function is None:
        return lambda f: jit(f, **options)
    if numba.config.DISABLE_JIT:
        return np.errstate(all="ignore")(function)  # as in compiled code, an overflow gives no warning
    if function.__closure__:
        # The symbol name contains a number that is unique only in the process that compiles. Two processes could give
        # the same name to two kernels of one factory, and the wrong kernel would be called. So the name also contains
        # the values in the closure
        values = "_".join(str(cell.cell_contents) for cell in function.__closure__)
        function.__qualname__ = f"{function.__qualname__}_{values}"
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(CACHE)
    try:
        dispatcher = numba.njit(error_model="numpy", nogil=True, **options)(function)
        dispatcher._cache = _Cache(dispatcher.py_func)
        return _compiled_in_thread(dispatcher)
    finally:
        numba.config.CACHE_DIR = before


_INNER = {
    "error_model": "numpy",
    "nogil": True,
    "_nrt": False,
    "no_cfunc_wrapper": True,  # a wrapper for calls from C is not needed, and takes long to compile
}


try:
    from vibrodrive.jit.pieces import Piece, compiling
except (ImportError, AttributeError):  # another version of Numba: compilation is slower, the numbers are the same
    _ENCLOSED = _INNER
    compiling = nullcontext  # type: ignore[assignment]
else:
    _ENCLOSED = {"no_cpython_wrapper": True, "pipeline_class": Piece, **_INNER}
"""Options of formulas and parts. They need no wrapper for calls from Python, which would double the compile time."""


SAID_AFTER = 1.0
"""Duration of a compilation in seconds after which a message is printed. A larger value suppresses messages of short
compilations."""


def _print_compiling(function):
    """Print one line in a terminal or a notebook, if no thread shows progress there (jobs/progress.py)."""
    shown = any(thread.name == "watch" for thread in threading.enumerate())
    if not shown and sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules):
        with suppress(OSError, ValueError):
            name = f"{function.__module__}.{function.__name__}"
            print(f"vibrodrive: compiling {name}, once for this version, Python and processor", file=sys.stderr)


_APART = {"forceinline": False, **_ENCLOSED}
"""Options of parts. `forceinline` is explicit, because Numba would otherwise inherit its value from the first caller. A
part whose first caller is a formula would then be inlined everywhere."""


def _in_thread(work, function):
    """Call `work`, which compiles or loads `function`, and return its result.

    If the main thread calls this, `work` runs in another thread, because Ctrl-C raises KeyboardInterrupt in the main
    thread only. So Ctrl-C takes effect immediately, and does not interrupt Numba while the data of Numba are
    inconsistent. The compilation continues in the background, and the next call uses its result.
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
        _print_compiling(function)
    return outcome.result()


def _compiled_in_thread(dispatcher):
    """Change a dispatcher so that it compiles and loads through `_in_thread`."""
    compile_for = dispatcher._compile_for_args
    dispatcher._compile_for_args = lambda *args, **kwargs: _in_thread(
        lambda: compile_for(*args, **kwargs), dispatcher.py_func
    )
    return dispatcher


def prepare(kernel, *signature):
    """Compile or load a kernel for arguments of the types `signature`, if it is not loaded yet."""
    if signature not in kernel.overloads:
        _in_thread(lambda: kernel.compile(signature), kernel.py_func)


def _once(dispatcher, *constant):
    """Compile a dispatcher once for each set of argument types.

    For the arguments named in `constant`, compile the dispatcher once for each value. Other literal arguments do not
    need this, because LLVM inserts constants when it inlines a formula.
    """
    if isinstance(dispatcher, numba.core.dispatcher.Dispatcher):
        names = inspect.getfullargspec(dispatcher.py_func).args
        template = dispatcher.get_call_template

        def for_types(args, kws):
            kept = [a if name in constant else types.unliteral(a) for name, a in zip(names, args, strict=True)]
            return template(kept, kws)

        dispatcher.get_call_template = for_types
        dispatcher.add_overload = lambda result: dispatcher.overloads.update({tuple(result.signature.args): result})
        # Python cannot call this machine code, so a call from Python compiles another version
        entry = cache(lambda: _compiled_in_thread(numba.njit(**_INNER)(dispatcher.py_func)))
        dispatcher._compile_for_args = lambda *args, **kwargs: entry()
    return dispatcher


def inline(function):
    """Compile a formula that is inlined in every caller, so that loops over it vectorise."""
    return _once(numba.njit(forceinline=True, **_ENCLOSED)(function))


def inline_each(*constant):
    """Compile a formula separately for each value of the arguments named in `constant`.

    Callers must pass literals for these arguments.
    """
    return lambda function: _once(numba.njit(forceinline=True, **_ENCLOSED)(function), *constant)


def part(function):
    """Compile a part of a kernel, which is called and not inlined. This shortens the compilation of its callers."""
    return _once(numba.njit(**_APART)(function))


def part_each(*constant):
    """Compile a part separately for each value of the arguments named in `constant`, without unused branches.

    Callers must pass literals for these arguments.
    """
    return lambda function: _once(numba.njit(**_APART)(function), *constant)
