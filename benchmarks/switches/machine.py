"""Turn a function that finds a first zero into answers for levels 1 to 3. Python's standard library suffices.

    python machine.py                        # the example `scan` below writes answers.json
    python machine.py mymodule:first_zero -o answers.json
    python score.py answers.json --brief

Your function first_zero(g, low, high) returns the first zero of g after `low`, up to `high`, or None. g is a function
of one number. It is positive just after `low`; at `low` it is positive or, after a start at rest, 0.
"""

import argparse
import importlib
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

UP, DOWN, STICK, REST, IMPACT = "UP", "DOWN", "STICK", "REST", "IMPACT"
MOST = 200_000  # largest number of events of a motion
FirstZero = Callable[[Callable[[float], float], float, float], float | None]


def scan(g: Callable[[float], float], low: float, high: float, step: float = 0.01) -> float | None:
    """Return the first zero of g by a grid and bisection. It misses two zeros in a step."""
    k, before = 0, low
    while before < high:
        k += 1
        after = min(low + k * step, high)
        if g(after) <= 0.0:
            while before < (middle := 0.5 * (before + after)) < after:
                before, after = (middle, after) if g(middle) > 0.0 else (before, middle)
            return after
        before = after
    return None


def events(x: dict[str, float], first_zero: FirstZero, periods: float, most: int = MOST) -> list[list[Any]]:
    """Return the events [τ, state before, state after] of a motion of levels 1 to 3."""
    A, B, eta = x["A"], x["B"], x["eta"]
    fast = A * x["eps"] * eta
    tau, xi, dxi = x["tau0"], x["xi0"], x["dxi0"]
    end = tau + 2.0 * math.pi * periods

    def h(t: float) -> float:
        return A * math.sin(t) - B + (fast * eta * math.sin(eta * t) if fast else 0.0)

    def at_rest(state: str, t: float) -> str:
        if h(t) > 1.0:
            return UP
        if state == IMPACT:
            return REST
        return DOWN if h(t) < -1.0 else STICK

    state = UP if dxi > 0.0 else DOWN if dxi < 0.0 else at_rest(IMPACT if xi <= 0.0 else STICK, tau)
    found: list[list[Any]] = []
    while len(found) < most:
        when: float | None
        if state in (UP, DOWN):
            s, t0, x0, v0 = (1.0 if state == UP else -1.0), tau, xi, dxi

            def velocity(t: float, s: float = s, t0: float = t0, v0: float = v0) -> float:
                v = v0 - (B + s) * (t - t0) - A * (math.cos(t) - math.cos(t0))
                return v - (fast * (math.cos(eta * t) - math.cos(eta * t0)) if fast else 0.0)

            def gap(t: float, s: float = s, t0: float = t0, x0: float = x0, v0: float = v0) -> float:
                base = v0 + A * math.cos(t0) + fast * math.cos(eta * t0)
                x = x0 + (base - 0.5 * (B + s) * (t - t0)) * (t - t0) - A * (math.sin(t) - math.sin(t0))
                return x - (fast / eta * (math.sin(eta * t) - math.sin(eta * t0)) if fast else 0.0)

            when = first_zero(lambda t, s=s, v=velocity: s * v(t), tau, end)  # type: ignore[misc]
            until = end if when is None else when
            # while the mass slides down ξ falls, so it lands before the slide ends if ξ is not positive then
            if lands := state == DOWN and gap(until) <= 0.0:
                when = first_zero(gap, tau, until)
            after = "" if when is None else IMPACT if lands else at_rest(state, when)
            xi = 0.0 if lands or when is None else gap(when)
        elif state == IMPACT:
            when, after = tau, at_rest(IMPACT, tau)
        else:
            rises = first_zero(lambda t: 1.0 - h(t), tau, end)
            falls = first_zero(lambda t: 1.0 + h(t), tau, end) if state == STICK else None
            when = min((t for t in (rises, falls) if t is not None), default=None)
            after = UP if when == rises else DOWN
        if when is None:
            break
        found.append([when, state, after])
        state, tau, dxi = after, when, 0.0
    return found


def answer(case: dict[str, Any], first_zero: FirstZero) -> dict[str, Any]:
    """Return the answer to a case. At level 1 only the first event is computed."""
    x = {name: float.fromhex(value) for name, value in case["inputs_hex"].items()}
    if case["level"] == 1:
        return {"events": events(x, first_zero, 1.0, 1) or events(x, first_zero, x["periods"], 1)}
    return {"events": events(x, first_zero, x["periods"])}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("function", nargs="?", default="machine:scan", help="module:function (machine:scan)")
    parser.add_argument("-o", "--output", type=Path, default=Path("answers.json"), help="the answers file")
    parser.add_argument("--levels", nargs="+", type=int, choices=(1, 2, 3), default=[1, 2, 3])
    parser.error = lambda message: parser.exit(2, f"machine.py: {message}\n")  # type: ignore[method-assign]
    options = parser.parse_args()
    module, _, name = options.function.partition(":")
    try:
        first_zero = getattr(importlib.import_module(module), name)
        options.output.touch()
    except (ImportError, AttributeError, TypeError, ValueError, OSError) as error:
        parser.error(str(error))
    paths = sorted(Path(__file__).parent.glob(f"cases/level[{''.join(map(str, options.levels))}]/*"))
    answers = {p.stem: answer(json.loads(p.read_text(encoding="utf-8")), first_zero) for p in paths}
    sent = {"solver": options.function, "version": "", "settings": "", "answers": answers}
    options.output.write_text(json.dumps(sent) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
