"""Arguments of the kernels that compute motions.

A kernel receives only the address of one row of the array that `packed` returns, so all kernels have the same
signature. Therefore the parallel loop in batch/prange.py can call each kernel by the address of its function, and is
compiled only once. `kernels/__init__.py` explains the terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from vibrodrive.jit.compile import operation
from vibrodrive.kernels.lane import address_of

SWITCH = np.dtype([("period", "i8"), ("phase", "f8"), ("before", "i1"), ("after", "i1"), ("xi", "f8"), ("dxi", "f8")])
"""Format of a row of `Trajectory.switches`. `xi` and `dxi` are the values just before the switch."""


class Arguments(NamedTuple):
    """Arrays that a kernel of `batch` (engine.py) or `single` (single.py) reads and writes, for n points.

    An array that the kernel does not use may be None.

    lanes_w float64 (1, ROWS_W · STRIDE), lanes_k int64 (2, ROWS_K · STRIDE): memory of the lanes in row 0, memory for
    a list of lanes in row 1 of `lanes_k` (lane.py)
    halt int64 (1,): the kernel returns early if this is not 0
    points float64 (n, columns): parameters and initial values of each point, in the order of model/names.py
    order int64 (m,), counter int64 (1,): the kernel takes numbers c from the counter, computes the motions from
    points[order[c]], and writes the results into row order[c] of the arrays below
    numbers int64 (5,): settings (`numbers_of` in outputs.py)
    section float64 (n, periods, 2): section points; (1, periods, 2) if they are not recorded
    status int8 (n,), margin float64 (n,): status and margin of each motion
    counts int64 (n, 5): number of switches into each state
    work float64 (n,): number of evaluations of switching functions
    impacts float64 (n, 2 · periods, 4): main impacts (record.py), NaN after the last; (n, 0, 4) if they are not
        recorded
    history float64 (LANES, APART, 6), totals float64 (LANES, TOTALS): memory for summaries (history.py, summary.py)
    summary float64 (n, OUT): summary of each motion; not computed if totals is (LANES, 0)
    rows SWITCH (cap,), for one motion: the last switch before the record, or else the start of the motion; then the
        first cap - 1 switches of the record
    stored int64 (1,): number of rows that all switches need, which may exceed cap
    off float64 (cap, 3): bounds of the errors of time, ξ and ξ' of each switch in `rows`
    bounds float64 (n, periods, 2): bounds of the errors of ξ and ξ' at the section points; (n, 1, 2): the largest ones
    until float64 (n,): the first period in which a decision may be wrong, inf if there is none (certainty.py)
    """

    lanes_w: np.ndarray
    lanes_k: np.ndarray
    halt: np.ndarray
    points: np.ndarray
    order: np.ndarray
    counter: np.ndarray
    numbers: np.ndarray
    section: np.ndarray
    status: np.ndarray
    margin: np.ndarray
    counts: np.ndarray
    work: np.ndarray
    impacts: np.ndarray | None = None
    history: np.ndarray | None = None
    totals: np.ndarray | None = None
    summary: np.ndarray | None = None
    rows: np.ndarray | None = None
    stored: np.ndarray | None = None
    off: np.ndarray | None = None
    bounds: np.ndarray | None = None
    until: np.ndarray | None = None


class Described(Arguments):
    """Arguments with their description for kernels, which is made once."""

    cells: np.ndarray

    @classmethod
    def of(cls, arguments: Arguments) -> Described:
        """Return the same arguments with their description."""
        found = cls(*arguments)
        found.cells = packed([arguments])
        return found


_DTYPES: dict[str, Any] = {
    **dict.fromkeys(("lanes_k", "halt", "order", "counter", "numbers", "counts", "stored"), np.dtype(np.int64)),
    "status": np.dtype(np.int8),
    "rows": SWITCH,
}
_DIMENSIONS = {
    **dict.fromkeys(("lanes_w", "lanes_k", "points", "counts", "totals", "summary", "off"), 2),
    **dict.fromkeys(("section", "impacts", "history", "bounds"), 3),
}
KINDS = [(name, np.dtype(_DTYPES.get(name, np.float64)), _DIMENSIONS.get(name, 1)) for name in Arguments._fields]
CELLS = sum(1 + dimensions for _, _, dimensions in KINDS)
"""Number of integers that describe one set of arguments, that is the address and the shape of each array."""


def packed(sets: Sequence[Arguments]) -> np.ndarray:
    """Return the addresses and shapes of the arrays of each set, int64 (sets, CELLS).

    The caller must hold references to the arrays as long as the result is used. Raises TypeError if an array is not
    contiguous, or has another dtype or number of dimensions than `Arguments` states.
    """
    if isinstance(sets[0], Described):
        return sets[0].cells
    rows: list[list[int]] = []
    for arguments in sets:
        cells: list[int] = []
        for (name, dtype, dimensions), array, shared in zip(KINDS, arguments, sets[0]):  # noqa: B905
            if rows and array is shared:
                cells += rows[0][len(cells) : len(cells) + 1 + dimensions]
            elif array is None:
                cells += [0] * (1 + dimensions)
            elif array.dtype != dtype or array.ndim != dimensions or not array.flags.c_contiguous:
                raise TypeError(f"{name}: must be a contiguous {dtype} array of {dimensions} dimensions")
            else:
                cells.append(address_of(array))
                cells += array.shape
        rows.append(cells)
    return np.array(rows, np.int64)


@operation("vibrodrive.kernels.addressed")
def arguments_at(address):
    """Return the arguments of a kernel from the address of their row in the result of `packed`.

    Without the JIT, `address` is an `Arguments` and is returned unchanged.
    """
    return address
