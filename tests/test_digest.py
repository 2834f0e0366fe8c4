"""Two digests of results, the same on every machine: of all switching methods, and of what all other kernels compute.

A correction that changes results also changes a digest. CONTRIBUTING.md says what the commit then states.
"""

import hashlib

import numpy as np
import pytest

import vibrodrive as vd
from build_kernels import kernels
from vibrodrive.explorer.density import darken
from vibrodrive.jit.compile import Kernel
from vibrodrive.periodic.flight import launch_after
from vibrodrive.periodic.impact_map import states
from vibrodrive.stability.failures import compared
from vibrodrive.stability.reach import reach

pytestmark = pytest.mark.jit

DIGEST = "f7c0ae3808dccd32acb0d92d92dbc623a635d338012056ba90dc25addd1ecaf1"

DIAGRAM = dict(A=np.linspace(1.05, 9.0, 90), eps=[0.0, 2e-4], transient=20, periods=12)
STARTS = dict(A=np.linspace(1.2, 6.0, 12), B=[0.0, 0.6, 1.3], xi0=[0.0, 3.0], dxi0=[-2.0, 1.5], tau0=1.0)
SHORT = dict(transient=2, periods=4)

SWEEPS = [
    DIAGRAM,
    dict(STARTS, eps=[0.0, 1e-5], section_phase=2.0, **SHORT),
    dict(A=np.linspace(2.0, 4.0, 9), eps=[1e-3, 3e-6], eta=[0.7, 40.5, 1500.0], **SHORT),
    dict(A=1e9, B=0.6, xi0=1e12, dxi0=-1e9, **SHORT),
    dict(A=np.linspace(3.0, 3.25, 40), transient=2000, periods=40),
    *(
        dict(A=np.linspace(1.2, 6.0, 12), eps=[0.0, 2e-4], method=method, dtau=dtau, **SHORT)
        for method in ("fixed", "muller")
        for dtau in (0.3, 0.01, 0.0007)
    ),
    dict(STARTS, method="muller", dtau=1e-5, tol=1e-9, **SHORT),
    dict(STARTS, method="fixed", dtau=0.05, section_phase=1.0, **SHORT),
]

MOTIONS = [
    dict(A=3.04, transient=3, periods=40),
    dict(A=1.5, eps=5e-4, transient=1, periods=6),
    dict(A=3.0, B=1.3, xi0=4.0, tau0=1.0, transient=0, periods=9),
    dict(A=3.04, method="fixed", dtau=0.1, eps=1e-4, transient=2, periods=9),
    dict(A=3.04, method="muller", dtau=0.01, tol=1e-9, transient=1, periods=9),
]


def test_results_have_the_stored_digest():
    digest = hashlib.sha256()
    for arguments in SWEEPS:
        results = vd.sweep(**arguments)
        for name in ("section", "status", "margin", "switches"):
            digest.update(np.ascontiguousarray(getattr(results, name)).tobytes())
    for arguments in MOTIONS:
        motion = vd.simulate(**arguments)
        sampled = motion.sample(32)
        for array in (motion.switches, motion.section, np.array([motion.margin, motion.status]), *sampled):
            digest.update(np.ascontiguousarray(array).tobytes())
    assert digest.hexdigest() == DIGEST


OTHERS = "b1502f2dc8d705e6ff19db43400578f1505d5952454cd46e0968c93fb572b035"

WAYS = [dict(), dict(method="muller", dtau=1e-3), dict(method="fixed", dtau=2e-3)]
RECORDS = ["section", ["summary", "impacts"], ["section", "error"], ["summary", "error"]]


def test_all_other_kernels_have_the_stored_digest(monkeypatch):
    """Those of records, orbits, the map of impacts, missed switches, proofs and the explorer."""
    called, digest = set(), hashlib.sha256()

    def call(kernel, *args, call=Kernel.__call__):
        called.add(kernel.name)
        return call(kernel, *args)

    def add(values):
        array = np.asarray(values) + 0  # a NaN may have any sign
        array = np.where(np.isnan(array), np.nan, array) if array.dtype.kind == "f" else array
        digest.update(np.ascontiguousarray(array).tobytes())

    monkeypatch.setattr(Kernel, "__call__", call)
    for way in WAYS:
        points = dict(A=np.linspace(1.2, 5.0, 9), B=0.2, transient=5, periods=12, **way)
        for record in RECORDS:
            for eps in (0.0, 2e-4):
                r = vd.sweep(eps=eps, record=record, threads=1, **points)
                for q in r.quantities:
                    add(r[q.name])
        add(vd.sweep(A=[3.04, 3.1], transient=20, periods=66, record="summary", **way).lyapunov)
        motion = vd.simulate(3.04, eps=2e-4, transient=1, periods=6, **way)
        add(motion.sample(16).xi)
        if way:
            add(compared(motion).behind)
    for A, B in ((1.2, 0.1), (3.04, 0.1), (8.0, 0.5)):
        for orbit in vd.orbits(A, B=B, max_period=3):
            add([*orbit.phases, *orbit.speeds, orbit.multiplier])
    found = vd.impact_map(3.04)(np.linspace(0.0, 6.2, 60))
    add([found.phase, found.speed, found.derivative])
    add(states(1.0, 3.04, 0.1))
    add([launch_after(phase, 3.04, 0.1) for phase in np.linspace(0.0, 6.2, 40)])
    image, counts = np.zeros((50, 30), np.uint8), np.zeros(50, np.int64)
    values, shades = np.random.default_rng(7).random((20, 40)), np.arange(41, dtype=np.uint8)
    darken(values, np.arange(20) + 3, 0.0, 1.0, shades, counts, image)
    add(image)
    r = vd.sweep(A=[1.2, 2.0, 2.62, 2.8], B=[0.1, 0.4], record="impulses")
    add([r.velocity_any, r.force_any, r.any_how])
    line = np.array([2.75, 0.1, 0.2, vd.ETA, 1.0, 1e-3, 0.05, 1e-4, 1e-13])
    window, out, work = np.array([9.4, 18.6, 19.8, 0.25]), np.zeros(4), np.array([0.0, 1e6])
    arrays = [np.tile([6.2, 6.8], (256, 1)), *(np.zeros((256, columns)) for columns in (2, 4)), out, work]
    add([reach(line, window, 0.01, *arrays), *out, *work])
    assert called == {kernel.name for kernel in kernels()}
    assert digest.hexdigest() == OTHERS
