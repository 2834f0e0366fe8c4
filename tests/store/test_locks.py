"""A lock that the system refuses is neither damage nor another writer. Readers take no lock at all."""

import errno
import fcntl
import os
import warnings

import h5py
import pytest

from tests.support import fake
from vibrodrive.errors import Busy
from vibrodrive.store.load import load
from vibrodrive.store.lock import UNKNOWN, Unlocked
from vibrodrive.store.reader import look, verify

CONFIG = "[sweep]\nA = [3.0, 3.1]\n[run]\nperiods = 3\n"

ERRORS = [*errno.errorcode, 524, 4444]
"""All errors of the system, and two without a name, such as some network file systems return."""


@pytest.fixture
def part(tmp_path):
    """Return the path of a file whose points are not computed yet."""
    path = tmp_path / "part.h5"
    fake.write(path, CONFIG, which=[])
    return path


def write(path):
    """Write or resume a file, and return what the user meets: "" or the error, and the messages of warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            fake.write(path, CONFIG)
        except (OSError, Busy) as error:
            return error, [str(w.message) for w in caught]
    assert {w.category for w in caught} <= {Unlocked}
    return None, [str(w.message) for w in caught]


def assert_right(number, path, error, said):
    if number == errno.EAGAIN:  # the one that means a lock held by somebody
        assert isinstance(error, Busy)
        assert not said
    elif number in UNKNOWN or number not in errno.errorcode:
        assert error is None
        assert said == [f"{path}: this file system has no locks; let only one process write this file"]
        assert verify(path).complete
    else:
        assert (error.errno, error.filename) == (number, str(path))
        assert not said
    assert [word for word in ("damage", "overwrite", "h5.part") if word in str(error)] == []


@pytest.mark.parametrize("number", ERRORS)
def test_refused_lock_gives_the_words_of_the_system(tmp_path, part, monkeypatch, number):
    def refuse(*arguments):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "fcntl", refuse)
    monkeypatch.setattr(fcntl, "flock", refuse)
    assert load(part).computed == 0.0
    assert verify(part).complaints() == []
    for path in (tmp_path / "new.h5", part):
        assert_right(number, path, *write(path))
    if number != errno.EAGAIN:
        assert {p.name for p in tmp_path.iterdir()} <= {"new.h5", "part.h5"}


def test_second_kind_of_lock_excludes_a_second_writer(part, monkeypatch):
    def unknown(*arguments):
        raise OSError(errno.EINVAL, "")

    monkeypatch.setattr(fcntl, "fcntl", unknown)
    with open(part, "r+b") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert load(part).section.shape == (2, 3, 2), "readers take no lock, not even that of HDF5"
        assert isinstance(write(part)[0], Busy)
    assert write(part) == (None, [])


def test_file_that_another_program_has_open_is_read(part):
    """HDF5 locks a file that a notebook has open, and all handles of a process must agree about the lock."""
    for mode in ("r", "a"):
        for locking in (None, True, False, "best-effort"):
            with h5py.File(part, mode, locking=locking):
                assert load(part).computed == 0.0
                assert look(part).share == 0.0
                fake.write(part, CONFIG, which=[])
    with h5py.File(part) as file:
        fake.write(part, CONFIG)
        assert file["status"][...].tolist() == [0, 1]
