"""Scenes of the 50-digit reference for tests. Each scene is computed once in a test run."""

import functools

import pytest

from vibrodrive.validation.reference import SCENES, Reference, reference

LONG = pytest.mark.slow("5 to 20 s each: hundreds of switches at 50 digits")

NAMES = [
    pytest.param(name, marks=[LONG] * (name in ("one-periodic", "two-periodic", "fast disturbance"))) for name in SCENES
]
"""Names of SCENES, as parameters of a test."""


@functools.cache
def scene(name: str) -> Reference:
    """Return the motion of one of SCENES by the reference."""
    return reference(**SCENES[name])
