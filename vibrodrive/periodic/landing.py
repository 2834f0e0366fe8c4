"""The compiled part of the impact-phase map: one impact, and the window of launches (`impact_map.py`).

It imports nothing that checks arguments, so that an edit of a parameter recompiles no kernel.
"""

from __future__ import annotations

import math

import numpy as np

from vibrodrive.jit.compile import jit
from vibrodrive.jit.trig import turns
from vibrodrive.kernels.codes import IMPACT, REST
from vibrodrive.kernels.release import release_up
from vibrodrive.periodic.flight import NO_WORD, append, flight, touching, window_end


@jit(_nrt=False)
def impacts(phi, A, B, horizon, phase, periods, speed, slope, code, no_slides):
    """The next impact for every phase of `phi`, into the arrays behind it, all (n,); `no_slides` (0, 3)."""
    up, _ = release_up(A, B)
    end = window_end(up)
    none = np.int64(NO_WORD)  # a literal would compile another specialisation
    rested = False  # the flight out of a rest, which may be long, is followed once, and only if needed
    k0, phase0, velocity0, word0 = -1, math.nan, math.nan, none
    for i in range(len(phi)):
        psi = turns(phi[i], 0.0)[1]
        if up < psi < end:
            k, landed, velocity, rate, word, _ = flight(psi, A, B, horizon, none, no_slides)
        else:
            if not rested:
                rested = True
                k0, phase0, velocity0, _, word0, _ = flight(up, A, B, horizon, append(none, REST + 1), no_slides)
            k, landed, velocity, rate, word = k0, phase0, velocity0, 0.0, word0
            if psi >= end and k0 >= 0:
                k = k0 + 1
        phase[i] = landed
        periods[i] = k
        speed[i] = -velocity + 0.0  # no -0.0
        slope[i] = rate
        code[i] = append(word, IMPACT + 1)


@jit(_nrt=False)
def launch_after(phi, A, B):
    """(ψ, rests): the phase φ of an impact, in [0, 2π), and whether a rest follows; if not, ψ is that of the launch."""
    psi = turns(phi, 0.0)[1]
    up, _ = release_up(A, B)
    return psi, psi <= up or psi >= window_end(up)


@jit(_nrt=False)
def launch_window(A, B):
    """(φ_up, π - φ_up, ψ*): the window, and the launch in it whose flight touches without speed if B = 0."""
    up = release_up(A, B)[0]
    return up, window_end(up), touching(A, up)
