"""Results as an xarray.Dataset, with the names, units and long names that the files have."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrodrive.model.plan import POINT, Plan
from vibrodrive.model.results import Results
from vibrodrive.store.describe import plain
from vibrodrive.store.layout import (
    MOTION_PERIOD,
    SECTIONS,
    axes_of,
    coordinates,
    flags_of_states,
    flags_of_statuses,
    meaning_of,
    variables_of,
)

if TYPE_CHECKING:
    import xarray

SUMS = "checksum"
"""What files have and a Dataset in memory has no use for."""


def dataset(results: Results) -> xarray.Dataset:
    """See `Results.to_xarray`."""
    try:
        import xarray
    except ImportError:
        raise ImportError("to_xarray needs xarray: pip install 'vibrodrive[data]'") from None

    plan = Plan(results.axes, results.scalars, results.settings, None, results.record, results.points)
    unnamed = set(axes_of(plan)) - set(plan.axes)  # the axis that a file of one motion has
    coords = {
        name: xarray.Variable(name, values, _about(name))
        for name, values in coordinates(plan).items()
        if name not in unnamed
    }
    coords["state"].attrs |= flags_of_states()
    coords |= {name: xarray.Variable(POINT, values, _about(name)) for name, values in plan.together.items()}
    variables = {}
    for v in variables_of(plan):
        if v.name == SUMS:
            continue
        dims = (*plan.axes, *([v.extra] if v.extra else []))
        variables[v.name] = xarray.Variable(dims, _array(results, v.name), {"units": v.units, "long_name": v.long_name})
    variables["status"].attrs |= flags_of_statuses()
    return xarray.Dataset(variables, coords, {"title": results.title, **plain(plan)})


def _about(name: str) -> dict[str, str]:
    long_name, units = meaning_of(name)
    return {"units": units, "long_name": long_name}


def _array(results: Results, name: str) -> np.ndarray:
    """A variable of the file: the section is one array in Results and one for each coordinate there."""
    columns = [v.name for v in SECTIONS]
    if name in columns:
        return results.section[..., columns.index(name)]
    return np.asarray(getattr(results, "period" if name == MOTION_PERIOD else name))
