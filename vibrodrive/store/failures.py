"""The failure map over two axes: into a file, with the line beyond which the structure of the motion is lost.

HDF5 with netCDF-4 dimension scales: `method` × the two axes of the configuration for the counts, and `limit` over
`method` and A, the smallest disturbance along the other axis at which order or gaps fail (limit.py).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from vibrodrive.errors import ConfigError, Damaged, NoResult
from vibrodrive.model.above import above
from vibrodrive.model.config import Config, parse
from vibrodrive.model.described import Described, numbers, span
from vibrodrive.stability.failures import KINDS, METHODS
from vibrodrive.stability.limit import PERIODS
from vibrodrive.store import netcdf
from vibrodrive.store.describe import explained, plain
from vibrodrive.store.file import Summary, axis_facts, axis_line, find_faults, reading, versions_of
from vibrodrive.store.layout import Origin, about

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SECOND = ("dtau", "eps")
"""What may lie across A."""


CONTENTS = (
    "For each method and point of the axes, how many switches of the motion were judged, against the exact one from "
    "the same state, and how many of them were missed, late or wrongly decided; `limit`: where the motion loses its "
    "structure, from `periods` recorded periods."
)
"""Of a file, for a reader who sees nothing else."""


@dataclass(frozen=True, repr=False)
class FailureMap(Described):
    """Counts int64 (method, A, other) by kind and `judged`; `limit` float64 (method, A), inf where none was found."""

    A: np.ndarray
    name: str
    other: np.ndarray
    judged: np.ndarray
    counts: dict[str, np.ndarray]
    limit: np.ndarray
    scalars: dict[str, float]
    settings: dict[str, int]

    @property
    def shared(self) -> dict[str, Any]:
        """Parameters and settings of all points, by name."""
        return {**self.scalars, **self.settings}

    def share(self, kind: str) -> np.ndarray:
        """Share of the judged switches that failed in this way; NaN where the mass never moved."""
        with np.errstate(invalid="ignore"):
            return self.counts[kind] / np.where(self.judged > 0, self.judged, np.nan)

    def plot(self, *, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """The share of the switches that are missed, late or wrong, for each method.

        Parameters
        ----------
        ax : sequence of six matplotlib Axes, optional
            where to draw, method by method; a new figure unless given.

        Returns
        -------
        Figure
            which shows itself in a notebook; `savefig` writes it.
        """
        return above("figures.failures").failures_figure(self, ax=ax)

    def failed(self, m: int) -> dict[str, int]:
        """How many switches of a method, by its number, were judged, and how many failed in each way."""
        return {"judged": int(self.judged[m].sum()), **{k: int(self.counts[k][m].sum()) for k in KINDS}}

    def _described(self) -> dict[str, str]:
        return {
            "of": f"{len(METHODS)} methods at {len(self.A)} × {len(self.other)} points",
            "computed": "computed",
            "axes": f"{span('A', self.A)}, {span(self.name, self.other)}",
            "methods": ", ".join(METHODS),
        }

    def _more(self) -> dict[str, str]:
        switches = {method: _switches_line(self.failed(m)) for m, method in enumerate(METHODS)}
        return {"fixed": numbers(self.scalars), **switches}


def _switches_line(count: dict[str, int]) -> str:
    return f"{count['judged']} switches judged: {', '.join(f'{count[kind]} {kind}' for kind in KINDS)}"


def lay_out(file: h5py.File, axes: dict[str, np.ndarray], shape: tuple[int, ...], config: Config) -> None:
    for name, values in {"method": np.arange(len(METHODS)), **axes}.items():
        netcdf.dimension(file, name, values, name)
    file["method"].attrs["names"] = ", ".join(METHODS)
    for kind in ("judged", *KINDS):
        meaning = "switches judged" if kind == "judged" else f"switches {kind}"
        netcdf.variable(file, kind, ("method", *axes), np.int64, meaning, fill=-1, chunks=(1, 1, shape[-1]))
    meaning = "smallest disturbance at which order or gaps are lost"
    netcdf.variable(file, "limit", ("method", "A"), np.float64, meaning, fill=np.nan)
    plan = config.plan()
    shared = {name: value for name, value in plain(plan).items() if name not in ("method", "scan", "record")}
    shared["periods"] = config.arguments.get("periods", PERIODS)
    file.attrs.update(
        about("failures", Origin(config.text, config.overrides, config.title or "Failures of the usual methods"))
        | explained(CONTENTS, shared)
        | {"scalars": json.dumps({k: v for k, v in plan.scalars.items() if v == v})}
    )


def load_failures(path: str | Path) -> FailureMap:
    """Read a file that `run_failures` wrote.

    Raises
    ------
    ConfigError
        if it is none.
    Damaged
        if it makes no sense.
    OSError
        if the system refuses.
    """
    try:
        with reading(Path(path), "failures") as file:
            return _content(file)
    except Damaged:
        raise
    except NoResult as error:
        raise ConfigError(f"{error} (a failure map made by `vibrodrive atlas` is wanted)") from None


def _content(file: h5py.File) -> FailureMap:
    plan = parse(str(file.attrs["config"]), json.loads(file.attrs["overrides"])).plan()
    other = next((name for name in SECOND if name in file), SECOND[0])
    return FailureMap(
        A=file["A"][...],
        name=other,
        other=file[other][...],
        judged=file["judged"][...],
        counts={kind: file[kind][...] for kind in KINDS},
        limit=file["limit"][...],
        scalars=json.loads(file.attrs["scalars"]),
        settings=dict(vars(plan.settings)),
    )


def summary(path: Path, thorough: bool = False) -> Summary:
    """What a failure map holds; `thorough` reads everything and looks for faults. Raises NoResult, Damaged, OSError."""
    with reading(path, "failures") as file:
        title = str(file.attrs["title"])
        faults = find_faults(file) if thorough else []
        if faults:
            return Summary(title, 1.0, [], faults)
        found = _content(file)
        if (found.judged < sum(found.counts.values())).any() or min(c.min() for c in found.counts.values()) < 0:
            faults.append("judged: fewer than failed")
        axes = {"A": found.A, found.name: found.other}
        switches = {method: found.failed(m) for m, method in enumerate(METHODS)}
        lines = [axis_line(name, values) for name, values in axes.items()]
        lines += [(method, _switches_line(count)) for method, count in switches.items()]
        facts = {
            "axes": {name: axis_facts(values) for name, values in axes.items()}, "parameters": found.scalars,
            "switches": switches, "versions": versions_of(file),
        }  # fmt: skip
        return Summary(title, 1.0, lines, faults, facts)
