"""Loop for trajectories that are computed one by one.

These are single trajectories whose switches are recorded. Each search runs to its end in registers, whereas the
searches of a batch (engine.py) are in memory. The trajectory is in lane 0. `kernels/__init__.py` explains the terms.
"""

from functools import cache

import numpy as np

from vibrodrive.jit.atomic import is_set, next_index
from vibrodrive.jit.compile import array, inline_each, jit, part, part_each
from vibrodrive.kernels import arguments, event, first_zero, history, record, setup, undisturbed
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import AT_ONCE, BRACKETED, CERTIFIED, NOTHING, ZERO
from vibrodrive.kernels.outputs import Errors, Log, Outcome, Recorder, extent_of

MOST = 1000  # number of steps of a search after which a kernel checks `halt`


@part
def follow_certified(w, k):
    """Continue the search without a grid in lane 0, to its end or for MOST steps."""
    w[r.OUTCOME] = NOTHING
    if w[r.SEARCH_MODE] == AT_ONCE:
        w[r.OUTCOME] = ZERO
    elif w[r.SEARCH_MODE] == BRACKETED:
        undisturbed.search_one_bracket(w, k, 0, MOST)
    else:
        for _ in range(MOST):
            first_zero.search(w, 0, True, False)
            if w[r.OUTCOME] != NOTHING:
                return


@part_each("fast")
def follow_on_grid(w, fast):
    """Continue the search on a grid in lane 0, to its end or for MOST steps, with a disturbance (`fast`) or without."""
    w[r.OUTCOME] = NOTHING
    for _ in range(MOST):
        first_zero.search(w, 0, fast, True)
        if w[r.OUTCOME] != NOTHING:
            return


@inline_each("method")
def follow(w, k, method):
    """Continue the search in lane 0."""
    if method == CERTIFIED:
        follow_certified(w, k)
    elif w[r.AF] > 0.0:
        follow_on_grid(w, True)
    else:
        follow_on_grid(w, False)


@cache
def single(method: int, recorded: bool, bounded: bool):
    """Return the kernel that computes trajectories one by one by `method`.

    If `recorded`, the kernel computes summaries. If `bounded`, it computes bounds of the errors of the motion
    (certainty.py). Main impacts are written if the array `impacts` has room for them.
    """
    grid = method != CERTIFIED

    @jit(like=(0,), _nrt=False)
    def run(address):
        """Take points by the counter and compute their trajectories, until all are done or `halt` is set."""
        a = arguments.arguments_at(address)
        w, k = a.lanes_w[0], a.lanes_k[0]
        extent = extent_of(a.numbers)
        section, impacts, outcome = a.section, a.impacts, Outcome(a.status, a.margin, a.counts, a.work)
        log = Log(a.rows, a.stored)
        recorder = Recorder(a.history, a.totals, a.summary, grid) if recorded else None
        errors = Errors(a.bounds, a.until, a.off) if bounded else None
        history.assign_slots(k)
        under_way = False
        while not is_set(a.halt):
            if not under_way:
                c = next_index(a.counter)
                if c >= a.order.shape[0]:
                    return 0
                under_way = setup.load(w, k, 0, a.points, a.order[c], method, extent, section, log, errors)
            if under_way:
                follow(w, k, method)
                if w[r.OUTCOME] == NOTHING:
                    continue
                under_way = event.process_event(w, k, 0, method, extent, section, impacts, recorder, log, errors)
            if not under_way:
                record.finish(w, k, 0, extent, section, impacts, recorder, errors, outcome)
        return 0

    return run


_EXAMPLE = (
    array(2), array(2, np.int64), array(2), array(1, np.int64), array(1, np.int64), array(3),
    array(1, arguments.SWITCH), array(1, np.int64), array(2, np.int64), array(1),
)  # fmt: skip


@jit(like=_EXAMPLE, _nrt=False)
def next_switches(lanes_w, lanes_k, points, states, numbers, section, rows, stored, ends, phases):
    """Find the certified switch that ends the state states[n] of the motion that starts at points[n], for each n.

    points float64 (n, columns), states int64 (n,)
    numbers : settings (outputs.py). The switch is searched for in the record, and there is no transient
    section float64 (1, periods, 2), rows SWITCH (m,), stored int64 (1,): memory. Up to m - 1 switches are examined. An
    impact, or a start with H within rounding of ±1, adds one or two switches before the switch that ends the state
    ends int64 (n, 2): results: period of the switch, and next state; -1 if there is no such switch
    phases float64 (n,): results: phase of the switch
    """
    w, k = lanes_w[0], lanes_k[0]
    extent, log = extent_of(numbers), Log(rows, stored)
    for n in range(points.shape[0]):
        going = setup.load(w, k, 0, points, n, CERTIFIED, extent, section, log, None)
        ends[n, 0], ends[n, 1], phases[n] = -1, -1, 0.0
        row = 1
        while going and row < rows.shape[0]:
            follow_certified(w, k)
            if w[r.OUTCOME] == NOTHING:
                continue
            going = event.process_event(w, k, 0, CERTIFIED, extent, section, None, None, log, None)
            while row < min(stored[0], rows.shape[0]):
                if rows[row]["before"] == states[n]:
                    ends[n, 0], ends[n, 1] = rows[row]["period"], rows[row]["after"]
                    phases[n] = rows[row]["phase"]
                    going = False
                    break
                row += 1
