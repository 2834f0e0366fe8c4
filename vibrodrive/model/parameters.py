"""Checks of the parameters and settings of a trajectory.

This module does not import Numba. Kernels rely on these checks and repeat none.
"""

from __future__ import annotations

import difflib
import functools
import inspect
import math
import numbers
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import IntEnum
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from vibrodrive.model.choices import Method, used_by
from vibrodrive.model.names import AXES, FOLLOWS, IDLE, NAMES, PARAMETERS, SCENE, SETTINGS, Settings

if TYPE_CHECKING:
    import numpy as np

P = ParamSpec("P")
R = TypeVar("R")

COLUMNS: tuple[str, ...] = tuple(PARAMETERS)  # columns of a point: all parameters, in this order


SHOWN = 80
"""Largest number of characters of a bad value in a message: the value may be an array, or a number of 400 digits."""


class Refusal(str):
    """The sentence of a refusal, which knows what it is about, so that nobody takes it apart again.

    name : name of the value that is refused. The sentence begins with it, or with the `place` that the value has
        elsewhere, such as "sweep.A" or "--quantity".
    """

    name: str
    _rest: str
    _place: str

    def __new__(cls, name: str, rest: str, place: str = "") -> Refusal:
        self = super().__new__(cls, (place or name) + rest)
        self.name, self._rest, self._place = name, rest, place
        return self

    def at(self, place: str) -> Refusal:
        """Return the same refusal with the place of the value."""
        return Refusal(self.name, self._rest, place)

    def __add__(self, hint: str) -> Refusal:
        return Refusal(self.name, self._rest + hint, self._place)

    def __reduce__(self) -> tuple[type[Refusal], tuple[str, str, str]]:
        return Refusal, (self.name, self._rest, self._place)


@contextmanager
def placed(place: Callable[[str], str]) -> Iterator[None]:
    """Let refusals begin with the place of their value, a function of its name."""
    try:
        yield
    except (TypeError, ValueError) as error:
        refusal = error.args[0] if error.args else None
        if not isinstance(refusal, Refusal):
            raise
        raise type(error)(refusal.at(place(refusal.name))) from None


def bad(key: str, value: object, allowed: str, index: str = "") -> Refusal:
    """Return the sentence for an invalid value: "KEY = VALUE: must be ALLOWED". `index` is such as "[3]"."""
    try:
        text = repr(value)
    except ValueError:
        text = "an integer of too many digits"  # more digits than Python prints
    except RecursionError:
        text = "lists in lists in lists …"
    return Refusal(key, f"{index} = {shortened(text)}: must be {allowed}")


def missing(key: str, why: str = "") -> Refusal:
    """Return the sentence for a value that is not given: "KEY is missing: must be given" and why."""
    return Refusal(key, f" is missing: must be given{why}")


def shortened(text: str, most: int = SHOWN) -> str:
    """Return at most `most` characters of a text, in one line."""
    text = " ".join(text.split())  # such as the repr of an array, or the message of an exception
    return text if len(text) <= most else f"{text[: most - 2]} …"


def bad_axes(names: Iterable[str], allowed: str) -> Refusal:
    """Return the sentence for axes that a computation or a figure cannot use: "axes = NAMES: must be ALLOWED"."""
    return Refusal("axes", f" = {', '.join(names) or 'none'}: must be {allowed}")


def unknown(key: str, name: object, names: Iterable[str]) -> Refusal:
    """Return the sentence for an unknown name: the known names, and the most similar one if there is one."""
    names = list(names)
    return bad(key, name, "one of " + ", ".join(names)) + did_you_mean(name, names)


def did_you_mean(name: object, names: Iterable[str]) -> str:
    """Return ". Did you mean NAME?" for the known name that is most similar or has this word, "" without one."""
    folded, slip = {allowed.lower(): allowed for allowed in names}, name.lower() if isinstance(name, str) else ""
    near = difflib.get_close_matches(slip, [key for key in folded if key == slip or len(key) > 2], 1, 0.65)
    near = near or [key for key in folded if slip in key.split("_") or (len(slip) > 2 and key.startswith(slip))]
    return f". Did you mean {folded[near[0]]}?" if near else ""


def refuse_unknown(names: Collection[str], most: int, args: Sequence[object], kwargs: Mapping[str, object]) -> None:
    """Refuse keywords that are not in `names`, and more than `most` arguments without a name.

    Raises TypeError with one sentence.
    """
    if len(args) > most:
        first = [*names][: most or 1]
        by_name = f"none; give each by name, such as {first[0]} = …"
        allowed = f"at most {most} ({', '.join(first)}); give the others by name" if most else by_name
        raise TypeError(bad("arguments without a name", args, allowed))
    for name in kwargs:
        if name not in names and name in SCENE and "scene" in names:
            raise TypeError(bad("argument", name, f"given by a scene, as scene = vd.Scene({name}=…, …)"))
        if name not in names:
            raise TypeError(unknown("argument", name, names))


def with_sentences(function: Callable[P, R]) -> Callable[P, R]:
    """Wrap a function so that it refuses unknown and missing arguments in one sentence. Raises TypeError."""
    parameters = dict(inspect.signature(function).parameters)
    bound = parameters.pop("self", None) is not None
    most = sum(p.kind != p.KEYWORD_ONLY for p in parameters.values())
    needed = [name for name, p in parameters.items() if p.default is p.empty]

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        positional = args[1:] if bound else args
        refuse_unknown(parameters, most, positional, kwargs)
        for name in needed:
            if name not in kwargs and name not in [*parameters][: len(positional)]:
                raise TypeError(missing(name))
        return function(*args, **kwargs)

    return call


def has_control(text: str) -> bool:
    """Return True if a string has line separators or characters that control a terminal."""
    return any(unicodedata.category(c) in ("Cc", "Zl", "Zp") for c in text)


def as_number(key: str, value: object, allowed: str, index: str = "") -> object:
    """Return a number or an array without dimensions, of NumPy, xarray or another library, as a number of Python.

    Any other value is returned unchanged. Raises TypeError with the sentence of `bad` for a masked value, for a time,
    and for a unit, because the number alone is not what was given.
    """
    if isinstance(value, float) or type(value) is int:  # nearly always
        return value.item() if hasattr(value, "item") else value
    refuse_unit(key, value, allowed, index)
    if getattr(value, "shape", None) != () or not hasattr(value, "item"):
        return value
    import numpy as np

    if np.ma.is_masked(value) or getattr(getattr(value, "dtype", None), "kind", "") in ("m", "M"):
        raise TypeError(bad(key, value, allowed, index))
    return np.asarray(value).item()  # `item` of astropy keeps the unit


NO_UNIT = ("", "1", "dimensionless")


def refuse_unit(key: str, value: object, allowed: str, index: str = "") -> None:
    """Refuse a quantity of pint, astropy or a similar library in another unit than that of the parameter `key`.

    Units are compared as texts and never converted. Raises TypeError with the sentence of `bad`.
    """
    expected = NAMES[key].unit if key in NAMES else "1"
    for holder in (value, getattr(value, "data", None) if hasattr(value, "dims") else None):  # xarray around a quantity
        unit = getattr(holder, "units", getattr(holder, "unit", None))
        if unit is not None and str(unit) not in (expected, *NO_UNIT):
            without = "without a unit" if expected == "1" else f"without a unit, in {expected}"
            raise TypeError(bad(key, value, f"{allowed}, {without}", index))


def real_number(key: str, value: object, allowed: str, index: str = "") -> float:
    """Return a real number as a float, ±inf if it is too large. Raises TypeError with the sentence of `bad`."""
    number = as_number(key, value, allowed, index)
    if isinstance(number, bool) or not isinstance(number, numbers.Real):
        raise TypeError(bad(key, value, allowed, index))
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf  # type: ignore[operator]


DEEPEST = 32  # lists in lists; NumPy has arrays of up to 32 or 64 dimensions


def real_array(key: str, value: object, allowed: str, index: str = "") -> np.ndarray:
    """Return real numbers of any shape as float64 array. Raises TypeError or ValueError with the sentence of `bad`.

    The sentence names the index of the first element that is not a real number, such as "A[1]".
    """
    import numpy as np

    usual = {int, float, np.float64, np.float32, np.int64, np.int32}
    if isinstance(value, list | tuple) and not set(map(type, value)) <= usual:  # NumPy would drop masks and units
        deep = index.count("[") >= DEEPEST
        rows = [] if deep else [real_array(key, row, allowed, f"{index}[{i}]") for i, row in enumerate(value)]
        if len({row.shape for row in rows}) != 1:  # rows of different lengths
            raise TypeError(bad(key, value, allowed, index))
        return np.array(rows)
    if type(value) not in (list, tuple, np.ndarray):  # these have no unit
        refuse_unit(key, value, allowed, index)
    try:
        array = np.asarray(value)
    except MemoryError:
        raise ValueError(bad(key, value, f"{allowed}, small enough for memory", index)) from None
    except (AttributeError, OverflowError, RuntimeError, TypeError, ValueError):  # in the words of other libraries
        raise TypeError(bad(key, value, allowed, index)) from None
    if array.ndim == 0:
        return np.array(real_number(key, value, allowed, index))
    masked = isinstance(value, np.ma.MaskedArray)
    if masked or array.dtype.kind not in "iuf":
        elements: Any = value if masked else array
        flat = [
            real_number(key, elements[at], allowed, index + "".join(f"[{i}]" for i in at))
            for at in np.ndindex(array.shape)
        ]
        array = np.array(flat).reshape(array.shape)
    return array.astype(np.float64, copy=False)


def check(name: str, value: object, index: str = "") -> float:
    """Cast a parameter or a quantity of a scene to float64.

    Raises TypeError if it is not a real number, ValueError if it is out of range.
    """
    row = NAMES[name]
    x = float(value) if isinstance(value, float) else real_number(name, value, row.allowed, index)
    if not row.allows(x):
        raise ValueError(bad(name, value.item() if hasattr(value, "item") else value, row.allowed, index))
    return x + 0.0  # -0.0 becomes 0.0


def cast_axis(name: str, value: Any) -> float | np.ndarray:
    """Return a parameter or quantity of a scene as a float, or its values along an axis, float64 (n,), checked.

    Raises TypeError or ValueError.
    """
    if isinstance(value, float) or type(value) is int:  # nearly always
        return check(name, value)
    row = NAMES[name]
    array = real_array(name, value, row.allowed)
    if array.ndim == 0 or row.axis is None:
        return check(name, value)
    if array.ndim > 1:
        raise ValueError(Refusal(name, f" = array of shape {array.shape}: must be a number or a one-dimensional axis"))
    if array.size == 0:
        raise ValueError(bad(name, [], "an axis with at least one value"))
    # an axis may have millions of values: find one to be refused without a loop
    within = (array > row.low if row.open_low else array >= row.low) & (array <= row.high)
    for i in (~within).nonzero()[0].tolist():
        check(name, value[i] if isinstance(value, list | tuple) else array[i].item(), f"[{i}]")
    return array + 0.0


def cast_arguments(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of a sweep as numbers and arrays of float64, checked, in their order.

    Those that are None, as in the signatures, are left out; `record` is unchanged. Raises TypeError or ValueError.
    """
    values: dict[str, Any] = {}
    for key, value in arguments.items():
        if key in SETTINGS:
            values[key] = check_setting(key, value)
        elif key == "record":
            values[key] = value
        elif value is None and key in PARAMETERS and PARAMETERS[key].default is None:
            raise TypeError(bad(key, value, PARAMETERS[key].allowed))
        elif value is not None:
            values[key] = _cast_points(value, arguments) if key == "points" else cast_axis(key, value)
    _refuse_idle(arguments, values)
    return values


def _refuse_idle(arguments: Mapping[str, Any], values: Mapping[str, Any]) -> None:
    """Refuse a parameter that the method does not use, and one that follows from the scene. Raises ValueError."""
    by_name = {**values, **values["points"]} if "points" in values else values
    method = by_name.get("method", Settings.method)
    idle = [(name, f" with method = {Method(method).name.lower()!r}, because it is used by {used_by(name)} only")
            for name in IDLE[method] if name in by_name]  # fmt: skip
    idle += [(name, ", because it follows from the scene")
             for name, source in FOLLOWS.items() if name in by_name and source in by_name]  # fmt: skip
    for name, why in idle:
        value = by_name[name] if arguments.get(name) is None else arguments[name]
        raise ValueError(bad(name, value.tolist() if hasattr(value, "tolist") else value, f"left out{why}"))


def _cast_points(points: Any, arguments: Mapping[str, object]) -> dict[str, np.ndarray]:
    """Return the parameters and quantities of a scene that change together, checked.

    Raises TypeError or ValueError.
    """
    allowed = 'sequences of one length, by parameter name, such as {"A": [3.0, 3.1], "eps": [0.0, 1e-4]}'
    if not callable(getattr(points, "keys", None)) or not hasattr(points, "__getitem__"):
        raise TypeError(bad("points", points, allowed))
    arrays: dict[str, Any] = {}
    for name in points.keys():  # noqa: SIM118 - also for a pandas.DataFrame
        if name not in AXES:
            raise ValueError(unknown("key of points", name, AXES))
        if arguments.get(name) is not None:
            raise ValueError(bad(name, arguments[name], f"left out, because points already gives {name}"))
        with placed(POINTS.__add__):
            arrays[name] = cast_axis(name, points[name])
            if isinstance(arrays[name], float):
                raise TypeError(bad(name, points[name], "several values (give one number outside of points)"))
    labels = {name: labels for name in arrays if (labels := _labels(points[name])) is not None}
    for name in labels:
        if not labels[name].equals(labels[first := next(iter(labels))]):
            aligned = f"in the order of the labels of points.{first}, or an array without labels"
            raise ValueError(bad(name, points[name], aligned).at(POINTS + name))
    lengths = {name: len(values) for name, values in arrays.items()}
    if len({*lengths.values()}) != 1:
        counts = ", ".join(f"{n} of {name}" for name, n in lengths.items()) or "nothing"
        raise ValueError(f"points = {counts}: must be {allowed}")
    return arrays


POINTS = "points."  # before the name of a parameter in `points`


def _labels(values: Any) -> Any:
    """Return the labels of a pandas.Series or of an xarray.DataArray of one dimension, or None without labels."""
    if hasattr(values, "get_index"):
        return values.get_index(values.dims[0])
    index = getattr(values, "index", None)
    return index if hasattr(index, "equals") else None


def check_count(name: str, value: object, low: int, high: int = 2**40) -> int:
    """Cast an integer setting to int. Raises TypeError or ValueError with the sentence of `bad`."""
    allowed = f"an integer >= {low}"
    if type(value) is not int:
        value = as_number(name, value, allowed)
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
