"""The signals that end a computation, as far as the system has them."""

from __future__ import annotations

import signal
from collections.abc import Callable
from typing import Any

SIGNALS = tuple(getattr(signal, s) for s in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, s))
"""SIGHUP, a terminal that is closed, is POSIX's; SIGBREAK, Ctrl-Break, is that of Windows."""


def catch(handler: Callable[[int, Any], None]) -> dict[int, Any]:
    """Have all of them handled; returns how they were before. A SIGHUP that nohup has switched off stays off."""
    before = {s: signal.getsignal(s) for s in SIGNALS}
    for s, was in before.items():
        if not (s == getattr(signal, "SIGHUP", None) and was == signal.SIG_IGN):
            signal.signal(s, handler)
    return before
