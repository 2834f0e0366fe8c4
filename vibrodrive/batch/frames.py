"""Conversion of the arrays of a trajectory to tables of pandas."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrodrive.model.choices import Method, Status
from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import Measure, column
from vibrodrive.model.states import State

if TYPE_CHECKING:
    import pandas

Table = Literal["switches", "impacts", "section"]


def columns(
    arrays: Mapping[str, np.ndarray], of: Table, arguments: Mapping[str, Any], measure: Callable[[str], Measure]
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Return the columns of a table by name, and the units of those that have one. States are given by name."""
    if not isinstance(of, str) or of not in arrays:
        raise ValueError(bad("of", of, "one of " + ", ".join(arrays)))
    rows = arrays[of]
    if of == "section":
        fields = {"tau": _section_times(arguments), "xi": rows[:, 0], "dxi": rows[:, 1]}
    else:
        fields = {"tau": 2.0 * math.pi * rows["period"] + rows["phase"]} | {n: rows[n] for n in rows.dtype.names or ()}
    states = np.array([str(s) for s in State])
    fields |= {name: states[fields[name]] for name in ("before", "after") if name in fields}
    scales = {name: measure(name) for name in fields}
    names = {name: column(name, scale.si) for name, scale in scales.items()}
    units = {names[name]: scale.si for name, scale in scales.items() if scale.si != "1"}
    return {names[name]: scales[name].of(values) for name, values in fields.items()}, units


def frame(
    arrays: Mapping[str, np.ndarray],
    of: Table,
    arguments: Mapping[str, Any],
    status: Status,
    measure: Callable[[str], Measure],
) -> pandas.DataFrame:
    """Return the table that `Trajectory.to_dataframe` returns for `of`."""
    data, units = columns(arrays, of, arguments, measure)
    attrs = {name: value for name, value in arguments.items() if value == value}
    attrs |= {"method": Method(arguments["method"]).name.lower(), "status": str(status), "units": units}
    table = made_of(data, attrs)
    for name in {"before", "after"} & data.keys():
        table[name] = table[name].astype("category").cat.set_categories([str(s) for s in State])
    return table


def made_of(columns: Mapping[str, np.ndarray], attrs: Mapping[str, Any]) -> pandas.DataFrame:
    """Return a DataFrame of these columns. Raises ImportError without pandas."""
    try:
        import pandas
    except ImportError:
        raise ImportError("to_dataframe needs the extra `data`: pip install 'vibrodrive[data]'") from None
    table = pandas.DataFrame(columns)
    table.attrs = dict(attrs)
    return table


def _section_times(a: Mapping[str, Any]) -> np.ndarray:
    """Return the time τ of each section point. These are the instants section_phase + 2πk in the record."""
    turn = 2.0 * math.pi
    offset = (a["section_phase"] - a["tau0"]) % turn or turn
    return a["tau0"] + offset + turn * (a["transient"] + np.arange(a["periods"]))
