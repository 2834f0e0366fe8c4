"""The word of a motion: the states through which it passes between its main impacts.

Of the properties of the structure (docs/stability.md) the limits compare the main impacts only. Two claims of the paper
are about the states, too: Fig. 5 and Fig. 8.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

import vibrodrive as vd
from vibrodrive.stability.main_impacts import follow_cycle

Word = tuple[vd.State, ...]


def words(motion: vd.Trajectory, rows: np.ndarray) -> list[Word]:
    """Return the states from each impact to the next. `rows` are the indices of impacts in `motion.switches`."""
    after = motion.switches["after"]
    return [tuple(map(vd.State, after[a:b])) for a, b in pairwise(rows)]


def cycle_of_words(motion: vd.Trajectory) -> tuple[Word, ...]:
    """Return one cycle of the words of a periodic motion."""
    found = words(motion, motion.impacts["row"])
    return next(tuple(found[:n]) for n in range(1, len(found) + 1) if repeats(found, found[:n]))


def keeps_words(base: Any, cycle: Sequence[Word], motion: vd.Trajectory) -> bool:
    """Return whether a motion has the gaps of an orbit, and between its main impacts the words of the orbit."""
    landings = follow_cycle(base.cycle, motion.impacts, len(motion.section), False)
    return landings is not None and repeats(words(motion, motion.impacts["row"][landings]), cycle)


def repeats(sequence: Sequence[Any], cycle: Sequence[Any]) -> bool:
    """Return whether `sequence`, which is not empty, is a part of the infinite repetition of `cycle`."""
    n = len(cycle)
    return any(all(one == cycle[(k + s) % n] for k, one in enumerate(sequence)) for s in range(n))
