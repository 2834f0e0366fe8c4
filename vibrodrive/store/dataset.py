"""Conversion of results to an xarray.Dataset with the names of the files, and their units unless there is a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrodrive.model.drawing import IMPACT_POWER
from vibrodrive.model.plan import POINT
from vibrodrive.model.quantities import CHECKSUM, SECTIONS, Quantity
from vibrodrive.model.records import SUMMARY
from vibrodrive.model.results import Results
from vibrodrive.store import layout
from vibrodrive.store.describe import plain

if TYPE_CHECKING:
    import xarray


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
    variables = {}
    for v in layout.variables_of(plan):
        if v is not CHECKSUM:
            dims = (*plan.axes, *([v.along] if v.along else []))
            unit = results.measure(v.name)
            about = {"units": v.unit if unit.si == "1" else unit.si, "long_name": unit.words(v.meaning)}
            variables[v.variable] = xarray.Variable(dims, unit.of(values_of(results, v)), about)
    if SUMMARY in plan.record and results.measure("energy").si != "1":
        power = results.measure(IMPACT_POWER.name)
        about = {"units": power.si, "long_name": "power of the impacts"}
        variables[IMPACT_POWER.name] = xarray.Variable(tuple(plan.axes), power.of(np.asarray(results.energy)), about)
    for name, flags in layout.flags_of(plan).items():
        variables[name].attrs |= flags
    return xarray.Dataset(variables, coords, {"title": results.title, **plain(plan)})


def _about(name: str) -> dict[str, str]:
    long_name, units = layout.meaning_of(name)
    return {"units": units, "long_name": long_name}


def values_of(results: Results, quantity: Quantity) -> np.ndarray:
    """Return the values of a quantity. The section is one array in Results and two variables in files."""
    if quantity in SECTIONS:
        return results.section[..., SECTIONS.index(quantity)]
    return np.asarray(getattr(results, quantity.name))
