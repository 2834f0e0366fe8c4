"""Limits k₂ of the paper: of the impacts over axes, and of any other property of a motion at one point."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal

import numpy as np

import vibrodrive as vd
from vibrodrive.stability.limit import LimitSearch, plan_limits
from vibrodrive.stability.limit_search import GRIDS, search_band

KINDS: dict[str, Literal["eps", "dtau"]] = {"ε": "eps", "Δτ": "dtau"}  # disturbances by their symbols


def limits(disturbance: str, **axes: Any) -> list[Any]:
    """Return the limits k₂ of the impacts at all points of axes of A, B and η, the last axis fastest.

    `axes` are arguments of `vd.limit`. Each result has the attributes of the result of `vd.limit`.
    """
    found = dict(LimitSearch(plan_limits({"transient": 1000, "periods": 1500, **axes}, disturbance)).run())
    return [found[at] for at in range(len(found))]


def band(disturbance: str, kept: Callable[[np.ndarray], np.ndarray]) -> Any:
    """Return the band from the first value of a disturbance at which a property is lost to the last one that keeps it.

    kept : returns, for values of the disturbance, float64 (k,), whether the property is kept, bool (k,).

    The values tried are those of `vd.limit`. The result has the attributes `lost`, `kept_below`, `last_kept`,
    `share_kept` and `searched_to`, which correspond to those of `vd.limit`.
    """
    search = search_band(GRIDS[disturbance])
    values = next(search)
    while True:
        try:
            values = search.send(kept(values))
        except StopIteration as end:
            return end.value


def band_of_motions(disturbance: str, kept: Callable[[vd.Trajectory], bool], **point: Any) -> Any:
    """Return the `band` of a property of a motion, at the arguments of `simulate` in `point`."""

    def answers(values: np.ndarray) -> np.ndarray:
        return np.array(
            list(pool.map(lambda value: kept(vd.simulate(**point | {disturbance: value})), values.tolist()))
        )

    with ThreadPoolExecutor() as pool:
        return band(disturbance, answers)
