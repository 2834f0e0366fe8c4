"""One place for every option given to Numba, each with its reason.

* ``error_model="numpy"``: no zero-division branches, which would keep loops from being vectorised.
* ``nogil=True``: the writer works while a block is computed.
* ``_nrt=False`` (all but entry points that allocate): no reference counting. With it every array argument of
  every inlined formula is counted up and down, atomically: four fifths of the time of a sweep.
* ``fastmath`` stays off: it would fold NaN checks away and change bits from machine to machine.
* The cache directory carries a hash of the kernel sources. Numba notices a change in the file of the
  function it loads, not in the files of the functions that one calls: without the hash an edited
  equation could go on giving the old numbers.
"""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import cgutils, types
from numba.extending import intrinsic

_HERE = Path(__file__).parent


_IMPORT = re.compile(rb"^from vibrodrive(?:\.(\w+))? import (\w+)", re.MULTILINE)


def _fingerprint() -> str:
    """A hash of every module with a kernel in it and of all that those import, whatever they take from there."""
    sources = {path.stem: path.read_bytes() for path in _HERE.glob("*.py")}
    todo = [name for name, source in sources.items() if b"from vibrodrive._jit import" in source]
    known = set(todo)
    while todo:
        for module, name in _IMPORT.findall(sources[todo.pop()]):
            imported = (module or name).decode()
            if imported in sources and imported not in known:
                known.add(imported)
                todo.append(imported)
    digest = hashlib.sha256(numba.__version__.encode())
    for name in sorted(known):
        digest.update(name.encode() + b"\0" + sources[name])
    return digest.hexdigest()[:16]


def _cache_directory() -> Path:
    """A writable directory outside the installation, which may be read-only."""
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    name = f"vibrodrive-{_fingerprint()}"
    for base in (Path(home).expanduser(), Path(tempfile.gettempdir()) / f"vibrodrive-cache-{os.getuid()}"):
        try:
            (base / name).mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError:
            continue
        if os.access(base / name, os.W_OK):
            return base / name
    return Path(tempfile.mkdtemp(prefix="vibrodrive-"))


CACHE = _cache_directory()


def must_compile() -> bool:
    """Whether the kernels of this version are not on disk yet: the first motion will take longer to begin."""
    return not (getattr(numba.config, "DISABLE_JIT", 0) or any(CACHE.rglob("*run*.nbc")))


def jit(function=None, **options):
    """A kernel entry point: compiled once per version, kept on disk. ``_nrt=False`` unless it allocates."""
    if function is None:
        return lambda f: jit(f, **options)
    if numba.config.DISABLE_JIT:
        return np.errstate(all="ignore")(function)  # compiled code does not warn of what overflows either
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(CACHE)
    try:
        return numba.njit(cache=True, error_model="numpy", nogil=True, **options)(function)
    finally:
        numba.config.CACHE_DIR = before


_INNER = {
    "error_model": "numpy",
    "nogil": True,
    "_nrt": False,
    "no_cfunc_wrapper": True,  # never called from C: a fair share of compiling a formula is the way in
}


def _once(dispatcher):
    """Compiled for types alone, not once more for every constant it is called with.

    Constants reach a formula when LLVM inlines it; a second compilation is a second wait for nothing.
    """
    if isinstance(dispatcher, numba.core.dispatcher.Dispatcher):
        template = dispatcher.get_call_template
        dispatcher.get_call_template = lambda args, kws: template([types.unliteral(a) for a in args], kws)
    return dispatcher


def inline(function):
    """A formula: inlined wherever it stands, so that loops over it vectorise; compiled with its caller."""
    return _once(numba.njit(forceinline=True, **_INNER)(function))


def inline_each(function):
    """A formula of its own for every set of constants it is called with: where it must be free of branches."""
    return numba.njit(forceinline=True, **_INNER)(function)


def part(function):
    """A piece of a kernel that is called, not inlined: keeps the compile time of its callers short.

    Called by kernels only: it has no way in from Python, which would take as long to compile again.
    """
    return _once(numba.njit(no_cpython_wrapper=True, **_INNER)(function))


def address(entry, arguments):
    """Where the code of an entry point for such arguments lies, compiled if it is not yet. For `call`."""
    if numba.config.DISABLE_JIT:
        return entry
    signature = tuple(numba.typeof(a) for a in arguments)
    entry.compile(signature)
    compiled = entry.overloads[signature]
    return compiled.library.get_pointer_to_function(compiled.fndesc.mangled_name)


@intrinsic
def _call(typingctx, where, arguments):
    def codegen(context, builder, signature, values):
        kinds = signature.args[1].types
        kind = context.call_conv.get_function_type(types.none, kinds)
        function = builder.inttoptr(values[0], kind.as_pointer())
        unpacked = cgutils.unpack_tuple(builder, values[1], len(kinds))
        context.call_conv.call_function(builder, function, types.none, kinds, unpacked)
        return context.get_dummy_value()

    return types.none(types.intp, arguments), codegen


call: Any = (lambda where, arguments: where(*arguments)) if numba.config.DISABLE_JIT else _call  # type: ignore[attr-defined]
"""call(where, arguments): the entry point at that address, which returns nothing. The caller does not contain it: a
loop over threads around the engine would take as long to compile as the engine."""
