"""Signals that end a computation."""

import signal
from collections.abc import Callable
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # the last one if the terminal is closed


def catch(handler: Callable[[int, Any], None]) -> dict[int, Any]:
    """Install `handler` for all SIGNALS except an ignored SIGHUP (nohup), and return the previous handlers."""
    before: dict[int, Any] = {s: signal.getsignal(s) for s in SIGNALS}
    for s, was in before.items():
        if not (s == signal.SIGHUP and was == signal.SIG_IGN):
            signal.signal(s, handler)
    return before
