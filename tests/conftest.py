"""The tests are a package, so `from tests.support.reference import reference` works from the repository root."""

from __future__ import annotations

import os

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave out what is marked `jit` when Numba is told not to compile: it would run for hours."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0"):
        return
    skip = pytest.mark.skip(reason="needs compiled kernels")
    for item in items:
        if "jit" in item.keywords:
            item.add_marker(skip)
