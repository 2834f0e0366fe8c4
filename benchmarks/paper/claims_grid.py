"""Claims about numerical disturbances (§5 of the paper)."""

import itertools
from collections import Counter
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.paper.claim import Outcome, claim, kept, listed, when
from benchmarks.paper.grids import convergents, returning
from benchmarks.paper.limits import KINDS, band_of_motions
from benchmarks.paper.motions import (
    LAGS,
    LONG,
    NotApplicable,
    Paper,
    find_phase_slip,
    kept_by_period,
    landings,
    low_and_high,
    order_and_gaps,
    shares,
    structures,
    widths,
    without_grid,
)
from benchmarks.paper.orbit_curve import curve_distance, orbit_curve
from benchmarks.paper.unique_motion import unique_limit as band_of_one_motion
from vibrodrive.stability.main_impacts import impact_gaps
from vibrodrive.stability.structure import compare_structure, deviation, order, period


@claim("fig08", "At A = 1.5 the constant step Δτ = 0.5 does not change the structure of the orbit.")
def step_kept(paper: Paper) -> Outcome:
    found, step = _structure(paper, "fig08", 0)
    text = f"at Δτ = {step:g}, over {LONG} periods, {_answers(found, 'impacts', 'word')}"
    return Outcome(
        text, {"dtau": step, "word": found.word, "impacts": found.impacts}, when(bool(found.impacts and found.word))
    )


@claim("fig08", "Fig. 8a can be compared with Fig. 5b: late switches make a band, as ε does.")
def band_beside_band(paper: Paper) -> Outcome:
    calm, physical = paper.motions("fig05")
    late = vd.simulate(**(paper.points("fig08")[0] | {"periods": len(physical.section)}))
    curve = orbit_curve(calm, paper.undisturbed("fig05").n)
    rows, numbers = [], {}
    for name, motion in (("ε", physical), ("Δτ", late)):
        xi, dxi = (float(w.mean()) for w in widths(motion))
        numbers[name] = {"xi": xi, "dxi": dxi, "rho": curve_distance(curve, motion)}
        rows.append(f"{xi:.2g} and {dxi:.2g} at {name} = {motion.arguments['eps' if name == 'ε' else 'dtau']:g}")
    ratio = {key: numbers["Δτ"][key] / numbers["ε"][key] for key in ("xi", "dxi", "rho")}
    text = (
        f"over {len(physical.section)} periods the mean widths of the band of ξ and of ξ' at one phase are "
        f"{', and '.join(rows)}, with ratios of {ratio['xi']:.2g} and {ratio['dxi']:.2g}; the largest distance of the "
        f"motion from the orbit as a curve is {numbers['ε']['rho']:.2g} under ε and {numbers['Δτ']['rho']:.2g} under Δτ"
    )
    near = [0.5 < r < 2.0 for r in ratio.values()]
    return Outcome(text, numbers | {"ratio": ratio}, when(all(near), any(near)))


@claim("fig08", "Δτ = 0.7 is beyond the limit and destroys the structure.")
def step_lost(paper: Paper) -> Outcome:
    found, step = _structure(paper, "fig08", 1)
    arguments = paper.points("fig08", 2)[1]
    k = vd.limit(arguments["A"], "dtau", "fixed", "word", B=arguments["B"])
    text = f"at Δτ = {step:g}, over {LONG} periods, {_answers(found, 'impacts', 'word')}"
    text += f"; the least step that changes it is {k.k2:.4g}"
    return Outcome(text, {"dtau": step, "word": found.word, "k2_word": k.k2}, when(not (found.impacts and found.word)))


@claim("fig08", "Beyond the limit (Δτ = 0.7) the solution has a multiple of the excitation period as its period.")
def step_multiple(paper: Paper) -> Outcome:
    arguments = paper.points("fig08", 2)[1]
    motion = vd.simulate(**(arguments | {"periods": LONG, "section_phase": np.pi / 2}))
    distance = returning(motion.section, LAGS)
    m = int(distance.argmin()) + 1
    near = [c for c in convergents(arguments["dtau"], LAGS) if c.periods == m]
    text = f"over {LONG} periods the motion nearly repeats after {m}, with a difference of {distance.min():.2g}"
    text += f"; {near[0].steps}·Δτ differs from {m}·2π by {near[0].miss:+.2g}" if near else ""
    exact = int(period(motion.section)) > 1
    return Outcome(text, {"m": m, "distance": distance.min()}, when(exact, m > 1 and distance.min() < 0.05))


@claim("fig09", "Small numerical disturbances act like physical ones: the section points spread, the structure stays.")
def similar(paper: Paper) -> Outcome:
    motions = paper.motions("fig09")
    base = paper.undisturbed("fig09")
    found = compare_structure(base, motions[0])
    text = f"at Δτ = {motions[0].arguments['dtau']:g} {_answers(found)}, and ρ = {found.rho:.2g}"
    return Outcome(text, {"rho": found.rho}, when(bool(found.impacts and found.order) and found.rho > 0))


@claim("fig09", "The case “Δτ = 0.5” is close to the limit: the structure is kept with an extreme deviation.")
def near_limit(paper: Paper) -> Outcome:
    arguments = paper.points("fig09", 2)[1]
    base = paper.undisturbed("fig09")
    drawn = compare_structure(base, vd.simulate(**arguments))
    printed = compare_structure(base, vd.simulate(**(arguments | {"dtau": PRINTED})))
    point = {name: arguments[name] for name in ("A", "B", "transient", "periods", "section_phase")}
    k = vd.limit(**point, disturbance="dtau")
    seen = band_of_motions("dtau", order_and_gaps(base), **point, method="fixed")
    still = [step for step, answer in k.kept_at.items() if answer and step > k.half_kept]
    text = (
        f"at the step {PRINTED:g}, which is printed, {_answers(printed)}; at {arguments['dtau']:g}, with a zero "
        f"more, {_answers(drawn)}, with ρ = {drawn.rho:.2g}; the impacts are first lost at Δτ = "
        f"{k.k2:.3g}, kept at less than half of the steps around from {k.half_kept:.3g} on, and still kept at "
        f"{listed(still)}; the order at the section is first lost at {seen.lost:.3g} and kept at less than half from "
        f"{seen.half_kept:.3g} on"
    )
    numbers = {"k2": k.k2, "half_kept": k.half_kept, "still_kept": still, "rho": drawn.rho}
    numbers |= {"k2_at_section": seen.lost, "half_kept_at_section": seen.half_kept}
    same = [bool(f.impacts) for f in (printed, drawn)]
    return Outcome(text, numbers | {"kept_printed": same[0], "kept_drawn": same[1]}, when(*same))


PRINTED = 0.5
"""Step of Fig. 9b as printed in the paper."""


@claim("fig09", "Large numerical disturbances make the motion irregular: a cloud of points.")
def cloud(paper: Paper) -> Outcome:
    motion = paper.motions("fig09")[-1]
    found = compare_structure(paper.undisturbed("fig09"), motion)
    n = period(motion.section)
    distinct = len(np.unique(np.round(motion.section, 9), axis=0))
    m = int(returning(motion.section, LAGS).argmin()) + 1
    back = returning(motion.section, LAGS).min()
    text = (
        f"at Δτ = {motion.arguments['dtau']:g} {_answers(found)}; there are {distinct} distinct points in "
        f"{len(motion.section)} periods, but the motion nearly repeats after {m} periods, with a difference of "
        f"{back:.2g}"
    )
    lost = n == 0 and not found.impacts
    return Outcome(
        text, {"distinct": distinct, "returns_after": m, "returns_to": back}, when(lost and back > 0.1, lost)
    )


@claim("fig09", "Large numerical disturbances make the motion irregular, large physical ones give it other periods.")
def reactions(paper: Paper) -> Outcome:
    back = []
    for motion in (paper.motions("fig06")[-1], paper.motions("fig09")[-1]):
        distance = returning(motion.section, LAGS)
        back.append((int(distance.argmin()) + 1, float(distance.min())))
    (m_eps, d_eps), (m_dtau, d_dtau) = back
    text = (
        f"at the largest ε drawn the motion repeats after {m_eps} periods with a difference of {d_eps:.2g}, "
        f"and at the largest Δτ after {m_dtau} periods with a difference of {d_dtau:.2g}"
    )
    numbers = {"eps": [m_eps, d_eps], "dtau": [m_dtau, d_dtau]}
    return Outcome(text, numbers, when(d_eps < 0.05 and d_dtau > 0.1, d_eps < 0.05))


AROUND_STEP = np.linspace(0.8, 1.25, 10)  # steps around that of Fig. 10, divided by it


@claim("fig10", "Δτ = 0.1 is large but not yet critical; its diagram shows that both kinds of disturbance act alike.")
def not_yet_critical(paper: Paper) -> Outcome:
    results = paper.results("fig10")
    same: dict[str, Any] = {name: results.scalars[name] for name in ("B", "section_phase")}
    s = results.settings
    exact = vd.sweep(A=results.axes["A"], **same, transient=s.transient, periods=s.periods)
    n = period(exact.section)
    seen = float(np.mean([order(exact.section[k, -m:], results.section[k]) for k, m in enumerate(n) if m > 0]))
    step, drawn = results.scalars["dtau"], paper.points("fig09", 2)[1]["dtau"]
    landed = structures(paper, "fig10")
    around = [
        np.mean([bool(f.impacts) for f in structures(paper, "fig10", dtau=step * factor)]) for factor in AROUND_STEP
    ]
    by_period = kept_by_period((f.n, f.impacts) for f in landed)
    share, low = float(np.mean([bool(f.impacts) for f in landed])), low_and_high(by_period)[0]
    text = (
        f"at Δτ = {step:g} the impacts are kept at {100 * share:.0f} % of {len(landed)} values of A; at "
        f"{len(around)} steps from {step * AROUND_STEP[0]:.3g} to {step * AROUND_STEP[-1]:.3g} this share is between "
        f"{100 * min(around):.0f} % and {100 * max(around):.0f} %, with the median {100 * np.median(around):.0f} %; at "
        f"Δτ = {step:g} they are kept at {100 * low:.0f} % of the values with a period up to 3 ({shares(by_period)}); "
        f"the order at the drawn section is kept at {100 * seen:.0f} % of all values; this step is "
        f"{step / PRINTED:.2g} times the one printed at Fig. 9b, and {step / drawn:.2g} times that with a zero more"
    )
    numbers: dict[str, Any] = {"share_kept": share, "share_kept_low_order": low, "share_kept_at_section": seen}
    numbers |= {"dtau_around": step * AROUND_STEP, "share_kept_around": around}
    return Outcome(text, numbers, when(np.median(around) > 0.5, max(around) > 0.5))


@claim("fig11", "With Δτ = 0.1 all starts end in one and the same motion: the solution has become unique.")
def unique(paper: Paper) -> Outcome:
    motions = paper.motions("fig11")
    if len(motions) < 2:
        raise NotApplicable("this claim needs several starts")
    same = [bool(np.array_equal(m.section, motions[0].section)) for m in motions]
    base = paper.undisturbed("fig11")
    exact = [vd.simulate(**without_grid(a)) for a in paper.points("fig11")]
    shifts = [int(deviation(base.points, m.section)[1]) for m in exact]
    text = (
        f"{sum(same)} of {len(same)} starts give the same section, bit for bit; without the grid the starts lead to "
        f"{len(set(shifts))} solutions"
    )
    return Outcome(text, {"same": same, "exact_shifts": shifts}, when(all(same) and len(set(shifts)) > 1))


@claim("fig11", "Uniqueness has a limit in the size of the disturbance, as orbital stability has.")
def unique_limit(paper: Paper) -> Outcome:
    arguments = paper.points("fig11")[0]
    point = {name: arguments[name] for name in ("A", "B", "eta")}
    rows: list[str] = []
    numbers: dict[str, Any] = {}
    for symbol, kind in KINDS.items():
        one, k2 = band_of_one_motion(kind, **point), vd.limit(**point, disturbance=kind).k2
        numbers[kind] = {"ku": one.lost, "k2": k2, "last_several": one.last_kept, "share": one.share_kept}
        rows.append(
            f"k_u({symbol}) = {one.lost:.3g}, which is {one.lost / k2:.3g} k₂; several motions remain at "
            f"{100 * one.share_kept:.0f} % of the values between k_u and {one.last_kept:.3g}"
        )
    limits = [found["ku"] for found in numbers.values()]
    sharp = all(found["last_several"] <= found["ku"] for found in numbers.values())
    text = f"at A = {arguments['A']:g}, {'; '.join(rows)}"
    return Outcome(text, numbers, when(sharp and np.isfinite(limits).all(), bool(np.isfinite(limits).all())))


@claim("fig12", "The motion consists of a basic motion of 6×2π, in place of 2×2π.")
def basic_motion(paper: Paper) -> Outcome:
    motion, base = paper.motions("fig12")[0], paper.undisturbed("fig12")
    slip = find_phase_slip(motion, base)
    back = returning(motion.section, LAGS)
    text = (
        f"the motion differs from itself {slip.basic} periods later by {back[slip.basic - 1]:.2g}, and from itself "
        f"{base.n} periods later by {back[base.n - 1]:.2g}; its impacts are {slip.usual} periods apart"
    )
    return Outcome(text, {"basic": slip.basic, "gap": slip.usual, "n": base.n}, when(slip.basic == 6 and base.n == 2))


@claim("fig12", "With some regularity, a transient motion of exactly 2π separates two basic motions.")
def transient(paper: Paper) -> Outcome:
    motion, base = paper.motions("fig12")[0], paper.undisturbed("fig12")
    slip = find_phase_slip(motion, base)
    apart = impact_gaps(landings(motion, base))
    odd = np.flatnonzero(apart != slip.usual)
    added = sorted({int(apart[k]) - slip.usual for k in odd})
    between = Counter(int(np.sum(apart[a:b])) for a, b in itertools.pairwise(odd))
    recurs = between.most_common(1)[0][0] if between else 0
    text = (
        f"the impacts are {slip.usual} periods apart, with {len(odd)} exceptions of {listed(np.unique(apart[odd]))} "
        f"periods; {listed(added)} × 2π is inserted every {listed(sorted(between))} periods"
    )
    closes = [c.periods for c in convergents(motion.arguments["dtau"], 1000)]
    text += (
        f"; the grid nearly closes after {recurs} periods, because {recurs} is the numerator of a convergent of Δτ/2π"
        if recurs in closes
        else ""
    )
    return Outcome(text, {"inserted": added, "times": len(odd), "every": sorted(between)}, when(added == [1]))


@claim("grid", "The paper leaves open why 6×2π. After 6 periods the grid nearly closes: 377·0.1 ≈ 6·2π.")
def why_six(paper: Paper) -> Outcome:
    results = paper.results("grid")
    steps = results.axes["dtau"]
    closes = np.array([convergents(d, LAGS)[-1].periods for d in steps])
    returns = np.array([int(returning(s, LAGS).argmin()) + 1 for s in results.section])
    equal, multiple = float((closes == returns).mean()), float((returns % closes == 0).mean())
    step = paper.motions("fig12")[0].arguments["dtau"]
    here = convergents(step, LAGS)[-1]
    text = (
        f"at Δτ = {step:g}, {here.steps}·Δτ differs from {here.periods}·2π by {here.miss:+.2g}; at "
        f"{100 * equal:.0f} % of {len(steps)} values of Δτ the motion returns most closely after the same number of "
        f"periods as the grid, and at {100 * multiple:.0f} % after a multiple of this number (by chance this would be "
        f"{100 * float(np.mean(1 / closes)):.0f} %)"
    )
    numbers = {"equal": equal, "multiple": multiple, "chance": float(np.mean(1 / closes)), "q": here.periods}
    return Outcome(text, numbers, when(multiple > 0.8 and multiple > 3 * numbers["chance"], multiple > 0.5))


def _structure(paper: Paper, name: str, index: int) -> tuple[Any, float]:
    arguments = paper.points(name, index + 1)[index]
    motion = vd.simulate(**(arguments | {"periods": LONG}))
    return compare_structure(paper.undisturbed(name), motion), arguments["dtau"]


def _answers(found: Any, *asked: str) -> str:
    """Return a text with the properties that the motion keeps and the properties that it loses.

    `asked` contains names of attributes of Structure; by default they are "impacts" and "order".
    """
    named = {"order": "the order at the section is", "impacts": "the impacts are", "word": "the sequence of states is"}
    return " and ".join(f"{named[name]} {kept(getattr(found, name))}" for name in asked or ("impacts", "order"))
