"""Integer and float codes of states, methods, switching functions and outcomes in kernels.

`kernels/__init__.py` explains the terms.
"""

from vibrodrive.model.choices import Method, Status
from vibrodrive.model.states import State

UP, DOWN, STICK, REST, IMPACT = (int(s) for s in State)

FIXED, MULLER, CERTIFIED = int(Method.FIXED), int(Method.MULLER), int(Method.CERTIFIED)

OK, TOO_CLOSE, NEVER_LEAVES, BUDGET = (
    int(s) for s in (Status.OK, Status.TOO_CLOSE, Status.NEVER_LEAVES, Status.BUDGET)
)


MULLER_BRACKETED, FIXED_BRACKETED = -1, -2
"""Values that replace MULLER and FIXED in a sweep at ε = 0, where a search in a bracket replaces the scan of the grid
(switch_grid.py)."""


CONTINUE, STRETCHED, END = 0, -1, -2
"""Ends of a search other than a zero of S1 ... S5 (first_zero.py). CONTINUE: another search follows. STRETCHED: the
state continues in a new segment. END: the record ends."""


S1, S2, S3, S4, S5 = 1, 2, 3, 4, 5


INFINITY, UNKNOWN = float("inf"), float("nan")


STEPPED, BRACKETED, AT_ONCE = 0.0, 1.0, 2.0
"""Search modes for the end of a state. STEPPED: by steps (first_zero.py). BRACKETED: in a bracket (undisturbed.py).
AT_ONCE: without a search, because the end is known."""


NOTHING, ZERO, LIMIT_MET, FALLEN, BOTH = 0.0, 1.0, 2.0, 3.0, 4.0
"""Outcomes of a search. NOTHING: none yet. ZERO: a zero. LIMIT_MET: no zero up to the limit of the search. FALLEN: ξ is
below 0 (without a grid: by more than the smallest margin so far). BOTH: on a grid, both ξ and the switching function
are below 0."""


NONE_BEGUN, COMPLETE, LEAVING, CLOSING_IN = 0.0, 1.0, 2.0, 3.0
"""Stages of the refinement of a zero (muller.py). LEAVING: bisection moves away from the zero at which the slide began.
CLOSING_IN: Muller's method approaches the next zero."""


DONE, UNUSUAL, WRITE_POINT, CHECK_RECURRENCE, KEEP_SWITCH = 0, 1, 2, 4, 8
"""Work that remains in a lane after a batch of switches. DONE: none. UNUSUAL: event.py must apply the switch. Other
values are a sum of WRITE_POINT (write a section point), CHECK_RECURRENCE (recurrence.py) and KEEP_SWITCH (store the
switch: `keep_switch` in history.py)."""


ENDED_EARLY = -1.0  # value of LEFT if all results of a trajectory are known before its record ends


OF_THE_RECORD, ALL, NONE = 0, 1, 2
"""Switches of a trajectory that are stored for its summary (history.py): those of the record, all, or none."""
