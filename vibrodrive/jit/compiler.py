"""Compilation by Numba of the functions marked in compile.py: all options, each with its reason, and the cache.

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

Another version of Numba may lack private names that this folder uses. What needs them is then left out: kernels are
loaded and compiled more slowly, and the numbers are the same.
"""

import hashlib
import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager, nullcontext, suppress
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np

from vibrodrive.jit.compilation import compilation
from vibrodrive.jit.sources import fingerprints

try:
    from numba.core.event import Listener, register
except ImportError:  # nobody is told of compilations
    Listener, register = object, lambda kind, listener: None  # type: ignore[assignment, misc]

OTHER_NUMBA = ImportError, AttributeError, TypeError
"""Errors of the use of private names that another version of Numba does not have."""


def processor() -> tuple[str, ...]:
    """Return the kind, the name and the features of the processor for which Numba compiles."""
    try:
        from numba.core.registry import cpu_target

        return cpu_target.target_context.codegen().magic_tuple()
    except OTHER_NUMBA:
        from llvmlite import binding

        return binding.get_process_triple(), binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()


def _target() -> str:
    """Return the versions and the processor on which machine code depends in addition to its sources."""
    versions = [numba.__version__, llvmlite.__version__, np.__version__]
    python = [sys.implementation.cache_tag or sys.version, getattr(sys, "abiflags", "")]
    return " ".join([*python, *versions, *map(str, processor())])


def _cache_directory() -> Path:
    """Return a writable cache directory outside the installation, which may be read-only. Raises OSError if none is."""
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    key = hashlib.sha256(f"{fingerprints()[1]} {_target()}".encode()).hexdigest()[:16]
    name = f"vibrodrive-{key}"
    with suppress(OSError, RuntimeError):  # RuntimeError: the user has no home
        return _writable(Path(home).expanduser() / name)
    user = os.getuid() if hasattr(os, "getuid") else 0  # on Windows each user has a temporary directory of his own
    path = _writable(Path(tempfile.gettempdir()) / f"{name}-{user}")
    if os.name == "posix" and path.lstat().st_uid != user:
        raise PermissionError(f"{path} belongs to another user, who could store any code there")
    return path


def _writable(path: Path) -> Path:
    """Make a directory unless it exists, and return its path. Raises OSError if no file can be written there."""
    path.mkdir(parents=True, exist_ok=True, mode=0o700)
    if not os.access(path, os.W_OK):
        raise PermissionError(f"{path} is not writable")
    return path


CACHE: Path | None = None


@contextmanager
def _or_without_cache() -> Iterator[None]:
    """Continue without the cache if the block fails, and print the reason, once in a process.

    Kernels that cannot be read are compiled. Kernels that cannot be stored are compiled again in the next process.
    """
    try:
        yield
    except Exception as error:
        if not _reasons:
            why = " ".join(str(error).split()) or type(error).__name__
            with suppress(OSError, ValueError, AttributeError):  # stderr is closed
                where = "" if CACHE is None else f" in {CACHE}"
                print(f"vibrodrive: kernels are compiled without the cache{where} ({why})", file=sys.stderr)
        _reasons.append(error)


_reasons: list[Exception] = []

with _or_without_cache():
    CACHE = _cache_directory()


class _Report(Listener):
    """Report of the compilations of Numba to `compilation`."""

    def on_start(self, event: Any) -> None:
        compilation.begins()

    def on_end(self, event: Any) -> None:
        compilation.ends()


register("numba:compile", _Report())

try:
    from vibrodrive.jit.caching import store
except OTHER_NUMBA:

    def store(dispatcher, folder, attempt):
        """Let a kernel be stored by Numba itself."""
        before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
        try:
            dispatcher.enable_caching()
        finally:
            numba.config.CACHE_DIR = before


try:
    from vibrodrive.jit.pieces import OPTIONS, compiling, once
except OTHER_NUMBA:
    OPTIONS, compiling, once = {}, nullcontext, lambda dispatcher, *more: dispatcher  # type: ignore[assignment]


_UNKNOWN = {"_nrt", "forceinline", "no_cfunc_wrapper", "no_cpython_wrapper"}
"""Options that Numba does not document and that this version does not know."""

with suppress(*OTHER_NUMBA):
    from numba.core.registry import cpu_target

    _UNKNOWN = {name for name in _UNKNOWN if not hasattr(cpu_target.options, name)}


def _njit(function, **options):
    options = {name: value for name, value in options.items() if name not in _UNKNOWN}
    return numba.njit(error_model="numpy", nogil=True, **options)(function)


def entry(function, **options):
    """Return Numba's dispatcher for a kernel. The kernel is stored in the cache on disk."""
    dispatcher = _njit(function, **options)
    if CACHE is not None:
        with _or_without_cache():
            store(dispatcher, CACHE, _or_without_cache)
    return _compiled_in_thread(dispatcher)


_INNER = {
    "_nrt": False,
    "no_cfunc_wrapper": True,  # a wrapper for calls from C is not needed, and takes long to compile
}

_ENCLOSED = {**OPTIONS, **_INNER}
"""Options of formulas and parts. They need no wrapper for calls from Python, which would double the compile time."""


def _print_compiling(function):
    """Print one line in a terminal or a notebook, if no thread shows progress there (jobs/progress.py)."""
    shown = any(thread.name == "watch" for thread in threading.enumerate())
    if not shown and sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules):
        with suppress(OSError, ValueError):
            name = f"{function.__module__}.{function.__name__}"
            takes = "once for this version, Python and processor, usually in 3 to 15 s"
            print(f"vibrodrive: compiling {name}, {takes}", file=sys.stderr)


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

    try:
        threading.Thread(target=call, name="compile", daemon=True).start()
    except RuntimeError:  # no further thread can be started
        call()
    if not wait([outcome], compilation.said_after).done and compilation.running:
        _print_compiling(function)
    return outcome.result()


def _compiled_in_thread(dispatcher):
    """Change a dispatcher so that it compiles and loads through `_in_thread`."""
    compile_for = getattr(dispatcher, "_compile_for_args", None)
    if compile_for is None:  # another version of Numba: Ctrl-C waits for the end of a compilation
        return dispatcher
    dispatcher._compile_for_args = lambda *args, **kwargs: _in_thread(
        lambda: compile_for(*args, **kwargs), dispatcher.py_func
    )
    return dispatcher


def prepare(dispatcher, like):
    """Compile or load a kernel for arguments of the types of `like`, if it is not loaded yet."""
    prepare_for(dispatcher, *map(numba.typeof, like))


def prepare_for(dispatcher, *signature):
    """Compile or load a kernel for arguments of these types of Numba, if it is not loaded yet."""
    if signature not in dispatcher.overloads:
        _in_thread(lambda: dispatcher.compile(signature), dispatcher.py_func)


def enclosed(function, *constant, forceinline):
    """Return Numba's dispatcher for a formula or a part.

    It compiles once for each set of argument types, and of values of the arguments in `constant`. Other literal
    arguments need no version of their own, because LLVM inserts constants when it inlines a formula.
    """
    dispatcher = _njit(function, forceinline=forceinline, **_ENCLOSED)
    # Python cannot call this machine code, so a call from Python compiles another version
    return once(dispatcher, cache(lambda: _compiled_in_thread(_njit(function, **_INNER))), *constant)


def type_of(called):
    """Return the type by which Numba calls a dispatcher or an operation."""
    if hasattr(called, "_numba_type_"):
        return called._numba_type_
    try:
        from numba.core.registry import cpu_target

        cpu_target.typing_context.refresh()  # the operation may have been defined since the compilation has begun
        cpu_target.target_context.refresh()
        return cpu_target.typing_context.resolve_value_type(called)
    except OTHER_NUMBA:
        _callers.append(_njit(lambda *args: called(*args), **_INNER))  # Numba keeps a weak reference only
        return _callers[-1]._numba_type_


_callers: list[Any] = []
