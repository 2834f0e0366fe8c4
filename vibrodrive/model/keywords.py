"""The keywords of `simulate`, `sweep` and `limit`: their types, and how what was written reaches the function.

Each of these functions spells its keywords out, with types and defaults: for `help()`, editors and type checkers. But
Python hands keywords over in the order of the signature, and the axes of a sweep are to be in the order in which the
caller wrote them; nor does it say which keywords he left out, or refuse an unknown one in a sentence of ours.
`as_written` adds that. The one explicit signature stays the real one: no second copy of it to keep in step, as there
would be with a TypedDict beside the defaults or with overloads.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Concatenate, Literal, ParamSpec, TypeAlias, TypeVar

import numpy as np

from vibrodrive.model.parameters import PARAMETERS, Method, Scan, bad

Axis: TypeAlias = float | Sequence[float] | np.ndarray
"""One number, or a sequence of them: an axis of a sweep."""

MethodLike: TypeAlias = Method | Literal["certified", "muller", "fixed"]
ScanLike: TypeAlias = Scan | Literal["skip", "literal"]

P = ParamSpec("P")
R = TypeVar("R")


def as_written(function: Callable[Concatenate[Mapping[str, Any], P], R]) -> Callable[P, R]:
    """Let `function` have, before its arguments, those that its caller wrote: by name, in the order written.

    An unknown keyword, or a missing one, is refused with the one sentence.
    """
    full = inspect.signature(function)
    public = full.replace(parameters=list(full.parameters.values())[1:])
    required = [p.name for p in public.parameters.values() if p.default is p.empty]

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        for name in kwargs:
            if name not in public.parameters:
                raise TypeError(bad("argument", name, "one of " + ", ".join(public.parameters)))
        written = dict(zip(public.parameters, args, strict=False)) | kwargs
        for name in required:
            if name not in written:
                raise TypeError(f"{name} is missing: must be given, {PARAMETERS[name].allowed}")
        public.bind(*args, **kwargs)  # too many without a name, or one given twice: Python's own TypeError
        return function(written, *args, **kwargs)

    call.__signature__ = public  # type: ignore[attr-defined]
    return call
