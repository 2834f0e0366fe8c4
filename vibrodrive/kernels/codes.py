"""The integers by which kernels tell states, methods, switching functions and outcomes apart: one list."""

from __future__ import annotations

from vibrodrive.model.choices import Method, Scan, Status
from vibrodrive.model.states import State

UP, DOWN, STICK, REST, IMPACT = (int(s) for s in State)

FIXED, MULLER, CERTIFIED = (int(m) for m in Method)

LITERAL = int(Scan.LITERAL)

OK, TOO_CLOSE, NEVER_LEAVES, BUDGET = (
    int(s) for s in (Status.OK, Status.TOO_CLOSE, Status.NEVER_LEAVES, Status.BUDGET)
)


MULLER_BRACKETED, FIXED_BRACKETED = CERTIFIED + 1, CERTIFIED + 2
"""`method` within the engine where a path on a grid is computed without scanning at ε = 0 (switch_grid.py): in sweeps,
unless a literal scan is asked for."""


CONTINUE, STRETCHED, END = 0, -1, -2
"""What ends a search, beside a zero of S1 ... S5: another search takes its place; the segment is continued from here
with a fresh start; the record ends."""


S1, S2, S3, S4, S5 = 1, 2, 3, 4, 5


INFINITY, UNKNOWN = float("inf"), float("nan")


STEPPED, BRACKETED, AT_ONCE = 0.0, 1.0, 2.0
"""How the end of a state is found: by steps (first_zero.py), in a bracket (undisturbed.py), or without a search."""


NOTHING, ZERO, LIMIT_MET, FALLEN, BOTH = 0.0, 1.0, 2.0, 3.0, 4.0
"""What a search has met: nothing yet; a zero; its limit; ξ below 0, by more than the smallest margin so far; on a grid,
both functions below 0."""


NONE_BEGUN, COMPLETE, LEAVING, CLOSING_IN = 0.0, 1.0, 2.0, 3.0
"""How far the refinement of a zero has come (muller.py): not begun; at its end; on the way, still leaving the zero that
its slide began with, or about to close in on the next."""


DONE, UNUSUAL, WRITE_POINT, CHECK_RECURRENCE, KEEP_SWITCH = 0, 1, 2, 4, 8
"""What is left to do in a lane after a batch of switches: nothing; everything (event.py); or some of: a section point
to be written, a recurrence to be looked for (recurrence.py), a switch to be kept (`keep_switch` in history.py)."""


ENDED_EARLY = -1.0
"""What is left of the record of a trajectory of which nothing more is to be known."""


OF_THE_RECORD, ALL, NONE = 0, 1, 2
"""Which switches of a trajectory are kept for its summary (history.py)."""
