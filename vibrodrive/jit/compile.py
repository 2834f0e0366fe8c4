"""Marks of the functions that are compiled. This module imports no compiler.

A *kernel* (`jit`) is a function of machine code that Python calls. It consists of parts (`part`), which it calls, and
of formulas (`inline`), which are inlined in it. Machine code of the kernels comes with the package (shipped.py), or
Numba compiles it at the first call (compiler.py). A mark keeps the function in Python, and makes Numba's function for
it when a kernel that uses it is compiled; so nothing imports Numba where no kernel is compiled.

If the JIT is disabled (NUMBA_DISABLE_JIT=1), the marks change nothing, and kernels run in plain Python.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import cached_property, update_wrapper
from importlib import import_module
from typing import Any

import numpy as np

from vibrodrive.jit import shipped
from vibrodrive.jit.sources import fingerprints


def _disabled() -> bool:
    """Return whether Numba's compiler is disabled, by a variable, by Numba's file of settings, or by a program."""
    if "numba" in sys.modules or os.path.exists(".numba_config.yaml"):
        return bool(import_module("numba").config.DISABLE_JIT)
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


COMPILED = not _disabled()

with suppress(OSError):  # the compiler, or the loader of machine code, says what is wrong
    fingerprints()  # of the sources that are imported now, whatever becomes of them before the first call


_making = threading.RLock()


def _compiler() -> Any:
    from vibrodrive.jit import compiler

    return compiler


class Marked:
    """A function that kernels call. From Python it is called as Numba compiles it, unless it is `plain`.

    py_func : the function in Python
    make : returns what Numba calls for this function: a dispatcher, or an operation
    plain : whether a call from Python runs `py_func`
    """

    def __init__(self, function: Callable[..., Any], make: Callable[[], Any], plain: bool = False) -> None:
        update_wrapper(self, function)
        self.py_func = function
        self._make = make
        if plain:
            self.code = function

    @cached_property
    def dispatcher(self) -> Any:
        """What Numba calls for this function: a dispatcher, or an operation."""
        with _making:
            if "dispatcher" not in self.__dict__:
                self.__dict__["dispatcher"] = self._make()
            return self.__dict__["dispatcher"]

    @cached_property
    def code(self) -> Callable[..., Any]:
        """What a call from Python runs."""
        return self.dispatcher

    def __call__(self, *args: Any) -> Any:
        return self.code(*args)

    @cached_property
    def _numba_type_(self) -> Any:
        """The type by which Numba calls the function. Numba asks for it where compiled code calls the function."""
        return _compiler().type_of(self.dispatcher)


class Kernel(Marked):
    """A kernel. `like` are arguments of the types with which the kernel is shipped; None if it is never shipped."""

    def __init__(self, function: Callable[..., Any], make: Callable[[], Any], like: tuple[Any, ...] | None) -> None:
        super().__init__(function, make)
        self.like = like
        self.name = f"{function.__module__}.{function.__qualname__}"

    @cached_property
    def code(self) -> Callable[..., Any]:
        """Machine code that came with the package, or Numba's dispatcher."""
        return self.shipped or self.dispatcher

    @cached_property
    def shipped(self) -> Callable[..., Any] | None:
        """The machine code of the kernel that came with the package, or None."""
        return shipped.function(self.name)

    def prepare(self) -> None:
        """Compile or load the kernel for the types of `like`, if it is not loaded yet."""
        if not self.shipped:
            _compiler().prepare(self.dispatcher, self.like or ())


def jit(function: Any = None, *, like: tuple[Any, ...] | None = None, **options: bool) -> Any:
    """Make a kernel of a function: compiled once for each version of the package, and stored on disk.

    If the kernel allocates no memory, pass ``_nrt=False``.
    """
    if function is None:
        return lambda f: jit(f, like=like, **options)
    if not COMPILED:
        return np.errstate(all="ignore")(function)  # as in compiled code, an overflow gives no warning
    if function.__closure__:
        # The symbol name contains a number that is unique only in the process that compiles. Two processes could give
        # the same name to two kernels of one factory, and the wrong kernel would be called. So the name also contains
        # the values in the closure
        values = "_".join(str(int(cell.cell_contents)) for cell in function.__closure__)
        function.__qualname__ = f"{function.__qualname__}_{values}"
    return Kernel(function, lambda: _compiler().entry(function, **options), like)


def array(ndim: int, dtype: Any = np.float64) -> np.ndarray:
    """Return an example of an array argument for `like`."""
    return np.empty((0,) * ndim, dtype)


def _enclosed(function: Any, *constant: str, plain: bool = False, forceinline: bool) -> Any:
    if not COMPILED:
        return function
    return Marked(function, lambda: _compiler().enclosed(function, *constant, forceinline=forceinline), plain)


def inline(function: Any) -> Any:
    """Mark a formula, which is inlined in every caller, so that loops over it vectorise."""
    return _enclosed(function, forceinline=True)


def formula(function: Any) -> Any:
    """Mark a formula that Python may call, too, without compiling it, and with arrays."""
    return _enclosed(function, plain=True, forceinline=True)


def inline_each(*constant: str) -> Callable[[Any], Any]:
    """Mark a formula that is compiled separately for each value of the arguments named in `constant`.

    Callers must pass literals for these arguments.
    """
    return lambda function: _enclosed(function, *constant, forceinline=True)


# `forceinline` is explicit, because Numba would otherwise inherit its value from the first caller. A part whose first
# caller is a formula would then be inlined everywhere


def part(function: Any) -> Any:
    """Mark a part of a kernel, which is called and not inlined. This shortens the compilation of its callers."""
    return _enclosed(function, forceinline=False)


def part_each(*constant: str) -> Callable[[Any], Any]:
    """Mark a part that is compiled separately for each value of the arguments in `constant`, without unused branches.

    Callers must pass literals for these arguments.
    """
    return lambda function: _enclosed(function, *constant, forceinline=False)


def operation(home: str) -> Callable[[Any], Any]:
    """Mark an operation: in kernels the object of the same name in the module `home`, in Python this function.

    That module imports Numba, and is imported when a kernel is compiled.
    """

    def mark(function: Any) -> Any:
        make = lambda: getattr(import_module(home), function.__name__)  # noqa: E731
        return Marked(function, make, plain=True) if COMPILED else function

    return mark


OPERATIONS = "vibrodrive.jit.operations"
"""Home of the operations of this folder."""
