"""The exceptions survive a pickle, by which they leave a worker, and a copy, with their message and attributes."""

import copy
import errno
import pickle

import pytest

from vibrodrive import errors

SYSTEM = errno.ENOSPC, "No space left on device", "x.h5"

EACH = [(name, ("one line",), "one line") for name in errors.__all__]
EACH += [(name, SYSTEM, "x.h5: No space left on device") for name in errors.__all__ if name == "Unwritable"]


@pytest.mark.parametrize(("name", "arguments", "message"), EACH)
@pytest.mark.parametrize("again", [lambda error: pickle.loads(pickle.dumps(error)), copy.copy], ids=["pickle", "copy"])
def test_every_exception_survives_a_pickle_and_a_copy(name, arguments, message, again):
    kind = getattr(errors, name)
    error = again(kind(*arguments))
    assert (type(error), str(error)) == (kind, message)
    if arguments is SYSTEM:
        assert (error.errno, error.strerror, error.filename) == SYSTEM
