"""What a file holds. Every result file says so in its root attribute `kind`; older ones are known by their names."""

from __future__ import annotations

import mmap
import os
import stat
from pathlib import Path
from typing import NamedTuple

import h5py


class Kind(NamedTuple):
    """A kind of result file: what it holds, the command that makes it, and how to know one that does not say."""

    holds: str
    command: str
    attributes: tuple[str, ...]  # of the root, present in every file of this kind
    datasets: tuple[str, ...]  # and groups


KINDS = {
    "sweep": Kind("a sweep", "sweep", ("plan", "config_sha256"), ("section_xi", "status")),
    "limits": Kind("limits of stability", "limits", ("limits_schema",), ("k2", "searched_to")),
    "failures": Kind("failures of methods", "atlas", ("scalars",), ("judged", "limit")),
    "orbits": Kind("periodic orbits", "orbits", ("max_period",), ("orbit", "bifurcation_A")),
    "curves": Kind("curves of bifurcations", "orbits", ("range_A",), ("curve", "meeting_A")),
    "switches": Kind("switches of single motions", "paper", ("config",), ("motion_0",)),
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
    """The kind an open file says it is (maybe one of a later version), or its contents show; None: not of this program.

    Raises what h5py raises where the bytes make no sense.
    """
    said = file.attrs.get("kind")
    if said is not None:
        return str(said) if "config_sha256" in file.attrs else None
    for name, kind in KINDS.items():
        if all(a in file.attrs for a in kind.attributes) and all(d in file for d in kind.datasets):
            return name
    return None


def bears_our_names(path: Path) -> bool:
    """Whether an HDF5 file that cannot be opened any more (cut short, damaged) was once made here."""
    with open(path, "rb") as file:
        if file.read(len(SIGNATURE)) != SIGNATURE:
            return False
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            return any(content.find(name) >= 0 for name in NAMES)
