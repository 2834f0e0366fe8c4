"""Atomic access to integers that threads share.

These are the index of the next point, the flag that ends a kernel early, and the status that shows that a point is
finished. The functions here are for plain Python, those for Numba are in operations.py.
"""

import threading

from vibrodrive.jit.compile import OPERATIONS, operation

_ONE_AT_A_TIME = threading.Lock()


@operation(OPERATIONS)
def next_index(counter):
    """Add 1 to counter[0] and return its earlier value, in one atomic operation. `counter` is int64 of length 1."""
    with _ONE_AT_A_TIME:
        value = int(counter[0])
        counter[0] += 1
    return value


@operation(OPERATIONS)
def is_set(flag):
    """Return True if flag[0] is not zero. Another thread may set the flag. `flag` is int64 of length 1."""
    return flag[0] != 0


@operation(OPERATIONS)
def publish(array, index, value):
    """Set array[index] so that a thread that reads the value also reads everything that this thread has written before.

    `array` contains integers and has one dimension.
    """
    array[index] = value
