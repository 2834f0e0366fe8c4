"""File of a failure map: the numbers of switches that a grid method misses, finds late or follows by a wrong state.

It is HDF5 with netCDF-4 dimension scales. The numbers have the dimensions `method` and the two axes of the
configuration. The variable `limit` has the dimensions `method` and A. It is the smallest disturbance along the other
axis at which the main impacts lose their order or their gaps, the periods between them (`stability.limit`).
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from vibrodrive.model.config import Config
from vibrodrive.model.described import Stored, axis_facts
from vibrodrive.model.kinds import above
from vibrodrive.stability.failures import JUDGED, KINDS, METHODS
from vibrodrive.stability.limit import PERIODS
from vibrodrive.store import netcdf
from vibrodrive.store.compare import altered
from vibrodrive.store.describe import explained, plain
from vibrodrive.store.header import origin_of
from vibrodrive.store.layout import Origin, about

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SECOND = ("dtau", "eps")

CONTENTS = (
    f"For each method and point of the axes: the number of switches that were judged in the first {JUDGED} recorded "
    "periods, each by comparison with the exact switch from the same state, and the numbers of those that were missed, "
    "late or wrongly decided. `limit`: the disturbance at which the motion loses its structure, judged over `periods` "
    "recorded periods."
)


@dataclass(frozen=True, repr=False)
class FailureMap(Stored):
    """Map of failures over A and another axis; `name` is the name of the other axis, and `other` its values.

    `judged` is the number of switches compared with the exact switch, and `counts` the number of failures by kind,
    int64 (method, A, other). `limit` is the smallest disturbance at which the structure of the motion (the pattern of
    its impacts) is lost, float64 (method, A); inf if there is none.
    `plot` draws the shares of missed, late and wrong switches for each method in six panels.
    """

    file_kind = "failures"

    A: np.ndarray
    name: str
    other: np.ndarray
    judged: np.ndarray
    counts: dict[str, np.ndarray]
    limit: np.ndarray
    scalars: dict[str, float]
    settings: dict[str, int]
    title: str = ""

    @property
    def shared(self) -> dict[str, Any]:
        """Parameters and settings common to all points, by name."""
        return {**self.scalars, **self.settings}

    def share(self, kind: str) -> np.ndarray:
        """Return the share of the judged switches that have this failure; NaN if the mass never moves."""
        with np.errstate(invalid="ignore"):
            return self.counts[kind] / np.where(self.judged > 0, self.judged, np.nan)

    def _drawn(self, **options: Any) -> Figure:
        return above("the figure of failures")(self, **options)

    def facts(self) -> dict[str, Any]:
        return {
            "axes": {name: axis_facts(values) for name, values in (("A", self.A), (self.name, self.other))},
            "parameters": self.scalars,
            "switches": {method: self.failed(m) for m, method in enumerate(METHODS)},
        }

    def failed(self, m: int) -> dict[str, int]:
        """Return the number of judged switches and of failures of each kind, by name, for the method with number m."""
        return {"judged": int(self.judged[m].sum()), **{k: int(self.counts[k][m].sum()) for k in KINDS}}


def lay_out(file: h5py.File, config: Config) -> None:
    """Lay out an empty file for the axes of a configuration."""
    plan = config.plan()
    axes = plan.axes
    for name, values in {"method": np.arange(len(METHODS)), **axes}.items():
        netcdf.dimension(file, name, values, name)
    file["method"].attrs["names"] = ", ".join(METHODS)
    for kind in ("judged", *KINDS):
        meaning = "switches judged" if kind == "judged" else f"switches {kind}"
        netcdf.variable(file, kind, ("method", *axes), np.int64, meaning, fill=-1, chunks=(1, 1, plan.shape[-1]))
    meaning = "smallest disturbance at which order or gaps are lost"
    netcdf.variable(file, "limit", ("method", "A"), np.float64, meaning, fill=np.nan)
    shared = {name: value for name, value in plain(plan).items() if name not in ("method", "scan", "record")}
    shared["periods"] = config.arguments.get("periods", PERIODS)
    file.attrs.update(
        about("failures", Origin.of(config, "Failures of the usual methods"))
        | explained(CONTENTS, shared)
        | {"scalars": json.dumps({k: v for k, v in plan.scalars.items() if v == v})}
    )


def read(file: h5py.File) -> FailureMap:
    """Read an open file of failures."""
    plan = origin_of(file).parsed().plan()
    other = next((name for name in SECOND if name in file), SECOND[0])
    return FailureMap(
        A=file["A"][...],
        name=other,
        other=file[other][...],
        judged=file["judged"][...],
        counts={kind: file[kind][...] for kind in KINDS},
        limit=file["limit"][...],
        scalars={k: v for k, v in plan.scalars.items() if v == v},
        settings=dict(vars(plan.settings)),
        title=str(file.attrs["title"]),
    )


def faults(file: h5py.File, found: FailureMap) -> list[str]:
    """Return contradictions in a complete file."""
    wrong = altered(file, periods=PERIODS)
    if (found.judged < sum(found.counts.values())).any() or min(c.min() for c in found.counts.values()) < 0:
        wrong.append("judged: less than the sum of the failures")
    return wrong
