"""Memory in which the kernels compute one motion. That of brief motions is used again.

To allocate the arrays and to describe them to a kernel takes several times as long as a motion of one period.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from vibrodrive.kernels.arguments import SWITCH, Arguments, Described
from vibrodrive.kernels.lane import clear, new_lanes
from vibrodrive.model.parameters import COLUMNS

FEW = 16
"""Largest number of periods of a motion whose memory, up to 250 kB, is kept for later motions"""

_idle: defaultdict[tuple[int, int], list[Arguments]] = defaultdict(list)
"""Memory that no motion uses, by the number of periods and of rows. A thread takes one and gives it back."""


def new(periods: int, rows: int, halt: np.ndarray) -> Arguments:
    """Return new arrays for a motion over some periods, with room for `rows` switches. `halt` ends the kernel."""
    w, k = new_lanes(1, 1)
    return Arguments(
        w[0], k[0], halt, np.empty((1, len(COLUMNS))), np.zeros(1, np.int64), np.zeros(1, np.int64),
        np.empty(4, np.int64), np.empty((1, periods, 2)), np.empty(1, np.int8), np.empty(1), np.zeros((1, 5), np.int64),
        np.empty(1), np.empty((1, 2 * periods, 4)), rows=np.empty(rows, SWITCH), stored=np.zeros(1, np.int64),
        off=np.empty((rows, 3)), bounds=np.empty((1, periods, 2)), until=np.empty(1),
    )  # fmt: skip


def take(periods: int, rows: int) -> Arguments:
    """Return such arrays for a brief motion, which nothing halts. `give_back` lets a later motion use them.

    Each number of periods must have only few numbers of rows, because all are kept.
    """
    try:
        arguments = _idle[periods, rows].pop()
    except IndexError:
        return Described.of(new(periods, rows, np.zeros(1, np.int64)))
    clear(arguments.lanes_w, arguments.lanes_k, 1)
    arguments.counter[0] = 0
    return arguments


def give_back(arguments: Arguments) -> None:
    """Let a later motion use these arrays, whose results have been copied."""
    _idle[arguments.section.shape[1], len(arguments.rows)].append(arguments)  # type: ignore[arg-type]
