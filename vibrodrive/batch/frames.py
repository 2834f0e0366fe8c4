"""Conversion of the arrays of a trajectory to tables of pandas."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrodrive.model.choices import Method, Scan, Status
from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import Measure
from vibrodrive.model.states import State

if TYPE_CHECKING:
    import pandas

Table = Literal["switches", "impacts", "section"]


def frame(
    arrays: Mapping[str, np.ndarray],
    of: Table,
    arguments: Mapping[str, Any],
    status: Status,
    measure: Callable[[str], Measure],
) -> pandas.DataFrame:
    """Return the table that `Trajectory.to_dataframe` returns for `of`."""
    if not isinstance(of, str) or of not in arrays:
        raise ValueError(bad("of", of, "one of " + ", ".join(arrays)))
    try:
        import pandas
    except ImportError:
        raise ImportError("to_dataframe needs the extra `data`: pip install 'vibrodrive[data]'") from None

    columns: dict[str, Any]
    rows = arrays[of]
    if of == "section":
        columns = {"tau": _section_times(arguments), "xi": rows[:, 0], "dxi": rows[:, 1]}
    else:
        columns = {"tau": 2.0 * math.pi * rows["period"] + rows["phase"]} | {n: rows[n] for n in rows.dtype.names or ()}
    units = {name: measure(name) for name in columns}
    columns = {name: units[name].of(values) for name, values in columns.items()}
    for name in {"before", "after"} & columns.keys():
        columns[name] = pandas.Categorical.from_codes(columns[name], [str(s) for s in State])
    found = pandas.DataFrame(columns)
    named = {"method": Method, "scan": Scan}
    known = {name: value for name, value in arguments.items() if value == value}
    found.attrs = {name: named[name](value).name.lower() if name in named else value for name, value in known.items()}
    found.attrs |= {"status": str(status), "units": {n: unit.si for n, unit in units.items() if unit.si != "1"}}
    return found


def _section_times(a: Mapping[str, Any]) -> np.ndarray:
    """Return the time τ of each section point. These are the instants section_phase + 2πk in the record."""
    turn = 2.0 * math.pi
    offset = (a["section_phase"] - a["tau0"]) % turn or turn
    return a["tau0"] + offset + turn * (a["transient"] + np.arange(a["periods"]))
