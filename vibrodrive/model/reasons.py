"""Reasons that files store as numbers: how structures are lost, and why no more is proved of them.

Kernels return the numbers. An edit of this module recompiles them.
"""

from __future__ import annotations

from enum import IntEnum


class Reason(IntEnum):
    """A number, and its meaning in words."""

    meaning: str

    def __new__(cls, number: int, meaning: str = "") -> Reason:
        member = int.__new__(cls, number)
        member._value_, member.meaning = number, meaning
        return member


class How(Reason):
    """How a motion loses the structure of the undisturbed orbit at k₂. Files contain the numbers."""

    KEPT = 0, "no value tried is lost, so k2 is inf"
    ORDER = 1, "the main impacts come in another order"
    GAPS = 2, "other numbers of periods between the main impacts"
    GAPS_IN_ANOTHER_ORDER = 3, "the numbers of periods between the main impacts in another order"
    FEWER_IMPACTS = 4, "fewer main impacts, at the same numbers of periods"
    BUDGET = 5, "the motion exceeds the budget"


class Beyond(Reason):
    """What is not proved of a structure beyond V and m (stability/impulses.py), or at all. Files have the numbers."""

    PROVED = 0, "the structure is kept"
    NO_IMPACTS = 1, "there may be no impacts: none undisturbed, A <= 1 + B, or gravity >= friction (B >= 1)"
    MISSED = 2, "a main impact may fail to come"
    SHIFTED = 3, "a main impact may come so early or so late that the mass leaves in another period"
    FALL = 4, "the mass may be falling when the force lifts it off the obstacle"
    HELD = 5, "a touch in flight may hold the mass"
    TOUCH = 6, "touches may be as fast as main impacts"
    DRIFT = 7, "the phases of the main impacts may drift out of every interval"
    ORDER = 8, "the main impacts may come in another order, or half a period early or late"


class Unproved(Reason):
    """Why no larger amplitude is proved for all times (stability/always.py), or none. Files have the numbers."""

    LATE = 1, "a main impact may fail to come when it is due"
    STRAYS = 2, "an impact may be neither a touch nor a main impact"
    FULL = 3, "too many intervals"
    COARSE = 4, "the phases of the disturbance are too far apart"
    DRIFT = 5, "the phases of the impacts drift out of every interval"
    ORDER = 6, "main impacts may come in another order"
    BUDGET = 7, "no proof within the budget of evaluations"
    NO_IMPACTS = 8, "there are no impacts"
