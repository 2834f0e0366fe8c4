"""Conversion of a plan to a configuration: the TOML text from which the same plan is read, bit for bit."""

import math
import textwrap

import numpy as np

from vibrodrive.model.config import HOMES
from vibrodrive.model.names import SCENE
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import RECORDS
from vibrodrive.model.spacing import geometric
from vibrodrive.model.variables import POINT

FEW = 3  # an axis of up to this number of values is written as a list, because a range would not be shorter

WIDTH = 110


def as_toml(plan: Plan) -> str:
    """Return the configuration of a plan.

    The text contains all settings in use, so that a later version with other defaults reads the same plan.
    """
    s, scene = plan.settings, {*SCENE} & {*plan.variables}
    follows = {"B", *(["A"] if "a0" in scene else [])} if scene else set()
    omitted = {*follows, *s.idle}
    numbers = {name: value for name, value in plan.scalars.items() if name not in omitted and not math.isnan(value)}
    records = [str(record) for record in plan.record if record in RECORDS]
    values = numbers | s.words | ({"record": records} if records else {})
    homes = ({"physical": tuple(SCENE)} if scene else {}) | HOMES
    tables = {name: {key: _value(values[key]) for key in keys if key in values} for name, keys in homes.items()}
    points = ", ".join(f"{name} = {_axis(values, inline=True)}" for name, values in plan.together.items())
    axes = {name: _axis(values) for name, values in plan.axes.items()} | ({POINT: f"{{{points}}}"} if points else {})
    tables["sweep"] = {"points" if name == POINT else name: text for name, text in axes.items()}
    at: set[str] = set()  # each parameter is given once, in the first table that may have it
    lines = ["# made from the arguments of vd.sweep"]
    lines += [
        f"# and with the function {name}, which a configuration cannot contain"
        for name in plan.record
        if name not in records
    ]
    for name, entries in tables.items():
        lines += ["", f"[{name}]", *(f"{key} = {text}" for key, text in entries.items() if key not in at)]
        at |= entries.keys()
    return "\n".join(lines) + "\n"


def _value(value: object) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _axis(values: np.ndarray, inline: bool = False) -> str:
    """Return the values as a range or a list. If `inline`, the text is one line, as in an inline table."""
    first, last, n = float(values[0]), float(values[-1]), len(values)
    if n > FEW:
        ends = f"start = {first!r}, stop = {last!r}, num = {n}"
        if np.linspace(first, last, n).tobytes() == values.tobytes():
            return f"{{{ends}}}"
        if min(first, last) > 0 and geometric(first, last, n).tobytes() == values.tobytes():
            return f'{{{ends}, scale = "log"}}'
    text = "[" + ", ".join(map(repr, values.tolist())) + "]"
    return text if inline else textwrap.fill(text, WIDTH, subsequent_indent="    ")
