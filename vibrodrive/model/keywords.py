"""Signatures and help of `simulate`, `sweep`, `limit` and the orbits, made from the table of names.

Each of these functions takes the keywords of a TypedDict as `**parameters: Unpack[…]`, from which a type checker, which
does not run the table, knows names and types. `takes` makes a signature with every keyword and its default of it, for
`help()`, editors and the site, and writes the keywords into the docstring, in the place of a line "**parameters".

Python passes keywords in the order of the signature, but the axes of a sweep must have the order of the call. Python
does not report which keywords the caller omitted, and it refuses an unknown keyword with a message of its own. So the
function gets the given keywords as a dictionary in the order of the call, and unknown ones are refused in a sentence.
"""

from __future__ import annotations

import functools
import inspect
import math
import re
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Concatenate, Generic, ParamSpec, TypeAlias, TypedDict, TypeVar, cast

import numpy as np

from vibrodrive.model.names import NAMES, PARAMETERS, SCENE
from vibrodrive.model.parameters import bad, refuse_unknown
from vibrodrive.model.physical import Scene

Axis: TypeAlias = (
    float | Sequence[float] | np.ndarray
)  # one number, or a sequence of numbers, which is an axis of a sweep

Points: TypeAlias = Mapping[str, Sequence[float] | np.ndarray]
"""Parameters that change together: sequences of one length, by the names of the parameters."""

One = TypeVar("One")
"""Type of a parameter in a signature: a number, or a number or a sequence of numbers."""


class Parameters(TypedDict, Generic[One], total=False):
    """Keywords for a motion, apart from A and the method, whose place in the signatures differs."""

    B: One
    eps: One
    eta: One
    dtau: One | None
    tol: One | None
    xi0: One
    dxi0: One
    tau0: One
    transient: int
    periods: int
    section_phase: One
    budget: int


class Machine(TypedDict, Generic[One], total=False):
    """Keywords for a machine in SI units."""

    scene: Scene | None
    a0: One | None
    omega0: One | None
    frequency: One | None
    mu: One | None
    alpha: One | None
    mass: One | None
    g: float | None


class Point(Parameters[One], Machine[One], total=False):
    """Keywords for a point of a sweep, or for a motion."""


P = ParamSpec("P")
R = TypeVar("R")


PLACE = "**parameters\n"

IN_WORDS = {"float": "float", "Axis": "float or sequence of float", "int": "int", "Scene": "Scene"}
"""Types of a signature in the words of help"""


def takes(
    kind: Any = None, /, **defaults: Any
) -> Callable[[Callable[Concatenate[Mapping[str, Any], P], R]], Callable[P, R]]:
    """Let a function have the keywords of `kind`, such as Point[Axis], with their `defaults`, or those of names.py.

    The first argument of the function becomes a dictionary of the given arguments in the order of the call. The made
    function raises TypeError with one sentence for an unknown keyword and for too many positional arguments.
    """
    made = [] if kind is None else list(_keywords(kind, defaults))

    def wrap(function: Callable[Concatenate[Mapping[str, Any], P], R]) -> Callable[P, R]:
        _, *own = (p for p in inspect.signature(function).parameters.values() if p.kind != p.VAR_KEYWORD)
        public = inspect.signature(function).replace(parameters=[*own, *made])
        names, most = public.parameters, sum(p.kind != p.KEYWORD_ONLY for p in own)
        named, run = {p.name for p in own}, cast(Callable[..., R], function)

        @functools.wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            for name, value in [*zip(["A"] * len(args), args, strict=True), *kwargs.items()]:
                if isinstance(value, Scene) and name != "scene" and "scene" in names:
                    raise TypeError(bad(name, value, "given by name, as scene=…"))
            refuse_unknown(names, most, args, kwargs)
            written = dict(zip(names, args, strict=False)) | kwargs
            return run(written, **{name: written[name] for name in named & written.keys()})

        call.__signature__ = public  # type: ignore[attr-defined]
        if function.__doc__:
            call.__doc__ = inspect.cleandoc(function.__doc__).replace(PLACE, "".join(map(_explained, made)))
        return call

    return wrap


def _keywords(kind: Any, defaults: Mapping[str, Any]) -> Iterator[inspect.Parameter]:
    """Yield the keywords of a TypedDict for a type of the values, such as Point[float]."""
    number = "float" if kind.__args__ == (float,) else "Axis"
    for name, annotation in kind.__origin__.__annotations__.items():
        row = NAMES[name]
        default = defaults.get(name, None if name in SCENE else row.default)
        if isinstance(default, float) and (math.isnan(default) or name == "tol"):
            default = None  # it depends on the method
        text = annotation.__forward_arg__.replace("One", number)
        yield inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=text)


def _explained(parameter: inspect.Parameter) -> str:
    """Return the entry of a docstring for a keyword."""
    row, kind = NAMES[parameter.name], IN_WORDS[parameter.annotation.removesuffix(" | None")]
    if parameter.name in PARAMETERS:
        kind += f", {number_text(row.low)} to {number_text(row.high)}"
    kind += ", optional" if parameter.default is None else f", default {number_text(parameter.default)}"
    unit = "" if row.unit == "1" else f" in {row.unit_text}"
    text = textwrap.fill(f"{row.meaning}{unit}. {row.note}".rstrip(), 108, break_on_hyphens=False)
    return f"{parameter.name} : {kind}\n{textwrap.indent(text, 4 * ' ')}\n"


def number_text(value: float) -> str:
    """Return a number as short as possible, such as 1e9."""
    return re.sub(r"e([+-])0*", lambda sign: "e" + sign[1].strip("+"), f"{value:g}")
