"""Check the switching times of your own program: compare each switch with the certified switch from the same state.

    python -m examples.audit mine.csv --A 3.04            # in the root of a clone
    python -m examples.audit mine.csv --scene scene.toml  # a configuration, of which [physical] gives A, B and units

The first line of `mine.csv` has the names of the columns, separated by commas: tau, xi, dxi, state or, in s, m and m/s,
t_s, x_m, v_m_per_s, state, where t_ms, x_mm and v_mm_per_s are other units; lines that begin with # are left out. Each
further line has one switch. `state` is the state that begins at this switch: UP, DOWN, STICK or REST. `xi` and `dxi`
are ξ and ξ' at the beginning of this state; after an impact both are 0. A line with the state IMPACT is left out,
because an impact takes no time. A table of `vibrodrive trajectory` is read, too. Each line is judged separately: the
certified motion starts from the state of the previous line. So an error counts only at the line at which it occurs.
"""

import argparse
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

import vibrodrive as vd
from vibrodrive import State
from vibrodrive.model import config
from vibrodrive.model.described import counted
from vibrodrive.model.names import PARAMETERS
from vibrodrive.model.parameters import bad, bad_axes
from vibrodrive.model.physical import UNITS, column, measure
from vibrodrive.model.quantities import QUANTITIES
from vibrodrive.store.tables import numbered_rows

RIGHT, MISSED, OTHER = "right", "missed", "another state"
"""Verdicts: the right switch (possibly late or early); an earlier switch was missed; a different state begins or
ends."""

MODEL = ("A", "B", "eps", "eta")
IN_SI = {name: column(name, UNITS[QUANTITIES[name].scales].si) for name in ("tau", "xi", "dxi")}
"""Columns of a table: the names of dimensionless numbers, and of numbers in SI units."""
MILLI = {"tau": "t_ms", "xi": "x_mm", "dxi": "v_mm_per_s"}
COLUMNS = f"{', '.join(IN_SI)} or, with --scene, {', '.join([*IN_SI.values(), *MILLI.values()])}"

FEW, MANY = 5, 20.0
"""Switches that are too few to judge their units, and switches in a period, more than an undisturbed motion has. Each
wave of a disturbance adds up to four."""


@dataclass(frozen=True)
class Switch:
    """The beginning of a state: its time τ, and ξ and ξ' at this time (dimensionless)."""

    tau: float
    xi: float
    dxi: float
    state: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "state", _state("state", self.state))


@dataclass(frozen=True)
class Judged:
    """A switch, its verdict, and its delay (negative if the switch is too early, NaN if the verdict is not RIGHT)."""

    switch: Switch
    verdict: str
    late: float


def audit(switches: Sequence[Switch], A: float, B: float = 0.1, eps: float = 0.0, eta: float = vd.ETA) -> list[Judged]:
    """Judge every switch except the first, from the state that begins at the previous switch. Impacts are left out."""
    lasting = [switch for switch in switches if switch.state != State.IMPACT.name]
    return [_judge(a, b, {"A": A, "B": B, "eps": eps, "eta": eta}) for a, b in pairwise(lasting)]


def _judge(start: Switch, found: Switch, model: dict[str, float]) -> Judged:
    """Compare the switch `found` with the certified switch after `start`.

    The certified motion is computed beyond `found`.

    An error of `start` counts only at the line of `start`. If `start` is below the obstacle, or too early for its
    state, the certified motion starts at the obstacle and rests until this state begins.
    """
    periods = 2 + int((found.tau - start.tau) / (2.0 * np.pi))
    scene = {**model, "xi0": max(start.xi, 0.0), "dxi0": start.dxi, "tau0": start.tau}
    rows = vd.simulate(**scene, transient=0, periods=periods).switches
    if len(rows) and State(rows["before"][0]).name != start.state == State(rows["after"][0]).name:
        rows = rows[1:]
    if not len(rows) or State(rows["before"][0]).name != start.state:
        return Judged(found, OTHER, np.nan)
    rows = rows[rows["after"] != State.IMPACT]  # an impact is instantaneous: the next row is the switch
    times = 2.0 * np.pi * rows["period"] + rows["phase"]
    if len(rows) > 1 and times[1] <= found.tau:
        return Judged(found, MISSED, np.nan)
    if not len(rows) or State(rows["after"][0]).name != found.state:
        return Judged(found, OTHER, np.nan)
    return Judged(found, RIGHT, found.tau - times[0])


def read(path: str, scene: Mapping[str, float] | None = None) -> list[Switch]:
    """Read the switches of a file. Columns in SI units need `scene`, the quantities of a scene (`Scene.given`).

    Raises OSError, and ValueError with one sentence for a file that is not understood.
    """
    rows = numbered_rows(Path(path))
    there = {_spelled(name): name for _, row in rows[:1] for name in row}
    state, found = there.get("state", there.get("after")), {}
    for name in IN_SI:
        unit = measure(QUANTITIES[name], scene or {})
        milli = ((MILLI[name], 1e3 * unit.one),) if scene and unit.si != "1" else ()
        for wanted, one in ((column(name, unit.si), unit.one), *milli, (name, 1.0)):
            if own := there.get(_spelled(wanted)):
                found[name] = own, one
    if rows and (state is None or len(found) < len(IN_SI)):
        raise ValueError(f"{path}: {bad('columns', ', '.join(rows[0][1]), f'state, and {COLUMNS}')}")
    if len(rows) < 2:
        told = f"{counted(len(rows), 'switch', 'es')}: must be at least 2, below the names of the columns"
        raise ValueError(f"{path}: {told}")
    switches: list[Switch] = []
    for line, row in rows:
        name = _state(f"{path}: {state} in line {line}", row[state])
        tau, xi, dxi = (_number(f"{path}: {own} in line {line}", row[own]) / one for own, one in found.values())
        if switches and tau < switches[-1].tau:
            own = found["tau"][0]
            raise ValueError(f"{path}: {bad(f'{own} in line {line}', row[own], 'at least that of the line before')}")
        if "state" not in there:  # a table of `vibrodrive trajectory` has the velocity before the switch
            dxi = 0.0
        switches.append(Switch(tau, xi, dxi, name))
    return switches


def _spelled(name: str) -> str:
    """Return the name of a column with its unit in one spelling: v_m_per_s, v_m_s and "v [m/s]" are equal."""
    return re.sub(r"(\W|_)+(per_)?", "_", name.lower()).strip("_")


def _state(key: str, text: object) -> str:
    name = str(text).strip().upper()
    if name not in State.__members__:
        raise ValueError(bad(key, text, "one of " + ", ".join(State.__members__)))
    return name


def _number(key: str, text: str) -> float:
    try:
        x = float(text)
    except ValueError:
        x = math.nan
    if not math.isfinite(x):
        raise ValueError(bad(key, text, "a finite number"))
    return x


def report(judged: Iterable[Judged]) -> str:
    """Return as text the number of each verdict, the delay of the right switches, and the first wrong switch."""
    judged = list(judged)
    counts = Counter(j.verdict for j in judged)
    lines = [
        f"{counted(len(judged), 'switch', 'es')}: " + ", ".join(f"{counts[v]} {v}" for v in (RIGHT, MISSED, OTHER))
    ]
    late = np.array([j.late for j in judged if j.verdict == RIGHT])
    if len(late):
        lines.append(f"late by {np.median(late):.2g} (median), from {late.min():.2g} to {late.max():.2g}")
    wrong = next((j for j in judged if j.verdict != RIGHT), None)
    if wrong is not None:
        lines.append(f"first at τ = {wrong.switch.tau:.6f}, {wrong.switch.state}: {wrong.verdict}")
    return "\n".join(lines)


def suspect(switches: Sequence[Switch], eps: float, eta: float) -> list[str]:
    """Return a line about the units if the switches follow each other so fast that τ is perhaps in seconds."""
    periods = (switches[-1].tau - switches[0].tau) / (2.0 * np.pi)
    if len(switches) <= FEW + periods * (MANY + (4.0 * eta if eps else 0.0)):
        return []
    return [f"{len(switches)} switches in {periods:.2g} periods: is τ in seconds? Columns: {COLUMNS}"]


def model_of(arguments: argparse.Namespace) -> dict[str, float]:
    """Return the values by name of the configuration and of the options. Raises ValueError with one sentence."""
    options = [f"{name}={value}" for name in MODEL if (value := getattr(arguments, name)) is not None]
    settings = config.read(Path(arguments.scene), options) if arguments.scene else config.parse("", options)
    plan = settings.plan()
    if plan.n_points > 1:
        raise ValueError(f"{arguments.scene}: {bad_axes(plan.axes, 'of one value each')}")
    return plan.single(0).scalars


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare your switching times with certified switching times.")
    parser.add_argument("file", help="CSV file with the columns tau, xi, dxi, state, and one line per switch")
    parser.add_argument("--scene", help="configuration of a machine, for A, B and columns t_s, x_m, v_m_per_s")
    for name in MODEL:
        parser.add_argument(f"--{name}", help=PARAMETERS[name].meaning)
    arguments = parser.parse_args()
    try:
        known = model_of(arguments)
        switches = read(arguments.file, known)
        told = [report(audit(switches, **{name: known[name] for name in MODEL}))]
        print("\n".join([*told, *suspect(switches, known["eps"], known["eta"])]))
    except OSError as error:
        parser.exit(2, f"audit: {error.filename}: {error.strerror}\n")
    except ValueError as error:
        parser.exit(2, f"audit: {error}\n")


if __name__ == "__main__":
    main()
