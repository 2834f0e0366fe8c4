"""Comparison of fixed and refined switching: cost, error, and the Δτ above which the orbital structure is wrong.

For A = 1.5 and 3.04 and for each Δτ the methods `fixed` and `muller` are compared with the certified orbit. The results
are the distance ρ of the section points, and True if the gaps (numbers of periods between impacts) and the order of the
impacts agree (docs/stability.md). `vd.limit` finds the values of Δτ at which the gaps or the order are lost, and those
at which the word (sequence of states) is lost. In the range 3.0 ≤ A ≤ 3.25 the sections are compared at each A at which
the certified motion is periodic. The result is the share of these A at which the order of the section points is right.
"""

from functools import partial
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.common import arguments, figure, paired, say, write
from vibrodrive.model.plain import plain
from vibrodrive.stability import structure

SECTION_PHASE = 2.0  # at this phase the mass slides for all A of this benchmark
TRANSIENT, PERIODS = 1000, 1500
SINGLE = (1.5, 3.04)
RANGE = (3.0, 3.25)
METHODS: dict[str, dict[str, Any]] = {"fixed": {"method": "fixed"}, "muller": {"method": "muller", "tol": 1e-7}}
LABELS = {"fixed": "fixed", "muller": "Muller"}
CRITERIA = ("impacts", "word")


def steps(quick: bool) -> np.ndarray:
    """Return values of Δτ from the paper's 1e-5 to 1. Above 0.01 successive values have the ratio 1.15, because the
    structure is lost there."""
    if quick:
        return np.array([1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.5, 0.7])
    fine = np.exp(np.arange(np.log(0.01), np.log(1.0), np.log(1.15)))
    return np.concatenate([np.geomspace(1e-5, 0.01, 13)[:-1], fine])


def single(A: float, quick: bool) -> dict[str, Any]:
    """Return for one A and each method: at each Δτ the distance ρ, and `kept`, which is True if gaps and order agree;
    the limits in Δτ for CRITERIA."""
    window: dict[str, Any] = {"A": A, "transient": TRANSIENT, "periods": PERIODS, "section_phase": SECTION_PHASE}
    base = structure.reference_orbit(vd.simulate(**window, method="certified"))
    if base is None:
        raise ValueError(f"A = {A}: the certified motion has not settled on an orbit")
    found: dict[str, Any] = {"A": A, "period": base.n}
    for name, method in METHODS.items():
        rows = []
        for dtau in steps(quick):
            s = structure.compare_structure(base, vd.simulate(**window, **method, dtau=float(dtau)))
            rows.append({"dtau": dtau, "rho": plain(s.rho), "kept": getattr(s, CRITERIA[0])})
        found[name] = {"rows": rows}
        for criterion in CRITERIA:
            k = vd.limit(A, "dtau", criterion=criterion, transient=TRANSIENT, periods=PERIODS, **method)
            found[name][criterion] = {"k2": k.k2 if np.isfinite(k.k2) else None, "last_kept": k.last_kept}
            say(f"A = {A:g}, {name}, {criterion}: {k}")
    return found


def over_range(quick: bool) -> dict[str, Any]:
    """Return for each method and Δτ the share of periodic motions with section points in the right order, and the
    median of ρ."""
    A = np.linspace(*RANGE, 11 if quick else 101)
    window: dict[str, Any] = {"transient": TRANSIENT, "periods": 128, "section_phase": SECTION_PHASE}
    certified = vd.sweep(A=A, **window, method="certified").section
    n = structure.period(certified)
    found: dict[str, Any] = {"A": RANGE, "points": len(A), "periodic": int((n > 0).sum())}
    for name, method in METHODS.items():
        section = vd.sweep(A=A, dtau=steps(quick), **window, **method).section
        share, median = [], []
        for k in range(section.shape[1]):
            kept, far = [], []
            for i in np.flatnonzero(n):
                points = certified[i, -n[i] :]
                kept.append(bool(structure.order(points, section[i, k])))
                far.append(float(structure.deviation(points, section[i, k])[0]))
            share.append(np.mean(kept))
            median.append(float(np.median(far)))
        found[name] = {"dtau": steps(quick), "share_kept": share, "median_rho": median}
        say(f"range, {name}: done")
    return found


def costs(quick: bool) -> dict[str, float]:
    """Return the CPU time in seconds per period of a sweep over the range on one thread, for each kind of switching."""
    n, p = (50, 50) if quick else (500, 200)
    sweep: dict[str, Any] = {"A": np.linspace(*RANGE, n), "transient": 0, "periods": p, "threads": 1}
    kinds: dict[str, dict[str, Any]] = {
        "certified": {"method": "certified"},
        "fixed, Δτ = 0.1": {"method": "fixed", "dtau": 0.1},
        "fixed, Δτ = 0.01": {"method": "fixed", "dtau": 0.01},
        "fixed, Δτ = 1e-5": {"method": "fixed", "dtau": 1e-5},
        "muller, Δτ = 0.01": {"method": "muller", "dtau": 0.01, "tol": 1e-7},
        "muller, Δτ = 1e-5 (the paper's)": {"method": "muller", "dtau": 1e-5, "tol": 1e-7},
    }
    times = paired({k: partial(vd.sweep, **sweep, **kind) for k, kind in kinds.items()}, 1 if quick else 5)
    return {k: t.seconds / (n * p) for k, t in times.items()}


def draw(data: dict[str, Any]):
    fig, axes = figure(10.0, 3.6, columns=3)
    marks = {"fixed": ("o", "black"), "muller": ("s", "0.45")}
    for ax, at in zip(axes[0], data["single"], strict=False):
        for name, (marker, color) in marks.items():
            rows = [r for r in at[name]["rows"] if r["rho"] is not None]
            for kept in (True, False):
                here = [r for r in rows if r["kept"] == kept]
                ax.loglog(
                    [r["dtau"] for r in here], [max(r["rho"], 1e-16) for r in here],
                    marker, color=color, markerfacecolor=color if kept else "white",
                    label=f"{LABELS[name]}, structure {'kept' if kept else 'lost'}" if here else None,
                )  # fmt: skip
        ax.set_title(f"$A = {at['A']:g}$")
        ax.set_xlabel(r"$\Delta\tau$")
        ax.set_ylabel(r"$\rho$")
        ax.legend()
    ax = axes[0, 2]
    for name, (marker, color) in marks.items():
        at = data["range"][name]
        ax.semilogx(at["dtau"], at["share_kept"], marker=marker, color=color, label=LABELS[name])
    ax.set_title("$3 \\leq A \\leq 3.25$")
    ax.set_xlabel(r"$\Delta\tau$")
    ax.set_ylabel("share of periodic motions that keep their order")
    ax.set_ylim(-0.03, 1.03)
    ax.legend()
    return fig


def main() -> None:
    options = arguments(__doc__)
    data = {
        "transient": TRANSIENT,
        "periods": PERIODS,
        "section_phase": SECTION_PHASE,
        "criterion": CRITERIA[0],
        "single": [single(A, options.quick) for A in SINGLE],
        "range": over_range(options.quick),
        "seconds_per_period": costs(options.quick),
    }
    write("refined_vs_fixed", data, draw(data), options.output)


if __name__ == "__main__":
    main()
