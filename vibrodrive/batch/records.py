"""Conversion of the arrays that kernels write into the arrays of results and files."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrodrive.batch.block import Block
from vibrodrive.kernels.outputs import Errors
from vibrodrive.kernels.summary import OUT
from vibrodrive.model.choices import Method
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import ERROR, IMPACTS, SUMMARY

Rows = tuple[np.ndarray | None, np.ndarray, np.ndarray, np.ndarray]


class Arrays(NamedTuple):
    """Arrays that kernels fill, with one row for each point. An array is None if its quantity is not recorded."""

    section: np.ndarray | None  # float64 (points, periods, 2)
    status: np.ndarray  # int8 (points,)
    margin: np.ndarray  # float64 (points,)
    counts: np.ndarray  # int64 (points, states)
    impacts: np.ndarray | None = None  # float64 (points, 2 × periods, 4): main impacts, kernels/record.py
    summary: np.ndarray | None = None  # float64 (points, OUT), kernels/summary.py
    errors: Errors | None = None  # bounds of errors, kernels/certainty.py

    @classmethod
    def new(cls, plan: Plan, n: int, rows: Rows | None = None) -> Arrays:
        """Allocate the arrays for n points of a plan. `rows` may give the first four (`Results.rows`)."""
        periods = plan.settings.periods
        if rows is None:
            section = np.empty((n, periods, 2)) if plan.sectioned else None
            rows = section, np.empty(n, np.int8), np.empty(n), np.empty((n, 5), np.int64)
        section, status, margin, counts = rows
        impacts = np.empty((n, 2 * periods, 4)) if IMPACTS in plan.record else None
        summary = np.empty((n, OUT)) if plan.summarised else None
        bound = np.nan if plan.settings.method == Method.FIXED else 0.0  # its kernels compute no bounds
        errors = Errors(np.full((n, 1, 2), bound), np.full(n, bound)) if plan.bounded else None
        return cls(section, status, margin, counts, impacts, summary, errors)

    def block(self, span: tuple[int, int, int], at: int) -> Block:
        """Return the block (index, start, stop) whose first point is in row `at`."""
        part = slice(at, at + span[2] - span[1])
        section = None if self.section is None else self.section[part]
        return Block(*span, section, self.status[part], self.margin[part], self.counts[part], self.quantities(part))

    def quantities(self, part: slice = slice(None)) -> dict[str, np.ndarray]:
        """Return the rows `part` of all other arrays by the names in model/records.py."""
        arrays: dict[str, np.ndarray] = {}
        if self.summary is not None:
            for column, q in enumerate(SUMMARY.quantities):
                arrays[q.name] = self.summary[part, column].astype(q.dtype)
        if self.impacts is not None:
            impacts = self.impacts[part]
            missing = np.isnan(impacts[..., 0])
            between = np.diff(impacts[..., 3], axis=1, prepend=np.nan) - 1.0
            for q, column in zip(IMPACTS.quantities, (*np.moveaxis(impacts[..., :3], -1, 0), between), strict=True):
                if np.dtype(q.dtype).kind == "i":
                    column = np.where(missing | np.isnan(column), q.fill, column)
                arrays[q.name] = column.astype(q.dtype)
        if self.errors is not None:
            columns = *self.errors.section[part, 0].T, self.errors.until[part]
            arrays.update(zip((q.name for q in ERROR.quantities), columns, strict=True))
        return arrays
