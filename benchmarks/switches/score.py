"""Score answers to the set of switches: pass rates for each level and family, from the files in `cases`."""

import argparse
import json
import sys
from collections import Counter
from decimal import Decimal, InvalidOperation
from itertools import pairwise
from pathlib import Path
from statistics import median
from xml.etree import ElementTree

FORM = """\
The form of an answers file (JSON):

  {"solver": "name", "version": "1.2", "settings": "rtol 1e-10",
   "answers": {"L0-plain-01": {"zeros": [1.25, 3.5]},
               "L2-paper-01": {"events": [[0.3677, "REST", "UP"], [3.81, "UP", "DOWN"], …]}},
   "seconds": {"L0-plain-01": 0.002}}

zeros    level 0: the zeros in (0, T], in order; [] says that there is none
events   levels 1 to 3: [tau, state before, state after] in order; the states are UP DOWN STICK REST IMPACT; an impact
         is two events of one tau: DOWN to IMPACT, IMPACT to UP or REST
numbers  JSON numbers, or strings if a double has too few digits
seconds  may be left out

A case counts as refused if its answer is left out, is null, or has another form.

  right        level 0: the first zero, or that there is none; level 1: the first event; levels 2, 3: all events
  missed       the first difference: a true zero is not there, or comes later
  invented     the first difference: a zero that does not exist
  wrong event  the first difference: the right time, the wrong states

A true zero is found if the answer is within min(1e-6, a third of the distance to the nearest other true zero; at level
0 also to the start of the search). At levels 0 and 1, an answer to a case with the verdict `either` is right if it is
one of the `answers` of the case. At levels 2 and 3, only events up to `certain_until` are judged. "all zeros": share of
the cases of level 0 with every zero right. Digits: -log10 of the largest relative error of a right answer, up to 30."""

VERDICTS = ("right", "missed", "invented", "wrong event", "refused")
COLUMNS = ("level", "family", "cases", *VERDICTS, "pass %", "all zeros %", "digits, median", "least", "seconds")
WIDTHS = (5, 22, *[max(6, len(name)) for name in COLUMNS[2:]])


def number(value: object) -> Decimal:
    """Return a value of an answer as an exact number. Raises ValueError if it is not a finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float | str | Decimal):
        raise ValueError(f"{value!r} is no number")
    try:
        exact = Decimal(value)
    except InvalidOperation:
        raise ValueError(f"{value!r} is no number") from None
    if not exact.is_finite() or exact.adjusted() > 400:
        raise ValueError(f"{value!r} is not finite")
    return exact


def tolerance(distance: Decimal | None) -> Decimal:
    """Return the largest error of a right answer, from the distance of the true zero to the nearest other one."""
    widest = Decimal("1e-6")
    return widest if distance is None else min(widest, distance / 3)


def true_zeros(zeros: list[str]) -> list[tuple[Decimal, Decimal, None]]:
    """Return (zero, tolerance, None) for the zeros of a case of level 0, which have no states."""
    at = [Decimal(0), *map(Decimal, zeros)]
    gaps = [b - a for a, b in pairwise(at)]
    return [(z, tolerance(min(gaps[i : i + 2])), None) for i, z in enumerate(at[1:])]


def true_events(events: list[dict]) -> list[tuple[Decimal, Decimal, tuple[str, str]]]:
    """Return (τ, tolerance, states) for the events of a case of levels 1 to 3."""
    near = [e["nearest_other_zero"] and Decimal(e["nearest_other_zero"]) for e in events]
    return [(Decimal(e["tau"]), tolerance(n), (e["before"], e["after"])) for e, n in zip(events, near, strict=True)]


def compare(true: list[tuple], given: list[tuple]) -> tuple[str, float | None]:
    """Return (verdict, digits) of the answer `given`. The first difference decides; only a right one has digits."""
    digits = []
    for (at, within, states), (tau, said) in zip(true, given, strict=False):
        error = abs(tau - at)
        if error > within:
            return ("invented" if tau < at else "missed"), None
        if said != states:
            return "wrong event", None
        digits.append(30.0 if not error else min(30.0, -float((error / (abs(at) or 1)).log10())))
    if len(given) != len(true):
        return ("missed" if len(given) < len(true) else "invented"), None
    return "right", min(digits, default=None)


def read_answer(case: dict, answer: object) -> list[tuple]:
    """Return the judged part of an answer as pairs (τ, states). Raises ValueError if its form is wrong."""
    level = case["level"]
    key = "events" if level else "zeros"
    if not isinstance(answer, dict) or not isinstance(answer.get(key), list):
        raise ValueError(f"no {key}")
    if not level:
        end = Decimal(float.fromhex(case["inputs_hex"]["T"]))
        return [(z, None) for z in map(number, answer["zeros"]) if z <= end]
    if any(not isinstance(e, list) or len(e) != 3 for e in answer["events"]):
        raise ValueError("an event is [tau, before, after]")
    events = [(number(tau), (before, after)) for tau, before, after in answer["events"]]
    if level == 1:
        return events[:1]
    return [e for e in events if e[0] <= Decimal(case["certain_until"])]


def judge(case: dict, answer: object) -> dict:
    """Return the verdict on one answer, its digits, and at level 0 True if all zeros are right."""
    try:
        given = read_answer(case, answer)
    except ValueError as error:
        return {"verdict": "refused", "digits": None, "all": False, "note": str(error)}
    level, exact = case["level"], case["events" if case["level"] else "zeros"]
    results, whole = [], False
    for alternative in case.get("answers", [exact]) if level < 2 else [exact]:
        true: list[tuple] = [*true_events(alternative)] if level else [*true_zeros(alternative)]
        if level == 0:
            whole = whole or compare(true, given)[0] == "right"
            results.append(compare(true[:1], given[:1]))
        else:
            until = Decimal(case["certain_until"])
            results.append(compare(true if level == 1 else [e for e in true if e[0] <= until], given))
    verdict, digits = next((r for r in results if r[0] == "right"), results[0])
    return {"verdict": verdict, "digits": digits, "all": whole, "note": ""}


def rows(cases: list[dict], results: dict[str, dict], seconds: dict) -> list[tuple[str, ...]]:
    """Return the table: a row for each level, followed by a row for each of its families."""
    groups: dict[tuple[int, str], list[str]] = {}
    for case in cases:
        for family in ("", case["family"]):
            groups.setdefault((case["level"], family), []).append(case["id"])
    table = []
    for (level, family), ids in sorted(groups.items()):
        counts = Counter(results[i]["verdict"] for i in ids)
        digits = [results[i]["digits"] for i in ids if results[i]["digits"] is not None]
        spent = [seconds[i] for i in ids if i in seconds]
        share = f"{100 * sum(results[i]['all'] for i in ids) / len(ids):.1f}" if level == 0 else ""
        least = (f"{median(digits):.1f}", f"{min(digits):.1f}") if digits else ("", "")
        rate = f"{100 * counts['right'] / len(ids):.1f}"
        verdicts = [str(counts[v]) for v in VERDICTS]
        time = f"{sum(spent):.3g}" if spent else ""
        table.append((str(level), family or "all", str(len(ids)), *verdicts, rate, share, *least, time))
    return table


def write_junit(path: Path, cases: list[dict], results: dict[str, dict], seconds: dict) -> None:
    """Write JUnit XML with one test for each case. A wrong answer is a failure, a refused case is skipped."""
    counts = Counter(r["verdict"] for r in results.values())
    failed = len(cases) - counts["right"] - counts["refused"]
    totals = {"tests": str(len(cases)), "failures": str(failed), "skipped": str(counts["refused"])}
    suite = ElementTree.Element("testsuite", {"name": "switches", "errors": "0", **totals})
    for case in cases:
        verdict, time = results[case["id"]]["verdict"], str(seconds.get(case["id"], 0))
        group = f"level{case['level']}.{case['family']}"
        test = ElementTree.SubElement(suite, "testcase", name=case["id"], classname=group, time=time)
        if verdict != "right":
            ElementTree.SubElement(test, "skipped" if verdict == "refused" else "failure", message=verdict)
    ElementTree.ElementTree(suite).write(path, encoding="utf-8", xml_declaration=True)


def main() -> int:
    """Read the answers, judge them and print the table. Return 1 below --fail-under, and 2 if a file fails."""
    for stream in filter(None, (sys.stdout, sys.stderr)):
        stream.reconfigure(errors="backslashreplace")  # any terminal and locale shows the help and the messages
    parser = argparse.ArgumentParser(description=__doc__, epilog=FORM, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("answers", type=Path, help="the answers file")
    parser.add_argument("--cases", type=Path, default=Path(__file__).parent / "cases", help="the folder of the cases")
    parser.add_argument("--brief", action="store_true", help="print only the table, not each case")
    parser.add_argument("--junit", type=Path, metavar="FILE", help="also write the verdicts to this file as JUnit XML")
    levels = (0, 1, 2, 3)
    parser.add_argument("--levels", nargs="+", type=int, choices=levels, default=levels, help="judge only these levels")
    parser.error = lambda message: parser.exit(2, f"score.py: {message}\n")  # type: ignore[method-assign]
    help_under = "exit with 1 if less than this share of the judged cases is right"
    parser.add_argument("--fail-under", type=float, default=0.0, metavar="PERCENT", help=help_under)
    options, lines, what = parser.parse_args(), [], "not readable as answers"
    path = options.answers
    try:
        sent = json.loads(path.read_text(encoding="utf-8-sig"), parse_float=str, parse_int=str)  # see `number`
        answers = dict(sent["answers"])
        seconds = {i: float(number(s)) for i, s in (sent.get("seconds") or {}).items()}
        title = " ".join(str(sent.get(key, "")) for key in ("solver", "version", "settings"))
        if not title.isprintable():
            raise ValueError(f"{title!r} is no line of text")
        path, what = options.cases, "not readable as cases"
        cases = [json.loads(p.read_text(encoding="utf-8")) for p in sorted(path.glob("*/*.json"))]
        known = {case["id"] for case in cases}
        cases = [case for case in cases if case["level"] in options.levels]
        if not cases:
            raise ValueError("there are none")
        results = {case["id"]: judge(case, answers.get(case["id"])) for case in cases}
        for name, r in () if options.brief else results.items():
            digits = "" if r["digits"] is None else format(r["digits"], "5.1f")
            lines.append(f"{name:28} {r['verdict']:12} {digits}".rstrip())
        lines.append(title)
        for row in [COLUMNS, *rows(cases, results, seconds)]:
            padded = zip(row, WIDTHS, "<<" + ">" * len(row), strict=False)
            lines.append("  ".join(f"{x:{side}{w}}" for x, w, side in padded))
        if unknown := len(answers.keys() - known):
            lines.append(f"{unknown} answers have an id that no case has, and were not read")
        path, what = options.junit, "not written"
        if path:
            write_junit(path, cases, results, seconds)
        path = "stdout"
        print(*lines, sep="\n", flush=True)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        sys.stdout = None  # Python would try again to write what could not be written
        if not isinstance(error, BrokenPipeError):  # the reader of the output has read enough
            print(f"{path}: {what}: {type(error).__name__}: {error}", file=sys.stderr)
        return 2
    right = sum(r["verdict"] == "right" for r in results.values())
    return 1 if 100.0 * right / len(results) < options.fail_under else 0


if __name__ == "__main__":
    sys.exit(main())
