"""Conversion of results to an xarray.Dataset with the names of the files, and to tables with those of `column`. With a
scene both are in SI units."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrodrive.batch.frames import made_of
from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import column
from vibrodrive.model.quantities import IMPACT_POWER, Quantity, values_of
from vibrodrive.model.records import IMPACTS, SECTION
from vibrodrive.model.results import Results
from vibrodrive.model.variables import POINT
from vibrodrive.store import layout
from vibrodrive.store.describe import plain

if TYPE_CHECKING:
    import pandas
    import xarray

ALONG = {"points": (), SECTION: ("period",), IMPACTS: ("impact",)}
"""Tables of results, and the dimensions of each in addition to the axes."""


def dataset(results: Results) -> xarray.Dataset:
    """Return results as a Dataset, see `Results.to_xarray`."""
    try:
        import xarray
    except ImportError:
        raise ImportError("to_xarray needs the extra `data`: pip install 'vibrodrive[data]'") from None

    plan = results.plan
    coords = {name: xarray.Variable(name, values, _about(name)) for name, values in layout.coordinates(plan).items()}
    if not plan.axes:
        coords.pop(POINT)  # the file of a single motion has this axis, with length 1; the Dataset has no such axis
    coords["state"].attrs |= layout.flags_of_states()
    coords |= {name: xarray.Variable(POINT, values, _about(name)) for name, values in plan.together.items()}
    variables = {q.variable: xarray.Variable((*plan.axes, *e), v, about) for e, q, v, about in _variables(results)}
    return xarray.Dataset(variables, coords, _shared(results))


def table(results: Results, of: str = "points") -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Return the columns of `Results.to_dataframe` by name, and their units."""
    if not isinstance(of, str) or of not in ALONG:
        raise ValueError(bad("of", of, "one of " + ", ".join(ALONG)))
    plan = results.plan
    if ALONG[of] and of not in plan.record:
        raise ValueError(bad("record", ", ".join(results.record), f'extended by "{of}"'))
    sizes, dims = layout.coordinates(plan), (*plan.axes, *ALONG[of])
    grid = np.ix_(*(sizes[name] for name in dims))
    arrays = dict(zip(dims, grid, strict=True))
    arrays |= {name: values.reshape(arrays[POINT].shape) for name, values in plan.together.items()}
    units = {name: layout.meaning_of(name)[1] for name in arrays}
    for _, q, values, about in _variables(results, ALONG[of]):
        if (flags := about.get("flag_values")) is not None:
            names = dict(zip(flags.tolist(), about["flag_meanings"].upper().split(), strict=True))
            values = np.vectorize(names.get, [object])(values)
        name = column(q.name, about["units"])
        arrays[name], units[name] = values, about["units"]
    shape = tuple(len(sizes[name]) for name in dims)
    columns = {name: np.broadcast_to(values, shape).ravel() for name, values in arrays.items()}
    if of == IMPACTS:
        filled = ~np.isnan(columns["impact_phase"])
        columns = {name: values[filled] for name, values in columns.items()}
    return columns, units


def frame(results: Results, of: str = "points") -> pandas.DataFrame:
    """Return the table that `Results.to_dataframe` returns for `of`."""
    columns, units = table(results, of)
    return made_of(columns, _shared(results) | {"units": units})


def _shared(results: Results) -> dict[str, Any]:
    return {"title": results.title, **plain(results.plan)}


def _variables(
    results: Results, wanted: tuple[str, ...] | None = None
) -> Iterator[tuple[tuple[str, ...], Quantity, np.ndarray, dict[str, Any]]]:
    """Yield the dimensions in addition to the axes, the row, the values and the attributes of each variable.

    With `wanted`, only variables with these dimensions are read.
    """
    flags = layout.flags_of(results.plan)
    power = [IMPACT_POWER] if results.plan.summarised and results.measure("energy").si != "1" else []
    for q in (*layout.variables_of(results.plan), *power):
        extra = (q.along,) if q.along else ()
        if wanted in (None, extra):
            unit = results.measure(q.name)
            about = {"units": q.unit if unit.si == "1" else unit.si, "long_name": unit.words(q.meaning)}
            yield extra, q, unit.of(values_of(results, q)), about | flags.get(q.variable, {})


def _about(name: str) -> dict[str, str]:
    long_name, units = layout.meaning_of(name)
    return {"units": units, "long_name": long_name}
