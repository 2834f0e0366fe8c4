"""Enclosure of the next main impacts of all motions from an interval of starts, with all phases of the disturbance.

It imports nothing from vibrodrive. It marches through one time for all motions at once, in steps of constant force. The
disturbance is the sine of amplitude V η, V = ε η A, and its phase is ψ + η t. An interval of starts *closes* if, one
period later, all motions are in it again, and have touched the obstacle only within half a period after its beginning.
Then the same holds from there on for ever. All impacts are in such halves of periods, and there is one in each.

(1) Friction contracts. Let R be the integral of the force, and w = v - R, so that w' = -sgn v. If R1 - R2 is within ±D,
w1 - w2 cannot grow beyond D: it is larger only if v1 > v2, and then friction draws it down. So the velocities of two
motions that begin at rest at one time differ by at most 2 D, without regard to the obstacle, and their positions by at
most D T after a time T, plus the integral of R1 - R2.

(2) One line for many phases. A motion with the phase ψ + δ, seen at the time t + δ/η, has the same ripple as one with
ψ. Only the slow force A sin t comes late, by at most σ = π/(η lines). This changes R by A σ, and the integral of R by
2 A σ.

(3) Steps. The force is replaced by its mean over each step of length h. R is then interpolated linearly. The ripple's
part of R changes by e = V (η h)²/8, and this error has no mean over a ripple, so that its integral is at most 2π e/η.
The slow part changes by A h²/8. The motion in a step of constant force is elementary. All rounding, below 1e-11, is
within the margin MARGIN in D.

(4) Groups. All motions that leave the obstacle in one step are a group. Under the forces of the line and of its steps
they stay between an *upper* motion, which has left at the beginning of the step, and a *lower* one, which begins at
its end, because motions under one force do not overtake each other in ξ'.

(5) A motion of a group touches only while its lower motion allows x <= 0 and ξ' < 0, and only after H has been below -1
since it has left. It has touched when the upper motion is below 0. If |H''| h² < 2, H does not fall from 1 to -1 within
a step and rise above -1 again.
"""

import math
from dataclasses import dataclass

import numpy as np

TWO_PI = 2.0 * math.pi
MARGIN = 1e-9


class Open(Exception):
    """The interval does not close. The message says what may happen."""


@dataclass(frozen=True)
class Scene:
    """Parameters of the oscillator."""

    A: float
    B: float
    eta: float
    eps: float

    @property
    def V(self) -> float:
        """Amplitude of the disturbance, as a velocity."""
        return self.eps * self.eta * self.A

    def force(self, t, psi):
        """Return H at the time t."""
        return self.A * np.sin(t) + self.V * self.eta * np.sin(psi + self.eta * t) - self.B

    def integral(self, t, psi):
        """Return the integral R of H up to the time t."""
        return -self.A * np.cos(t) - self.V * np.cos(psi + self.eta * t) - self.B * t


@dataclass
class Groups:
    """Groups of motions: the line of each, when it has left, whether it may fall, ξ and ξ' (2, n): upper, lower."""

    line: np.ndarray
    begun: np.ndarray
    falls: np.ndarray
    x: np.ndarray
    v: np.ndarray

    def join(self, line, begun, falls, force, h):
        """Add groups that leave in a step of length h and of constant force."""
        v = h * np.stack([np.maximum(force - 1.0, 0.0), np.minimum(force + 1.0, 0.0)])
        self.line = np.concatenate([self.line, line])
        self.begun = np.concatenate([self.begun, np.full(len(line), begun)])
        self.falls = np.concatenate([self.falls, falls])
        self.x = np.concatenate([self.x, 0.5 * h * v], axis=1)
        self.v = np.concatenate([self.v, v], axis=1)

    def move(self, force, h):
        """Move all groups through a step of constant force on each line. Return the least ξ in it."""
        self.x, self.v, low = advance(self.x, self.v, force[self.line], h)
        return low

    def keep(self, which):
        """Keep only some of the groups."""
        self.line, self.begun, self.falls = self.line[which], self.begun[which], self.falls[which]
        self.x, self.v = self.x[:, which], self.v[:, which]


def advance(x, v, force, h):
    """Return ξ and ξ' after a step of constant force without an obstacle, and the least ξ in it."""
    from_rest = np.maximum(force - 1.0, 0.0) + np.minimum(force + 1.0, 0.0)
    a = force - np.sign(v)
    later = v + a * h
    stops = v * later <= 0.0
    first = np.where(stops, np.divide(-v, a, out=np.zeros_like(v), where=stops & (v != 0.0)), h)
    rest = h - first
    turn = x + 0.5 * (v + np.where(stops, 0.0, later)) * first
    end = turn + 0.5 * from_rest * rest * rest
    return end, np.where(stops, from_rest * rest, later), np.minimum(np.minimum(x, turn), end)


class Cover:
    """All motions from rest at the obstacle at the times `starts`, float (first, last), and for all ψ.

    window : times in which the next impacts after half a period must be; by default `starts`, one period later.
    lines : number of phases ψ to which the others are compared.
    steps : number of steps in a ripple.
    """

    def __init__(self, scene, starts, window=None, lines=64, steps=64):
        self.scene, A, V, eta = scene, scene.A, scene.V, scene.eta
        self.h = TWO_PI / (eta * steps)
        self.psi = TWO_PI * (np.arange(lines) + 0.5) / lines
        self.shift = math.pi / (eta * lines)
        ripple, slow = V * (eta * self.h) ** 2 / 8.0, A * self.h**2 / 8.0 + MARGIN
        self.D = A * self.shift + ripple + slow
        self.rate, self.offset = self.D + slow, 2.0 * A * self.shift + ripple * TWO_PI / eta
        self.bend = (V * eta**3 + A) * self.h**2
        assert self.bend < 2.0, "the steps are too long"
        assert starts[1] - starts[0] < math.pi, "main impacts may be half a period apart"
        self.starts = starts[0] - self.shift, starts[1] + self.shift
        self.near = starts[0] + math.pi - self.shift
        first, last = window or (starts[0] + TWO_PI, starts[1] + TWO_PI)
        self.window = first + self.shift, last - self.shift
        self.first, self.last = math.inf, -math.inf
        self.groups = Groups(np.empty(0, int), np.empty(0), np.empty(0, bool), np.empty((2, 0)), np.empty((2, 0)))

    def image(self):
        """Return the first and the last time of the next impact after the half period. Raise Open if one may stray."""
        begin, h, scene, psi = self.starts[0], self.h, self.scene, self.psi
        away = 0.125 * self.bend + scene.A * self.shift  # of H in a step from its values at the ends
        rest = np.zeros(len(psi), bool)
        for k in range(math.floor((self.window[1] - begin) / h)):
            t, end = begin + k * h, begin + (k + 1) * h
            H0, H1 = scene.force(t, psi), scene.force(end, psi)
            mean = (scene.integral(end, psi) - scene.integral(t, psi)) / h
            rest |= t <= self.starts[1]
            rest |= self._fly(t, end, mean, np.minimum(H0, H1) - away)
            leaves = np.flatnonzero(rest & (np.maximum(H0, H1) + away > 1.0))
            falls = H1[leaves] - away <= -1.0
            self.groups.join(leaves, t, falls, mean[leaves], h)
            if falls.any():
                self._touch(t, end)
            rest &= H1 - away <= 1.0
        if rest.any() or (self.groups.x[0] + self.room(end) >= 0.0).any():
            raise Open("a main impact may come late")
        return self.first - self.shift, self.last + self.shift

    def _fly(self, t, end, mean, least):
        """Move all groups through a step. Return the lines on which motions may come to rest, bool (lines,)."""
        groups, touched = self.groups, np.zeros(len(self.psi), bool)
        before, room = groups.v[1], self.room(end)
        low = groups.move(mean, self.h)
        groups.falls |= least[groups.line] < -1.0
        touching = groups.falls & (low[1] <= room) & (np.minimum(before, groups.v[1]) < 2.0 * self.D)
        if touching.any() and self._touch(t, end):
            touched[groups.line[touching]] = True
        landed = groups.x[0] + room < 0.0
        if landed.any():
            groups.keep(~landed)
        return touched

    def room(self, t):
        """Return how far the motions of each group may be from those that enclose it."""
        return self.rate * (t - self.groups.begun) + self.offset

    def _touch(self, t, end):
        """Note an impact in a step. Return whether it belongs to the starts."""
        if end <= self.near:
            return True
        if t < self.window[0]:
            raise Open(f"an impact may come at {t:.4f}")
        self.first, self.last = min(self.first, t), max(self.last, end)
        return False
