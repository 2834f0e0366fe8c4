"""Holes that a power failure, a sparse copy or a disk leaves anywhere in a file never pass as results.

tests/test_products.py damages every variable of every record. Zeros are the hardest kind, because the status OK is 0.
"""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from tests.support import fake
from vibrodrive.errors import NoResult
from vibrodrive.model.choices import Status
from vibrodrive.model.plan import make_plan
from vibrodrive.store.load import load
from vibrodrive.store.reader import DamagedBlock, look, verify

RECORDED = {"section": ("section",), "several": ("impacts", "error"), "summary": ("summary",), "limit": ("limit",)}
BLOCKS = 3

each = pytest.mark.parametrize("name", RECORDED)


def made(name):
    axes = {"A": [3.0, 3.1, 3.2, 3.3, 3.4], "eps": [0.0, 2e-4]} if name != "limit" else {"A": np.linspace(3, 3.1, 10)}
    plan = make_plan({**axes, "transient": 0, "periods": 12, "record": RECORDED[name]})
    return replace(plan, tiling=(2, 2) if name != "limit" else (4,))


def block(plan, k):
    """Return a block as motions have it: one with points that are all OK, and one with numbers that are all zero."""
    b = fake.block(plan, k)
    zeros = {name: np.zeros_like(values) for name, values in b.records.items()} if k == 1 else b.records
    return b._replace(status=b.status if k else np.zeros_like(b.status), records=zeros)


def assert_no_wrong_number(path, plan):
    """Assert that each point of each array is right or, by its status, not computed."""
    results, blocks = load(path), [block(plan, k) for k in range(BLOCKS)]
    for name in ["status", "margin", "switches", *["section"] * plan.sectioned, *(q.name for q in plan.quantities)]:
        values = np.asarray(results[name]).reshape(plan.n_points, *results[name].shape[len(plan.axes) :])
        truth = np.concatenate([{**b._asdict(), **b.records}[name] for b in blocks]).astype(values.dtype)
        right = np.array([v.tobytes() == t.tobytes() for v, t in zip(values, truth, strict=True)])
        assert (right | (results.status.ravel() == Status.NOT_COMPUTED)).all(), name


@each
@pytest.mark.parametrize("which", [range(BLOCKS), [0]], ids=["complete", "begun"])
@pytest.mark.parametrize("size", [64, 4096])
def test_hole_anywhere_is_no_result(tmp_path, name, which, size):
    """It is refused, named, or harmless; and what can be computed again is then as it was."""
    path, plan = tmp_path / "x.h5", made(name)
    fake.write(path, plan, of=block)
    whole = path.read_bytes()
    path.unlink()
    fake.write(path, plan, "", which, block)
    content, statuses = path.read_bytes(), look(path).statuses
    for start in np.linspace(0, len(content) - size, 16, dtype=int).tolist():
        path.write_bytes(content[:start] + bytes(size) + content[start + size :])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DamagedBlock)
            try:
                assert_no_wrong_number(path, plan)
                report = verify(path)
                assert report.statuses.get("OK", 0) <= statuses["OK"]
                fake.write(path, plan, of=block)
            except NoResult:
                continue
        assert_no_wrong_number(path, plan)
        again = path.read_bytes()
        assert verify(path).complete
        if again != whole:  # texts that no reader of this program reads
            holes = np.flatnonzero(np.frombuffer(again, "u1") != np.frombuffer(whole, "u1"))
            assert start <= holes.min() <= holes.max() < start + size
