"""A number of the user's own as a record: a function of a motion, its name, and the names of its numbers."""

from __future__ import annotations

import functools
import hashlib
import inspect
import re
from collections.abc import Callable
from typing import Any

from vibrodrive.model.parameters import bad

_TEXT = re.compile(r"(?P<name>[^:,]+): (?P<numbers>.*) \((?P<of>source|function) (?P<sha256>[0-9a-f]{64})\)")

SOURCE, FUNCTION = "source", "function"
"""What a SHA-256 is of: of the source alone, as in older files, or of all that the function depends on (identity.py)"""


class Own(str):
    """A function of a motion as a record of a sweep. As a string it is the name of the function.

    Attributes
    ----------
    text : the function as files know it: its name, its numbers and their SHA-256.
    numbers : names of the numbers that it returns; () until it has been called for the first time.
    sha256 : SHA-256 of what its numbers depend on (identity.py), or of its source alone in older files.
    of : FUNCTION or SOURCE, what `sha256` is of.
    function : the function; None if the record was read from a file.
    uses : names of the values outside of its source that it depends on.
    unknown : why two calls of the function cannot be compared, so that no file can be resumed; "" if they can.
    """

    numbers: tuple[str, ...]
    sha256: str
    of: str
    function: Callable[[Any], Any] | None
    uses: tuple[str, ...]
    unknown: str

    def __new__(
        cls,
        name: str,
        numbers: tuple[str, ...],
        sha256: str,
        of: str = FUNCTION,
        function: Callable[[Any], Any] | None = None,
        uses: tuple[str, ...] = (),
        unknown: str = "",
    ) -> Own:
        self = super().__new__(cls, name)
        self.numbers, self.sha256, self.of, self.function = numbers, sha256, of, function
        self.uses, self.unknown = uses, unknown
        return self

    @property
    def text(self) -> str:
        return f"{self}: {', '.join(self.numbers)} ({self.of} {self.sha256})"

    def __reduce__(self) -> tuple[type[Own], tuple[Any, ...]]:
        return Own, (str(self), self.numbers, self.sha256, self.of, self.function, self.uses, self.unknown)

    @classmethod
    def from_function(cls, function: Callable[[Any], Any]) -> Own:
        """Return the record of a function whose numbers are not known yet."""
        from vibrodrive.model.identity import Unknown, digest_of

        name = getattr(_plain(function), "__name__", "function")
        name = name if name.isidentifier() else "function"  # "<lambda>"
        try:
            sha256, uses = digest_of(function)
            return cls(name, (), sha256, FUNCTION, function, uses)
        except Unknown as error:
            return cls(name, (), "0" * 64, FUNCTION, function, unknown=str(error))

    def returning(self, numbers: tuple[str, ...]) -> Own:
        """Return the same record with the names of its numbers."""
        return Own(str(self), numbers, *self.__reduce__()[1][2:])

    def refuse_unknown(self) -> None:
        """Raise TypeError if a file with these numbers could be resumed by another function."""
        if self.unknown:
            allowed = f"a function that a repeated call can be compared with, to resume the file, but {self.unknown}"
            raise TypeError(bad("record", str(self), allowed))

    def known_like(self, stored: Own) -> Own:
        """Return this record, described as in a file: an older file contains the SHA-256 of the source alone."""
        if stored.of == FUNCTION or self.function is None:
            return self
        from vibrodrive.model.identity import source_of

        sha256 = hashlib.sha256(source_of(_plain(self.function)).encode()).hexdigest()
        return Own(str(self), self.numbers, sha256, SOURCE, self.function, self.uses)


def _plain(function: Callable[..., Any]) -> Any:
    """Return the function that carries the name and the source: without wrappers, and the class of an instance."""
    plain = inspect.unwrap(function)
    while isinstance(plain, functools.partial):
        plain = plain.func
    return plain if inspect.isroutine(plain) else type(plain)


def as_record(text: str) -> str:
    """Return a record from its text in a file."""
    found = _TEXT.fullmatch(text)
    if found is None:
        return text
    return Own(found["name"], tuple(found["numbers"].split(", ")), found["sha256"], found["of"])


def texts(record: tuple[str, ...]) -> list[str]:
    """Return the records as files know them."""
    return [one.text if isinstance(one, Own) else one for one in record]
