"""Limits over an A axis in a file: laid out whole, filled limit by limit, resumed where it stopped.

HDF5 with netCDF-4 dimension scales: `curve` (which disturbance, which path) × `A`, and beside them the
bifurcation diagram of the undisturbed motion over a finer axis: a figure needs nothing but the file.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibrodrive.model.config import Config, ConfigError
from vibrodrive.stability.limit import Limit
from vibrodrive.store import netcdf
from vibrodrive.store.compare import differences, refuse_different
from vibrodrive.store.file import Summary, find_faults, new_file, provenance, reading, unwritable
from vibrodrive.store.header import BROKEN, Damaged, NoResult
from vibrodrive.store.layout import Origin, about
from vibrodrive.store.lock import Lock

CURVES = (("eps", "certified"), ("dtau", "fixed"), ("dtau", "muller"))
"""Disturbance and path of each curve."""

SCHEMA = 1

FINE = 1500
"""Values of A of the bifurcation diagram."""

SHOWN = 120
"""Periods of it recorded at each."""

HOW_BYTES = 120

NUMBERS = {
    "k2": "first loss of the orbital structure; inf: none found up to searched_to",
    "kept_below": "largest disturbance below k2 that was kept",
    "last_kept": "largest value kept together with its neighbour on the grid",
    "share_kept": "share of the values tried between k2 and last_kept that are kept",
    "searched_to": "largest disturbance tried",
    "rho_kept": "largest distance from the orbit at kept_below",
    "rho_lost": "largest distance from the orbit at k2",
}
"""float64 variables over curve and A."""

NOT_COMPUTED, DONE = -1, 0


@dataclass(frozen=True)
class Limits:
    """What a file of limits holds. Arrays over (curve, A); `n`, the period of the undisturbed orbit, too.

    `done` says what has been computed. `diagram` is float64 (fine A, periods): ξ' of the undisturbed motion.
    """

    A: np.ndarray
    numbers: dict[str, np.ndarray]
    n: np.ndarray
    done: np.ndarray
    how: np.ndarray
    fine: np.ndarray
    diagram: np.ndarray
    criterion: str
    title: str


def load_limits(path: str | Path) -> Limits:
    """Read a file of limits, finished or not. Raises ConfigError if it is none, Damaged, or OSError."""
    with _open(Path(path), "r") as file:
        return _content(file)


def _content(file: h5py.File) -> Limits:
    return Limits(
        A=file["A"][...],
        numbers={name: file[name][...] for name in NUMBERS},
        n=file["n"][...],
        done=file["status"][...] == DONE,
        how=np.char.decode(file["how"][...], "utf-8"),
        fine=file["A_fine"][...],
        diagram=file["section_dxi"][...],
        criterion=str(file.attrs["criterion"]),
        title=str(file.attrs["title"]),
    )


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
        if (np.isnan(found.numbers["k2"]) & found.done & (found.n > 0)).any():
            faults.append("k2: missing where it is marked as computed")
        lines = [
            ("axis", f"A = {found.A[0]:g} to {found.A[-1]:g}, {len(found.A)} values"),
            ("criterion", found.criterion),
        ]
        for c, (disturbance, method) in enumerate(CURVES):
            limits_of = f"{found.done[c].sum()} of {len(found.A)} limits"
            k2 = found.numbers["k2"][c][found.done[c] & np.isfinite(found.numbers["k2"][c])]
            span = f", {k2.min():.3g} to {k2.max():.3g}" if len(k2) else ""
            lines.append((disturbance, f"{method}: {limits_of}{span}"))
        return Summary(found.title, float(found.done.mean()), lines + provenance(file), faults)


@contextmanager
def _open(path: Path, mode: str) -> Iterator[h5py.File]:
    try:
        with reading(path, "limits", mode) as file:
            if file.attrs.get("limits_schema") != SCHEMA:
                raise NoResult(f"{path}: limits_schema = {file.attrs.get('limits_schema')}: must be {SCHEMA}")
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


def write_limit(file: h5py.File, c: int, i: int, found: Limit) -> None:
    """Data first, then the mark that says they are there."""
    rho = {f"rho_{side}": getattr(found, side) for side in ("kept", "lost")}
    for name in NUMBERS:
        if name in rho:
            structure = rho[name]
            file[name][c, i] = structure.rho if structure is not None else np.nan
        else:
            file[name][c, i] = getattr(found, name)
    file["n"][c, i] = found.n
    file["how"][c, i] = found.how.encode()[:HOW_BYTES]
    file.flush()
    file["status"][c, i] = DONE
    file.flush()


def create(path: Path, config: Config, A: np.ndarray, criterion: str) -> None:
    with new_file(path) as file:
        _lay_out(file, config, A, criterion)


def _lay_out(file: h5py.File, config: Config, A: np.ndarray, criterion: str) -> None:
    def variable(name: str, dims: tuple[str, ...], dtype: str, fill: Any, meaning: str) -> None:
        # filled now, not when it is first written: what is laid out does not grow
        netcdf.variable(file, name, dims, dtype, meaning, fill=fill)[...] = fill

    netcdf.dimension(file, "curve", np.arange(len(CURVES), dtype=np.int8), "disturbance and switching path")
    file["curve"].attrs["flag_values"] = np.arange(len(CURVES), dtype=np.int8)
    file["curve"].attrs["flag_meanings"] = " ".join(f"{d}_{m}" for d, m in CURVES)
    netcdf.dimension(file, "A", A, "excitation amplitude")
    netcdf.dimension(file, "A_fine", np.linspace(A.min(), A.max(), FINE), "excitation amplitude of the diagram")
    netcdf.dimension(file, "period", np.arange(1, SHOWN + 1), "recorded excitation period of the diagram")
    for name, meaning in NUMBERS.items():
        variable(name, ("curve", "A"), "<f8", np.nan, meaning)
    variable("n", ("curve", "A"), "<i4", 0, "period of the undisturbed orbit, 0 if it has none")
    variable("how", ("curve", "A"), f"S{HOW_BYTES}", b"", "how the structure was lost")
    variable("status", ("curve", "A"), "<i1", NOT_COMPUTED, "0: computed, -1: not yet")
    variable("section_dxi", ("A_fine", "period"), "<f8", np.nan, "velocity ξ' of the undisturbed motion")
    origin = Origin(config.text, config.overrides, config.title or "Limits of practically orbital stability")
    file.attrs.update(about("limits", origin) | {"limits_schema": SCHEMA, "criterion": criterion})


def refuse_another(file: h5py.File, path: Path, config: Config, criterion: str) -> None:
    """Raise Different unless an open file was made from this configuration."""
    refuse_different(path, differences(file, config.plan(), given=config.arguments, criterion=criterion))
