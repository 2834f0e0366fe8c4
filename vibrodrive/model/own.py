"""A number of the user's own as a record: a function of a motion, its name, and the names of its numbers."""

from __future__ import annotations

import difflib
import functools
import inspect
import keyword
import re
import traceback
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any
from unicodedata import normalize

from vibrodrive.errors import Failed
from vibrodrive.model.parameters import bad, did_you_mean, has_control, real_number, shortened, unknown, with_sentences
from vibrodrive.model.physical import UNITS, column
from vibrodrive.model.quantities import SCALES, Quantity, number
from vibrodrive.model.record import OfMotion

_TEXT = re.compile(r"(?P<name>[^:,]+): (?P<numbers>[^()]*) \(version (?P<version>.*)\)")

ALIKE = 0.8
"""Likeness, as in `difflib`, from which on a unit is taken for a slip, such as "lenght" or "Velocity"."""

LONGEST = 200
"""Largest number of characters of the type and message of an exception that a function raised."""

Row = tuple[str, str, str]
NO_ROWS: Mapping[str, Row] = {}


class Own(OfMotion):
    """A function of a motion as a record of a sweep. As a string it is the name of the function.

    Attributes
    ----------
    returned : names of the numbers that it returns; () until it has been called for the first time.
    version : text that its author changes whenever the function would give other numbers; "" outside of files.
    function : the function; None if the record was read from a file.
    rows : (unit, key of UNITS, label) of its numbers by name, from `own`; those of the name "" hold for all others.
    """

    returned: tuple[str, ...]
    version: str
    function: Callable[[Any], Any] | None
    rows: Mapping[str, Row]

    def __new__(
        cls,
        name: str,
        returned: tuple[str, ...] = (),
        version: str = "",
        function: Callable[[Any], Any] | None = None,
        rows: Mapping[str, Row] = NO_ROWS,
    ) -> Own:
        self = super().__new__(cls, name)
        self.returned, self.version, self.function, self.rows = returned, version, function, rows
        return self

    def __reduce__(self) -> tuple[type[Own], tuple[Any, ...]]:
        return Own, (str(self), self.returned, self.version, self.function, self.rows)

    @property
    def quantities(self) -> tuple[Quantity, ...]:  # type: ignore[override]
        quantities = []
        for name in self.returned:
            unit, scales, label = self.rows.get(name) or self.rows.get("") or ("1", "", "")
            meaning = name if name == self else f"{name} of the function {self}"
            quantities.append(number(name, label or meaning, unit=unit, scales=scales, label=label))
        return tuple(quantities)

    @property
    def outline(self) -> str:
        return f"{self}: {', '.join(self.returned)} (version {self.version})"

    def text(self, sought: str = "") -> str:
        return f"{self} (version {self.version})"

    def numbers(self, motion: Any) -> dict[str, float] | Exception:
        """Return the numbers of a motion, or the exception that the function raised, also for a result without numbers.

        Any other exception is a fault of this program, and never the result of a point.
        """
        if self.function is None:
            raise Failed(f"record = {str(self)!r}: must be computed by a call that gives the function")
        allowed = f"a number, or numbers by name, as the result of {self}"
        try:
            result = self.function(motion)
            named = result if isinstance(result, Mapping) else {str(self): result}
            values = {str(name): real_number(str(name), value, allowed) for name, value in named.items()}
            if not values:
                raise TypeError(bad(str(self), result, allowed))
            if self.returned and set(values) != set(self.returned):
                raise ValueError(bad("names", list(values), f"{', '.join(self.returned)}, as at the first point"))
            return values
        except Exception as error:
            return error

    @classmethod
    def from_function(cls, function: Callable[[Any], Any]) -> Own:
        """Return the record of a function whose numbers are not known yet."""
        name = _name_of(function)
        return cls(name if name.isidentifier() else "function", function=function)  # "<lambda>"

    def with_rows(self, rows: Mapping[str, Row]) -> Own:
        """Return the same record with units and labels of its numbers."""
        return Own(str(self), self.returned, self.version, self.function, rows)

    def bare(self) -> Own:
        """Return the same record without its function, as a file contains it."""
        return Own(str(self), self.returned, self.version, None, self.rows)

    def returning(self, motions: Iterable[tuple[str, Any]], taken: Collection[str]) -> Own:
        """Return the same record with the names of its numbers, from the first of the motions at which the function
        does not raise. Each motion has its place in words.

        Raises ValueError for a name that results or files could not have, or that is taken, and if the function raises
        at all places, with the first exception.
        """
        raised: list[tuple[str, Exception]] = []
        for at, motion in motions:
            numbers = self.numbers(motion)
            if not isinstance(numbers, Exception):
                return self._named(list(numbers), taken)
            raised.append((at, numbers))
        (first, why), n = raised[0], len(raised)
        places = f" at all {n} points, first at {first}" if n > 1 else ""
        raise ValueError(f"{self} raised{places}: {message_of(why)}") from why

    def _named(self, names: Sequence[str], taken: Collection[str]) -> Own:
        for name in self.rows.keys() - {"", *names}:
            raise ValueError(unknown(f"name in the units and labels of {self}", name, names))
        for name in names:
            allowed = "a name as of a variable in Python, such as settling_time"
            usable = name.isidentifier() and not keyword.iskeyword(name) and not name.startswith("_")
            if usable and name == normalize("NFKC", name):
                if name not in taken:
                    continue
                allowed = "a name of its own, such as settling_time, because this one is taken"
            raise ValueError(bad(f"a name of {self}", name, allowed))
        named = Own(str(self), tuple(names), self.version, self.function, self.rows)
        for q in named.quantities:
            title = column(q.name, UNITS[q.scales].si if q.scales else q.unit)
            if title != q.name and title in names:
                allowed = f"another name than {title!r}, the column of {q.name!r} with its unit"
                raise ValueError(bad(f"a name of {self}", title, allowed))
        return named

    def refuse_without_version(self) -> None:
        """Raise TypeError for a file whose numbers no version would tell from those of another function."""
        if not self.version:
            advice = f"change the version whenever {self} would give other numbers"
            raise TypeError(bad("record", str(self), f'vd.own({self}, version="1") with path; {advice}'))


@with_sentences
def own(
    function: Callable[[Any], Any],
    *,
    version: str = "",
    unit: str | Mapping[str, str] = "",
    label: str | Mapping[str, str] = "",
) -> Own:
    """Return a function of a motion as a record of `sweep`, with a version, and a unit and a label of its numbers.

    Parameters
    ----------
    function : function of a Trajectory
        that returns a number, or a dict of numbers by name.
    version : str, required for files
        Change it whenever the function would give other numbers: a file is resumed only by a function of the same name
        and version. The function itself is not compared, because its numbers may depend on anything, such as a table
        that it reads or a library.
    unit : str, or dict of str by name of a number, optional
        "length", "velocity", "time", "rate", "force", "momentum", "energy" or "power" for a dimensionless number that
        figures and tables convert to SI units if there is a scene ("rate": per excitation period; "power": an energy
        per excitation period). Any other text is the unit of the numbers as they are, such as "m s-1" or "degree".
    label : str, or dict of str by name of a number, optional
        words for figures, tables and files; by default the name.

    Returns
    -------
    Own
        for the argument `record` of `sweep`.

    Raises
    ------
    TypeError, ValueError
        if an argument has another type, or a unit is written wrongly. The message is one line.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> def rise(motion):
    ...     return motion.sample(50).xi.max() - motion.section[:, 0].mean()
    >>> scene = vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4)
    >>> record = vd.own(rise, unit="length", label="rise above the mean of the section")
    >>> r = vd.sweep(scene=scene, frequency=[22.0, 24.0], transient=50, periods=64, record=record)
    >>> r.to_dataframe().columns.tolist()
    ['frequency', 'rise_m', 'margin', 'status']
    """
    if not callable(function) or isinstance(function, str):
        raise TypeError(bad("function", function, "a function of a motion"))
    if not isinstance(version, str) or not version.isprintable():
        raise TypeError(bad("version", version, 'a text of one line, such as "1"'))
    rows = {}
    for name in {"", *(unit if isinstance(unit, Mapping) else ()), *(label if isinstance(label, Mapping) else ())}:
        texts = []
        for key, argument in (("unit", unit), ("label", label)):
            text = argument.get(name, "") if isinstance(argument, Mapping) else argument
            if not isinstance(text, str) or has_control(text):
                raise TypeError(bad(key, argument, "a text of one line, or a dict of them by the names of the numbers"))
            texts.append(text)
        scales = texts[0] if texts[0] in SCALES else ""
        if not scales and difflib.get_close_matches(texts[0].lower(), SCALES, 1, ALIKE):
            allowed = f"one of {', '.join(SCALES)}, which follow a scene, or another unit, such as m s-1"
            raise ValueError(bad("unit", texts[0], allowed) + did_you_mean(texts[0], SCALES))
        rows[name] = ("1" if scales else texts[0] or "1", scales, texts[1])
    return Own(str(Own.from_function(function)), version=version, function=function, rows=rows)


def _name_of(function: Callable[..., Any]) -> str:
    """Return the name of a function: without wrappers, and that of the class of an instance."""
    plain = inspect.unwrap(function)
    while isinstance(plain, functools.partial):
        plain = plain.func
    return getattr(plain if inspect.isroutine(plain) else type(plain), "__name__", "")


def message_of(error: Exception) -> str:
    """Return the type and the message of an exception of a function in one line."""
    text = "".join(traceback.format_exception_only(error))  # also if its own method __str__ raises
    return shortened("".join(c if c.isprintable() else " " for c in text), LONGEST)


def as_own(text: str) -> Own | None:
    """Return the record of a function from the plan of a file; None for the text of another record."""
    match = _TEXT.fullmatch(text)
    return match and Own(match["name"], tuple(match["numbers"].split(", ")), match["version"])
