"""Open a result file, and read and check its header."""

import contextlib
import errno
import io
import itertools
import json
import os
import traceback
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from vibrodrive.errors import Damaged, NoResult, Unwritable, VibrodriveError
from vibrodrive.model.choices import Method
from vibrodrive.model.config import special
from vibrodrive.model.names import AXES, FOLLOWS, IDLE, NAMES, Settings
from vibrodrive.model.own import Own, as_own
from vibrodrive.model.parameters import Refusal, check, check_count, has_control
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.model.quantities import Quantity, length_along
from vibrodrive.model.records import RECORDS, SECTION, Record, quantities
from vibrodrive.model.size import refuse_large_reading
from vibrodrive.model.variables import POINT
from vibrodrive.store import layout
from vibrodrive.store.describe import plain
from vibrodrive.store.layout import DIGESTS, NUMBER, SCHEMA, SWEEP, Origin, coordinates, digest, variables_of
from vibrodrive.store.netcdf import attribute
from vibrodrive.version import __version__

BROKEN = (OSError, KeyError, TypeError, ValueError, RuntimeError, OverflowError)
"""Exceptions that h5py raises for bytes that it cannot interpret."""

RESTORE = "restore or delete it"
"""Advice for a file that cannot be read or repaired: nobody knows whether its results are elsewhere."""

SIGNATURE = b"\x89HDF\r\n\x1a\n"


class Header(NamedTuple):
    """Plan, configuration and versions of a file, and how another program has rewritten it ("" if none has)."""

    plan: Plan
    origin: Origin
    versions: dict[str, str]
    rewritten: str


class _Bytes(io.FileIO):
    """The bytes of a file for HDF5, which locks files, but no such object.

    The layout of a file makes reading safe while a sweep writes it, so a reader needs no lock, and a lock that fails
    would keep it away. `locking=False` is not enough: HDF5_USE_FILE_LOCKING overrides it. An error of the system does
    not mean damage: as Refused it passes all code that interprets the errors of HDF5, until the end of `open_result`.
    """

    def readinto(self, buffer: Any) -> int:
        unread = memoryview(buffer)
        try:
            while unread and (count := super().readinto(unread)):  # the system may read less than asked
                unread = unread[count:]
        except OSError as error:
            raise Refused(error) from None
        return len(buffer) - len(unread)


class Refused(Exception):
    """The system refused to read; the argument is its OSError."""


@contextlib.contextmanager
def open_result(path: Path) -> Iterator[h5py.File]:
    """Open a result file to read it, also while another process writes it.

    Raises NoResult, Damaged if HDF5 cannot interpret the bytes, and OSError if the system refuses to read them.
    """
    if (kind := special(path)) is not None:  # raises OSError for a missing file
        raise no_result(path, f"must be a result file, but is {kind}")
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    access.set_fclose_degree(h5py.h5f.CLOSE_STRONG)
    try:
        with _Bytes(path) as content:
            start = bytearray(len(SIGNATURE))
            if content.readinto(start) < len(start) or start != SIGNATURE:
                if path.suffix == ".toml":
                    raise no_result(path, f"not a result file; `vibrodrive sweep {path} --plot` computes and draws one")
                raise no_result(path, "not a result file (not HDF5, or its beginning is damaged)")
            access.set_fileobj_driver(h5py.h5fd.fileobj_driver, content)
            with _opened(path, access) as file, interpreting(path):
                yield file
    except Refused as refused:
        raise OSError(refused.args[0].errno, refused.args[0].strerror, str(path)) from None
    finally:
        access.close()  # a reference to `content` that outlives the interpreter crashes it


def _opened(path: Path, access: h5py.h5p.PropFAID) -> h5py.File:
    """Open a result file by HDF5. Raises Damaged."""
    try:
        return h5py.File(h5py.h5f.open(os.fsencode(path), h5py.h5f.ACC_RDONLY, access))
    except (OSError, OverflowError) as error:  # an address that is too large
        fault = "truncated" if "truncated" in str(error) else f"too damaged to be read ({error})"
        raise Damaged(f"{path}: {fault}; {RESTORE}") from error


def unwritable(error: OSError, path: Path) -> Unwritable:
    """Return Unwritable with the words of the system."""
    return Unwritable(error.errno or errno.EIO, error.strerror or str(error), str(path))


def no_result(path: str | Path, why: str) -> NoResult:
    """Return the error for a file that is no result file of this version. Its refusal is about the path."""
    return NoResult(Refusal(str(path), f": {why}"))


def damaged(path: str | Path, fault: str) -> Damaged:
    """Return the error for a result file that can be opened, but has a fault."""
    return Damaged(f"{path}: damaged ({fault}); {RESTORE}")


def rewritten(path: str | Path, change: str, readers: str = "h5py, xarray and other programs for HDF5") -> NoResult:
    """Return the error for a file that another program has written anew from one of this program."""
    reason = f"rewritten by another program ({change}): its numbers can be read by {readers}, but it cannot be resumed"
    return no_result(path, reason)


@contextlib.contextmanager
def interpreting(path: str | Path) -> Iterator[None]:
    """Raise Damaged if the reader in the block fails to interpret the contents.

    A TypeError means damage only if h5py raised it. Any other TypeError is a fault of this program, and no reason to
    delete a file.
    """
    try:
        yield
    except VibrodriveError:
        raise
    except BROKEN as error:
        *_, (frame, _) = traceback.walk_tb(error.__traceback__)
        if isinstance(error, TypeError) and not str(frame.f_globals.get("__name__")).startswith("h5py"):
            raise
        message = " ".join(str(error).split())
        raise Damaged(f"{path}: too damaged to be read ({message}); {RESTORE}") from error


def is_ours(file: h5py.File) -> bool:
    """Return True if an open file was made by any version of this program. Raises the exceptions of h5py."""
    return "kind" in file.attrs and "config_sha256" in file.attrs


def check_kind(file: h5py.File) -> None:
    """Raise NoResult unless an open file is a sweep of a schema that this version reads."""
    path = file.filename
    if not is_ours(file):
        raise no_result(path, "not a result file of vibrodrive")
    if (kind := attribute(file, "kind")) != SWEEP:
        raise of_another_version(file, f"kind = {kind}: must be {SWEEP}")
    if lacking := [name for name in NEEDED if name not in file.attrs]:
        raise rewritten(path, f"without the attribute {lacking[0]}")
    if (number := attribute(file, SCHEMA)) != NUMBER:
        raise of_another_version(file, f"{SCHEMA} = {number}: must be {NUMBER}")
    if DIGESTS not in file:
        raise rewritten(path, f"without the group {DIGESTS}")


NEEDED = (SCHEMA, "title", "config", "overrides", "versions", "plan", "plan_sha256")
"""Attributes that are read, in addition to those of `is_ours`."""


def of_another_version(file: h5py.File, contents: str) -> NoResult:
    """Return the error for a sound file with contents that only another version reads."""
    made = versions_of(file)["vibrodrive"]
    return no_result(
        file.filename, f"{contents} in vibrodrive {__version__}; read it with vibrodrive {made}, which wrote it"
    )


def versions_of(file: h5py.File) -> dict[str, str]:
    """Return the versions of the program and of its libraries that have laid out an open file."""
    return _parsed(file, "versions")


@contextlib.contextmanager
def reading(path: Path) -> Iterator[h5py.File]:
    """Open the file of a sweep. Raises the exceptions of `check_kind` and `open_result`."""
    with open_result(path) as file:
        check_kind(file)
        yield file


def identity(file: h5py.File) -> tuple[object, ...]:
    """Return what distinguishes the file of a sweep from the files of other sweeps and versions. It never changes, also
    while the file is written or resumed."""
    return tuple(attribute(file, name) for name in ("plan_sha256", "versions") if name in file.attrs)


def read_header(file: h5py.File) -> Header:
    """Return the Header of an open file of a sweep. Its plan is rebuilt from the file and checked. Raises NoResult."""
    for name, word in (("config", "configuration"), ("plan", "plan")):
        if digest(_text(file, name)) != attribute(file, f"{name}_sha256"):
            raise damaged(file.filename, f"the SHA-256 of the {word} differs from the stored SHA-256")
    try:
        plan = _plan(file, _parsed(file, "plan"))
        origin = Origin(_text(file, "config"), tuple(_parsed(file, "overrides")), _text(file, "title"))
        return Header(plan, origin, versions_of(file), how_rewritten(offsets(file, plan)))
    except VibrodriveError:
        raise
    except NO_PLAN as error:
        raise damaged(file.filename, f"plan: {' '.join(str(error).split())}") from error


NO_PLAN = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""Exceptions of values that are no plan, of another type or out of range."""


def _plan(file: h5py.File, outline: dict[str, Any]) -> Plan:
    """Return the plan of a file, checked like the arguments of a call. Raises NoResult and the exceptions NO_PLAN."""
    record, axes, points = _record(file, outline), outline["axes"], outline.get("points", {})
    stored = _stored(file, outline, quantities(record))
    lengths = dict(zip(axes, variable(file, "status").shape, strict=True)) if axes else {}
    lengths |= {name: lengths[POINT] for name in points}
    values = {name: _values(file, name, n) for name, n in lengths.items()}
    for name, sha in layout.digests(values).items():
        if sha != (axes | points)[name]:
            raise damaged(file.filename, f"axis {name}: changed after it was written")
    method = Method(outline["settings"]["method"])
    parameters = {name: value for name, value in outline["scalars"].items() if name not in IDLE[method]}
    follows = [name for name, of in FOLLOWS.items() if name in parameters and of in {*parameters, *values}]
    exact = {name: check(name, parameters.pop(name)) for name in follows}  # as on the machine that wrote the file
    parameters |= {name: array for name, array in values.items() if name not in (POINT, *points)}
    arguments = {"points" if name == POINT else name: parameters.get(name) for name in [*axes, *parameters]}
    arguments |= {"points": {name: values[name] for name in points}} if points else {}
    plan = make_plan(arguments | outline["settings"] | {"method": method, "record": record})
    tiling = tuple(check_count("tiling", n, 1) for n in outline["tiling"])
    return replace(plan.having(exact), tiling=tiling or None, stored=stored)


def _text(file: h5py.File, name: str) -> str:
    """Return a text of the file. Raises Damaged for another value, and for characters that control a terminal."""
    text = attribute(file, name)
    if not isinstance(text, str) or _controls(text):
        raise damaged(file.filename, f"{name}: not a text without control characters")
    return text


def _parsed(file: h5py.File, name: str) -> Any:
    """Return a value that the file contains as JSON. Raises Damaged as `_text`, and ValueError for another text."""
    value = json.loads(_text(file, name))
    if any(map(_controls, _texts(value))):
        raise damaged(file.filename, f"{name}: not without control characters")
    return value


def _controls(text: str) -> bool:
    """Return whether a text has control characters other than those of its lines."""
    return has_control(text.translate(dict.fromkeys(b"\t\r\n")))


def _texts(value: object) -> Iterator[str]:
    """Yield all texts in a value of JSON."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, list | dict):
        for part in value if isinstance(value, list) else itertools.chain(*value.items()):
            yield from _texts(part)


def variable(file: h5py.File, name: str) -> h5py.Dataset:
    """Return a variable. Raises NoResult if the file has none of this name, and Damaged if its header is damaged.

    Links and variables that lead to other files are not followed.
    """
    data: Any = file
    for part in name.split("/"):
        link = data.get(part, getlink=True)
        if link is None:
            raise rewritten(file.filename, f"without the variable {name}")
        try:
            data = data[part] if isinstance(link, h5py.HardLink) else None
        except KeyError:  # its header is damaged
            data = None
        if not isinstance(data, h5py.Group | h5py.Dataset):
            raise damaged(file.filename, f"{name}: no variable of this file")
    if not isinstance(data, h5py.Dataset) or data.external or data.is_virtual:
        raise damaged(file.filename, f"{name}: no variable of this file")
    return data


def _values(file: h5py.File, name: str, length: int) -> np.ndarray:
    """Return the values of a coordinate. Raises as `variable`, for another length, and TooLarge."""
    data = variable(file, name)
    if data.shape != (length,):
        raise damaged(file.filename, f"{name}: wrong shape")
    refuse_large_reading(f"{file.filename}: {name}", data.nbytes)
    return np.asarray(data[...])


def offsets(file: h5py.File, plan: Plan) -> dict[Quantity, list[int | None]]:
    """Return where the values and the digests of each variable begin, None where they have chunks or filters.

    Raises NoResult if one cannot be read.
    """
    places: dict[Quantity, list[int | None]] = {}
    blocks = (plan.n_blocks,)
    for v in variables_of(plan):
        shape = (plan.shape or (1,)) + length_along(v.along, plan.settings.periods)
        for name, dtype, expected in ((v.variable, v.dtype, shape), (digests_of(v), "<u8", blocks)):
            data = variable(file, name)
            if data.dtype != np.dtype(dtype) or data.shape != expected:
                raise damaged(file.filename, f"{name}: wrong shape or data type")
            places.setdefault(v, []).append(data.id.get_offset())
    return places


def how_rewritten(places: Mapping[Quantity, Sequence[int | None]]) -> str:
    """Return how variables with these `offsets` differ from those of this program; "" if they do not."""
    names = (name for v, at in places.items() for name, k in zip((v.variable, digests_of(v)), at, strict=True) if not k)
    return next((f"{name} has chunks or filters" for name in names), "")


def digests_of(quantity: Quantity) -> str:
    """Return the name of the variable with the digests of another one."""
    return f"{DIGESTS}/{quantity.variable}"


def _record(file: h5py.File, outline: dict[str, Any]) -> tuple[Record, ...]:
    """Return the records of a file. Raises NoResult if one is that of another version."""
    records = []
    for text in outline.get("record", (SECTION,)):
        if (record := as_own(text) or RECORDS.get(text)) is None:
            raise of_another_version(file, f"record {text!r}: unknown")
        if isinstance(record, Own) and record in outline.get("rows", {}):
            rows = {name: tuple(row) for name, row in outline["rows"][record].items()}
            record = record.with_rows(rows)
        records.append(record)
    return tuple(records)


def _stored(file: h5py.File, outline: dict[str, Any], of_record: tuple[Quantity, ...]) -> tuple[Quantity, ...]:
    """Return the quantities of a file. Raises NoResult if the outline of its plan has names of another version."""
    recorded = {q.name: q for q in of_record}
    types = outline.get("quantities", {})
    for kind, names, ours in (
        ("setting", outline["settings"], vars(Settings())), ("parameter", outline["scalars"], NAMES),
        ("axis", outline["axes"], (*AXES, POINT)), ("quantity", types, recorded),
    ):  # fmt: skip
        if unknown := [name for name in names if name not in ours]:
            raise of_another_version(file, f"{kind} {unknown[0]!r}: unknown")
    return tuple(q._replace(dtype=str(types[name])) for name, q in recorded.items() if name in types)


def damaged_descriptions(file: h5py.File, plan: Plan) -> list[str]:
    """Return the names of the coordinates and of the root attributes of `describe.plain` that differ from the plan.

    A file of an older version may lack an attribute.
    """
    wrong = []
    attributes = {name: value for name, value in plain(plan).items() if name in file.attrs}
    for kind, written in (("coordinate", coordinates(plan)), ("attribute", attributes)):
        for name, value in written.items():
            try:
                stored = _values(file, name, len(value)) if kind == "coordinate" else attribute(file, name)
                intact = np.array_equal(stored, value)  # which hides errors of reading
            except BROKEN:
                intact = False
            if not intact:
                wrong.append(f"{kind} {name}")
    return wrong
