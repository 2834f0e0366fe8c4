"""The undisturbed orbit as a curve in the plane (ξ, ξ'), and how far a disturbed motion strays from it: ϱ < k₃ in §1.

The estimate of the definition compares motions as curves: a point of the disturbed motion may be early or late, as long
as it is near some point of the orbit. So ϱ is the largest distance of the disturbed motion's points from the nearest
point of the closed curve, whatever its time. At an impact the velocity jumps from -v to 0 at ξ = 0, and the segment
between belongs to the curve: without it a motion that lands a little softer than the orbit would be far from it.

The curve is a polygon through PER_PERIOD instants of each period and the states just before and after each switch.
Its chords leave the curve by h²/8 |(ξ'', ξ''')| at most, which is below 2e-5 (2A + B + 1) with this step. Of the
disturbed motion as many points a period are taken as asked for, and the states at its switches.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibrodrive.jit.compile import jit
from vibrodrive.jit.slices import in_slices
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.model.states import State
from vibrodrive.stability.structure import reference_orbit

if TYPE_CHECKING:
    from vibrodrive.batch.trajectory import Trajectory

PER_PERIOD = 512  # instants of the orbit in each excitation period
LOOKED_AT = 1024  # points from which it is seen which of the n shifted solutions a motion is nearest to


@dataclass(frozen=True, eq=False)
class OrbitCurve:
    """The orbit as a closed polygon of period n.

    vertices : float64 (k, 2), ξ and ξ' in the order in which they are passed; the last is followed by the first.
    times : float64 (k,), ascending, excitation periods since τ = 0, over n of them.
    """

    n: int
    vertices: np.ndarray
    times: np.ndarray

    @functools.cached_property
    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """From each vertex to the next, float64 (k, 2), and one over the squared length (k,), 0 where it has none."""
        along = np.roll(self.vertices, -1, axis=0) - self.vertices
        squared = (along**2).sum(axis=1)
        return along, np.divide(1.0, squared, out=np.zeros_like(squared), where=squared > 1e-300)

    def at(self, times: np.ndarray) -> np.ndarray:
        """The edges that are passed at `times`, any number of whole n periods earlier or later: int64 (m,)."""
        since = (times - self.times[0]) % self.n
        return np.searchsorted(self.times - self.times[0], since, side="right") - 1


def orbit_curve(orbit: Trajectory) -> OrbitCurve:
    """The curve of the orbit that an undisturbed motion has settled on: its last n periods."""
    found = reference_orbit(orbit)
    if found is None:
        raise ValueError("the undisturbed motion has no period: there is no curve to stay near")
    n = found.n
    times, points = _path(orbit, PER_PERIOD)
    last = np.flatnonzero(times > times[-1] - n)  # the end is the beginning, n periods later
    chosen = last[np.argsort(times[last], kind="stable")]
    return OrbitCurve(n, points[chosen], times[chosen])


def curve_distance(curve: OrbitCurve, motion: Trajectory, per_period: int = 64, enough: float = math.inf) -> float:
    """ϱ: the largest distance of a disturbed motion from the orbit as a curve; or one above `enough`.

    It is inf where the motion was given up as chattering. With 64 instants of the motion in each period, besides its
    switches, ϱ came out up to 0.6 % below what it is with 1024.
    """
    times, points = _path(motion, per_period)
    if not np.isfinite(points).all():
        return math.inf
    edge = _same_time(curve, times, points)
    farthest = np.zeros(1)
    done = 0

    def advance(steps: int) -> bool:
        nonlocal done
        part = slice(done, done + steps)
        raise_farthest(points[part], edge[part], curve.vertices, *curve.edges, enough**2, farthest)
        done += steps
        return done >= len(points) or farthest[0] > enough**2

    in_slices(advance)
    return float(np.sqrt(farthest[0]))


@jit(_nrt=False)
def raise_farthest(points, edge, vertices, along, inverse, enough, farthest):
    """farthest float64 (1,): the larger of itself and the largest squared distance of `points` from the polygon.

    Only up to the first point beyond `enough`, a squared distance.

    Edges are looked at from the one at the same time outwards, until one is no farther than the farthest point so far:
    for most points that is the first.
    """
    count = len(vertices)
    for i in range(len(points)):
        nearest = math.inf
        for k in range(count):
            j = edge[i] + (k // 2 + 1 if k % 2 == 1 else -(k // 2))
            j -= count if j >= count else 0
            j += count if j < 0 else 0
            x, y = points[i, 0] - vertices[j, 0], points[i, 1] - vertices[j, 1]
            share = min(max((x * along[j, 0] + y * along[j, 1]) * inverse[j], 0.0), 1.0)
            x, y = x - share * along[j, 0], y - share * along[j, 1]
            nearest = min(nearest, x * x + y * y)
            if nearest <= farthest[0]:
                break
        farthest[0] = max(farthest[0], nearest)
        if farthest[0] > enough:
            break


def _same_time(curve: OrbitCurve, times: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The edges of the curve passed at the same times, of the one of the n shifted solutions that is nearest."""
    some = slice(None, None, max(1, len(times) // LOOKED_AT))
    apart = [np.abs(points[some] - curve.vertices[curve.at(times[some] + s)]).sum() for s in range(curve.n)]
    return curve.at(times + int(np.argmin(apart)))


def _path(motion: Trajectory, per_period: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (m,), in excitation periods since τ = 0, and points (m, 2) of a record.

    Both sides of each switch come first, then the instants.
    """
    sampled = motion.sample(per_period)
    rows = motion.switches
    switched = rows["period"] + rows["phase"] / TWO_PI
    before = np.stack([rows["xi"], rows["dxi"]], axis=1)
    after = np.stack([np.where(rows["after"] == State.IMPACT, 0.0, rows["xi"]), np.zeros(len(rows))], axis=1)
    at_switches = np.stack([before, after], axis=1).reshape(-1, 2)
    times = np.concatenate([np.repeat(switched, 2), sampled.tau / TWO_PI])
    points = np.concatenate([at_switches, np.stack([sampled.xi, sampled.dxi], axis=1)])
    return times, points
