"""The word of a motion is the cycle of states between its main impacts; two claims about the paper need it."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.paper.words import cycle_of_words, keeps_words, repeats
from tests.stability.test_structure import motion
from vibrodrive.model.states import State
from vibrodrive.stability import structure

WORD = State.REST, State.UP, State.STICK, State.DOWN


def test_missed_interruption_changes_the_word_only():
    once = motion(times=range(60), word=WORD, section=np.ones((60, 2)))
    base, cycle = structure.reference_orbit(once), cycle_of_words(once)
    assert cycle == ((State.IMPACT, *WORD),)
    assert keeps_words(base, cycle, once)
    at = np.flatnonzero(once.switches["after"] == State.STICK)[4]
    once.switches = np.delete(once.switches, at)
    once.impacts["row"] -= once.impacts["row"] > at
    found = structure.compare_structure(base, once)
    assert (found.order, found.gaps, found.impacts) == (True, True, True)
    assert not keeps_words(base, cycle, once)


@given(
    cycle=st.lists(st.integers(1, 4), min_size=1, max_size=4),
    start=st.integers(0, 3),
    count=st.integers(1, 30),
)
def test_every_piece_of_a_repeated_cycle_is_recognised(cycle, start, count):
    piece = [cycle[(start + k) % len(cycle)] for k in range(count)]
    assert repeats(piece, cycle)
    assert not repeats([*piece, 9], cycle)
