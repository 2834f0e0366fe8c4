"""Every kind of file: `vd.load` reads it, equal runs make equal files, and its attributes describe its contents."""

import re
from dataclasses import replace

import h5py
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from vibrodrive.model.kinds import ABOVE, FILES, named
from vibrodrive.store.every_kind import summary

import vibrodrive as vd
from tests.store import test_curves
from tests.support import fake
from tests.support.process import python
from vibrodrive.errors import OtherKind
from vibrodrive.model.config import parse
from vibrodrive.periodic.bifurcations import Bifurcation
from vibrodrive.periodic.family import Family
from vibrodrive.periodic.search import Orbit
from vibrodrive.store import curves, failures, limits, netcdf, orbits
from vibrodrive.store.checksums import content_digest
from vibrodrive.store.layout import Origin

ORBIT = Orbit(
    1, 1, np.array([2.0]), np.array([-1.0]), np.array([1]), -0.5, "stable", "UP DOWN IMPACT", 2.0, 0.1, ("UP",)
)


def a_sweep(path):
    fake.write(path, "[sweep]\nA = [1.0, 2.0]\neps = [0.0]\n[run]\nperiods = 3\n")


def some_limits(path):
    config = parse("[sweep]\nA = [1.0, 2.0]\n")
    limits.create(path, config, config.plan().axes, "word")


def some_curves(path):
    curves.save(path, test_curves.made(), test_curves.ORIGIN)


def some_failures(path):
    config = parse("[sweep]\nA = [1.0, 2.0]\ndtau = [0.1, 0.2]\n")
    with h5py.File(path, "w") as file:
        failures.lay_out(file, config)
        for kind in ("judged", *failures.KINDS):
            file[kind][...] = 0


def some_orbits(path):
    bifurcation = Bifurcation(2.0, "fold", ORBIT, 1.0, 1.0)
    found = [[ORBIT], [replace(ORBIT, A=2.1)]]
    orbits.save(path, Family(np.array([2.0, 2.1]), 0.1, 1, found, [bifurcation]), Origin(""), 0.0)


def no_orbits(path):
    orbits.save(path, Family(np.array([0.5]), 0.1, 1, [[]], []), Origin(""), 0.0)


MAKERS = {
    "sweep": (a_sweep, vd.Results),
    "limits": (some_limits, limits.Limits),
    "failures": (some_failures, failures.FailureMap),
    "orbits": (some_orbits, orbits.StoredOrbits),
    "curves": (some_curves, curves.StoredCurves),
}

each = pytest.mark.parametrize("kind", MAKERS)


@pytest.fixture
def made(kind, tmp_path):
    path = tmp_path / f"{kind}.h5"
    MAKERS[kind][0](path)
    return path


@each
def test_every_kind_is_loaded(made, kind):
    for found in (vd.load(made), vd.load(str(made), kind=kind)):
        assert type(found) is MAKERS[kind][1]
    for other in MAKERS.keys() - {kind}:
        with pytest.raises(OtherKind, match=f"must contain {FILES[other].holds}, but contains {FILES[kind].holds}"):
            vd.load(made, kind=other)
    with pytest.raises(ValueError, match="kind = 'basins': must be one of sweep, limits"):
        vd.load(made, kind="basins")


@each
def test_repr_and_html_describe_the_contents(made, kind):
    found = vd.load(made)
    assert repr(found).startswith(f"<{type(found).__name__} of ")
    assert len(repr(found)) < 300
    assert "\n" not in repr(found)
    table = found._repr_html_()
    assert found.title in table
    assert all(re.search(rf">[^<]*\b{name}\b", table) for name in {"curves": "AB"}.get(kind, "A"))
    assert "nan" not in repr(found) + table


@pytest.mark.jit  # the orbits are drawn over a simulated sweep
@each
def test_plot_accepts_given_axes(made, kind):
    found = vd.load(made)
    figure = found.plot()
    drawn = [ax for ax in figure.axes if ax.lines or ax.images or ax.collections]
    panels = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
    assert drawn
    own = Figure()
    given = own.subplots(1, len(panels), squeeze=False)[0].tolist()
    assert found.plot(ax=given if len(given) > 1 else given[0]) is own
    assert [len(ax.lines) for ax in given] == [len(ax.lines) for ax in panels]


def test_unknown_figure_is_refused(tmp_path):
    for kind, wrong in (("limits", "bands"), ("orbits", "map")):
        MAKERS[kind][0](tmp_path / kind)
        with pytest.raises(ValueError, match=f"^kind = '{wrong}': must be "):
            vd.load(tmp_path / kind).plot(wrong)


@each
def test_two_runs_give_the_same_bytes(made, kind, tmp_path):
    MAKERS[kind][0](tmp_path / "again.h5")
    assert made.read_bytes() == (tmp_path / "again.h5").read_bytes()


@each
def test_attributes_describe_the_contents(made, kind):
    with xr.open_dataset(made, engine="h5netcdf") as data:
        assert data.attrs["kind"] == kind
        words = ["oscillator", "incline", "dimensionless", "τ"]
        assert [w for w in words[1:] if w not in data.attrs["comment"]] == []
        shared = {"sweep": ["B", "eta", "periods"], "limits": ["B", "eta", "eps", "periods", "transient", "criterion"],
                  "failures": ["B", "eta", "eps", "transient"], "orbits": ["B", "section_phase", "max_period"],
                  "curves": ["max_period"]}[kind]  # fmt: skip
        for name in shared:
            assert f" {name}: " in data.attrs["comment"]
            assert data.attrs[name] is not None


def assert_netcdf(path):
    with h5py.File(path) as file:
        for name, data in file.items():
            text = h5py.check_string_dtype(data.dtype) is not None and data.dtype.kind == "O"
            assert data.attrs["long_name"], name
            assert data.attrs.get("units") == (None if text else "1"), name
            assert data.fletcher32 == (data.size > 0 and not text), name
            if not data.is_scale:
                assert [len(d) for d in data.dims] == [1] * data.ndim, name
                assert tuple(len(d[0]) for d in data.dims) == data.shape, name


@each
def test_every_dataset_is_a_variable_of_netcdf(made, tmp_path):
    """Every dataset has named dimensions, a unit, a long name and a checksum."""
    assert_netcdf(made)
    no_orbits(tmp_path / "none.h5")
    assert_netcdf(tmp_path / "none.h5")


@pytest.mark.integration
def test_netcdf_library_opens_every_kind(tmp_path):
    for kind, (make, _) in MAKERS.items():
        make(tmp_path / kind)
    read = "import sys, netCDF4\nfor path in sys.argv[1:]:\n for v in netCDF4.Dataset(path).variables.values(): v[...]"
    python(read, *tmp_path.iterdir())


def test_variable_has_its_dimensions(tmp_path):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        netcdf.dimension(file, "A", np.array([1.0, 2.0, 3.0]), "amplitude")
        netcdf.dimension(file, "none", np.arange(0), "of nothing")
        data = netcdf.variable(file, "x", ("A",), "<i4", "a number", fill=-1, chunks=(2,))
        assert (data.chunks, data.dtype, data[...].tolist()) == ((2,), np.dtype("<i4"), [-1, -1, -1])
        assert data.dims[0].keys() == ["A"]
        assert netcdf.variable(file, "y", ("A", "none"), float, "nothing").shape == (3, 0)
        assert netcdf.variable(file, "z", ("A",), h5py.string_dtype(), "words").chunks is None


def an_orbit(path):
    origin = Origin("[sweep]\nA = [2.0, 2.1]\n[orbits]\nmax_period = 1\n")
    orbits.save(path, orbits.Family(np.array([2.0, 2.1]), 0.1, 1, [[ORBIT], []], []), origin, 0.0)


def test_orbits_of_another_incline_have_no_sweep(tmp_path):
    """If B differs from that of the configuration in the file, only the values of A with orbits are known."""
    for name, B, searched in (("same.h5", 0.1, [2.0, 2.1]), ("other.h5", 0.2, [2.0])):
        found = orbits.Family(np.array([2.0, 2.1]), B, 1, [[replace(ORBIT, B=B)], []], [])
        orbits.save(tmp_path / name, found, Origin("[sweep]\nA = [2.0, 2.1]\n"), 0.0)
        stored = vd.load(tmp_path / name)
        assert (stored.plan is None) == (B != 0.1)
        assert stored.family.A.tolist() == searched


def two_curves(path):
    curves.save(path, test_curves.made(), Origin("[sweep]\nA = [1.0, 2.0]\nB = [0.0, 1.0]\n[orbits]\nmax_period = 2\n"))


def a_scene(path):
    config = parse("[physical]\nomega0 = 150.0\nmu = 0.6\nalpha = 3.4\n[sweep]\nA = [1.0, 2.0]\n")
    limits.create(path, config, config.plan().axes, "word")


@pytest.mark.parametrize(
    ("make", "at", "names"),
    [
        (a_sweep, "/", ["B", "eta", "periods", "method"]),
        (some_limits, "/", ["B", "eta", "periods", "transient"]),
        (a_scene, "velocity_mm_s", ["velocity_unit"]),
        (some_failures, "/", ["B", "eta", "periods"]),
        (an_orbit, "/", ["B", "max_period", "section_phase"]),
        (two_curves, "/", ["max_period", "range_A", "range_B"]),
    ],
)
def test_changed_attributes_are_found(make, at, names, tmp_path):
    path = tmp_path / "x.h5"
    make(path)
    assert summary(path, thorough=True).faults == []
    for name in names:
        with h5py.File(path, "r+") as file:
            value = file[at].attrs[name]
            file[at].attrs.modify(name, value[:-1] + "_" if isinstance(value, str) else np.asarray(value) + 1)
        assert [fault for fault in summary(path, thorough=True).faults if f"attribute {name}: changed" in fault], name
        with h5py.File(path, "r+") as file:
            file[at].attrs[name] = value
    assert summary(path, thorough=True).faults == []


@pytest.mark.parametrize("kind", failures.KINDS)
def test_unwritten_cell_of_a_failure_map_is_found(kind, tmp_path):
    path = tmp_path / "x.h5"
    some_failures(path)
    for judged, count in ((0, 1), (-1, -1)):
        with h5py.File(path, "r+") as file:
            file["judged"][0, 0, 0], file[kind][0, 0, 0] = judged, count
        assert summary(path, thorough=True).faults == ["judged: less than the sum of the failures"]


def test_named_objects_exist():
    """All objects that strings name exist: those of each kind of file, and the functions in ABOVE (model/kinds.py)."""
    for kind in FILES.values():
        for place in (kind.reader, kind.faults, kind.recipe):
            assert not place or named(place)
    assert [what for what, place in ABOVE.items() if not callable(named(place))] == []
    recipes = {kind.recipe: len(kind.figures) for kind in FILES.values() if kind.recipe}
    assert all(callable(part) for place in recipes for part in named(place)[:5])


def test_limits_store_their_default_periods(tmp_path):
    """By default a sweep has 250 periods and limits have 1500."""
    some_limits(tmp_path / "l.h5")
    with h5py.File(tmp_path / "l.h5") as file:
        assert (file.attrs["transient"], file.attrs["periods"], file.attrs["criterion"]) == (1000, 1500, "word")


def test_content_digest_covers_names_shapes_types_and_values():
    """A difference in a name, shape, type or value changes the digest. The order of writing does not change it."""

    def sealed(**arrays):
        with h5py.File("sealed", "w", driver="core", backing_store=False) as file:
            for name, values in arrays.items():
                file[name] = values
            return content_digest(file)

    some = np.arange(6.0)
    assert sealed(a=some, b=some) == sealed(b=some, a=some)
    others = [dict(a=some, c=some), dict(a=some, b=some.reshape(2, 3)), dict(a=some, b=some.view("<i8")),
              dict(a=some, b=some[::-1])]  # fmt: skip
    assert len({sealed(**other) for other in [dict(a=some, b=some), *others]}) == 5
