"""Parameters and quantities of a scene as variables over dimensions, as in netCDF.

A variable with one value has no dimension. An axis of a sweep is a variable along the dimension of its own name.
Parameters that change together are variables along the dimension `point`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import numpy as np

POINT = "point"  # dimension along which parameters change together; its coordinates are 0, 1, …


class Variable(NamedTuple):
    """A value, or values float64 (n,) along a dimension."""

    values: Any
    dimension: str = ""

    def at(self, index: Mapping[str, Any]) -> Variable:
        """Return the variable at places along dimensions, by name: numbers, or arrays of numbers, of values."""
        return Variable(self.values[index[self.dimension]]) if self.dimension in index else self


Variables = Mapping[str, Variable]
"""Variables by name. Their dimensions have the order in which they occur."""


def constants(values: Mapping[str, float]) -> dict[str, Variable]:
    """Return variables without a dimension."""
    return {name: Variable(value) for name, value in values.items()}


def along(dimension: str, values: Mapping[str, np.ndarray]) -> dict[str, Variable]:
    """Return variables along one dimension."""
    return {name: Variable(array, dimension) for name, array in values.items()}
