"""Signals that end a computation."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

ANNOUNCED = (signal.SIGHUP, signal.SIGUSR1, signal.SIGUSR2, signal.SIGXCPU)
"""A closed terminal, and the signals by which batch systems announce that a job reaches its limits. A process that is
started with one of them ignored, as by nohup, ignores it."""

SIGNALS = (signal.SIGINT, signal.SIGTERM, *ANNOUNCED)


def catch(handler: Callable[[int, Any], None]) -> dict[int, Any]:
    """Install `handler` for all SIGNALS except an ignored one of ANNOUNCED, and return the previous handlers."""
    before: dict[int, Any] = {s: signal.getsignal(s) for s in SIGNALS}
    for s, was in before.items():
        if not (s in ANNOUNCED and was == signal.SIG_IGN):
            signal.signal(s, handler)
    return before


class Interrupted(KeyboardInterrupt):
    """One of SIGNALS has arrived. The message says which, and what is done."""


@contextmanager
def raising() -> Iterator[None]:
    """Let SIGNALS raise Interrupted in the main thread, which calls this, while the block runs."""

    def stop(signum: int, frame: object) -> None:
        raise Interrupted(f"stopped by {signal.Signals(signum).name}")

    before = catch(stop)
    try:
        yield
    finally:
        for s, handler in before.items():
            signal.signal(s, handler)
