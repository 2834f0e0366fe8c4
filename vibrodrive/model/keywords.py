"""The keywords of `simulate`, `sweep` and `limit`: their types, and how they are passed on as the caller wrote them.

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

from vibrodrive.model.choices import Method, Scan
from vibrodrive.model.names import PARAMETERS
from vibrodrive.model.parameters import bad, unknown

Axis: TypeAlias = float | Sequence[float] | np.ndarray
"""One number, or a sequence of them: an axis of a sweep."""

Points: TypeAlias = Mapping[str, Sequence[float] | np.ndarray]
"""Sequences of one length, of parameters that change together."""

MethodLike: TypeAlias = Method | Literal["certified", "muller", "fixed"]
ScanLike: TypeAlias = Scan | Literal["skip", "literal"]

P = ParamSpec("P")
R = TypeVar("R")


def as_written(function: Callable[Concatenate[Mapping[str, Any], P], R]) -> Callable[P, R]:
    """Let `function` have, before its arguments, those that its caller wrote: by name, in the order written.

    An unknown keyword, a missing one, or too many arguments without a name are refused with the one sentence.
    """
    full = inspect.signature(function)
    public = full.replace(parameters=list(full.parameters.values())[1:])
    names = list(public.parameters)
    known, most = set(names), sum(p.kind != p.KEYWORD_ONLY for p in public.parameters.values())
    required = [p.name for p in public.parameters.values() if p.default is p.empty]

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        if len(args) > most:
            raise TypeError(bad("arguments without a name", args, ", ".join(names[:most]) or "none"))
        for name in kwargs:
            if name not in known:
                raise TypeError(unknown("argument", name, names))
        written = dict(zip(names, args, strict=False)) | kwargs
        for name in required:
            if name not in written:
                allowed = f", {PARAMETERS[name].allowed}" if name in PARAMETERS else ""
                raise TypeError(f"{name} is missing: must be given{allowed}")
        return function(written, *args, **kwargs)

    call.__signature__ = public  # type: ignore[attr-defined]
    return call
