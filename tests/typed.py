"""Calls that a type checker accepts or refuses: mypy reports an ignored error that is no error. Nothing runs them."""

import numpy as np

import vibrodrive as vd

A = np.linspace(3.0, 3.25, 10)


def right() -> None:
    motion = vd.simulate(3.04, eps=0, B=0.1, eta=vd.ETA, method="certified", dtau=None, tol=None)
    r = vd.sweep(A=A, eps=[0, 2e-4], dtau=(1e-3, 1e-2), method="muller", threads=2, executor=None)
    k = vd.limit(3.04, "dtau", method=vd.Method.FIXED, periods=100, threads=1)
    found: float = k.k2 + motion.margin + r.margin[0, 0, 0]
    r = vd.sweep(points={"A": A, "eps": [found] * 10}, record=["section", "summary"])
    lengths: list[int] = [*r.to_xarray().sizes.values(), len(motion.to_dataframe("impacts"))]
    machine = vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4)
    vd.bifurcations(scene=machine, frequency=(20, 24), mu=A)
    vd.plot.cobweb(scene=machine, orbit=vd.orbits(frequency=20, scene=machine)[0])
    r.select("nearest", tolerance=0.1, A=lengths[0]).plot("poincare", ax=None).savefig("figure.png")


def wrong(r: vd.Results, motion: vd.Trajectory) -> None:
    vd.load("limits.h5", kind="limits")  # type: ignore[call-arg]
    vd.simulate(A=3.04, periods="many")  # type: ignore[arg-type]
    vd.simulate(A=3.04, bogus=3)  # type: ignore[call-arg]
    vd.simulate(A=[3.0, 3.1])  # type: ignore[arg-type]
    vd.sweep(A=A, periods=[1, 2])  # type: ignore[arg-type]
    vd.sweep(A)  # type: ignore[call-arg]
    vd.sweep(points=[3.0, 3.1])  # type: ignore[arg-type]
    vd.limit(3.04, "eta")  # type: ignore[arg-type]
    vd.limit(3.04).k3  # type: ignore[attr-defined]  # noqa: B018
    text: str = r.section  # type: ignore[assignment]
    r.select(A=3.0, method=text + "closest")  # type: ignore[arg-type]
    r.plot(colour="red")  # type: ignore[call-arg]
    motion.to_dataframe("rows")  # type: ignore[arg-type]
    vd.plot.bifurcation(r, limits=3)  # type: ignore[arg-type]
