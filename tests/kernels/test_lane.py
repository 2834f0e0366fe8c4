"""A lane holds the state of one motion in rows of the arrays w and k (kernels/lane.py). One module writes each row.

Rows that several modules write are listed here with the reason.
"""

import ast
from collections import defaultdict
from pathlib import Path

import vibrodrive.kernels
from vibrodrive.kernels import codes, lane

SHARED = {
    "a search begins in first_zero.py or undisturbed.py, and each way to search moves its cursor": ["CURSOR"],
    "a search for the end of a stick may change to the other side of S4": ["SIG", "SEARCH"],
    "margins.py clears the smallest distance from a zero at each new state": ["DIP_DENOMINATOR"],
    "each kind of search sets its outcome": ["OUTCOME"],
    "each module counts its own evaluations": ["WORK"],
    "recurrence.py skips whole cycles": ["PERIOD", "COUNTED", "LEFT", "SINCE", "SECTIONS"],
    "margins.py sets TOO_CLOSE and NEVER_LEAVES, event.py BUDGET": ["STATUS"],
}  # fmt: skip
"""Rows that several modules write, with the reason. setup.py writes the first value of each row, and is not listed."""


def rows_written(path: Path):
    """Yield the names of rows to which a module assigns values: w[NAME + i] or k[r.NAME + i], also in a tuple, or with
    `put`."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "put":
            written = [(node.args[0], node.args[1])]
        else:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            elements = [e for t in targets for e in (t.elts if isinstance(t, ast.Tuple) else [t])]
            written = [(e.value, e.slice) for e in elements if isinstance(e, ast.Subscript)]
        for array, index in written:
            if getattr(array, "id", "") in ("w", "k"):
                names = [getattr(n, "attr", getattr(n, "id", "")) for n in ast.walk(index)]
                yield from (n for n in names if n.isupper() and n != "STRIDE" and hasattr(lane, n))


def test_each_row_has_one_owner_or_a_reason():
    writers = defaultdict(set)
    for path in Path(vibrodrive.kernels.__file__).parent.glob("*.py"):
        for row in rows_written(path):
            writers[row].add(path.stem)
    assert len(writers) > 90
    several = {row for row, modules in writers.items() if len(modules - {"setup"}) > 1}
    assert several == {row for rows in SHARED.values() for row in rows}


def test_codes_and_rows_have_different_names():
    rows = {name for name in vars(lane) if name.isupper()}
    assert not rows & {name for name in vars(codes) if name.isupper()}
