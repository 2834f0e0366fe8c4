"""One digest of results of all switching methods. If a change of the code does not change the results, the digest is
the same.

Sines, roots and fused products are implemented in the package (trig.py, branchless.py), so the bits are the same on
every machine. A correction that changes results also changes the digest. The commit then states which results change,
and why. See CONTRIBUTING.md.
"""

import hashlib

import numpy as np
import pytest

import vibrodrive as vd

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


@pytest.mark.jit
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
