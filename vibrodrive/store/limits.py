"""Files of limits of stability (k₂, see stability/limits.py) over one or two of A, B and η.

A file is laid out completely and then filled limit by limit, so that it can be resumed after a stop. It is HDF5 with
netCDF-4 dimension scales. The dimensions are `curve` (disturbance and method) and the
axes in the order of the configuration. If A is the only axis, the file also contains the bifurcation diagram of the
undisturbed motion over a finer axis, for the figure. The `quantity` of a file is its kind of limit, "k2".
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibrodrive.model.config import Config
from vibrodrive.model.kinds import FILES
from vibrodrive.model.names import PARAMETERS
from vibrodrive.stability.limit import AXES, PERIODS, Limit
from vibrodrive.stability.limits import FINE, K2, QUANTITIES, SHOWN, Limits, check_quantity, values_of
from vibrodrive.store import netcdf
from vibrodrive.store.compare import altered, differences, refuse_different
from vibrodrive.store.describe import explained, plain
from vibrodrive.store.file import new_file, refuse_moved, unwritable
from vibrodrive.store.header import origin_of, reading
from vibrodrive.store.layout import Origin, about
from vibrodrive.store.lock import Lock

SCHEMA = FILES["limits"].readable[0]

HOW_BYTES = 120

IN_MM_S = {"velocity": "velocity_mm_s", "velocity_last": "velocity_last_mm_s"}
"""Names of the variables in mm/s, by the name of the dimensionless variable. They need a scene in SI units."""

UNIT = "velocity_unit"  # attribute of a variable in mm/s: the unit of the dimensionless velocity, in mm/s

NOT_COMPUTED, DONE = -1, 0

OF_CURVES = ("method", "scan", "dtau", "record")  # settings that differ between the curves of a file

CONTENTS = {
    "k2": "For each curve and point of the axes: the smallest disturbance at which the motion violates `criterion`. "
    "The disturbance is ε (eps) of the excitation, or the step Δτ (dtau) of a grid on which switches are found.",
}
"""Description of the contents in a file, by quantity."""


def read(file: h5py.File) -> Limits:
    """Read an open file of limits, finished or not."""
    quantity = quantity_of(file)
    names = [dimension.keys()[0] for dimension in file[quantity].dims][1:]
    axes = {name: file[name][...] for name in names}
    plan = origin_of(file).parsed().plan()
    drawn, in_mm_s = "section_dxi" in file, IN_MM_S["velocity"] in file
    return Limits(
        axes=axes,
        fixed={name: plan.scalars[name] for name in AXES if name not in axes},
        numbers={name: file[name][...] for name in QUANTITIES[quantity].numbers},
        n=file["n"][...],
        done=file["status"][...] == DONE,
        how=np.char.decode(file["how"][...], "utf-8"),
        criterion=check_quantity(quantity, file.attrs.get("criterion")),
        title=str(file.attrs["title"]),
        fine=file["A_fine"][...] if drawn else None,
        diagram=file["section_dxi"][...] if drawn else None,
        shared={**plan.scalars, **vars(plan.settings)},
        mm_s=float(file[IN_MM_S["velocity"]].attrs[UNIT]) if in_mm_s else None,
        quantity=quantity,
    )


def quantity_of(file: h5py.File) -> str:
    """Return the quantity of an open file. Raises KeyError if the file contains no limits."""
    found = [name for name in QUANTITIES if name in file]
    if not found:
        raise KeyError("no limits")
    return found[0]


def faults(file: h5py.File, found: Limits) -> list[str]:
    """Return contradictions in a file of limits."""
    wrong = altered(file, periods=PERIODS)
    scene = origin_of(file).parsed().physical
    if found.mm_s is not None and (scene is None or found.mm_s != 1e3 * scene.velocity(1.0)):
        wrong.append(f"attribute {UNIT}: changed after it was written")
    if not np.isin(file["status"][...], (DONE, NOT_COMPUTED)).all():
        wrong.append("status: unknown value")
    if (np.isnan(found.values) & found.done & (found.how == "")).any():
        wrong.append(f"{found.quantity}: missing at a point that is marked as computed")
    return wrong


@contextmanager
def writing(path: Path) -> Iterator[h5py.File]:
    """Open a file of limits for writing, locked against other writers."""
    with reading(path, "limits"):  # so that an unreadable file is reported as unreadable, and not as unwritable
        pass
    try:
        with Lock(path), h5py.File(path, "r+", locking=False) as file:
            yield file
    except (OSError, RuntimeError) as error:
        if "errno" in str(error):  # text of an HDF5 message
            raise unwritable(error, path) from None
        raise


def write_limit(file: h5py.File, c: int, at: tuple[int, ...], found: Limit) -> None:
    """Write one limit of curve c at an index of the axes. The status comes last and marks the limit as computed."""
    refuse_moved(Path(file.filename))
    place = (c, *at)
    for name, value in values_of(quantity_of(file), found).items():
        file[name][place] = value
        if name in IN_MM_S and IN_MM_S[name] in file:
            data = file[IN_MM_S[name]]
            data[place] = value * data.attrs[UNIT]
    file["n"][place] = found.n
    file["how"][place] = found.how.encode()[:HOW_BYTES]
    file.flush()
    file["status"][place] = DONE
    file.flush()


def create(path: Path, config: Config, axes: Mapping[str, np.ndarray], criterion: str, quantity: str = K2) -> None:
    """Create a file for all limits over the axes. The file replaces any result file at `path`."""
    with new_file(path) as file:
        _lay_out(file, config, axes, quantity)
        shared = {name: value for name, value in plain(config.plan()).items() if name not in OF_CURVES}
        shared |= own_settings(config, criterion)
        origin = Origin.of(config, "Limits of practically orbital stability")
        file.attrs.update(about("limits", origin) | explained(CONTENTS[quantity], shared) | {"limits_schema": SCHEMA})


def own_settings(config: Config, criterion: str) -> dict[str, Any]:
    """Return by name the settings that the plan does not contain: periods and the criterion."""
    return {"periods": config.arguments.get("periods", PERIODS), "criterion": criterion}


def _lay_out(file: h5py.File, config: Config, axes: Mapping[str, np.ndarray], quantity: str) -> None:
    def variable(name: str, dtype: str, fill: Any, meaning: str, *along: str, units: str = "1") -> h5py.Dataset:
        data = netcdf.variable(file, name, along or ("curve", *axes), dtype, meaning, fill=fill, units=units)
        data[...] = fill  # allocates all chunks, so that later writes do not extend the file
        return data

    curves, numbers, _ = QUANTITIES[quantity]
    values = np.arange(len(curves), dtype=np.int8)
    netcdf.dimension(file, "curve", values, "disturbance and method")
    file["curve"].attrs["flag_values"] = values
    file["curve"].attrs["flag_meanings"] = " ".join(f"{d}_{m}" for d, m in curves)
    for name, values in axes.items():
        netcdf.dimension(file, name, values, PARAMETERS[name].meaning)
    for name, meaning in numbers.items():
        variable(name, "<f8", np.nan, meaning)
    if config.physical is not None and "velocity" in numbers:
        for name, other in IN_MM_S.items():
            data = variable(other, "<f8", np.nan, f"{name} of the scene in SI units", units="mm s-1")
            data.attrs[UNIT] = 1e3 * config.physical.velocity(1.0)
    variable("n", "<i4", 0, "period of the undisturbed orbit, 0 if it has none")
    variable("how", f"S{HOW_BYTES}", b"", f"property lost at {quantity}, or the reason why there is no {quantity}")
    variable("status", "<i1", NOT_COMPUTED, "0: computed, -1: not computed")
    if list(axes) == ["A"]:
        fine = np.linspace(axes["A"].min(), axes["A"].max(), FINE)
        netcdf.dimension(file, "A_fine", fine, "excitation amplitude of the diagram")
        netcdf.dimension(file, "period", np.arange(1, SHOWN + 1), "recorded excitation period of the diagram")
        variable("section_dxi", "<f8", np.nan, "velocity ξ' of the undisturbed motion", "A_fine", "period")


def refuse_another(file: h5py.File, path: Path, config: Config, criterion: str, quantity: str) -> None:
    """Raise Different if an open file was made from another configuration."""
    if quantity_of(file) != quantity:
        refuse_different(path, [f"quantity is {quantity_of(file)!r} in the file and {quantity!r} in the configuration"])
    refuse_different(path, differences(file, config.plan(), own_settings(config, criterion)))
