"""A number of the user's own as a record: a function of a motion, its name, and the names of its numbers."""

from __future__ import annotations

import functools
import hashlib
import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from vibrodrive.errors import Failed
from vibrodrive.model.parameters import bad, real_number
from vibrodrive.model.quantities import Quantity, number
from vibrodrive.model.record import OfMotion, Record

_TEXT = re.compile(r"(?P<name>[^:,]+): (?P<numbers>.*) \((?P<of>source|function) (?P<sha256>[0-9a-f]{64})\)")

SOURCE, FUNCTION = "source", "function"
"""What a SHA-256 is of: of the source alone, as in older files, or of all that the function depends on (identity.py)"""


class Own(OfMotion):
    """A function of a motion as a record of a sweep. As a string it is the name of the function.

    Attributes
    ----------
    returned : names of the numbers that it returns; () until it has been called for the first time.
    sha256 : SHA-256 of what its numbers depend on (identity.py), or of its source alone in older files.
    of : FUNCTION or SOURCE, what `sha256` is of.
    function : the function; None if the record was read from a file.
    uses : names of the values outside of its source that it depends on.
    unknown : why two calls of the function cannot be compared, so that no file can be resumed; "" if they can.
    """

    returned: tuple[str, ...]
    sha256: str
    of: str
    function: Callable[[Any], Any] | None
    uses: tuple[str, ...]
    unknown: str

    def __new__(
        cls,
        name: str,
        returned: tuple[str, ...],
        sha256: str,
        of: str = FUNCTION,
        function: Callable[[Any], Any] | None = None,
        uses: tuple[str, ...] = (),
        unknown: str = "",
    ) -> Own:
        self = super().__new__(cls, name)
        self.returned, self.sha256, self.of, self.function = returned, sha256, of, function
        self.uses, self.unknown = uses, unknown
        return self

    def __reduce__(self) -> tuple[type[Own], tuple[Any, ...]]:
        return Own, (str(self), self.returned, self.sha256, self.of, self.function, self.uses, self.unknown)

    @property
    def quantities(self) -> tuple[Quantity, ...]:  # type: ignore[override]
        return tuple(number(n, n if n == self else f"{n} of the function {self}") for n in self.returned)

    @property
    def outline(self) -> str:
        return f"{self}: {', '.join(self.returned)} ({self.of} {self.sha256})"

    def text(self, sought: str = "") -> str:
        return self.outline

    def numbers(self, motion: Any) -> dict[str, float] | Exception:
        """Return the numbers of a motion, or the exception that the function raised, also for a result without numbers.

        Any other exception is a fault of this program, and never the result of a point.
        """
        if self.function is None:
            raise Failed(f"record = {str(self)!r}: must be computed by a call that gives the function")
        allowed = f"a number, or numbers by name, as the result of {self}"
        try:
            found = self.function(motion)
            named = found if isinstance(found, Mapping) else {str(self): found}
            values = {str(name): real_number(str(name), value, allowed) for name, value in named.items()}
            if not values:
                raise TypeError(bad(str(self), found, allowed))
            if self.returned and set(values) != set(self.returned):
                raise ValueError(bad("names", list(values), f"{', '.join(self.returned)}, as at the first point"))
            return values
        except Exception as error:
            return error

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

    def returning(self, names: Sequence[str]) -> Own:
        """Return the same record with the names of its numbers."""
        return Own(str(self), tuple(names), *self.__reduce__()[1][2:])

    def refuse_unknown(self) -> None:
        """Raise TypeError if a file with these numbers could be resumed by another function."""
        if self.unknown:
            allowed = f"a function that a repeated call can be compared with, to resume the file, but {self.unknown}"
            raise TypeError(bad("record", str(self), allowed))

    def continued(self, stored: Record) -> Own:
        """Return this record as the file describes it: an older file contains the SHA-256 of the source alone."""
        if not isinstance(stored, Own) or stored.of == FUNCTION or self.function is None:
            return self
        from vibrodrive.model.identity import source_of

        sha256 = hashlib.sha256(source_of(_plain(self.function)).encode()).hexdigest()
        return Own(str(self), self.returned, sha256, SOURCE, self.function, self.uses)


def _plain(function: Callable[..., Any]) -> Any:
    """Return the function that carries the name and the source: without wrappers, and the class of an instance."""
    plain = inspect.unwrap(function)
    while isinstance(plain, functools.partial):
        plain = plain.func
    return plain if inspect.isroutine(plain) else type(plain)


def as_own(text: str) -> Own | None:
    """Return the record of a function from the plan of a file; None for the text of another record."""
    found = _TEXT.fullmatch(text)
    return found and Own(found["name"], tuple(found["numbers"].split(", ")), found["sha256"], found["of"])
