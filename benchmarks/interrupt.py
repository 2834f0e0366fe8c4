"""Latency of Ctrl-C: seconds from a SIGINT to the KeyboardInterrupt, for each kind of work.

With compiled kernels and an idle machine the latency should be at most one second. tests/batch/test_interrupt.py tests
that a KeyboardInterrupt is raised and that no work continues after it.
"""

import os
import signal
import statistics
import threading
import time
from collections.abc import Callable
from importlib import import_module

from benchmarks.common import say

work = import_module("tests.batch.test_interrupt")  # an import statement would fail in mypy, which does not check tests

TIMES = 5


def latency(case: Callable[[], object]) -> float:
    """Return the seconds from a SIGINT, sent 0.3 s after the start of the work, to the KeyboardInterrupt."""
    sent = []

    def press() -> None:
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.3, press)
    timer.start()
    try:
        case()
    except KeyboardInterrupt:
        return time.perf_counter() - sent[0]
    finally:
        timer.cancel()
        timer.join()
    raise AssertionError("the work ended before the interrupt")


def main() -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts background jobs with SIGINT ignored
    work.prepare()
    for name, case in work.CASES.items():
        found = [latency(case) for _ in range(TIMES)]
        say(f"{name}: median {statistics.median(found):.3f} s, at most {max(found):.3f} s")


if __name__ == "__main__":
    main()
