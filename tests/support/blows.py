"""Many motions under impulses at once, by small steps of constant force: an attacker that shares no code with kernels.

The impulses of all disturbances so far, P, are between 0 and V. At each step an *action* chooses P from the state of
the mass, so that the next impact comes late or early, or at random. The force is exact as an average over each step, so
that a motion is that of the oscillator within about A dt² for each switch.
"""

import math
from dataclasses import dataclass

import numpy as np

TWO_PI = 2.0 * math.pi
IMPACT = np.dtype([("period", np.int64), ("phase", float), ("speed", float)])

LATE, EARLY, UP, DOWN, KEEP, HOVER, ALONG, AGAINST, DRAWN = range(9)
"""Actions. LATE, EARLY: the next impact comes as late, or as early, as possible. UP, DOWN: P = V or 0. KEEP: no blow.
HOVER: stay near the obstacle. ALONG, AGAINST: push along the motion, or against it. DRAWN: any P."""


@dataclass
class Blows:
    """Disturbances of several motions: V, float64 (n,), one m, and what each does.

    actions int (n, rows, segments): action in each segment of a time, row after row; signs float64 of the same shape:
    the force, in units of m. A row begins at each impact faster than `turn`, and has `per_period` segments in an
    excitation period.
    """

    V: np.ndarray
    m: float
    actions: np.ndarray
    signs: np.ndarray
    per_period: int
    turn: float


def chosen(V, action, P, v, rest, chatter, force, rng):
    """Return the next P of each motion, and `chatter`. The force is (H dt, dt), and dt gives the size of a chatter."""
    (push, dt), u = force, v - P
    small = 6.0 * dt
    late, early = action == LATE, action == EARLY
    begins = (late & (u >= -1e-12)) | (early & (u + V <= 1e-12) & (push < dt))
    ends = (late & ((u + V < -1e-12) | (u < -small))) | (early & ((push >= dt) | (u > 1e-12) | (u + V > small)))
    chatter = np.where(begins, True, np.where(ends, False, chatter))
    falls = np.clip(-u - 1e-9 - np.maximum(dt + push, 0.0), 0.0, V)  # v is just below 0
    rises = np.clip(-u + 1e-9 + np.maximum(dt - push, 0.0), 0.0, V)  # v is just above 0
    values = [
        np.where((u > 0.0) | (u + V < -1e-12) | chatter, V, falls),
        np.where(u > 1e-12, 0.0, np.where(chatter, np.where(rest, V, 0.0), rises)),
        V, 0.0 * V, P, rises, np.where(v > 0.0, V, 0.0), np.where(v > 0.0, 0.0, V), V * rng.random(len(V)),
    ]  # fmt: skip
    return np.choose(action, values), chatter


def strike(A, B, phase, periods, blows, steps=1500, seed=0):
    """Return the impacts of motions from rest at the obstacle at `phase`, as rows (time, speed) for each motion."""
    n, dt, rng = len(blows.V), TWO_PI / steps, np.random.default_rng(seed)
    x, v, row, begun, each = np.zeros(n), np.zeros(n), np.zeros(n, int), np.zeros(n, int), np.arange(n)
    P = np.where(blows.actions[:, 0, 0] == EARLY, blows.V, 0.0)
    rows, segments = blows.actions.shape[1:]
    chatter, found = np.zeros(n, bool), []
    force = A * -np.diff(np.cos(phase + dt * np.arange(periods * steps + 1))) - B * dt
    for i, plain in enumerate(force):
        segment = (i - begun) * blows.per_period // steps % segments
        action = blows.actions[each, row % rows, segment]
        push = plain + blows.m * blows.signs[each, row % rows, segment] * dt
        rest = (x <= 0.0) & (v == 0.0)
        P = np.where(rest & (action == LATE), 0.0, P)  # the obstacle has taken the impulse down
        new, chatter = chosen(blows.V, action, P, v, rest, chatter, (push, dt), rng)
        v, P = v + (new - P), new
        v = np.where((x <= 0.0) & (v < 0.0), 0.0, v)
        pull = push / dt
        from_rest = np.where(pull > 1.0, pull - 1.0, np.where(pull < -1.0, pull + 1.0, 0.0))
        from_rest = np.where((x <= 0.0) & (v == 0.0) & (pull <= 1.0), 0.0, from_rest)
        a = np.where(v == 0.0, from_rest, pull - np.sign(v))
        first = np.where(v * a < 0.0, np.minimum(-v / np.where(a == 0.0, 1.0, a), dt), dt)
        h = dt - first
        x1, v1 = x + (v + 0.5 * a * first) * first, np.where(first < dt, 0.0, v + a * first)
        x2, v2 = x1 + 0.5 * from_rest * h * h, v1 + from_rest * h
        hit = (x2 <= 0.0) & (np.minimum(v, v2) < 0.0)
        if hit.any():
            k = np.flatnonzero(hit)
            late = v[k] > 0.0  # the fall begins within the step
            x0, v0, a0 = np.where(late, (x1[k], 0.0 * v[k], from_rest[k]), (x[k], v[k], a[k]))
            speed = np.sqrt(np.maximum(v0 * v0 - 2.0 * a0 * x0, 0.0))
            taken = np.minimum(np.where(late, first[k], 0.0) + 2.0 * x0 / np.maximum(speed - v0, 1e-300), dt)
            fast = speed > blows.turn
            row[k], begun[k] = row[k] + fast, np.where(fast, i, begun[k])
            room = blows.V[k] - P[k]
            up = (blows.actions[k, row[k] % rows, 0] == EARLY) & (speed > room)  # a last blow, P = V at the impact
            speed, P[k] = np.where(up, speed - room, speed), np.where(up, blows.V[k], P[k])
            found.append(np.array([k, phase + i * dt + taken, speed]))
            v2[k] = np.maximum(pull[k] - 1.0, 0.0) * (dt - taken)
            x2[k] = 0.5 * v2[k] * (dt - taken)
        x, v = np.maximum(x2, 0.0), v2
    which, time, speed = np.concatenate([np.empty((3, 0)), *found], axis=1)
    return [np.array([time[which == k], speed[which == k]]).T for k in range(n)]


def main_impacts(found):
    """Return those of the impacts of a motion that have no faster one within half a period: rows of IMPACT."""
    kept: list[tuple[float, float]] = []
    for time, speed in found:
        if not kept or time - kept[-1][0] > math.pi:
            kept.append((time, speed))
        elif speed > kept[-1][1]:
            kept[-1] = time, speed
    time, speed = np.array(kept or np.empty((0, 2))).T
    rows = np.empty(len(time), IMPACT)
    rows["period"], rows["phase"], rows["speed"] = time // TWO_PI, time % TWO_PI, speed
    return rows


def attack(V, m, cycle, count, rng):
    """Return `count` disturbances for each of several V, with the force m, against an orbit.

    The first ones make main impacts late and early in turn, or all late, or all early. The next ones wait for half a
    period and then touch the obstacle as fast as possible. In all others parts of such rows are replaced.
    """
    per_period, rows = 48, 2
    segments = per_period * (int(cycle.gaps.max()) + 1)
    actions = np.empty((count, rows, segments), int)
    actions[:] = rng.choice([LATE, EARLY], (count, rows, 1))
    actions[:3] = np.array([[LATE, EARLY], [LATE, LATE], [EARLY, EARLY]])[..., None]
    half = per_period // 2
    for k, one in enumerate(actions[3:9]):
        one[0, :], one[1, :], one[0, half + k : half + k + 1] = HOVER, EARLY, DOWN
        one[0, half + k + 1 :] = LATE
    others = [LATE, EARLY, LATE, EARLY, *range(UP, DRAWN + 1)]
    for one in actions[9:]:
        for _ in range(rng.integers(1, 5)):
            at = rng.integers(segments - 1)
            end = segments if rng.random() < 0.5 else at + rng.integers(1, segments // 3)
            one[rng.integers(rows), at:end] = rng.choice(others)
    actions = np.tile(actions, (len(V), 1, 1))
    signs = np.where(actions == EARLY, -1.0, 1.0)
    return Blows(np.repeat(V, count), m, actions, signs, per_period, 0.15 * cycle.speed.min())
