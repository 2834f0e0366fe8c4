"""Conversion of the arrays of a trajectory to tables of pandas."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrodrive.model.choices import Method, Status
from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import Measure
from vibrodrive.model.states import State

if TYPE_CHECKING:
    import pandas

Table = Literal["switches", "impacts", "section"]


def columns(arrays: Mapping[str, np.ndarray], of: Table, arguments: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return the columns of a table by name. States are given by name."""
    if not isinstance(of, str) or of not in arrays:
        raise ValueError(bad("of", of, "one of " + ", ".join(arrays)))
    rows = arrays[of]
    if of == "section":
        return {"tau": _section_times(arguments), "xi": rows[:, 0], "dxi": rows[:, 1]}
    found = {"tau": 2.0 * math.pi * rows["period"] + rows["phase"]} | {n: rows[n] for n in rows.dtype.names or ()}
    states = np.array([str(s) for s in State])
    return {name: states[values] if name in ("before", "after") else values for name, values in found.items()}


def frame(
    arrays: Mapping[str, np.ndarray],
    of: Table,
    arguments: Mapping[str, Any],
    status: Status,
    measure: Callable[[str], Measure],
) -> pandas.DataFrame:
    """Return the table that `Trajectory.to_dataframe` returns for `of`."""
    known = columns(arrays, of, arguments)
    try:
        import pandas
    except ImportError:
        raise ImportError("to_dataframe needs the extra `data`: pip install 'vibrodrive[data]'") from None
    units = {name: measure(name) for name in known}
    known = {name: units[name].of(values) for name, values in known.items()}
    for name in {"before", "after"} & known.keys():
        known[name] = pandas.Categorical(known[name], [str(s) for s in State])
    found = pandas.DataFrame(known)
    found.attrs = {name: value for name, value in arguments.items() if value == value}
    found.attrs |= {"method": Method(arguments["method"]).name.lower(), "status": str(status)}
    found.attrs |= {"units": {n: unit.si for n, unit in units.items() if unit.si != "1"}}
    return found


def _section_times(a: Mapping[str, Any]) -> np.ndarray:
    """Return the time τ of each section point. These are the instants section_phase + 2πk in the record."""
    turn = 2.0 * math.pi
    offset = (a["section_phase"] - a["tau0"]) % turn or turn
    return a["tau0"] + offset + turn * (a["transient"] + np.arange(a["periods"]))
