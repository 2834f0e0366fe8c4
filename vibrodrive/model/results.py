"""Results of a sweep with named axes, in memory or read from a file on access."""

from __future__ import annotations

import copy
import functools
import textwrap
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from inspect import cleandoc
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrodrive.model.above import above
from vibrodrive.model.choices import Status
from vibrodrive.model.described import counted, html_table, numbers, span
from vibrodrive.model.figure import documented
from vibrodrive.model.own import Own
from vibrodrive.model.parameters import as_number, bad, did_you_mean, real_number, unknown, with_sentences
from vibrodrive.model.physical import Measure, measure, with_A_and_B
from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import IMPACT_POWER, QUANTITIES, SECTIONS, length_along, row_of
from vibrodrive.model.records import ERROR, RECORDS, SECTION, quantities
from vibrodrive.model.size import refuse_large_results
from vibrodrive.model.slips import warn
from vibrodrive.model.statuses import Statuses, count_statuses
from vibrodrive.model.variables import constants

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

    from vibrodrive.model.figure import Style, Width

Index = tuple[Any, ...]  # for each axis an int (one value) or slice(None) (all values)

Read = Callable[[str, Index], np.ndarray]
"""Function that returns the array with a given name (such as "section") at an Index."""


class NotRecorded(ValueError, AttributeError):
    """A record without the array that an attribute names. `hasattr` is False, and `getattr` returns its default."""


class Results:
    """Results of `sweep` and `load`: sections, statuses, margins and numbers of switches over the axes of a sweep.

    Each array is read on its first access and kept. At a point that is not computed yet, section and margin are NaN,
    the switches are -1 and the status is Status.NOT_COMPUTED. If a part of an array is damaged in the file, its
    points get the same values. So read an array first, and then the `status` with which you select its points.

    Each of these records adds arrays:

    (the records and their arrays)

    After the last impact the arrays over `impact` are filled with NaN or -1. The error bounds are also one array,
    `error`. If `period` is positive, a summary is taken over one period of the motion. Otherwise it is an estimate from
    the record: extremes are those from the first recorded switch to the last, and all other numbers are means from the
    first to the last main impact with recorded switches more than half an excitation period before and after it, NaN
    without two of these. A period is found if the recorded switches span it. `period` is 0 if they span 64 periods and
    do not repeat. If they span less, it is -2, and the period and `lyapunov` are unknown. At ε = 0 and B < 1 a record
    of 66 periods suffices. A motion that still alternates about the orbit it approaches has the period of this orbit,
    or -2 if the record is too short to show that.

    Files and `to_xarray` describe each array. In them `period` has the name `motion_period`.

    A pickle or copy of the results of a file contains the arrays read so far. It reads the other arrays from
    the absolute path of the file. If the file of another sweep has replaced this file, reading raises
    `vd.errors.Different`, a ValueError. No pickle or copy contains the functions of the record.

    Attributes
    ----------
    axes : dict[str, float64 array]
        the swept parameters, in order. They are dimensionless, or quantities of a `[physical]` scene in SI units
        (alpha in degrees). If an axis is in SI units, A, or A and B, are computed for each point. The axis "point"
        counts the values of parameters that change together. Arrays are dimensionless, also with a scene; figures and
        `to_xarray` are then in SI units, and those of `dimensionless()` are not.
    points : dict[str, float64 array]
        the parameters and quantities of a scene that change together along the axis "point", each with one value for
        each point; empty without this axis.
    scalars : dict[str, float]
        the parameters with one value, and the quantities of the scene, if any, that are not axes.
    settings : Settings
        the settings common to all points, as attributes, such as `settings.transient`.
    record : tuple of str
        names of the records: "section", "impacts", "summary", "error", "limit", "failures", or of functions.
    quantities : tuple of Quantity
        name, type, unit and meaning of each array that the records add. A file of an older version may lack some.
    title : str
        title of the configuration; "" if it has none.
    section : float64 (axes…, periods, 2)
        ξ and ξ' at τ = section_phase + 2πk.
    status : int8 (axes…)
        `Status` of each point; it prints as names and equals them: `r.status == "OK"`. With "error" in the record, OK
        guarantees the complete motion, as in `Trajectory`. Without "error", OK guarantees each switch as if the
        computed state after the previous switch were exact.
    margin : float64 (axes…)
        smallest distance of any decision of a motion from the opposite decision.
    error : float64 (axes…, 2)
        with "error" in the record: bounds of the errors of ξ and ξ', for each motion the largest of all section points.
        They are inf if a decision may be wrong, and NaN with the method "fixed".
    switches : int64 (axes…, 5)
        number of switches into each `State` within the recorded periods.
    shape : tuple of int
        lengths of the axes.
    computed : float
        computed share of the points, 0 to 1.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> r = vd.sweep(A=[1.5, 2.0, 2.5], eps=[0.0, 1e-4], transient=10, periods=4)
    >>> r.shape, list(r.axes)
    ((3, 2), ['A', 'eps'])
    >>> r
    <Results of 3 × 2 points, computed: A 1.5…2.5 (3), eps 0…0.0001 (2); section; certified, 10 + 4 periods; 6 OK>
    >>> print(r.status[0])
    [OK, OK]
    >>> one = r.select(A=2.5, eps=0.0)
    >>> one.section.shape, int(one.switches[vd.State.IMPACT])
    ((4, 2), 4)
    """

    _dimensionless = False

    def __init__(self, plan: Plan, source: Mapping[str, np.ndarray] | Read, title: str = "") -> None:
        self._plan = plan
        self.record, self.quantities, self.settings = plan.record, plan.quantities, plan.settings
        self.axes, self.scalars, self.points = dict(plan.axes), dict(plan.scalars), dict(plan.together)
        self.title = title
        self._origin: Any = None  # of results in a file: its configuration (Origin of store/layout.py)
        self._damaged: Collection[int] = ()  # damaged blocks of the file that the arrays read so far have shown
        self._arrays: dict[str, np.ndarray] = {} if callable(source) else dict(source)
        self._source: Read = source if callable(source) else _no_source

    def __getstate__(self) -> dict[str, Any]:
        """Leave functions of the record out, as a file does. Who reads a pickle need not have them."""
        bare = tuple(record.bare() if isinstance(record, Own) else record for record in self.record)
        return self.__dict__ | {"record": bare, "_plan": replace(self._plan, record=bare)}

    @classmethod
    def uncomputed(cls, plan: Plan) -> Results:
        """Return `new` results without any point. The sections are not initialised."""
        results = cls.new(plan)
        fills = {"status": int(Status.NOT_COMPUTED), "margin": np.nan, "switches": -1}
        for name, value in (fills | {q.name: q.fill for q in plan.quantities}).items():
            results._arrays[name].fill(value)
        return results

    @classmethod
    def new(cls, plan: Plan) -> Results:
        """Allocate results for all points of a plan. They are not initialised.

        Raises TooLarge if the results do not fit into memory.
        """
        refuse_large_results(plan)
        shape, periods = plan.shape, plan.settings.periods
        arrays = {q.name: np.empty((*shape, *length_along(q.along, periods)), q.dtype) for q in plan.quantities}
        arrays |= {"status": np.empty(shape, np.int8), "margin": np.empty(shape)}
        arrays["switches"] = np.empty((*shape, 5), np.int64)
        if plan.sectioned:
            arrays["section"] = np.empty((*shape, periods, 2))
        return cls(plan, arrays)

    def rows(self, start: int, stop: int) -> tuple[np.ndarray | None, np.ndarray, np.ndarray, np.ndarray]:
        """Return (section, status, margin, switches) of the points `start` to `stop` - 1: views with a row for each
        point.

        `section` is None if it is not recorded.
        """
        section = self.section.reshape(-1, self.settings.periods, 2) if SECTION in self.record else None
        return (
            None if section is None else section[start:stop],
            self._array("status").reshape(-1)[start:stop],
            self.margin.reshape(-1)[start:stop],
            self.switches.reshape(-1, 5)[start:stop],
        )

    def put(self, start: int, stop: int, records: Mapping[str, np.ndarray]) -> None:
        """Store the records of the points `start` to `stop` - 1, given as arrays by the names in records.py."""
        for name, values in records.items():
            array = self._arrays[name]
            array.reshape(-1, *array.shape[len(self.axes) :])[start:stop] = values

    def __getattr__(self, name: str) -> np.ndarray:
        if not name.startswith("_") and name in (q.name for q in self.quantities):
            return self._array(name)
        if name.startswith("_") or name not in _WHERE:
            hint = "" if name.startswith("_") else did_you_mean(name, [n for n in (*dir(self), *_WHERE) if n[0] != "_"])
            hint = f": it is {_ELSEWHERE[name]}" if name in _ELSEWHERE else hint
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}{hint}")
        if _WHERE[name] not in self.record:
            contents = "" if name in RECORDS else f", which contains {name}"
            raise NotRecorded(bad("record", ", ".join(self.record), f'extended by "{_WHERE[name]}"{contents}'))
        raise AttributeError(f"{name}: was not recorded by the version of vibrodrive that wrote this file")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(q.name for q in self.quantities)]

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the array of this name, or the values of an axis. Raises KeyError for a name without an array."""
        arrays = [*(record for record in (SECTION, ERROR) if record in self.record), "status", "margin", "switches"]
        arrays += [q.name for q in self.quantities]
        coordinates = self.axes | self.points
        if not isinstance(name, str) or name not in [*arrays, *coordinates]:
            raise KeyError(unknown("name", name, [*arrays, *coordinates]))
        return coordinates[name] if name in coordinates else getattr(self, name)

    __iter__ = None  # otherwise Python would iterate over r[0], r[1], …

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the axes."""
        return self._plan.shape

    @property
    def plan(self) -> Plan:
        """The plan of the sweep (model/plan.py), in blocks of the usual size."""
        return replace(self._plan, tiling=None, stored=self.quantities)

    @property
    def section(self) -> np.ndarray:
        """float64 (axes…, periods, 2): ξ and ξ' at the section. Raises ValueError if it is not recorded."""
        return self._array("section") if SECTION in self.record else self.__getattr__("section")

    @property
    def status(self) -> np.ndarray:
        """int8 (axes…): `Status` of each point; an element is a `Status`."""
        return np.asarray(self._array("status")).view(Statuses)  # asarray: the status of one point is a scalar

    @property
    def margin(self) -> np.ndarray:
        """float64 (axes…): smallest distance of any decision of a motion from the opposite decision."""
        return self._array("margin")

    @property
    def error(self) -> np.ndarray:
        """float64 (axes…, 2): error bounds of ξ and ξ'. Raises ValueError if they are not recorded."""
        if ERROR not in self.record:
            return self.__getattr__("error")
        return np.stack([self.error_xi, self.error_dxi], axis=-1)

    @property
    def switches(self) -> np.ndarray:
        """int64 (axes…, 5): switches into each `State` within the recorded periods."""
        return self._array("switches")

    @property
    def computed(self) -> float:
        """Computed share of the points, 0 to 1."""
        return float(np.mean(self.status != Status.NOT_COMPUTED))

    def select(
        self, method: Literal["nearest"] | None = None, tolerance: float | None = None, **values: float
    ) -> Results:
        """Return the results at one value of each named axis, without these axes.

        Parameters
        ----------
        method : "nearest", optional
            take the nearest value of the axis. By default the axis must contain the value; differences of up to 4 units
            in the last place are allowed.
        tolerance : float, optional
            largest allowed distance of the nearest value. Default: no limit.
        **values : float
            the value for each named axis.

        Raises
        ------
        TypeError, ValueError
            if a name is not an axis of these results, or if the axis does not contain the value.

        Warns
        -----
        UserWarning
            if the nearest value, without a tolerance, is an end of the axis, and `value` is beyond it by more than the
            largest step of the axis.

        Examples
        --------
        >>> import vibrodrive as vd
        >>> r = vd.sweep(A=[1.5, 2.0, 2.5], eps=[0.0, 1e-4], transient=0, periods=1)
        >>> part = r.select(A=2.0)
        >>> part.scalars["A"], list(part.axes)
        (2.0, ['eps'])
        >>> r.select(A=2.1, method="nearest").scalars["A"]
        2.0
        >>> r.select(A=2.1)
        Traceback (most recent call last):
        ...
        ValueError: A = 2.1: must be one of the 3 values of this axis; method="nearest" would select 2.0
        """
        if method is not None and not (isinstance(method, str) and method == "nearest"):
            named = f", or a value by the name of its axis, such as {next(iter(self.axes), 'A')}={method!r}"
            raise ValueError(bad("method", method, '"nearest"' + ("" if values else named)))
        reach = _reach(method, tolerance)
        index = {}
        for name, value in values.items():
            if name not in self.axes:
                raise ValueError(bad("axis", name, "one of " + ", ".join(self.axes)))
            index[name] = _place(name, self.axes[name], value, reach)
        variables = {name: variable.at(index) for name, variable in self._plan.variables.items()}
        scalars = {name: float(variable.values) for name, variable in variables.items() if not variable.dimension}
        plan = replace(self.plan, variables=variables | constants(with_A_and_B(scalars)))
        at = tuple(index.get(name, slice(None)) for name in self.axes)
        part = Results(plan, functools.partial(_read_part, self._source, at), self.title)
        part._dimensionless, part._damaged = self._dimensionless, self._damaged
        part._arrays.update({name: array[at] for name, array in self._arrays.items()})
        return part

    def dimensionless(self) -> Results:
        """Return the same results, whose figures and tables have dimensionless quantities also with a scene."""
        results = copy.copy(self)
        results._dimensionless = True
        return results

    def measure(self, quantity: str) -> Measure:
        """Return the conversion of a quantity to SI units over the axes; one that changes nothing without a scene."""
        return measure(row_of(self.quantities, quantity), self._plan.grid(), self._dimensionless)

    @property
    def varied(self) -> dict[str, np.ndarray]:
        """Values of all parameters and quantities of a scene that vary, along an axis or along `point`."""
        return self._plan.varied

    def to_xarray(self) -> xarray.Dataset:
        """Return all arrays as an `xarray.Dataset`, named as in the files. This needs the extra `data`.

        With a scene the quantities are in SI units, unlike in files and attributes; those of `dimensionless()` are not.
        Without a mass, momenta and energies are per kilogram. The axes are coordinates; the parameters with one value
        and the settings are attributes. Each variable has `units` and a `long_name`, and the status has `flag_values`
        and `flag_meanings`, too.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        ImportError
            if xarray is not installed. The message is one line.

        Examples
        --------
        >>> import vibrodrive as vd
        >>> d = vd.sweep(A=[1.5, 2.0], B=0.1, transient=0, periods=3).to_xarray()
        >>> dict(d.sizes), d.attrs["B"], d.A.attrs["units"]
        ({'A': 2, 'period': 3, 'state': 5}, 0.1, '1')
        >>> d.section_dxi.sel(A=2.0).shape
        (3,)
        """
        return above("a Dataset of results")(self)

    @with_sentences
    def to_dataframe(self, of: Literal["points", "section", "impacts"] = "points") -> pandas.DataFrame:
        """Return a table for pandas, which the extra `data` installs.

        The default has a row for each point, and so no section: `of="section"` has a row for each section point, which
        are also in `to_xarray().section_xi` and `section_dxi`, and `of="impacts"` one for each main impact.

        The columns are the axes, the parameters of `points`, and the arrays of `to_xarray` with one value for each row;
        the status has its name. With a scene those in SI units have the unit in their name, such as x_max_m,
        v_min_m_per_s, impact_power_W; parameters keep their keywords, in the units of the scene. `attrs` contains those
        of `to_xarray`, and the units by column.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        ValueError
            if `of` is another name, or not recorded.
        ImportError
            if pandas is not installed. The message is one line.

        Examples
        --------
        >>> import vibrodrive as vd
        >>> r = vd.sweep(A=[1.5, 3.04], transient=100, periods=64, record=["summary", "section"])
        >>> r.to_dataframe()[["A", "status", "period", "impacts"]]
              A status  period  impacts
        0  1.50     OK       1      1.0
        1  3.04     OK       2      0.5
        >>> r.to_dataframe("section").tail(1).round(4)
                A  period      xi     dxi
        127  3.04      64  1.2155 -2.8904
        """
        return above("a table of results")(self, of)

    @documented
    def plot(
        self,
        kind: str | None = None,
        quantity: str | None = None,
        *,
        x: str | None = None,
        y: str | None = None,
        limits: tuple[float, float] | None = None,
        over: Any = None,
        cmap: str | Colormap | None = None,
        ax: Axes | Sequence[Axes] | None = None,
        style: Style | None = None,
        width: Width | None = None,
        notes: bool | None = None,
    ) -> Figure:
        """Draw a bifurcation diagram, Poincaré sections, a map or limits.

        If neither `kind` nor `quantity` nor `y` is given, the axes and the record determine the kind, whatever the
        number of values. The first condition that is true decides:

        - Without an axis: the Poincaré section of the motion.
        - With the record "limit": the limits over one axis (`vd.plot.limits`), or a map of them.
        - Without sections in the record: a map of the period or, if only impacts are recorded, a diagram of their
          phases.
        - If there are several axes, all of them coordinates of the start (xi0, dxi0, tau0): a map of the last section
          point.
        - Otherwise: a bifurcation diagram. For Poincaré sections of several motions give `kind="poincare"`.

        A quantity of the impacts gives a diagram; a quantity of a map, or `y`, gives a map.

        Parameters
        ----------
        kind : "bifurcation", "poincare" or "map", optional
            kind of the figure.
        quantity : str, optional
            quantity to draw: "dxi" or "xi" of the section, "impact_phase" or "impact_speed" of the main impacts; for a
            map a quantity of the summary, "last_xi" or "last_dxi" of the section, "status" or "margin". Poincaré
            sections have none.
        x, y : str, optional
            axes of the sweep along the abscissa (diagram and map) and along the ordinate (map); by default the longest
            axes.
        limits : (float, float), optional
            range of the quantity (diagram and map); by default that of the values (for a map see `vd.plot.map`).
        over : list of Bifurcation, Results with the record "limit", or a file, a table or a list of these, optional
            lines over a map (see `vd.plot.map`); bifurcations also over a diagram.
        cmap : str or matplotlib Colormap, optional
            colours of the values (diagram and map).

        Raises
        ------
        ValueError
            for an unknown kind, quantity or axis, a quantity that is not recorded, or an argument that has no effect on
            the figure.
        """
        drawn = above("the figure of results")
        shown = {"x": x, "y": y, "limits": limits, "over": over, "cmap": cmap}
        return drawn(self, kind, quantity, **shown, ax=ax, style=style, width=width, notes=notes)

    def _array(self, name: str) -> np.ndarray:
        if name not in self._arrays:
            self._arrays[name] = self._source(name, self._full_index())
            if name != "status" and self._source is not _no_source:
                self._arrays.pop("status", None)  # if the source has found a damaged block, the status has changed
        return self._arrays[name]

    def _described(self) -> dict[str, str]:
        """Return the texts of the repr and of the table for notebooks; the repr begins with "of" and "computed"."""
        s = self.settings
        points = " × ".join(map(str, self.shape)) + " point" + "s" * (self.shape != (1,) * len(self.shape))
        axes = [span(name, values) for name, values in self.axes.items()]
        computed, statuses = self._status_texts()
        return {
            "of": points if self.axes else "one point",
            "computed": computed,
            "axes": ", ".join(axes) + (f" with {', '.join(self.points)}" if self.points else ""),
            "record": ", ".join(self.record),
            "settings": f"{s.method_name}, {s.transient} + {counted(s.periods, 'period')}",
            "status": statuses,
        }

    def _status_texts(self) -> tuple[str, str]:
        """Return (computed share, numbers of points with each status) as texts.

        A status read from a file is not kept here, because the file may grow before the other arrays are read.
        """
        try:
            in_memory = "status" in self._arrays
            status = self._arrays["status"] if in_memory else self._source("status", self._full_index())
        except (OSError, ValueError):  # missing or damaged file; an access to any array raises the error
            return "not readable", ""
        share = float(np.mean(status != Status.NOT_COMPUTED))
        statuses = ", ".join(f"{n} {name}" for name, n in count_statuses(status).items())
        return "computed" if share == 1 else f"{100 * share:.1f} % computed", statuses

    def _full_index(self) -> Index:
        return (slice(None),) * len(self.axes)

    def __repr__(self) -> str:
        of, computed, *texts = self._described().values()
        return f"<{type(self).__name__} of {of}, {computed}: {'; '.join(filter(None, texts))}>"

    def _repr_html_(self) -> str:
        fixed = numbers(self.scalars)
        rows = [("title", self.title), *self._described().items(), ("fixed", fixed)]
        return html_table(type(self).__name__, rows)


def _records_in_words() -> str:
    """Return the records and their arrays as a list for the docstring of Results."""
    lines = []
    for record in RECORDS.values():
        if rows := quantities((record,)):
            along = f"(axes…, {rows[0].along})" if rows[0].along else "the axes"
            text = f'- "{record}" adds arrays over {along}: {", ".join(q.name for q in rows)}.'
            lines += textwrap.wrap(text, 112, subsequent_indent="  ")
    return "\n".join(lines)


if Results.__doc__:  # not with -OO
    Results.__doc__ = cleandoc(Results.__doc__).replace("(the records and their arrays)", _records_in_words())

ATTRIBUTES = ("axes", "points", "scalars", "settings", "record", "quantities", "title")
"""Attributes of each object of Results, which `dir(Results)` does not contain."""

_WHERE = {q.name: record for record in RECORDS.values() for q in quantities((record,))}
_WHERE |= {"section": SECTION, "error": ERROR}

_ELSEWHERE = {
    **{q.stored: q.name for q in QUANTITIES.values() if q.stored},
    **{q.stored: f"section[..., {k}]" for k, q in enumerate(SECTIONS)},
    IMPACT_POWER.name: f"{IMPACT_POWER.source} or, in W with a scene, to_xarray().{IMPACT_POWER.name}",
}
"""Attributes that have other names in files and figures."""


def _no_source(name: str, index: Index) -> np.ndarray:
    """Raise KeyError. This is the source of results that have all arrays in memory."""
    raise KeyError(name)


def _read_part(source: Read, chosen: Index, name: str, inner: Index) -> np.ndarray:
    """Read an array at `inner`, an Index of the axes that remain after the selection `chosen`."""
    places = iter(inner)
    return source(name, tuple(next(places) if isinstance(c, slice) else c for c in chosen))


ROUNDING = 4
"""Largest difference of two values that count as equal, in units in the last place of the largest value of the axis."""


def _reach(method: str | None, tolerance: object) -> float | None:
    """Return the allowed distance from a value of an axis, or None if only rounding is allowed.

    Raises ValueError or TypeError.
    """
    if tolerance is None:
        return None if method is None else np.inf
    if method is None:
        raise ValueError(bad("tolerance", tolerance, 'left out, or given with method="nearest"'))
    allowed = "a number >= 0"
    reach = real_number("tolerance", tolerance, allowed)
    if not reach >= 0:
        raise ValueError(bad("tolerance", tolerance, allowed))
    return reach


def _place(name: str, axis: np.ndarray, value: object, reach: float | None) -> int:
    """Return the index of a value on an axis; `reach` is the result of `_reach`. Raises TypeError or ValueError."""
    value = as_number(name, value, "one number")
    if isinstance(value, list | tuple | slice) or getattr(value, "shape", None):
        raise TypeError(bad(name, value, f"one number; to_xarray().sel({name}=…) selects several values, or a range"))
    only = f"{axis[0].item()!r}, the one value of this axis"
    allowed = f"one of the {len(axis)} values of this axis" if len(axis) > 1 else only
    x = real_number(name, value, allowed)
    if not np.isfinite(x):
        raise ValueError(bad(name, value, allowed))
    distance = np.abs(axis - x)
    at = int(np.argmin(distance))
    most = ROUNDING * np.spacing(float(np.abs(axis).max())) if reach is None else reach
    if not distance[at] <= most:
        if reach is None:
            allowed += f'; method="nearest" would select {axis[at].item()!r}'
        else:
            allowed = f"within {reach:g} of {allowed}, of which the nearest is {axis[at].item()!r}"
        raise ValueError(bad(name, value, allowed))
    step = np.diff(np.sort(axis)).max() if len(axis) > 1 else abs(axis[0])
    if reach == np.inf and not axis.min() - step <= x <= axis.max() + step:
        warn([f"{name} = {x:g}: outside of the axis, {axis.min():g} to {axis.max():g}; {axis[at]:g} is selected"])
    return at
