"""Machine code of the kernels that came with the package, in the folder `vibrodrive/shipped` of a wheel.

`shipped/build.py` makes this folder: a library for each kind of processor, and a table of the kernels in them, with the
hash of their sources. Each kernel is a function of C, whose argument is the address of words of 64 bits: the numbers
of its arguments in order, and for an array its address and its shape. The result is written over them.

The code is used if it belongs to the sources that are installed, if the processor can run it, if its checksum is right,
and if nobody asks Numba to compile: by NUMBA_CPU_NAME or NUMBA_CPU_FEATURES, or by VIBRODRIVE_CODE=numba.
VIBRODRIVE_CODE may also name one of the libraries, such as x86-64-v3.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import struct
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from vibrodrive.jit.sources import fingerprints

FOLDER = Path(__file__).parent.parent / "shipped"
TABLE = "kernels.json"

_V3 = ("AVX", "AVX2", "FMA3", "F16C", "BMI", "BMI2", "LZCNT", "MOVBE")
LEVELS = {"x86-64-v4": (*_V3, "AVX512F", "AVX512CD", "AVX512BW", "AVX512DQ", "AVX512VL"), "x86-64-v3": _V3}
"""Kinds of processors, the widest first, and NumPy's names of the features of each"""


def _features() -> Mapping[str, bool]:
    """Return the features of the processor on Linux, by NumPy's names.

    NumPy asks the processor, with the instruction CPUID, and whether the system saves its registers. There an emulator
    answers for itself, and in /proc/cpuinfo for the machine on which it runs.
    """
    core = "numpy.core" if np.__version__.startswith("1.") else "numpy._core"
    return import_module(f"{core}._multiarray_umath").__cpu_features__ if sys.platform == "linux" else {}


def can_run(level: str) -> bool:
    """Return whether this processor is of the kind `level`, or of a wider one.

    Before 2.4, NumPy does not ask for BMI, BMI2, LZCNT and MOVBE, which processors with AVX2 and FMA3 have.
    """
    features = _features()
    return features.get("AVX2", False) and all(features.get(name, True) for name in LEVELS[level])


def sum_of(kernels: Any) -> str:
    """Return the checksum of the table of the kernels."""
    return hashlib.sha256(json.dumps(kernels, sort_keys=True).encode()).hexdigest()


@cache
def _table_and_library() -> tuple[dict[str, Any], ctypes.CDLL | None]:
    """Return the kernels that came with the package, by name, and the library that contains them."""
    wanted = os.environ.get("VIBRODRIVE_CODE", "")
    if wanted == "numba" or os.environ.get("NUMBA_CPU_NAME") or os.environ.get("NUMBA_CPU_FEATURES"):
        return {}, None
    try:
        table = json.loads((FOLDER / TABLE).read_text(encoding="utf-8"))
        if table["sources"] != fingerprints()[1]:  # edited since
            return {}, None
        if table["sum"] != sum_of(table["kernels"]):
            raise ValueError(f"{FOLDER / TABLE} is damaged")
        paths = {level: FOLDER / f"{level}.so" for level in LEVELS if level in table["libraries"] and can_run(level)}
        usable = [level for level, path in paths.items() if path.exists()]
        if wanted and wanted not in usable:
            raise ValueError(f"VIBRODRIVE_CODE = {wanted}: must be {' or '.join([*usable, 'numba'])} here")
        if not usable:
            return {}, None
        level = wanted or usable[0]
        path = paths[level]
        if hashlib.sha256(path.read_bytes()).hexdigest() != table["libraries"][level]:
            raise ValueError(f"{path} is damaged")
        return table["kernels"], ctypes.CDLL(str(path))
    except (FileNotFoundError, NotADirectoryError):  # no wheel with machine code, or an archive
        return {}, None
    except Exception as error:
        print(
            f"vibrodrive: the machine code of the package is not used, kernels are compiled ({error})", file=sys.stderr
        )
        return {}, None


def function(name: str) -> Callable[..., Any] | None:
    """Return the machine code of a kernel as a function, or None if Numba must compile it.

    The function raises TypeError for an array of another kind than the kernel was compiled for.
    """
    kernels, library = _table_and_library()
    if library is None or name not in kernels:
        return None
    symbol, arguments, result = kernels[name]
    run = getattr(library, symbol)
    run.restype = None
    letters = "".join(map(_LETTERS.__getitem__, result if isinstance(result, list) else [result]))
    results = struct.Struct(letters)
    adders, words = zip(*map(_argument, arguments), strict=True)
    pack = struct.Struct(f"{''.join(words)}{results.size}x").pack

    def call(*args: Any) -> Any:
        flat: list[Any] = []
        for n, each in enumerate(args):
            adders[n](flat, each)
        block = bytearray(pack(*flat))
        run(_memory(block))
        values = results.unpack_from(block)
        return values if isinstance(result, list) else values[0] if values else None

    return call


_memory: Callable[[Any], Any] = (ctypes.c_char * 0).from_buffer
"""Function that returns what ctypes passes as the address of memory that may be written to"""

_LETTERS = {"i8": "q", "u8": "Q", "f8": "d", "b1": "?", None: "x"}
"""Letter of `struct` for each kind of number of a result, and for nothing"""

_WORDS = _LETTERS | {"b1": "q"}  # of an argument, which is a whole word


def _argument(kind: Any) -> tuple[Callable[[list[Any], Any], None], str]:
    """Return a function that appends the words of an argument of this kind to a list, and the letters of these words.

    kind : name of a number, {"dtype": …, "ndim": …} for an array, or a list of kinds for a tuple
    """
    if isinstance(kind, str):
        return list.append, _WORDS[kind]
    if isinstance(kind, list) and all(isinstance(each, str) for each in kind):
        return list.extend, "".join(map(_WORDS.__getitem__, kind))
    if isinstance(kind, list):
        adders, words = zip(*map(_argument, kind), strict=True)

        def add_all(flat: list[Any], values: Sequence[Any]) -> None:
            for add, each in zip(adders, values, strict=True):
                add(flat, each)

        return add_all, "".join(words)
    dtype, ndim = _dtype(kind["dtype"]), kind["ndim"]

    def add(flat: list[Any], array: np.ndarray) -> None:
        nonlocal dtype
        flags = array.flags
        if array.dtype != dtype or array.ndim != ndim or not flags.c_contiguous:
            raise TypeError(f"must be a contiguous {dtype} array of {ndim} dimensions, got {array.dtype}, {array.ndim}")
        dtype = array.dtype  # to compare the same object takes no time
        flat.append(ctypes.addressof(_memory(array)) if flags.writeable else array.ctypes.data)
        flat += array.shape

    return add, "q" * (1 + ndim)


def _dtype(written: str | Sequence[Sequence[str]]) -> np.dtype[Any]:
    return np.dtype(written if isinstance(written, str) else [(name, kind) for name, kind in written])
