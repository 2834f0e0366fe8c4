"""SHA-256 of a function and of all values that its result depends on, so that a file is resumed by the same function.

The digest contains the source of the function, its defaults, the values of its closure and of the names at the top of
its module that it reads, the arguments of a `functools.partial`, and the state of an instance, all of them recursively.
Objects contribute what their pickle would contain. Of a library (the standard library, installed packages) only names
are part of it, and of a name that the function itself changes, such as a log or a cache, nothing.
"""

from __future__ import annotations

import ast
import dis
import functools
import hashlib
import inspect
import sys
import sysconfig
import textwrap
import types
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np

CHANGES = {"append", "add", "update", "extend", "insert", "pop", "popitem", "remove", "discard", "clear", "setdefault"}
"""Methods that change a list, a dict or a set."""

READS = ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_FROM_DICT_OR_GLOBALS")
WRITES = ("STORE_GLOBAL", "STORE_DEREF", "DELETE_GLOBAL", "DELETE_DEREF")

PLAIN = (int, float, complex, str, bytes, bool, type(None), type(Ellipsis))


class Unknown(Exception):
    """A value on which a function depends cannot be compared with that of a later call. The message names it."""


def digest_of(function: Callable[..., Any]) -> tuple[str, tuple[str, ...]]:
    """Return the SHA-256 of a function and of what its result depends on, and the names of the values in it that are no
    functions. Raises Unknown."""
    digest = _Digest(_module_of(function).partition(".")[0])
    digest.add("its contents", function)
    return digest.hash.hexdigest(), tuple(dict.fromkeys(digest.uses))


def source_of(value: Any) -> str:
    """Return the source of a module, a class, a function or its code; "" without one, as for what a prompt defines."""
    try:
        return inspect.getsource(value)
    except (OSError, TypeError):
        return ""


OWN_WORK = ("__init__", "__new__", "__post_init__", "__setstate__")
"""Methods that give an instance the state on which its result depends. What other methods change is no such state."""


class _Digest:
    def __init__(self, home: str) -> None:
        self.home = home  # the top package of the function, which counts as the user's even if it is installed
        self.hash = hashlib.sha256()
        self.uses: list[str] = []
        self._seen: dict[int, int] = {}
        self._kept: list[Any] = []  # an object that is deleted could give its id to another one

    def add(self, what: str, value: Any) -> None:
        """Add a value; `what` names it in the message of Unknown."""
        if isinstance(value, PLAIN) and type(value) in PLAIN:
            self._put(type(value).__name__, repr(value))
            return
        if id(value) in self._seen:
            self._put("again", str(self._seen[id(value)]))
            return
        self._seen[id(value)] = len(self._seen)
        self._kept.append(value)
        self._add(value, what)

    @functools.singledispatchmethod
    def _add(self, value: Any, what: str) -> None:
        """Add what the pickle of an object would contain."""
        if callable(value) and hasattr(value, "__wrapped__"):  # a compiled or caching wrapper of a function
            self._put("wrapper", type(value).__qualname__)
            self.add(what, value.__wrapped__)
            return
        try:
            reduced = value.__reduce_ex__(4)
        except Exception:
            raise Unknown(f"of {what}, a {type(value).__name__}, the contents are unknown") from None
        self._put("object")
        self.add(what, type(value))
        changed = () if self._library(type(value).__module__) else _changed_by_methods(type(value))
        for part in [reduced] if isinstance(reduced, str) else reduced:  # a text is the name of a constant
            if isinstance(part, dict):
                part = {key: one for key, one in part.items() if key not in changed}
            self.add(what, list(part) if isinstance(part, Iterator) else part)

    @_add.register
    def _array(self, value: np.ndarray, what: str) -> None:
        self._put("array", type(value).__qualname__, value.dtype.str, str(value.shape))
        if value.dtype.kind == "O":
            self.add(what, value.tolist())
        else:
            self.hash.update(np.ascontiguousarray(value).tobytes())
        if type(value) is not np.ndarray:  # a mask or a unit
            self.add(what, vars(value))

    @_add.register(tuple)
    @_add.register(list)
    def _sequence(self, value: tuple[Any, ...] | list[Any], what: str) -> None:
        self._put(type(value).__qualname__, str(len(value)))
        for one in value:
            self.add(what, one)

    @_add.register(set)
    @_add.register(frozenset)
    def _set(self, value: set[Any], what: str) -> None:
        self._put("set", *sorted(self._apart(what, one) for one in value))

    @_add.register
    def _dict(self, value: dict, what: str) -> None:
        self._put(type(value).__qualname__, str(len(value)))
        for key, one in value.items():
            self.add(what, key)
            self.add(f"{what}[{key!r}]", one)

    @_add.register
    def _method(self, value: types.MethodType, what: str) -> None:
        self._put("method")
        self.add(what, value.__func__)
        self.add(what, value.__self__)

    @_add.register
    def _partial(self, value: functools.partial, what: str) -> None:
        self._put("partial")
        for part in (value.func, value.args, value.keywords):
            self.add(what, part)

    @_add.register
    def _module(self, value: types.ModuleType, what: str) -> None:
        self._put("module", value.__name__)
        if not self._library(value.__name__):
            self._put(source_of(value))
            for name, one in vars(value).items():
                if not name.startswith("__") and (type(one) in PLAIN or isinstance(one, types.ModuleType)):
                    self._put(name)
                    self.add(f"{name} of {value.__name__}", one)

    @_add.register
    def _class(self, value: type, what: str) -> None:
        self._put("class", value.__qualname__)
        if self._library(value.__module__):
            self._put(value.__module__)
            return
        self._put(source_of(value))
        changed = _changed_by_methods(value)
        for name, one in vars(value).items():
            one = getattr(one, "__func__", getattr(one, "fget", getattr(one, "func", one)))  # of a property, method, …
            data = type(one) in (*PLAIN, tuple, list, dict, set, np.ndarray) and not name.startswith("__")
            if isinstance(one, types.FunctionType) or (data and name not in changed):
                self._put(name)
                self.add(f"{name} of {value.__name__}", one)
        for base in value.__bases__:
            self.add(what, base)

    @_add.register
    def _function(self, value: types.FunctionType, what: str) -> None:
        self._put("function", value.__qualname__)
        if self._library(value.__module__ or ""):
            self._put(value.__module__)
            return
        source = source_of(value.__code__)  # not that of a function that it wraps
        self._put(source)
        if not source or "<lambda>" in value.__qualname__:  # several may share their lines
            for code in _codes(value.__code__):
                self._put(code.co_code.hex(), repr(code.co_names), repr(code.co_varnames))
                self.add("a constant", [c for c in code.co_consts if not isinstance(c, types.CodeType)])
        self.add(f"a default of {value.__name__}", value.__defaults__)
        self.add(f"a default of {value.__name__}", value.__kwdefaults__)
        changed = _changed(source) | _names(value.__code__, WRITES)
        for name, cell in zip(value.__code__.co_freevars, value.__closure__ or (), strict=True):
            with suppress(ValueError):  # not assigned yet
                self._name(name, cell.cell_contents, value, changed)
        for name in sorted(_names(value.__code__, READS) & value.__globals__.keys()):
            self._name(name, value.__globals__[name], value, changed)

    def _name(self, name: str, content: Any, reader: types.FunctionType, changed: set[str]) -> None:
        """Add a name that a function reads, and its value, unless the function changes it."""
        code = isinstance(content, type | types.FunctionType | types.ModuleType | types.BuiltinFunctionType)
        if code or name not in changed:
            self._put(name)
            if not code:
                self.uses.append(name)
            self.add(f"{name} in {reader.__name__}", content)

    def _put(self, *words: str) -> None:
        for word in words:
            text = word.encode(errors="surrogatepass")
            self.hash.update(len(text).to_bytes(8, "little") + text)

    def _apart(self, what: str, value: Any) -> str:
        """Return the digest of a value alone, for sets, whose order differs between processes."""
        other = _Digest(self.home)
        other.add(what, value)
        return other.hash.hexdigest()

    def _library(self, module: str) -> bool:
        top = module.partition(".")[0]
        if top in (self.home, "__main__", ""):  # "": made by `exec`
            return False
        file = getattr(sys.modules.get(module), "__file__", None) or ""
        return top == "vibrodrive" or top in sys.stdlib_module_names or file.startswith(INSTALLED) or not file


INSTALLED = tuple({sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")})


def _module_of(function: Any) -> str:
    while isinstance(function, functools.partial):
        function = function.func
    return getattr(function, "__module__", None) or type(function).__module__


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    """Yield the code of a function and of the functions inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _codes(constant)


def _names(code: types.CodeType, operations: tuple[str, ...]) -> set[str]:
    """Return the names on which a function, or a function inside it, does one of these operations."""
    return {i.argval for one in _codes(code) for i in dis.get_instructions(one) if i.opname in operations}


def _changed(source: str) -> set[str]:
    """Return the names whose elements or attributes a function changes, such as log in `log.append(x)`."""
    return {path[0] for path in _places(source)}


def _changed_by_methods(kind: type) -> set[str]:
    """Return the attributes that the methods of a class change, such as n in `self.n += 1`, apart from OWN_WORK."""
    found = set()
    for one in kind.__mro__:
        for name, member in vars(one).items():
            if isinstance(member, functools.cached_property):
                found.add(name)
            elif isinstance(member, types.FunctionType) and name not in OWN_WORK:
                found |= {path[1] for path in _places(source_of(member.__code__)) if len(path) > 1}
    return found


def _places(source: str) -> list[list[str]]:
    """Return what a function changes, as lists of a name and its attributes: `self.log.append(x)` is [self, log]."""
    try:
        tree = ast.parse(textwrap.dedent(source))
    except SyntaxError:  # a lambda inside a call
        return []
    found = []
    for node in ast.walk(tree):
        place: ast.AST | None = None
        if isinstance(node, ast.Attribute | ast.Subscript) and isinstance(node.ctx, ast.Store | ast.Del):
            place = node
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in CHANGES:
            place = node.func.value
        path: list[str] = []
        while isinstance(place, ast.Attribute | ast.Subscript):
            path = [place.attr, *path] if isinstance(place, ast.Attribute) else path
            place = place.value
        if isinstance(place, ast.Name):
            found.append([place.id, *path])
    return found
