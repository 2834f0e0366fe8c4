"""What a sweep found, with named axes: from memory, or read from a file on access."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrodrive.model.parameters import Method, Status, bad, real_number
from vibrodrive.model.physical import with_A_and_B
from vibrodrive.model.plan import Plan, Settings
from vibrodrive.model.records import IMPACTS, MAIN_IMPACTS, SECTION, SUMMARIES, SUMMARY, quantities
from vibrodrive.model.size import refuse_large_results

if TYPE_CHECKING:
    from vibrodrive.model.block import Block

Index = tuple[Any, ...]
"""An int (one value) or slice(None) (all of them) for every axis."""

Read = Callable[[str, Index], np.ndarray]
"""Array `name` ("section", "status", "margin", "switches") at an Index."""


class Results:
    """Sections, statuses, margins and switch counts over the axes of a sweep: what `sweep` and `load` return.

    The arrays are read on first access and kept. In what has not been computed yet the section and
    the margin are NaN, the switches -1 and the status is Status.NOT_COMPUTED.

    What else there is depends on `record`. A summary has, over the axes, and per excitation period where it adds up:
    period, sequence, gaps; impacts, impact_speed_max, impact_speed_mean, momentum, energy; friction_loss, drive_work;
    xi_max, dxi_min, dxi_max; lyapunov; share_up, share_down, share_stick, share_rest. Impacts have, over
    (axes…, impact), NaN or -1 behind the last: impact_period, impact_phase, impact_speed, impact_states. What each of
    them is stands in records.py and in the files.

    Pickled, or copied, results of a file go on reading it, by its absolute path; what has been read goes with them.

    Attributes
    ----------
    axes : dict[str, float64 array]
        the swept parameters, in order: dimensionless, or quantities of a `[physical]` scene in SI units (alpha in
        degrees), along which A, or A and B, follow point by point.
    scalars : dict[str, float]
        the parameters that have one value; where an axis is in SI units, the rest of the scene, too.
    settings : Settings
        method, scan, transient, periods, budget.
    record : tuple of str
        what was recorded: "section", "impacts", "summary".
    title : str
        that of the configuration, "" where there was none.
    section : float64 (axes…, periods, 2)
        ξ and ξ' at τ = section_phase + 2πk.
    status : int8 (axes…)
        `Status` of every point.
    margin : float64 (axes…)
        how close the closest decision of a point came to going the other way.
    switches : int64 (axes…, 5)
        how often each `State` was entered within the recorded periods.
    shape : tuple of int
        lengths of the axes.
    computed : float
        share of the points that are computed, 0 to 1.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> r = vd.sweep(A=[1.5, 2.0, 2.5], eps=[0.0, 1e-4], transient=10, periods=4)
    >>> r.shape, list(r.axes)
    ((3, 2), ['A', 'eps'])
    >>> bool((r.status == vd.Status.OK).all())
    True
    >>> one = r.select(A=2.5, eps=0.0)
    >>> one.section.shape, int(one.switches[vd.State.IMPACT])
    ((4, 2), 4)
    """

    def __init__(
        self,
        axes: Mapping[str, np.ndarray],
        scalars: Mapping[str, float],
        settings: Settings,
        source: Mapping[str, np.ndarray] | Read,
        title: str = "",
        record: tuple[str, ...] = (SECTION,),
    ) -> None:
        self.record = record
        self.axes = dict(axes)
        self.scalars = dict(scalars)
        self.settings = settings
        self.title = title
        self._arrays: dict[str, np.ndarray] = {}
        self._source: Read
        if callable(source):
            self._source = source
        else:
            self._arrays.update(source)
            self._source = _no_more

    @classmethod
    def collect(cls, plan: Plan, blocks: Iterable[Block]) -> Results:
        """All blocks of a plan, in memory. Raises TooLarge (a ValueError) where they do not fit it."""
        results = cls.uncomputed(plan)
        section, status, margin, switches = results.rows(0, plan.n_points)
        for b in blocks:
            if section is not None:
                section[b.start : b.stop] = b.section
            results.put(b.start, b.stop, b.records)
            status[b.start : b.stop] = b.status
            margin[b.start : b.stop] = b.margin
            switches[b.start : b.stop] = b.switches
        if section is not None:
            section[status == int(Status.NOT_COMPUTED)] = np.nan
        return results

    @classmethod
    def uncomputed(cls, plan: Plan) -> Results:
        """Memory for all points of a plan, their sections not set yet. Raises TooLarge where it does not fit."""
        refuse_large_results(plan)
        shape = plan.shape
        extra = {"": (), "impact": (2 * plan.settings.periods,)}
        arrays: dict[str, np.ndarray] = {
            **{q.name: np.full((*shape, *extra[q.along]), q.fill, q.dtype) for q in quantities(plan.record)},
            "status": np.full(shape, int(Status.NOT_COMPUTED), np.int8),
            "margin": np.full(shape, np.nan),
            "switches": np.full((*shape, 5), -1, np.int64),
        }
        if SECTION in plan.record:
            arrays["section"] = np.empty((*shape, plan.settings.periods, 2))
        return cls(plan.axes, plan.scalars, plan.settings, arrays, record=plan.record)

    def rows(self, start: int, stop: int) -> tuple[np.ndarray | None, np.ndarray, np.ndarray, np.ndarray]:
        """Views of section (if it is recorded), status, margin and switches of the points start..stop, flattened."""
        wanted = SECTION in self.record
        return (
            self.section.reshape(-1, self.settings.periods, 2)[start:stop] if wanted else None,
            self.status.reshape(-1)[start:stop],
            self.margin.reshape(-1)[start:stop],
            self.switches.reshape(-1, 5)[start:stop],
        )

    def put(self, start: int, stop: int, records: Mapping[str, np.ndarray]) -> None:
        """Take what was recorded of the points start..stop, by the names of records.py."""
        for name, values in records.items():
            array = self._arrays[name]
            array.reshape(-1, *array.shape[len(self.axes) :])[start:stop] = values

    def __getattr__(self, name: str) -> np.ndarray:
        if name.startswith("_") or name not in _WHERE:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        if name not in (q.name for q in quantities(self.record)):
            raise AttributeError(bad("record", ", ".join(self.record), f'with "{_WHERE[name]}" for {name} to be known'))
        return self._array(name)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(q.name for q in quantities(self.record))]

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the axes."""
        return tuple(len(a) for a in self.axes.values())

    @property
    def section(self) -> np.ndarray:
        """float64 (axes…, periods, 2): ξ and ξ' at the instants of the section. ValueError if it is not recorded."""
        if SECTION not in self.record:
            raise ValueError(bad("record", ", ".join(self.record), f'with "{SECTION}" for the section to be known'))
        return self._array("section")

    @property
    def status(self) -> np.ndarray:
        """int8 (axes…): `Status` of every point."""
        return self._array("status")

    @property
    def margin(self) -> np.ndarray:
        """float64 (axes…): how close the closest decision came to going the other way."""
        return self._array("margin")

    @property
    def switches(self) -> np.ndarray:
        """int64 (axes…, 5): switches into each `State` within the recorded periods."""
        return self._array("switches")

    @property
    def computed(self) -> float:
        """Share of the points that are computed, 0 to 1."""
        return float(np.mean(self.status != Status.NOT_COMPUTED))

    def select(self, **values: float) -> Results:
        """The part of the results at the value of an axis nearest to the one given; that axis is dropped.

        Raises
        ------
        TypeError, ValueError
            if a name is no axis of these results, or a value no number between the ends of its axis.

        Examples
        --------
        >>> import vibrodrive as vd
        >>> r = vd.sweep(A=[1.5, 2.0, 2.5], eps=[0.0, 1e-4], transient=0, periods=1)
        >>> part = r.select(A=2.1)
        >>> part.scalars["A"], list(part.axes)
        (2.0, ['eps'])
        """
        index: list[Any] = [slice(None)] * len(self.axes)
        axes, scalars = dict(self.axes), dict(self.scalars)
        for name, value in values.items():
            if name not in self.axes:
                raise ValueError(bad("axis", name, "one of " + ", ".join(self.axes)))
            nearest = _nearest(name, self.axes[name], value)
            index[list(self.axes).index(name)] = nearest
            scalars[name] = float(axes.pop(name)[nearest])
        chosen = tuple(index)
        scalars = with_A_and_B(scalars)
        part = Results(
            axes, scalars, self.settings, functools.partial(_read_part, self._source, chosen), self.title, self.record
        )
        part._arrays.update({name: array[chosen] for name, array in self._arrays.items()})
        return part

    def _array(self, name: str) -> np.ndarray:
        if name not in self._arrays:
            self._arrays[name] = self._source(name, (slice(None),) * len(self.axes))
        return self._arrays[name]

    def __repr__(self) -> str:
        axes = ", ".join(
            f"{name} {a[0]:g}" + (f"…{a[-1]:g} ({len(a)})" if len(a) > 1 else "") for name, a in self.axes.items()
        )
        s = self.settings
        return (
            f"<Results {axes or 'of one point'}: {Method(s.method).name.lower()}, {s.transient} + {s.periods} periods>"
        )


_WHERE = {q.name: record for record, known in ((SUMMARY, SUMMARIES), (IMPACTS, MAIN_IMPACTS)) for q in known}
"""The record that each quantity is of."""


def _no_more(name: str, index: Index) -> np.ndarray:
    """The source of results that are in memory as a whole."""
    raise KeyError(name)


def _read_part(source: Read, chosen: Index, name: str, inner: Index) -> np.ndarray:
    """The values of `source` at `inner`, an index over the axes that `chosen` left."""
    return source(name, _within(chosen, inner))


SLACK = 1e-9
"""How far beyond the ends of an axis, in parts of their size, a value is still taken for the end: rounding."""


def _nearest(name: str, axis: np.ndarray, value: object) -> int:
    """Where on an axis the value nearest to the one given is. Raises TypeError or ValueError with the one sentence."""
    low, high = float(axis.min()), float(axis.max())
    allowed = f"a number between {low:g} and {high:g}, the ends of this axis"
    if low == high:
        allowed = f"{low:g}, the one value of this axis"
    x = real_number(name, value, allowed)
    slack = SLACK * max(abs(low), abs(high))
    if not low - slack <= x <= high + slack:
        raise ValueError(bad(name, value, allowed))
    return int(np.argmin(np.abs(axis - x)))


def _within(chosen: Index, inner: Index) -> Index:
    """`inner`, an index over the axes that `chosen` left, as an index over all of them."""
    rest = iter(inner)
    return tuple(next(rest) if isinstance(c, slice) else c for c in chosen)
