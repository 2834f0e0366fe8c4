"""Files whose checksums are right, and whose header says what no version writes: refused in one line, and not followed.

Such a file is damaged, written by another program, or meant to do harm.
"""

import hashlib
import json
import random
from dataclasses import replace

import h5py
import numpy as np
import pytest

from tests.support import fake
from vibrodrive.errors import VibrodriveError
from vibrodrive.model.own import Own
from vibrodrive.model.parameters import has_control
from vibrodrive.model.plan import make_plan
from vibrodrive.store.layout import Origin
from vibrodrive.store.load import load
from vibrodrive.store.reader import look, verify

OWN = Own("settle", ("last", "share"), "0" * 64).with_rows({"last": ("1", "length", "label")})
PLANS = {
    "grid": replace(make_plan({"A": np.linspace(3, 3.25, 9), "eps": [0, 2e-4], "periods": 3}), tiling=(2, 2)),
    "records": make_plan({"A": [3.0, 3.1], "periods": 3, "record": ("section", "impacts", "summary", OWN)}),
    "scene": make_plan({"mu": 0.6, "mass": 250, "omega0": [100, 150], "alpha": [2, 3.4], "a0": 8e-4, "periods": 3}),
    "points": make_plan({"points": {"A": [3, 3.1], "eps": [0, 1e-4]}, "B": [0.1, 0.2], "periods": 3}),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    for name, plan in PLANS.items():
        fake.write(folder / f"{name}.h5", plan, Origin("[sweep]\nA = 3\n", ("A=[3,\n4]",), "A title"))
    return {name: (folder / f"{name}.h5").read_bytes() for name in PLANS}


def resume(path, plan):
    fake.write(path, plan, which=[])


def read(path, _):
    results = load(path)
    repr(results)
    for name in ("status", "margin", *(q.name for q in results.plan.quantities)):
        results[name]
    results.plan.points(0, results.plan.n_points)


def show(path, _):
    report = look(path)
    report.lines(), report.facts()


def refusals(path, plan):
    """Return the sentences with which a file is refused. Any other exception than a refusal is a fault."""
    told = []
    for attempt in (read, show, resume, lambda path, _: verify(path).complaints()):
        try:
            attempt(path, plan)
        except VibrodriveError as error:
            told.append(str(error))
    assert not any(map(has_control, told)), told
    return told


WRONG = [
    None, 99, -1, 0, 1.5, 1e400, -1e308, True, 10**30, "abc", "", "\x1b[31m", [], [1], [None], {}, {"a": 1}, "eps",
    "limit", [9, 2], [2, 2, 2], "O", "<f4", "<f1", "f: a, a (function " + "0" * 64 + ")",
]  # fmt: skip


def places(value, at=()):
    """Yield the places in a value of JSON, as keys and indices from the outside in."""
    yield at
    if isinstance(value, dict | list):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from places(value[key], (*at, key))


def changed(value, draw):
    """Return a value of JSON with something wrong at a drawn place."""
    *outer, last = draw.choice([at for at in places(value) if at])
    inner = value = json.loads(json.dumps(value))
    for key in outer:
        inner = inner[key]
    if isinstance(inner, dict) and draw.random() < 0.3:
        inner[draw.choice(["tomorrow", "A", "point", "a0", "status", "\x1b"])] = inner.pop(last)
    else:
        inner[last] = draw.choice(WRONG)
    return value


@pytest.mark.filterwarnings("ignore::vibrodrive.store.reader.DamagedBlock")
@pytest.mark.parametrize("name", PLANS)
def test_any_header_is_read_or_refused_in_one_line(name, whole, tmp_path):
    path, draw, refused = tmp_path / "x.h5", random.Random(65), 0
    for _ in range(25):
        path.write_bytes(whole[name])
        with h5py.File(path, "r+") as file:
            plan = json.dumps(changed(json.loads(file.attrs["plan"]), draw))
            file.attrs.update({"plan": plan, "plan_sha256": hashlib.sha256(plan.encode()).hexdigest()})
        refused += bool(refusals(path, PLANS[name]))
    assert refused > 12


def axis(file, **options):
    """Replace the axis A by one of other options."""
    del file["A"]
    return file.create_dataset("A", **{"shape": 9, "dtype": "f8"} | options)


def virtual(file, other):
    del file["A"]
    layout = h5py.VirtualLayout((9,), "f8")
    layout[...] = h5py.VirtualSource(other, "A", shape=(9,))
    file.create_virtual_dataset("A", layout)


CHANGES = {
    "axis in another file": lambda file, other: axis(file, external=[(other + ".bin", 0, 72)]),
    "axis of 2³⁶ values": lambda file, other: axis(file, shape=2**36, chunks=True),
    "virtual axis": virtual,
    "link to another file": lambda file, other: file.pop("A") and file.update(A=h5py.ExternalLink(other, "/A")),
    "link within the file": lambda file, other: file.move("A", "B") or file.update(A=h5py.SoftLink("/B")),
    "title for a terminal": lambda file, other: file.attrs.update(title="\x1b]0;pwned\x07"),
    "version for a terminal": lambda file, other: file.attrs.update(versions='{"vibrodrive": "\\u001b[2J"}'),
    "version with a backspace": lambda file, other: file.attrs.update(versions='{"vibrodrive": "1\\b2"}'),
    "configuration of a number": lambda file, other: file.attrs.update(config=3),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_nothing_is_followed_or_printed_that_leads_out_of_the_file(change, whole, tmp_path):
    """The other file could be a pipe, for which a reader would wait for ever. Here it has the right values."""
    path, other = tmp_path / "x.h5", tmp_path / "other.h5"
    path.write_bytes(whole["grid"])
    other.write_bytes(whole["grid"])
    (tmp_path / "other.h5.bin").write_bytes(PLANS["grid"].axes["A"].tobytes())
    with h5py.File(path, "r+") as file:
        change(file, str(other))
    assert len(refusals(path, PLANS["grid"])) == 4
