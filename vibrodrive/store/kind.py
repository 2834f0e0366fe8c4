"""Kinds of result files, named in their root attribute `kind`."""

from __future__ import annotations

import mmap
import os
import stat
from pathlib import Path
from typing import NamedTuple

import h5py


class Kind(NamedTuple):
    """A kind of result file: its contents and the command that makes it."""

    holds: str
    command: str


KINDS = {
    "sweep": Kind("a sweep", "sweep"),
    "limits": Kind("limits of stability", "limits"),
    "failures": Kind("failures of methods", "atlas"),
    "orbits": Kind("periodic orbits", "orbits"),
    "curves": Kind("curves of bifurcations", "orbits"),
    "switches": Kind("switches of single motions", "paper"),
}

SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of an HDF5 file."""

NAMES = (
    b"recorded excitation period", b"section_xi", b"section_dxi", b"searched_to", b"bifurcation_A", b"first_impact",
    b"judged", b"motion_0", b"meeting_A",
)  # fmt: skip
"""Words that lie as text in every result file, some near its beginning, and hardly in a file of another program."""

_SPECIAL = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a directory",
}


def special(path: str | Path) -> str | None:
    """What a path is if it is no file in the usual sense ("a named pipe"): to open it may wait for ever.

    None for a file. Raises OSError if there is nothing, or the system refuses to say.
    """
    mode = os.stat(path).st_mode
    return None if stat.S_ISREG(mode) else _SPECIAL.get(stat.S_IFMT(mode), "no file")


def kind_of(file: h5py.File) -> str | None:
    """Return the kind that an open file names (maybe one of a later version); None: not of this program.

    Raises what h5py raises where the bytes make no sense.
    """
    if "kind" not in file.attrs or "config_sha256" not in file.attrs:
        return None
    return str(file.attrs["kind"])


def bears_our_names(path: Path) -> bool:
    """Whether an HDF5 file that cannot be opened any more (cut short, damaged) was once made here."""
    with open(path, "rb") as file:
        if file.read(len(SIGNATURE)) != SIGNATURE:
            return False
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            return any(content.find(name) >= 0 for name in NAMES)
