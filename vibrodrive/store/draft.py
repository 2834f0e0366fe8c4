"""Files that are written under a temporary name in the same directory, and renamed when they are complete."""

import contextlib
import hashlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path


def draft_of(path: Path) -> Path:
    """Return the temporary path of a file, next to the target if the path is a link.

    Usual file systems allow names of 255 bytes. Where this name would have more, it is a hash.
    """
    target = Path(os.path.realpath(path))
    name = os.fsencode(target.name)
    stem = hashlib.sha256(name).hexdigest() if 250 < len(name) <= 255 else target.name
    return target.with_name(f"{stem}.part")


@contextlib.contextmanager
def drafted(path: Path) -> Iterator[Path]:
    """Yield the path of a temporary file, which replaces any file at `path` if the block ends without an error.

    A replaced file leaves its permissions to the new one. After an error no temporary file remains, and an existing
    file is unchanged. A link remains a link. An OSError gets the name `path`.
    """
    target, draft = Path(os.path.realpath(path)), draft_of(path)
    try:
        yield draft
        with contextlib.suppress(OSError):  # there is no file to replace, or a file system without permissions
            shutil.copymode(target, draft)
        os.replace(draft, target)
    except BaseException as error:
        with contextlib.suppress(OSError):
            draft.unlink()
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror or str(error), str(path)) from None
        raise
