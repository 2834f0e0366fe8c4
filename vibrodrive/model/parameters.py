"""Checks of the parameters and settings of a trajectory.

This module does not import Numba. Kernels rely on these checks and repeat none.
"""

from __future__ import annotations

import difflib
import math
import numbers
import unicodedata
from collections.abc import Iterable
from enum import IntEnum
from typing import TYPE_CHECKING

from vibrodrive.model.names import PARAMETERS, SETTINGS

if TYPE_CHECKING:
    import numpy as np

COLUMNS: tuple[str, ...] = tuple(PARAMETERS)  # columns of a point: all parameters, in this order


SHOWN = 80
"""Largest number of characters of a bad value in a message: the value may be an array, or a number of 400 digits."""


def bad(key: str, value: object, allowed: str) -> str:
    """Return the sentence for an invalid value: "KEY = VALUE: must be ALLOWED"."""
    try:
        text = " ".join(repr(value).split())  # the repr of an array has several lines
    except ValueError:
        text = "an integer of too many digits"  # more digits than Python prints
    return f"{key} = {text if len(text) <= SHOWN else text[: SHOWN - 2] + ' …'}: must be {allowed}"


def bad_axes(names: Iterable[str], allowed: str) -> str:
    """Return the sentence for axes that a computation or a figure cannot use: "axes = NAMES: must be ALLOWED"."""
    return f"axes = {', '.join(names) or 'none'}: must be {allowed}"


def unknown(key: str, name: object, known: Iterable[str]) -> str:
    """Return the sentence for an unknown name: the known names, and the most similar one if there is one."""
    names = list(known)
    sentence = bad(key, name, "one of " + ", ".join(names))
    folded = {known.lower(): known for known in names}
    near = difflib.get_close_matches(name.lower(), folded, 1) if isinstance(name, str) else []
    return f"{sentence}. Did you mean {folded[near[0]]}?" if near else sentence


def is_name(text: str) -> bool:
    """Return True if a string is not empty and has no control characters, so that it can be a name in one line."""
    return bool(text) and not has_control(text)


def has_control(text: str) -> bool:
    """Return True if a string has line separators or characters that control a terminal."""
    return any(unicodedata.category(c) in ("Cc", "Zl", "Zp") for c in text)


def real_number(key: str, value: object, allowed: str) -> float:
    """Return a real number as a float, ±inf if it is too large. Raises TypeError with the sentence of `bad`."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise TypeError(bad(key, value, allowed))
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf  # type: ignore[operator]


def real_array(key: str, value: object, allowed: str) -> np.ndarray:
    """Return real numbers of any shape as float64 array. Raises TypeError or ValueError with the sentence of `bad`."""
    import numpy as np

    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        raise TypeError(bad(key, value, allowed)) from None
    except MemoryError:
        raise ValueError(bad(key, value, f"{allowed}, small enough for memory")) from None
    if array.dtype.kind not in "iuf":
        flat = [real_number(key, v, allowed) for v in array.reshape(-1).tolist()]
        array = np.array(flat).reshape(array.shape)
    return array.astype(np.float64, copy=False)


def check(name: str, value: object) -> float:
    """Cast one argument to float64. Raises TypeError if it is not a real number, ValueError if it is out of range."""
    p = PARAMETERS[name]
    x = real_number(name, value, p.allowed)
    shown = value.item() if hasattr(value, "item") else value
    if not (p.low <= x <= p.high) or (p.open_low and x == p.low):
        raise ValueError(bad(name, shown, p.allowed))
    return x + 0.0  # -0.0 becomes 0.0


def check_count(name: str, value: object, low: int, high: int = 2**40) -> int:
    """Cast an integer setting to int. Raises TypeError or ValueError with the sentence of `bad`."""
    allowed = f"an integer >= {low}"
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise TypeError(bad(name, value, allowed))
    value = int(value)
    if value < low:
        raise ValueError(bad(name, value, allowed))
    if value > high:
        raise ValueError(bad(name, value, f"{allowed} and <= {high}"))
    return value


def check_choice(name: str, value: object, choices: type[IntEnum]) -> int:
    """Return the int of a method that is given as a member or by its name, in upper or lower case."""
    names = [m.name.lower() for m in choices]
    if isinstance(value, choices):
        return int(value)
    allowed = "one of " + ", ".join(names)
    if not isinstance(value, str):
        raise TypeError(bad(name, value, allowed))
    if value.lower() not in names:
        raise ValueError(bad(name, value, allowed))
    return int(choices[value.upper()])


def check_setting(name: str, value: object) -> int:
    """Return the value of one of SETTINGS as the int in `Settings`. Raises TypeError or ValueError."""
    row = SETTINGS[name]
    return check_choice(name, value, row.choices) if row.choices else check_count(name, value, int(row.low))
