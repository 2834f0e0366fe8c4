"""Comparison of the methods fixed and muller, which skip grid points that cannot have a sign change, with plain loops
over all grid points, and of sweeps with single motions.
"""

import math

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.agreement import same
from tests.kernels.test_recurrence import evaluations
from tests.support import naive

SCENES = [
    dict(A=3.04, dtau=0.1),
    dict(A=1.5, dtau=0.65),
    dict(A=1.5, dtau=0.7),
    dict(A=3.15, dtau=0.03, xi0=2.0, dxi0=-0.5),
    dict(A=3.0, B=1.3, dtau=0.05, xi0=4.0, tau0=1.0),
    dict(A=2.5, B=0.0, dtau=0.2, xi0=0.3, dxi0=1.0, tau0=-7.0),
    dict(A=3.04, eps=2e-4, dtau=0.004),
    dict(A=2.6, eps=0.01, eta=7.3, dtau=0.02),
]


def compare(plain, ours, tolerance):
    rows = ours.switches
    assert [(s.before, s.after) for s in plain.switches] == [(r["before"], r["after"]) for r in rows]
    tau = np.array([float(s.tau) for s in plain.switches])
    mine = 2 * np.pi * rows["period"] + rows["phase"]
    np.testing.assert_allclose(mine, tau, rtol=0, atol=tolerance)
    np.testing.assert_allclose(rows["xi"], [s.xi for s in plain.switches], rtol=0, atol=tolerance * 10)


@pytest.mark.parametrize("scene", [*SCENES, *(dict(s, tol=1e-10) for s in SCENES if s["dtau"] <= 0.1)], ids=str)
def test_grid_method_equals_the_plain_loop(scene):
    """Grid points and decisions are the same. Times differ by the rounding of τ, and by `tol` after a refinement."""
    method, tolerance = ("muller", 1e-7) if "tol" in scene else ("fixed", 1e-11)
    plain = getattr(naive, method)(**scene, periods=12)
    compare(plain, vd.simulate(method=method, transient=0, periods=12, **scene), tolerance)


@pytest.mark.parametrize(
    ("method", "scene"),
    [
        ("fixed", dict(A=3.575305434815514, eps=1.37e-6, eta=23.767, dtau=3.3020431562018566, tau0=5.0959612342907,
                       dxi0=-1.317258655509)),
        ("muller", dict(A=1.352744021696512, B=0.0, dtau=0.6833730966552495, tau0=1.1157036179718958,
                        xi0=6.315140320656706)),
    ],
)  # fmt: skip
def test_stick_may_end_at_the_last_grid_point(method, scene):
    """The search of one side of S4 has reached the end of the record. The other side has a zero there."""
    plain = getattr(naive, method)(**scene, periods=5)
    compare(plain, vd.simulate(**scene, method=method, transient=0, periods=5), 1e-6)
    assert plain.switches[-1].before == vd.State.STICK


@pytest.mark.jit
@pytest.mark.parametrize(("method", "steps"), [("fixed", (-3.0, 0.5)), ("muller", (-3.5, -2.0))])
@pytest.mark.parametrize("disturbed", [True, False], ids=["disturbed", "undisturbed"])
def test_no_skipped_grid_point_has_a_switch(method, steps, disturbed):
    """At random points the switches are those of the plain loop, which visits every grid point."""
    points = disturbed_points(method, 10, 100, steps)  # with other seeds the loop misses an impact between two points
    if not disturbed:
        points["eps"] = np.zeros(100)
    count = 0
    for point in zip(*points.values(), strict=True):
        scene = dict(zip(points, map(float, point), strict=True)) | ({"tol": 1e-10} if method == "muller" else {})
        ours = vd.simulate(**scene, method=method, transient=0, periods=1)
        if ours.status == vd.Status.OK:  # else a decision is within rounding of the other one
            compare(getattr(naive, method)(**scene, periods=1), ours, 1e-6)
            count += len(ours.switches)
    assert count > 200


@pytest.mark.jit
@pytest.mark.parametrize("tol", [1e-3, 1e-5, 1e-7, 1e-9, 1e-12])
def test_muller_reaches_its_tolerance(tol):
    """The error of a switch is below tol times the factor by which errors grow in the motion (at most 20)."""
    exact = vd.simulate(A=3.04, transient=0, periods=3)
    t = vd.simulate(A=3.04, method="muller", dtau=0.01, tol=tol, transient=0, periods=3)
    late = np.abs(t.switches["phase"] - exact.switches["phase"])
    assert late.max() < max(20 * tol, 1e-13)


def test_fixed_grid_is_never_accumulated():
    """Each switching time is τ0 + kΔτ with an integer k, up to the last bits, even after a thousand periods."""
    dtau = 0.1
    t = vd.simulate(A=3.04, method="fixed", dtau=dtau, transient=1000, periods=3)
    for row in t.switches:
        tau = math.fsum([2 * math.pi * int(row["period"]), 2.4492935982947064e-16 * int(row["period"]), row["phase"]])
        assert abs(tau / dtau - round(tau / dtau)) * dtau < 4e-12


LEAPS: dict[str, dict[str, float]] = {
    "H touches 1 at a grid point": dict(A=1.1, xi0=3.0, tau0=np.pi / 12, dtau=2 * np.pi / 1200, periods=5),
    "the same, finer": dict(A=1.1, xi0=3.0, tau0=np.pi / 12, dtau=2 * np.pi / 12000, periods=5),
    "the same, steeper": dict(
        A=1.75, B=0.75, xi0=3.0, tau0=0.861587740205537, dtau=0.002129755515283362, periods=3
    ),
    "a budget of few switches": dict(
        A=1.7287220708143323, B=0.7287220707685688, xi0=0.0833430610322381, tau0=0.48687829911216496,
        dtau=0.004042611324263639, tol=4.53e-14, transient=40, periods=3, budget=4,
    ),
    "ξ' is positive between two grid points, but not at these points": dict(
        A=56.334685138402385, B=1.9, tau0=np.pi / 2, xi0=1e-300, dtau=3.23769908526484, tol=1e-300, periods=1,
    ),
    "the same, from another start": dict(
        A=1.9850003906512026, B=0.985, tau0=4.5359423004019055, xi0=4.440821210799109, dtau=3.3299295262907394,
        tol=1.0, periods=1,
    ),
    "hardly any wait": dict(
        A=1.000000001374711, B=0.0, xi0=2.0, dxi0=0.7062784193398164, dtau=1.8074693008481331e-06,
        tol=0.0006628171063370612, periods=3, budget=4,
    ),
}  # fmt: skip


@pytest.mark.jit
@pytest.mark.parametrize("method", ["muller", "fixed"])
@pytest.mark.parametrize("name", LEAPS)
def test_skipping_finds_the_switches_of_the_scan(name, method):
    """At ε = 0 a sweep evaluates only the grid points next to a zero. `simulate` evaluates all grid points."""
    scene = acting({"transient": 0, **LEAPS[name], "method": method})
    swept = vd.sweep(**{**scene, "A": [scene["A"]]})
    assert same(swept, 0, vd.simulate(**scene))


def acting(scene, arguments=None):
    """Return `arguments` (default: `scene`), without `tol` if the method of `scene` is fixed."""
    left = {"tol"} if scene["method"] == "fixed" else set()
    return {name: value for name, value in (arguments or scene).items() if name not in left}


@pytest.mark.jit
@pytest.mark.parametrize("method", ["muller", "fixed"])
@pytest.mark.parametrize("seed", range(20))
def test_skipping_finds_the_switches_of_the_scan_in_any_scene(seed, method):
    """The scenes have random inclines, starts in the air and in motion, and steps from 1e-4 to half a period."""
    rng = np.random.default_rng(seed)
    B = float(rng.choice([0.0, 0.1, 0.985, 1.2, rng.uniform(0, 2)]))
    scene = dict(
        B=B, dtau=float(10 ** rng.uniform(-4, 0.5)),
        transient=int(rng.integers(0, 40)), periods=int(rng.integers(1, 60)),
        tau0=rng.uniform(0, 6.28), section_phase=rng.uniform(0, 6.28), xi0=float(rng.choice([0, rng.exponential()])),
        dxi0=float(rng.choice([0, rng.normal()])), method=method, tol=float(10 ** rng.uniform(-12, -3)),
    )  # fmt: skip
    scene = acting(scene)
    A = np.sort(rng.uniform(abs(1 - B) + 0.01, B + 4, 8))
    swept = vd.sweep(A=A, **scene)
    assert [a for k, a in enumerate(A) if not same(swept, k, vd.simulate(A=a, **scene))] == []


@pytest.mark.jit
@pytest.mark.parametrize("method", ["muller", "fixed"])
def test_skipping_costs_the_same_for_every_step(method):
    """In a sweep the number of evaluations does not depend on Δτ, in `simulate` it does. No cycle is copied here."""
    steps = (1e-5, 1e-4, 1e-3, 0.05) if method == "muller" else (1e-5, 1e-4)
    sweep = dict(method=method, transient=0, periods=60)
    leapt = {evaluations(A=[3.054, 3.055, 3.056], dtau=dtau, **sweep) for dtau in steps}
    scanned = {vd.simulate(A=3.055, dtau=dtau, **sweep).evaluations for dtau in steps}
    assert len(leapt) == 1 < len(scanned)


def disturbed_points(method, seed, n, dtau):
    """Return n random points with ε > 0 and Δτ between 10**dtau[0] and 10**dtau[1]."""
    rng = np.random.default_rng(seed)
    B = rng.choice([0.0, 0.1, 0.5, 0.985, 1.2], n)
    started = rng.choice([0.0, 1.0], (2, n))
    points = dict(
        A=rng.uniform(abs(1 - B) + 0.01, B + 4), B=B, eps=10 ** rng.uniform(-6, -2, n),
        eta=10 ** rng.uniform(0.7, 2.3, n), dtau=10 ** rng.uniform(*dtau, n), tau0=rng.uniform(0, 6.28, n),
        xi0=started[0] * rng.exponential(size=n), dxi0=started[1] * rng.normal(size=n),
        tol=10 ** rng.uniform(-12, -6, n),
    )  # fmt: skip
    return acting(points | {"method": method}, points)


@pytest.mark.jit
@pytest.mark.parametrize("method", ["muller", "fixed"])
def test_batched_lanes_with_a_disturbance_equal_one_lane(method):
    """Motions computed together (sweep) or one by one (simulate) have the same bits and numbers of evaluations."""
    points = disturbed_points(method, 8, 500, (-3.0, 0.0))
    run = dict(method=method, transient=3, periods=6, section_phase=2.0)
    swept = vd.sweep(points=points, **run)
    alone = [
        vd.simulate(**dict(zip(points, point, strict=True)), **run) for point in zip(*points.values(), strict=True)
    ]
    assert [k for k, motion in enumerate(alone) if not same(swept, k, motion)] == []
    assert evaluations(points=points, **run) == sum(motion.evaluations for motion in alone)
