"""Limits over one or two axes of A, B and η in a file: laid out whole, filled limit by limit, resumed where it stopped.

HDF5 with netCDF-4 dimension scales: `curve` (which disturbance, which path) × the axes in the order of the
configuration. Over A alone the bifurcation diagram of the undisturbed motion stands beside them, over a finer axis:
a figure needs nothing but the file.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibrodrive.errors import ConfigError, Damaged, NoResult
from vibrodrive.model.config import Config, parse
from vibrodrive.model.parameters import PARAMETERS, bad
from vibrodrive.stability.limit import AXES, PERIODS, Limit
from vibrodrive.stability.limits import (
    CURVES,
    FINE,
    K2,
    QUANTITIES,
    SHOWN,
    Limits,
    check_quantity,
    curve_facts,
    curve_line,
    values_of,
)
from vibrodrive.stability.starts import StartLimit
from vibrodrive.stability.unique_motion import UniqueLimit
from vibrodrive.stability.velocity import as_velocity
from vibrodrive.store import netcdf
from vibrodrive.store.compare import differences, refuse_different
from vibrodrive.store.describe import explained, plain
from vibrodrive.store.file import (
    Summary,
    axis_facts,
    axis_line,
    find_faults,
    new_file,
    reading,
    refuse_moved,
    unwritable,
    versions_of,
)
from vibrodrive.store.header import BROKEN
from vibrodrive.store.layout import Origin, about
from vibrodrive.store.lock import Lock

SCHEMA, OTHERS = 2, 3
"""Of files of k2, and of those of k1 and ku, which have names of their own for what they hold."""

READABLE = (1, SCHEMA, OTHERS)
"""Files of schema 1 have an axis of A alone and no velocities, which follow from what they have."""

HOW_BYTES = 120

IN_MM_S = {"velocity": "velocity_mm_s", "velocity_last": "velocity_last_mm_s"}
"""The same of a scene in SI units (`[physical]`), in mm/s; files of other configurations do not have them."""

UNIT = "velocity_unit"
"""Attribute of these: mm/s that a dimensionless velocity of 1 is."""

NOT_COMPUTED, DONE = -1, 0

OF_CURVES = ("method", "scan", "dtau", "record")
"""Settings that are not those of a whole file."""

CONTENTS = {
    "k2": "Over the axes, for each curve, how large a disturbance may be before the motion loses what `criterion` asks "
    "for: ε (eps) of the excitation, the step Δτ (dtau) of a grid on which switches are found, or an error of the "
    "start.",
    "k1": "Over the axes, for each coordinate of the start, how far it may be off before the undisturbed motion ends "
    "on another solution.",
    "ku": "Over the axes, for each curve, the disturbance from which all starts end on one motion: ε (eps) of the "
    "excitation, or the step Δτ (dtau) of a grid on which switches are found.",
}
"""Of a file, for a reader who sees nothing else. eps among the attributes is that of motions on a grid."""


def load_limits(path: str | Path) -> Limits:
    """Read a file of limits, finished or not. Raises ConfigError if it is none, Damaged, or OSError."""
    with _open(Path(path), "r") as file:
        return _content(file)


def _content(file: h5py.File) -> Limits:
    quantity = quantity_of(file)
    names = [dimension.keys()[0] for dimension in file[quantity].dims][1:]
    axes = {name: file[name][...] for name in names}
    plan = parse(str(file.attrs["config"]), json.loads(file.attrs.get("overrides", "[]"))).plan()
    fixed = {name: plan.scalars[name] for name in AXES if name not in axes}
    numbers = {name: file[name][...] for name in QUANTITIES[quantity].numbers if name in file}
    if quantity == K2 and "velocity" not in numbers:  # schema 1, over A
        for name, of in (("velocity", "k2"), ("velocity_last", "last_kept")):
            rows = zip(CURVES, numbers[of], strict=True)
            numbers[name] = np.stack([as_velocity(d, values, axes["A"], fixed["eta"]) for (d, _), values in rows])
    drawn = "section_dxi" in file
    return Limits(
        axes=axes,
        fixed=fixed,
        numbers=numbers,
        n=file["n"][...],
        done=file["status"][...] == DONE,
        how=np.char.decode(file["how"][...], "utf-8"),
        criterion=check_quantity(quantity, file.attrs.get("criterion")),
        title=str(file.attrs["title"]),
        fine=file["A_fine"][...] if drawn else None,
        diagram=file["section_dxi"][...] if drawn else None,
        shared={**plan.scalars, **vars(plan.settings)},
        mm_s=float(file[IN_MM_S["velocity"]].attrs[UNIT]) if IN_MM_S["velocity"] in file else None,
        quantity=quantity,
    )


def quantity_of(file: h5py.File) -> str:
    """The kind of limits that an open file holds."""
    return next(name for name in QUANTITIES if name in file)


def summary(path: Path, thorough: bool = False) -> Summary:
    """What a file of limits holds; `thorough` reads everything and looks for faults. Raises as `load_limits`."""
    with _open(path, "r") as file:
        faults = find_faults(file) if thorough else []
        if faults:
            return Summary(str(file.attrs["title"]), np.nan, [], faults)
        found = _content(file)
        status = file["status"][...]
        if not np.isin(status, (DONE, NOT_COMPUTED)).all():
            faults.append("status: a value that means nothing")
        if (np.isnan(found.values) & found.done & (found.how == "")).any():
            faults.append(f"{found.quantity}: missing where it is marked as computed")
        curves = [curve_facts(found, c) for c in range(len(found.curves))]
        facts = {
            "axes": {name: axis_facts(values) for name, values in found.axes.items()}, "parameters": found.fixed,
            "quantity": found.quantity, "criterion": found.criterion, "curves": curves, "versions": versions_of(file),
        }  # fmt: skip
        lines = [axis_line(name, values) for name, values in found.axes.items()]
        lines.append(("fixed", ", ".join(f"{name} = {value:g}" for name, value in found.fixed.items())))
        lines.append(("criterion", found.criterion) if found.criterion else ("quantity", found.quantity))
        lines += [(curve["disturbance"], curve_line(curve, found.mm_s)) for curve in curves]
        return Summary(found.title, found.computed, lines, faults, facts)


@contextmanager
def _open(path: Path, mode: str) -> Iterator[h5py.File]:
    try:
        with reading(path, "limits", mode) as file:
            if (schema := file.attrs.get("limits_schema")) not in READABLE:
                allowed = "one of " + ", ".join(map(str, READABLE))
                raise NoResult(f"{path}: {bad('limits_schema', schema, allowed)}")
            yield file
    except Damaged:
        raise
    except NoResult as error:
        raise ConfigError(f"{path}: no file of limits: {str(error).removeprefix(f'{path}: ')}") from None


@contextmanager
def writing(path: Path) -> Iterator[h5py.File]:
    """The file open for writing, by this process alone."""
    with _open(path, "r"):  # what cannot be read is refused before what cannot be written
        pass
    lock = Lock(path)
    file = None
    try:
        file = h5py.File(path, "r+", locking=False)
        yield file
        file.close()
    except (OSError, RuntimeError) as error:
        if "errno" in str(error):  # as HDF5 words it
            raise unwritable(error, path) from None
        raise
    finally:
        if file is not None:
            with suppress(*BROKEN):
                file.close()
        lock.release()


def write_limit(file: h5py.File, c: int, at: tuple[int, ...], found: Limit | StartLimit | UniqueLimit) -> None:
    """One limit of curve c at an index of the axes. Data first, then the mark that says they are there."""
    refuse_moved(Path(file.filename))
    place = (c, *at)
    for name, value in values_of(quantity_of(file), found).items():
        if name in file:  # velocities are missing in schema 1
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
    """A new file with room for all limits over the axes, in the place of a result file of that name."""
    with new_file(path) as file:
        _lay_out(file, config, axes, judged_by(quantity, criterion), quantity)


def judged_by(quantity: str, criterion: str) -> dict[str, str]:
    """The attribute that says what the limits are of: the criterion of k2, else the quantity."""
    return {"criterion": criterion} if quantity == K2 else {"quantity": quantity}


def _lay_out(
    file: h5py.File, config: Config, axes: Mapping[str, np.ndarray], judged: dict[str, str], quantity: str
) -> None:
    places = ("curve", *axes)

    def variable(
        name: str, dtype: str, fill: Any, meaning: str, dims: tuple[str, ...] = places, units: str = "1"
    ) -> h5py.Dataset:
        data = netcdf.variable(file, name, dims, dtype, meaning, fill=fill, units=units)
        data[...] = fill  # now, not when it is first written: what is laid out does not grow
        return data

    curves, numbers, _ = QUANTITIES[quantity]
    netcdf.dimension(file, "curve", np.arange(len(curves), dtype=np.int8), "disturbance and switching path")
    file["curve"].attrs["flag_values"] = np.arange(len(curves), dtype=np.int8)
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
    variable("how", f"S{HOW_BYTES}", b"", f"what was lost at {quantity}, or why there is no {quantity}")
    variable("status", "<i1", NOT_COMPUTED, "0: computed, -1: not yet")
    if list(axes) == ["A"]:
        fine = np.linspace(axes["A"].min(), axes["A"].max(), FINE)
        netcdf.dimension(file, "A_fine", fine, "excitation amplitude of the diagram")
        netcdf.dimension(file, "period", np.arange(1, SHOWN + 1), "recorded excitation period of the diagram")
        variable("section_dxi", "<f8", np.nan, "velocity ξ' of the undisturbed motion", ("A_fine", "period"))
    origin = Origin(config.text, config.overrides, config.title or "Limits of practically orbital stability")
    shared = {name: value for name, value in plain(config.plan()).items() if name not in OF_CURVES}
    shared |= {"periods": config.arguments.get("periods", PERIODS), **judged}
    schema = SCHEMA if quantity == K2 else OTHERS
    file.attrs.update(about("limits", origin) | explained(CONTENTS[quantity], shared) | {"limits_schema": schema})


def refuse_another(file: h5py.File, path: Path, config: Config, criterion: str, quantity: str = K2) -> None:
    """Raise Different unless an open file was made from this configuration."""
    if quantity_of(file) != quantity:
        refuse_different(path, [f"quantity is {quantity_of(file)} there and {quantity} here"])
    refuse_different(path, differences(file, config.plan(), given=config.arguments, **judged_by(quantity, criterion)))
