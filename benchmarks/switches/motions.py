"""Events of a motion with many digits, and the distance of each event to the nearest other zero."""

from typing import Any, NamedTuple

from benchmarks.switches.zeros import Function
from tests.exact import reference as digits50
from tests.exact.reference import DOWN, IMPACT, REST, STICK, UP, Oscillator, Switch, mp, reference

STATES = ("UP", "DOWN", "STICK", "REST", "IMPACT")
NAMES = ("A", "B", "eps", "eta", "xi0", "dxi0", "tau0", "periods")
DIGITS = 80  # decimal digits in a motion: rounding errors grow over 200 periods, and 30 digits remain correct
NEAR = 60  # decimal digits in the search near an event, sufficient to recognise the zero of the event itself

Inputs = dict[str, float]


class Event(NamedTuple):
    """A switch and its neighbourhood.

    dxi : ξ' just before an impact, 0 at all other switches
    slope : slope at the switch of the function whose zero ends the state (it is positive before the switch); None at
        the end of an impact
    nearest_other_zero : distance to the nearest other zero, None if it is more than a period away
    """

    tau: Any
    before: str
    after: str
    xi: Any
    dxi: Any
    slope: Any
    nearest_other_zero: Any


def inputs(**given: float) -> Inputs:
    """Return all inputs in their order. Defaults: the paper's eta, B = 0.1, periods = 20, and 0 for the others."""
    usual = {"B": 0.1, "eta": 10 * float(mp.sqrt(102)), "periods": 20.0}
    return {name: float(given.get(name, usual.get(name, 0.0))) for name in NAMES}


def functions(model: Oscillator, s: Switch) -> list[Function]:
    """Return the functions whose zeros could end the state before the switch s.

    They are functions of h = τ - τ_s. For h > 0, up to one period, they describe the motion as if the state did not end
    at s.
    """
    waves, B, span = model.waves(s.tau), model.B, 2 * mp.pi
    if s.before in (STICK, REST):
        up = Function((1 + B, 0, 0), [(-a, w, angle) for a, w, angle in waves], span)
        down = Function((1 - B, 0, 0), waves, span)
        return [up, down] if s.before == STICK else [up]
    pull = B + (1 if s.before == UP else -1)
    c = s.dxi + sum(a / w * mp.cos(angle) for a, w, angle in waves)
    d = s.xi + sum(a / w**2 * mp.sin(angle) for a, w, angle in waves)
    speed = Function((c, -pull, 0), [(-a / w, w, angle + mp.pi / 2) for a, w, angle in waves], span)
    gap = Function((d, c, -pull / 2), [(-a / w**2, w, angle) for a, w, angle in waves], span)
    return [speed] if s.before == UP else [speed, gap]


def slope(model: Oscillator, s: Switch) -> Any:
    """Return the slope of the function that is zero at the switch s; None at the end of an impact."""
    if s.before == IMPACT:
        return None
    if s.after == IMPACT:
        return s.dxi
    if s.before in (UP, DOWN):
        return s.H - 1 if s.before == UP else -s.H - 1
    rate = sum(a * w * mp.cos(angle) for a, w, angle in model.waves(s.tau))
    return rate if s.after == DOWN else -rate


def nearest(model: Oscillator, s: Switch, others: list[Any]) -> Any:
    """Return the distance from the switch s to the nearest other zero, or None if no zero is within a period.

    This zero is another event (`others` are times of events near s), or the next zero of a function that could end the
    state if the state continued.
    """
    distance = min([2 * mp.pi, *(abs(s.tau - tau) for tau in others)])
    for g in functions(model, s):
        g.end = distance
        distance = min([distance, *(z.at for z in g.zeros(1))])
    return None if distance == 2 * mp.pi else distance


def solve(x: Inputs, most: int | None = None) -> list[Event]:
    """Return the events of a motion in order, all or the first `most`. States are names."""
    values = {name: x[name] for name in NAMES[:-1]}
    with digits50.with_digits(DIGITS):
        switches = reference(**values, periods=int(x["periods"]), max_switches=most).switches[:most]
    model = Oscillator(x["A"], x["B"], x["eps"], x["eta"])
    slopes = [slope(model, s) for s in switches]
    times = [s.tau for s in switches]
    if not x["dxi0"]:
        times.insert(0, mp.mpf(x["tau0"]))  # a slide from rest begins with a zero of ξ'
    events: list[Event] = []
    with mp.workdps(NEAR):
        for i, s in enumerate(switches):
            if s.before == IMPACT:
                near = events[-1].nearest_other_zero
            else:
                at = i + len(times) - len(switches)
                around = [tau for tau in times[max(0, at - 2) : at + 3] if tau != s.tau]
                near = nearest(model, s, around)
            events.append(Event(s.tau, STATES[s.before], STATES[s.after], s.xi, s.dxi, slopes[i], near))
    return events
