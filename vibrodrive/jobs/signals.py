"""Signals that end a computation."""

import signal
from collections.abc import Callable
from typing import Any

SIGNALS = tuple(getattr(signal, s) for s in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, s))
"""Signals of this system. Only POSIX has SIGHUP (closed terminal), and only Windows has SIGBREAK (Ctrl-Break)."""


def catch(handler: Callable[[int, Any], None]) -> dict[int, Any]:
    """Install `handler` for all SIGNALS except an ignored SIGHUP (nohup), and return the previous handlers."""
    before = {s: signal.getsignal(s) for s in SIGNALS}
    for s, was in before.items():
        if not (s == getattr(signal, "SIGHUP", None) and was == signal.SIG_IGN):
            signal.signal(s, handler)
    return before
