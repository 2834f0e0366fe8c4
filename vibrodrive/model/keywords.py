"""Types of the keywords of `simulate`, `sweep` and `limit`, and a decorator that preserves the order of the call.

Each of these functions has an explicit signature with types and defaults, for `help()`, editors and type checkers.
Python passes keywords in the order of the signature, but the axes of a sweep must have the order of the call. Python
does not report which keywords the caller omitted, and it refuses an unknown keyword with a message of its own.
`as_written` passes the given keywords in the order of the call and refuses unknown keywords with a message of this
package. A TypedDict or overloads would be a second copy of the signature.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Concatenate, ParamSpec, TypeAlias, TypeVar

import numpy as np

from vibrodrive.model.parameters import bad, refuse_unknown
from vibrodrive.model.physical import Scene

Axis: TypeAlias = (
    float | Sequence[float] | np.ndarray
)  # one number, or a sequence of numbers, which is an axis of a sweep

Points: TypeAlias = Mapping[str, Sequence[float] | np.ndarray]
"""Parameters that change together: sequences of one length, by the names of the parameters."""

P = ParamSpec("P")
R = TypeVar("R")


def as_written(function: Callable[Concatenate[Mapping[str, Any], P], R]) -> Callable[P, R]:
    """Wrap `function` so that its first argument is a dictionary of the given arguments in the order of the call.

    Raises TypeError with one sentence for an unknown keyword and for too many positional arguments.
    """
    full = inspect.signature(function)
    public = full.replace(parameters=list(full.parameters.values())[1:])
    known, most = public.parameters, sum(p.kind != p.KEYWORD_ONLY for p in public.parameters.values())

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        for name, value in [*zip(["A"] * len(args), args, strict=True), *kwargs.items()] if "scene" in known else ():
            if isinstance(value, Scene) and name != "scene":
                raise TypeError(bad(name, value, "given by name, as scene=…"))
        refuse_unknown(known, most, args, kwargs)
        written = dict(zip(known, args, strict=False)) | kwargs
        return function(written, *args, **kwargs)

    call.__signature__ = public  # type: ignore[attr-defined]
    return call
