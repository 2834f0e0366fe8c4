"""Orbits and bifurcations as an HDF5 file with netCDF-4 dimension scales.

Dimensions `orbit` (one entry an orbit at one A), `impact` (those of all orbits, in order: orbit i has the
rows first_impact[i] to first_impact[i] + impacts[i]) and `bifurcation`.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibrodrive.orbit_family import Family

SCHEMA_VERSION = 1


def save_family(path: Path, found: Family, attributes: dict[str, Any]) -> None:
    """Write everything about a family into `path`, at once: the file is there whole or not at all.

    Raises
    ------
    OSError
        if it cannot be written.
    """
    draft = path.with_name(path.name + ".part")
    try:
        with h5py.File(draft, "w") as file:
            file.attrs.update({"Conventions": "CF-1.10", "schema_version": SCHEMA_VERSION, **attributes})
            file.attrs.update({"B": found.B, "max_period": found.max_period})
            for dimension, columns in _tables(found).items():
                _write(file, dimension, columns)
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)


def _tables(found: Family) -> dict[str, dict[str, tuple[Any, str]]]:
    """Columns (values, long name) by dimension."""
    orbits = [o for there in found.orbits for o in there]
    impacts = np.array([o.impacts for o in orbits], dtype=np.int64)
    joined = {
        name: np.concatenate([getattr(o, name) for o in orbits] or [np.empty(0)])
        for name in ("phases", "speeds", "gaps")
    }
    b = found.bifurcations
    return {
        "orbit": {
            "A": (np.array([o.A for o in orbits]), "excitation amplitude"),
            "period": (np.array([o.period for o in orbits], np.int64), "whole excitation periods"),
            "impacts": (impacts, "number of impacts"),
            "multiplier": (np.array([o.multiplier for o in orbits]), "derivative of the return map"),
            "kind": ([o.kind for o in orbits], "stability"),
            "word": ([o.word for o in orbits], "states of one period"),
            "first_impact": (np.cumsum(impacts) - impacts, "row of its first impact"),
        },
        "impact": {
            "phase": (joined["phases"], "phase of the impact"),
            "speed": (joined["speeds"], "impact speed"),
            "gap": (joined["gaps"].astype(np.int64), "whole excitation periods to the next impact"),
        },
        "bifurcation": {
            "bifurcation_A": (np.array([x.A for x in b]), "excitation amplitude"),
            "bifurcation_kind": ([x.kind for x in b], "kind of bifurcation"),
            "bifurcation_period": (np.array([x.orbit.period for x in b], np.int64), "period of its orbit"),
            "bifurcation_impacts": (np.array([x.orbit.impacts for x in b], np.int64), "impacts of its orbit"),
            "bifurcation_word": ([x.orbit.word for x in b], "states of its orbit"),
            "multiplier_below": (np.array([x.multiplier_below for x in b]), "multiplier a little below"),
            "multiplier_above": (np.array([x.multiplier_above for x in b]), "multiplier a little above"),
        },
    }


def _write(file: h5py.File, dimension: str, columns: dict[str, tuple[Any, str]]) -> None:
    count = len(next(iter(columns.values()))[0])
    checked = {"fletcher32": True, "chunks": (min(count, 16384),)} if count else {}
    scale = file.create_dataset(dimension, data=np.arange(count), **checked)
    scale.make_scale(dimension)
    scale.attrs.update({"units": "1", "long_name": f"index of the {dimension}"})
    for name, (values, meaning) in columns.items():
        if isinstance(values, list):  # text: of any length, so HDF5 keeps no checksum of it
            data = file.create_dataset(name, (count,), h5py.string_dtype())
            if count:
                data[:] = values
            data.attrs["long_name"] = meaning
        else:
            data = file.create_dataset(name, data=values, **checked)
            data.attrs.update({"units": "1", "long_name": meaning})
        data.dims[0].attach_scale(scale)
