"""The 50-digit reference for tests; each of its scenes is computed once in a test run."""

from __future__ import annotations

import functools

from vibrodrive.validation.reference import (
    DOWN,
    ETA,
    IMPACT,
    REST,
    SCENES,
    STICK,
    UP,
    Oscillator,
    Reference,
    Slide,
    Switching,
    mp,
    reference,
)

__all__ = [
    "DOWN", "ETA", "IMPACT", "REST", "SCENES", "STICK", "UP", "Oscillator", "Reference", "Slide", "Switching", "mp",
    "reference", "scene",
]  # fmt: skip


@functools.cache
def scene(name: str) -> Reference:
    """Return the reference of one of SCENES."""
    return reference(**SCENES[name])
