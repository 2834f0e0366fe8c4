"""A file that appears whole or not at all: written beside its place, under another name, and renamed at the end."""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Iterator
from pathlib import Path

NAME_BYTES = 255
"""Longest name of a file on the usual file systems. A longer one is refused by the system, under its own name."""


def target_of(path: Path) -> Path:
    """The file that a path means: where its links lead. Raises OSError if they lead in a circle."""
    with contextlib.suppress(FileNotFoundError):  # a new file, or a link to one
        os.stat(path)
    return Path(os.path.realpath(path))


def draft_of(path: Path) -> Path:
    """Where a file (what it is, if it is a link) is written before it gets its name."""
    path = target_of(path)
    name = path.name + ".part"
    if len(os.fsencode(name)) > NAME_BYTES >= len(os.fsencode(path.name)):
        name = hashlib.sha256(os.fsencode(path.name)).hexdigest() + ".part"
    return path.with_name(name)


@contextlib.contextmanager
def drafted(path: Path) -> Iterator[Path]:
    """Where to write a file that gets its name, in the place of one that bears it, when the block ends well.

    Otherwise nothing is left behind, and an older file of that name stays. A link stays one.
    """
    target, draft = target_of(path), draft_of(path)
    try:
        yield draft
        os.replace(draft, target)
    except BaseException:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise
