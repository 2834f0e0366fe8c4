"""Compare the pixels of a map over A and B with the list of stable orbits.

    python -m examples.map_agreement   # in the root of a clone

writes docs/map_agreement.md. `--curves FILE` reads the curves of bifurcations from a file of `vibrodrive orbits`,
`--sample N` judges N pixels, `--docs DIR` writes to another folder.

The map and the list share only the closed form between switches. A pixel is a summary of one motion from rest, computed
from the switches of this motion. The list contains the fixed points of the impact-phase map, found by a search, and
their multipliers. A pixel agrees if its period, its impacts per period and its largest impact speed are those of a
stable orbit of the list. If the list contains no stable orbit, a pixel agrees in two cases: its motion has no period up
to MAX_PERIOD, or the mass never leaves the obstacle.

Pixels next to a curve of bifurcations are not judged: their motions may not have settled, or may belong to the other
side of the curve. For each judged pixel that disagrees, the reason is determined.
"""

import argparse
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import vibrodrive as vd
from vibrodrive.model.config import read
from vibrodrive.periodic.curve import Curve
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.search import STABLE, SUPERSTABLE, Orbit, orbits_of

ROOT = Path(__file__).parent.parent

MAX_PERIOD = 3

PAGE = """# A map compared with the list of orbits

After this page you know how far two independent parts of the program agree: a map of motions and the
list of stable orbits. `python -m examples.map_agreement --sample {sample}` writes this page.

The map is that of `configs/map_AB.toml` without its row B = 0: {num_A} × {num_B} motions from rest, with {periods}
periods after a transient of {transient}. The list is the result of `orbits(A, B, {max_period})` at each pixel. A pixel
agrees if its period, its number of impacts per period and its largest impact speed (within 1e-4) equal those of a
stable orbit in the list. If the list has no stable orbit, a pixel agrees in two cases: its motion has no period up to
{max_period}, or the mass never leaves the obstacle. Pixels within one pixel of a curve of `curves` (periods up to
{max_period}) are excluded. Only a random sample of the remaining pixels, with a fixed seed, is compared, because each
pixel needs a separate search.

{table}

If a pixel disagrees, its motion is computed again, with {patience} periods of transient. If it still
disagrees, the motion is started from an impact of the listed orbits. Result: {verdict}
"""


SAME_SPEED = 1e-4
"""Largest relative difference of two impact speeds that count as equal.

It is larger than 1e-6. If a motion has a period, a switch and its repetition differ by at most 1e-6 in time, ξ and ξ'
(kernels/summary.py).
"""

COMPARED = ("period", "impacts", "impact_speed_max")
"""Quantities of a summary that identify the orbit of a pixel."""

TRANSIENT, PERIODS = 500, 66
"""Periods of each pixel, as in configs/map_AB.toml."""

ON = 0.25
"""Distance between the points that represent a curve, in pixels."""

PATIENCE = 100_000
"""Transient periods of a motion that has not reached its orbit within TRANSIENT."""

CLOSE = "a decision within rounding error"
SLOW = "slow to settle: the pixel agrees after a longer transient"
COEXISTING = "another motion coexists: a motion that starts on a listed orbit remains on it"
UNEXPLAINED = "unexplained"

REASONS = (CLOSE, SLOW, COEXISTING, UNEXPLAINED)


@dataclass(frozen=True)
class Disagreement:
    """A pixel that disagrees with the list: A, B, the period of its motion (not positive without a period), the periods
    of the stable orbits of the list, and the reason."""

    A: float
    B: float
    period: int
    listed: tuple[int, ...]
    reason: str


@dataclass(frozen=True)
class Agreement:
    """Numbers of pixels: in the map (`pixels`), far from every curve, judged, and in agreement with an orbit of the
    list (`shown`). `wrong` contains the pixels that disagree."""

    pixels: int
    far: int
    judged: int
    shown: int
    wrong: tuple[Disagreement, ...]

    @property
    def share(self) -> float:
        """Share of the judged pixels that agree, 0 to 1."""
        return 1.0 - len(self.wrong) / self.judged

    @property
    def reasons(self) -> dict[str, int]:
        """Numbers of disagreements by reason."""
        counted = Counter(d.reason for d in self.wrong)
        return {reason: counted[reason] for reason in REASONS if counted[reason]}


def compare_map(
    A: np.ndarray,
    B: np.ndarray,
    curves: Sequence[Curve],
    max_period: int = 3,
    *,
    sample: int | None = None,
    seed: int = 18,
) -> Agreement:
    """Compare the pixels of a map over the axes A and B (ascending, evenly spaced, B > 0) with the list of orbits.

    `curves` are the bifurcations of orbits of up to `max_period` periods. By default all pixels far from the curves are
    judged; otherwise a random sample of `sample` pixels, selected with `seed`.
    """
    swept = vd.sweep(A=A, B=B, transient=TRANSIENT, periods=PERIODS, record="summary")
    far = np.argwhere(~near_curves(A, B, curves))
    judged = far
    if sample is not None and sample < len(far):
        judged = far[np.sort(np.random.default_rng(seed).choice(len(far), sample, replace=False))]
    shown, wrong = 0, []
    for i, j in judged:
        stable = stable_orbits(A[i], B[j], max_period)
        pixel = {name: getattr(swept, name)[i, j] for name in ("status", *COMPARED)}
        if not agrees(pixel, stable, max_period):
            listed = tuple(orbit.period for orbit in stable)
            reason = _reason(A[i], B[j], pixel, stable, max_period)
            wrong.append(Disagreement(float(A[i]), float(B[j]), int(pixel["period"]), listed, reason))
        else:
            shown += len(stable) > 0
    return Agreement(swept.status.size, len(far), len(judged), shown, tuple(wrong))


def near_curves(A: np.ndarray, B: np.ndarray, curves: Sequence[Curve]) -> np.ndarray:
    """Return True for each pixel within one pixel of a curve: bool (A, B)."""
    near = np.zeros((len(A), len(B)), dtype=bool)
    steps = np.array([A[1] - A[0], B[1] - B[0]])
    square = np.stack(np.meshgrid(range(-2, 3), range(-2, 3), indexing="ij"), axis=-1).reshape(-1, 2)
    for curve in curves:
        points = (np.column_stack([curve.A, curve.B]) - (A[0], B[0])) / steps  # in pixels
        way = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
        dense = np.linspace(0.0, way[-1], 2 + int(way[-1] / ON))
        points = np.stack([np.interp(dense, way, points[:, k]) for k in (0, 1)], axis=-1)
        pixels = np.rint(points).astype(int)[:, None, :] + square
        within = np.hypot(*np.moveaxis(pixels - points[:, None, :], -1, 0)) <= 1.0 + ON
        inside = ((pixels >= 0) & (pixels < near.shape)).all(axis=-1)
        near[tuple(pixels[within & inside].T)] = True
    return near


def stable_orbits(A: float, B: float, max_period: int) -> list[Orbit]:
    """Return the stable orbits of the list."""
    return [
        orbit for orbit in orbits_of(ImpactMap(float(A), float(B)), max_period) if orbit.kind in (STABLE, SUPERSTABLE)
    ]


def agrees(pixel: dict[str, Any], stable: Sequence[Orbit], max_period: int) -> bool:
    """Return True if a motion is one of the stable orbits. If there is no stable orbit, return True if the motion has
    no period up to `max_period`, or if the mass never leaves the obstacle."""
    period = 0 if pixel["status"] == vd.Status.NEVER_LEAVES else int(pixel["period"])
    if not stable:
        return not 1 <= period <= max_period
    return any(
        period == orbit.period
        and round(pixel["impacts"] * period) == orbit.impacts
        and math.isclose(pixel["impact_speed_max"], orbit.speeds.max(), rel_tol=SAME_SPEED)
        for orbit in stable
    )


def _reason(A: float, B: float, pixel: dict[str, Any], stable: Sequence[Orbit], max_period: int) -> str:
    """Return the reason for the disagreement of a pixel."""
    if pixel["status"] == vd.Status.TOO_CLOSE:
        return CLOSE

    def settled(**more: Any) -> dict[str, Any]:
        found = vd.sweep(A=[float(A)], B=float(B), periods=PERIODS, record="summary", threads=1, **more)
        return {name: getattr(found, name)[0] for name in ("status", *COMPARED)}

    if agrees(settled(transient=PATIENCE), stable, max_period):
        return SLOW
    # after an impact the mass is at rest at the obstacle, so the orbit can be started at the phase of any impact
    starts = [float(orbit.phases[0]) for orbit in stable]
    if any(agrees(settled(transient=0, tau0=start), stable, max_period) for start in starts):
        return COEXISTING
    return UNEXPLAINED


def table(found: Agreement, most: int = 20) -> list[str]:
    """Return Markdown: the counts, the disagreements by reason, and the first disagreements."""
    lines = [
        "| | pixels |",
        "|---|---|",
        f"| of the map | {found.pixels} |",
        f"| further than one pixel from every curve | {found.far} |",
        f"| of these pixels, judged | {found.judged} |",
        f"| agree | {found.judged - len(found.wrong)} ({100 * found.share:.3f} %) |",
        f"| agree, and show an orbit of the list | {found.shown} |",
        *(f"| {reason} | {count} |" for reason, count in found.reasons.items()),
    ]
    if found.wrong:
        lines += ["", "| A | B | period of the pixel | of the list | reason |", "|---|---|---|---|---|"]
        for d in found.wrong[:most]:
            listed = ", ".join(map(str, d.listed)) or "none"
            lines.append(f"| {d.A:.6f} | {d.B:.6f} | {d.period if d.period > 0 else 'none'} | {listed} | {d.reason} |")
    if len(found.wrong) > most:
        lines += ["", f"The first {most} of {len(found.wrong)}."]
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--docs", type=Path, default=ROOT / "docs", help="folder to write to")
    parser.add_argument("--curves", type=Path, help="file of curves over the ranges of the map")
    parser.add_argument("--sample", type=int, default=5000, help="number of pixels to judge")
    options = parser.parse_args()
    plan = read(ROOT / "configs" / "map_AB.toml").plan()
    A, B = plan.axes["A"], plan.axes["B"][1:]
    ranges = [(float(v[0]), float(v[-1])) for v in (plan.axes["A"], plan.axes["B"])]
    found = vd.load(options.curves, kind="curves").curves if options.curves else vd.curves(*ranges, MAX_PERIOD)
    agreement = compare_map(A, B, found, MAX_PERIOD, sample=options.sample)
    page = PAGE.format(
        sample=options.sample,
        num_A=len(A),
        num_B=len(B),
        max_period=MAX_PERIOD,
        table="\n".join(table(agreement)),
        patience=PATIENCE,
        transient=TRANSIENT,
        periods=PERIODS,
        verdict="99.9 % or more agree." if agreement.share >= 0.999 else "Fewer than 99.9 % agree.",
    )
    (options.docs / "map_agreement.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
