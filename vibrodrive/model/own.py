"""A number of the user's own as a record: a function of a motion, its name, and the names of its numbers."""

from __future__ import annotations

import functools
import hashlib
import inspect
import re
from collections.abc import Callable
from typing import Any

from vibrodrive.model.parameters import bad

_TEXT = re.compile(r"(?P<name>\w+): (?P<numbers>[\w, ]*) \(source (?P<sha256>[0-9a-f]{64})\)")


class Own(str):
    """A function of a motion as a record of a sweep. As a string it is the text by which files know the function.

    Attributes
    ----------
    name : name of the function.
    numbers : names of the numbers that it returns; () until it has been called for the first time.
    sha256 : SHA-256 of its source. Values that the function takes from outside are not part of it.
    function : the function; None if the record was read from a file.
    """

    name: str
    numbers: tuple[str, ...]
    sha256: str
    function: Callable[[Any], Any] | None

    def __new__(
        cls, name: str, numbers: tuple[str, ...], sha256: str, function: Callable[[Any], Any] | None = None
    ) -> Own:
        self = super().__new__(cls, f"{name}: {', '.join(numbers)} (source {sha256})")
        self.name, self.numbers, self.sha256, self.function = name, numbers, sha256, function
        return self

    def __reduce__(self) -> tuple[type[Own], tuple[Any, ...]]:
        return Own, (self.name, self.numbers, self.sha256, self.function)

    @classmethod
    def of(cls, function: Callable[[Any], Any]) -> Own:
        """Return the record of a function whose numbers are not known yet. Raises TypeError without a source."""
        plain = inspect.unwrap(function)
        while isinstance(plain, functools.partial):
            plain = plain.func
        if not inspect.isroutine(plain):
            plain = type(plain)
        try:
            source = inspect.getsource(plain)
        except (OSError, TypeError):
            code = getattr(plain, "__code__", None)
            if code is None:
                raise TypeError(bad("record", function, "a function that is written in Python")) from None
            source = repr((code.co_code, code.co_consts, code.co_names))
        name = getattr(plain, "__name__", "function")
        name = name if name.isidentifier() else "function"  # "<lambda>"
        return cls(name, (), hashlib.sha256(source.encode()).hexdigest(), function)

    def returning(self, numbers: tuple[str, ...]) -> Own:
        """Return the same record with the names of its numbers."""
        return Own(self.name, numbers, self.sha256, self.function)


def as_record(text: str) -> str:
    """Return a record from its text in a file."""
    found = _TEXT.fullmatch(text)
    return text if found is None else Own(found["name"], tuple(found["numbers"].split(", ")), found["sha256"])
