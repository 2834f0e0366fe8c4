"""Files that are written under a temporary name in the same directory, and renamed when they are complete."""

import contextlib
import hashlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

NAME_BYTES = 255
"""Largest number of bytes of a file name on usual file systems. A longer temporary name is replaced by a hash."""


def target_of(path: Path) -> Path:
    """Return the file to which a path leads, with links resolved. Raises OSError for circular links."""
    with contextlib.suppress(FileNotFoundError):  # the file does not exist yet
        os.stat(path)
    return Path(os.path.realpath(path))


def draft_of(path: Path) -> Path:
    """Return the temporary path of a file, next to the target if the path is a link."""
    path = target_of(path)
    name = path.name + ".part"
    if len(os.fsencode(name)) > NAME_BYTES >= len(os.fsencode(path.name)):
        name = hashlib.sha256(os.fsencode(path.name)).hexdigest() + ".part"
    return path.with_name(name)


@contextlib.contextmanager
def drafted(path: Path) -> Iterator[Path]:
    """Yield the path of a temporary file, which replaces any file at `path` if the block ends without an error.

    A replaced file leaves its permissions to the new one. After an error no temporary file remains, and an existing
    file is unchanged. A link remains a link.
    """
    target, draft = target_of(path), draft_of(path)
    try:
        yield draft
        with contextlib.suppress(OSError):  # there is no file to replace, or a file system without permissions
            shutil.copymode(target, draft)
        os.replace(draft, target)
    except BaseException:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise
