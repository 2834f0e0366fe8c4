"""Open a result file, and read and check its header."""

import contextlib
import errno
import io
import itertools
import json
import math
import os
import re
import stat
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from vibrodrive.errors import Busy, Damaged, NoResult, Unwritable, VibrodriveError
from vibrodrive.model.names import AXES, Settings
from vibrodrive.model.own import Own
from vibrodrive.model.plan import POINT, Plan
from vibrodrive.model.quantities import Quantity
from vibrodrive.model.records import SECTION, Record, quantities, read_record
from vibrodrive.store import layout
from vibrodrive.store.describe import plain
from vibrodrive.store.layout import READABLE, SCHEMA, SWEEP, Origin, chunk_of, coordinates, digest, variables_of
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
        rest = memoryview(buffer)
        try:
            while rest and (count := super().readinto(rest)):  # the system may read less than asked
                rest = rest[count:]
        except OSError as error:
            raise Refused(error) from None
        return len(buffer) - len(rest)


class Refused(Exception):
    """The system refused to read; the argument is its OSError."""


@contextlib.contextmanager
def open_result(path: Path) -> Iterator[h5py.File]:
    """Open a result file to read it, also while another process writes it.

    Raises NoResult, Damaged if HDF5 cannot interpret the bytes, and OSError if the system refuses to read them.
    """
    if (what := special(path)) is not None:  # raises OSError for a missing file
        raise NoResult(f"{path}: must be a result file, but is {what}")
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    access.set_fclose_degree(h5py.h5f.CLOSE_STRONG)
    try:
        with _Bytes(path) as content:
            start = bytearray(len(SIGNATURE))
            if content.readinto(start) < len(start) or start != SIGNATURE:
                if path.suffix == ".toml":
                    raise NoResult(
                        f"{path}: not a result file; `vibrodrive sweep {path} --plot` computes and draws one"
                    )
                raise NoResult(f"{path}: not a result file (not HDF5, or its beginning is damaged)")
            access.set_fileobj_driver(h5py.h5fd.fileobj_driver, content)
            with _opened(path, access) as file:
                yield file
    except Refused as refused:
        raise OSError(refused.args[0].errno, refused.args[0].strerror, str(path)) from None
    finally:
        access.close()  # a reference to `content` that outlives the interpreter crashes it


def _opened(path: Path, access: h5py.h5p.PropFAID) -> h5py.File:
    """Open a result file by HDF5. Raises Damaged.

    While another process writes the file, it may be shorter for a moment than its header tells.
    """
    waits = iter((0.01, 0.1, 0.4))
    while True:
        try:
            return h5py.File(h5py.h5f.open(os.fsencode(path), h5py.h5f.ACC_RDONLY, access))
        except (OSError, OverflowError) as error:  # an address that is too large
            truncated = "truncated" in str(error)
            if truncated and (wait := next(waits, 0.0)):
                time.sleep(wait)
                continue
            what = "truncated" if truncated else f"too damaged to be read ({error})"
            raise Damaged(f"{path}: {what}; {RESTORE}") from error


def open_to_write(path: Path) -> h5py.File:
    """Open a result file to change it. Raises Busy if this process has it open, and Unwritable.

    HDF5's own lock would exclude readers. The lock of lock.py excludes a second writer.
    """
    try:
        return h5py.File(path, "r+", locking=False, rdcc_nbytes=0)
    except OSError as error:
        for words, doing in (("already open for read-only", "reading"), ("flag values don't match", "writing")):
            if words in str(error):
                raise Busy(f"{path}: open for {doing} in this process (h5py, xarray); close it first") from None
        raise unwritable(error, path) from None


def unwritable(error: BaseException, path: Path) -> Unwritable:
    """Return Unwritable with the words of the system, from an error of HDF5 with a message of many lines."""
    number = getattr(error, "errno", None) or re.search(r"errno = (\d+)", str(error))
    code = int(number[1]) if isinstance(number, re.Match) else number or errno.EIO
    what = os.strerror(code)
    if "lock file" in str(error):  # HDF5 locks against `locking=False` if HDF5_USE_FILE_LOCKING is set
        what += " (HDF5's own lock; HDF5_USE_FILE_LOCKING=FALSE turns it off, this program has another one)"
    return Unwritable(code, what, str(path))


def damaged(path: str | Path, what: str) -> Damaged:
    """Return the error for a result file that can be opened, but has a fault."""
    return Damaged(f"{path}: damaged ({what}); {RESTORE}")


def rewritten(path: str | Path, what: str, readers: str = "h5py, xarray and other programs for HDF5") -> NoResult:
    """Return the error for a file that another program has written anew from one of this program."""
    told = f"rewritten by another program ({what}): its numbers can be read by {readers}, but it cannot be resumed"
    return NoResult(f"{path}: {told}")


MARKS = ("_NCProperties", "history")
"""Attributes that the netCDF library, h5netcdf and NCO leave in a file that they write."""


def _altered(file: h5py.File, what: str) -> NoResult:
    """Return the error for contents that are not those that this program has written."""
    return rewritten(file.filename, what) if any(m in file.attrs for m in MARKS) else damaged(file.filename, what)


@contextlib.contextmanager
def interpreting(path: str | Path) -> Iterator[None]:
    """Raise Damaged if the reader in the block fails to interpret the contents.

    A TypeError means damage only if h5py raised it. Any other TypeError is a bug in the block and is raised unchanged.
    """
    try:
        yield
    except VibrodriveError:
        raise
    except BROKEN as error:
        if isinstance(error, TypeError) and not _raised_by_h5py(error):
            raise
        what = " ".join(str(error).split())
        raise Damaged(f"{path}: too damaged to be read ({what}); {RESTORE}") from error


def _raised_by_h5py(error: BaseException) -> bool:
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    return bool(frames) and str(frames[-1].f_globals.get("__name__")).startswith("h5py")


def special(path: str | Path) -> str | None:
    """Return the type of a path that is not a regular file, such as "a named pipe"; None for a regular file.

    Opening such a path may block. Raises OSError if the path does not exist, or if the system refuses access.
    """
    mode = os.stat(path).st_mode
    return None if stat.S_ISREG(mode) else _SPECIAL.get(stat.S_IFMT(mode), "no file")


_SPECIAL = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a directory",
}


def is_ours(file: h5py.File) -> bool:
    """Return True if an open file was made by any version of this program. Raises the exceptions of h5py."""
    return "kind" in file.attrs and "config_sha256" in file.attrs


def check_kind(file: h5py.File) -> None:
    """Raise NoResult unless an open file is a sweep of a schema that this version reads."""
    path = file.filename
    with interpreting(path):
        if not is_ours(file):
            raise NoResult(f"{path}: not a result file of vibrodrive")
        if (kind := attribute(file, "kind")) != SWEEP:
            raise of_another_version(file, f"kind = {kind}: must be {SWEEP}")
        if lacking := [name for name in NEEDED if name not in file.attrs]:
            raise rewritten(path, f"without the attribute {lacking[0]}")
        if (found := attribute(file, SCHEMA)) not in READABLE:
            raise of_another_version(file, f"{SCHEMA} = {found}: must be {' or '.join(map(str, READABLE))}")


NEEDED = (SCHEMA, "title", "config", "overrides", "versions", "plan", "plan_sha256")
"""Attributes that are read, in addition to those of `is_ours`."""


def of_another_version(file: h5py.File, what: str) -> NoResult:
    """Return the error for a sound file with contents that only another version reads."""
    made = versions_of(file)["vibrodrive"]
    return NoResult(
        f"{file.filename}: {what} in vibrodrive {__version__}; read it with vibrodrive {made}, which wrote it"
    )


def versions_of(file: h5py.File) -> dict[str, str]:
    """Return the versions of the program and of its libraries that have laid out an open file."""
    return dict(json.loads(attribute(file, "versions")))


@contextlib.contextmanager
def reading(path: Path) -> Iterator[h5py.File]:
    """Open the file of a sweep. Raises the exceptions of `check_kind`, `open_result` and `interpreting`."""
    with open_result(path) as file:
        check_kind(file)
        with interpreting(path):
            yield file


def identity(file: h5py.File) -> tuple[object, ...]:
    """Return what distinguishes the file of a sweep from the files of other sweeps and versions. It never changes, also
    while the file is written or resumed."""
    names = [name for name in ("plan_sha256", "versions") if name in file.attrs]
    return *(attribute(file, name) for name in names), getattr(file.get("status"), "chunks", None)


def read_header(file: h5py.File) -> Header:
    """Return the Header of an open file of a sweep. Its plan is rebuilt from the file and checked. Raises NoResult."""
    check_kind(file)
    path = file.filename
    with interpreting(path):
        for name, what in (("config", "configuration"), ("plan", "plan")):
            if digest(attribute(file, name)) != attribute(file, f"{name}_sha256"):
                raise _altered(file, f"the SHA-256 of the {what} differs from the stored SHA-256")
        outline = json.loads(attribute(file, "plan"))
        record = _record(file, outline)
        stored = _stored(file, outline, quantities(record))
        axes, together = ({name: _values(file, name) for name in outline.get(part, {})} for part in ("axes", "points"))
        for name, sha in layout.digests(axes | together).items():
            if sha != (outline["axes"] | outline.get("points", {}))[name]:
                raise _altered(file, f"axis {name}: changed after it was written")
        scalars = {k: math.nan if v is None else v for k, v in outline["scalars"].items()}
        tiling = tuple(outline.get("tiling") or _variable(file, "status").chunks or ()) if axes else ()
        plan = Plan(axes, scalars, Settings(**outline["settings"]), tiling or None, record, together, stored)
        config, overrides, title = (attribute(file, name) for name in ("config", "overrides", "title"))
        origin = Origin(config, tuple(json.loads(overrides)), title)
        return Header(plan, origin, versions_of(file), how_rewritten(file, plan))


def _variable(file: h5py.File, name: str) -> h5py.Dataset:
    """Return a variable. Raises NoResult if the file has none of this name, and Damaged if its header is damaged."""
    try:
        if isinstance(data := file[name], h5py.Dataset):
            return data
    except KeyError:
        if name not in [*file]:  # and not a damaged header
            raise rewritten(file.filename, f"without the variable {name}") from None
    raise damaged(file.filename, f"{name}: no variable")


def _values(file: h5py.File, name: str) -> np.ndarray:
    """Return the values of a coordinate. Raises as `_variable`."""
    data = _variable(file, name)
    if not is_readable(data):
        raise damaged(file.filename, f"axis {name}: {BAD_INDEX}")
    return np.asarray(data[...])


def how_rewritten(file: h5py.File, plan: Plan) -> str:
    """Return how the variables of a file differ from those of this program, although all can be read; "" if they do
    not. Raises NoResult if one cannot be read."""
    found = ""
    for v in variables_of(plan):
        data = _variable(file, v.variable)
        if data.dtype != np.dtype(v.dtype) or data.shape != layout.shape_of(v, plan):
            raise _altered(file, f"{v.variable}: wrong shape or data type")
        if not found and not is_as_written(data, chunk_of(v, plan)):
            found = f"{v.variable} has other chunks or filters"
    return found


def is_as_written(data: h5py.Dataset, chunk: tuple[int, ...]) -> bool:
    """Return True if a variable has the chunks of this program, and no other filter than fletcher32."""
    made = data.id.get_create_plist()
    filters = [made.get_filter(k)[0] for k in range(made.get_nfilters())]
    return bool(data.chunks == chunk and filters == [h5py.h5z.FILTER_FLETCHER32])


BAD_INDEX = "wrong index of its chunks"


def is_readable(data: h5py.Dataset) -> bool:
    """Return False if the index of a variable gives a chunk of a wrong size, for which HDF5 crashes.

    Zeros only make a size less, so the sum of the sizes tells. Variables of other programs are not judged.
    """
    try:
        each = _size(data) if is_as_written(data, data.chunks) else 0
        return not each or data.id.get_storage_size() == data.id.get_num_chunks() * each
    except BROKEN:
        return False


def is_in_order(*variables: h5py.Dataset) -> bool:
    """Return True if the indices of variables list all chunks in order, with their sizes, and no two that overlap.

    If they do not, HDF5 may give the chunk of another block, and write into another part of the file.
    """
    spans = []
    try:
        first = variables[0].file.meta_block_size  # HDF5 begins a file with a block of headers
        for data in variables:
            listed: list[Any] = []
            data.id.chunk_iter(listed.append)
            corners = itertools.product(*(range(0, n, c) for n, c in zip(data.shape, data.chunks, strict=True)))
            if [entry.chunk_offset for entry in listed] != [*corners] or {e.size for e in listed} != {_size(data)}:
                return False
            spans += [(entry.byte_offset, entry.byte_offset + entry.size) for entry in listed]
    except BROKEN:
        return False
    return all(a[1] <= b[0] for a, b in itertools.pairwise([(0, first), *sorted(spans)]))


def _size(data: h5py.Dataset) -> int:
    """Return the size of a chunk with its fletcher32."""
    return math.prod(data.chunks) * data.dtype.itemsize + 4


def _record(file: h5py.File, outline: dict[str, Any]) -> tuple[Record, ...]:
    """Return the records of a file. Raises NoResult if one is that of another version."""
    record = []
    for text in outline.get("record", (SECTION,)):
        if (one := read_record(text)) is None:
            raise of_another_version(file, f"record {text!r}: unknown")
        if isinstance(one, Own) and one in outline.get("rows", {}):
            one = one.with_rows({name: tuple(row) for name, row in outline["rows"][one].items()})
        record.append(one)
    return tuple(record)


def _stored(file: h5py.File, outline: dict[str, Any], of_record: tuple[Quantity, ...]) -> tuple[Quantity, ...]:
    """Return the quantities of a file. Raises NoResult if the outline of its plan has names of another version."""
    known = {q.name: q for q in of_record}
    types = outline.get("quantities", {})
    for what, names, ours in (
        ("setting", outline["settings"], vars(Settings())), ("axis", outline["axes"], (*AXES, POINT)),
        ("quantity", types, known),
    ):  # fmt: skip
        if unknown := [name for name in names if name not in ours]:
            raise of_another_version(file, f"{what} {unknown[0]!r}: unknown")
    return tuple(q._replace(dtype=types[name]) for name, q in known.items() if name in types)


def damaged_descriptions(file: h5py.File, plan: Plan) -> list[str]:
    """Return the names of the coordinates and of the root attributes of `describe.plain` that differ from the plan.

    A file of an older version may lack an attribute.
    """
    wrong = []
    attributes = {name: value for name, value in plain(plan).items() if name in file.attrs}
    for kind, written in (("coordinate", coordinates(plan)), ("attribute", attributes)):
        for name, value in written.items():
            try:
                stored = _values(file, name) if kind == "coordinate" else attribute(file, name)
                whole = np.array_equal(stored, value)  # which hides errors of reading
            except BROKEN:
                whole = False
            if not whole:
                wrong.append(f"{kind} {name}")
    return wrong
