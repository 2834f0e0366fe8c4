"""Machine code of the kernels that came with the package, in the folder `vibrodrive/shipped` of a wheel.

`shipped/build.py` makes this folder: a library for each kind of processor, and a table of the kernels in them, with the
hash of their sources. Each kernel is a function of C with the arguments of Numba's calling convention: addresses for
the result and for an exception, which no kernel raises, and then the arguments; tuples and arrays take several.

The code is used if it belongs to the sources that are installed, if the processor can run it, if its checksum is right,
and if nobody asks Numba to compile: by NUMBA_CPU_NAME or NUMBA_CPU_FEATURES, or by VIBRODRIVE_CODE=numba.
VIBRODRIVE_CODE may also name one of the libraries, such as x86-64-v3.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import platform
import sys
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from vibrodrive.jit.sources import fingerprints

FOLDER = Path(__file__).parent.parent / "shipped"
TABLE = "kernels.json"

_V3 = ("avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave")
LEVELS = {"x86-64-v4": (*_V3, "avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"), "x86-64-v3": _V3}
"""Kinds of processors, the widest first, and what Linux calls the features of each. It names those features only whose
registers the system saves."""


def _features() -> set[str]:
    """Return the features of this processor; none on systems other than Linux on x86-64."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        return set()
    with open("/proc/cpuinfo", encoding="utf-8") as lines:
        return next((set(line.split()) for line in lines if line.startswith("flags")), set())


def can_run(level: str) -> bool:
    """Return whether this processor is of the kind `level`, or of a wider one."""
    return _features().issuperset(LEVELS[level])


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
        if wanted and not (wanted in LEVELS and can_run(wanted)):
            allowed = " or ".join([*filter(can_run, LEVELS), "numba"])
            raise ValueError(f"VIBRODRIVE_CODE = {wanted}: must be {allowed} here")
        if table["sum"] != sum_of(table["kernels"]):
            raise ValueError(f"{FOLDER / TABLE} is damaged")
        level = next((name for name in LEVELS if wanted in ("", name) and can_run(name)), "")
        if level not in table["libraries"]:
            return {}, None
        path = FOLDER / f"{level}.so"
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
    if arguments == ["i8"]:
        run.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64]
        return lambda address: run(_IGNORED, _IGNORED, address)
    flatten = [_flat(kind) for kind in arguments]
    of_result, value = _result(result)

    def call(*args: Any) -> Any:
        flat: list[Any] = []
        for add, each in zip(flatten, args, strict=True):
            add(flat, each)
        out = of_result()
        run(ctypes.byref(out), ctypes.byref(_EXCEPTION), *flat)
        return value(out)

    return call


_EXCEPTION = ctypes.c_void_p()
_UNREAD = ctypes.create_string_buffer(16)
_IGNORED = ctypes.addressof(_UNREAD)  # where kernels write results that nobody reads

_SCALARS: dict[str, tuple[Any, Callable[[Any], Any]]] = {
    "i8": (ctypes.c_int64, int),
    "u8": (ctypes.c_uint64, int),
    "f8": (ctypes.c_double, float),
    "b1": (ctypes.c_int8, bool),
}
"""Type of C, and the conversion to it and from it, of each kind of number"""


def _flat(kind: Any) -> Callable[[list[Any], Any], None]:
    """Return a function that appends an argument of this kind to a list of arguments of C.

    kind : name of a number, {"dtype": …, "ndim": …} for an array, or a list of kinds for a tuple
    """
    if isinstance(kind, str):
        number, convert = _SCALARS[kind]
        return lambda flat, value: flat.append(number(convert(value)))
    if isinstance(kind, list):
        adders = [_flat(each) for each in kind]

        def add_all(flat: list[Any], values: Sequence[Any]) -> None:
            for add, each in zip(adders, values, strict=True):
                add(flat, each)

        return add_all
    dtype, ndim = _dtype(kind["dtype"]), kind["ndim"]

    def add(flat: list[Any], array: np.ndarray) -> None:
        if array.dtype != dtype or array.ndim != ndim or not array.flags.c_contiguous:
            raise TypeError(f"must be a contiguous {dtype} array of {ndim} dimensions, got {array.dtype}, {array.ndim}")
        numbers = array.size, array.itemsize, array.ctypes.data, *array.shape, *array.strides
        flat += [None, None, *map(ctypes.c_int64, numbers)]

    return add


def _dtype(written: str | Sequence[Sequence[str]]) -> np.dtype[Any]:
    return np.dtype(written if isinstance(written, str) else [(name, kind) for name, kind in written])


def _result(kind: Any) -> tuple[Any, Callable[[Any], Any]]:
    """Return the type of C of a result, and a function that converts it to Python."""
    if kind is None:
        return ctypes.c_void_p, lambda out: None
    if isinstance(kind, str):
        number, convert = _SCALARS[kind]
        return number, lambda out: convert(out.value)
    parts = [_result(each) for each in kind]
    fields = [(f"f{n}", part) for n, (part, _) in enumerate(parts)]
    structure = type("Result", (ctypes.Structure,), {"_fields_": fields})
    convert_each = [(name, _SCALARS[each][1]) for (name, _), each in zip(fields, kind, strict=True)]
    return structure, lambda out: tuple(convert(getattr(out, name)) for name, convert in convert_each)
