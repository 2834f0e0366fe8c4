"""Files of limits over one axis or two are read as they were written."""

import math
from itertools import groupby

import h5py
import numpy as np
import pytest
import xarray

from vibrodrive.errors import NoResult
from vibrodrive.model.config import parse
from vibrodrive.stability.limit import Limit
from vibrodrive.stability.limits import CURVES, QUANTITIES
from vibrodrive.stability.structure import Structure
from vibrodrive.store.every_kind import load, summary
from vibrodrive.store.limits import create, write_limit, writing

OVER_A = "[sweep]\nA = [2.5, 2.8, 3.04]\n[model]\neta = 50.5\n"
OVER_TWO = "[sweep]\nB = [0.1, 0.2]\neta = [20.3, 50.5, 101.3]\n[model]\nA = 2.5\n"
SCENE = "[physical]\na0 = 0.8e-3\nomega0 = 150.0\nmu = 0.6\nalpha = 3.4\n[sweep]\neta = [50.5, 101.3]\n"


def written(path, text, k2=lambda c, place: 1e-3 * (1 + c + sum(place))):
    """Write a file with a limit k2(curve, index) at each point except the last point of each curve. Return its path."""
    config = parse(text)
    plan = config.plan()
    create(path, config, plan.axes, "impacts")
    with writing(path) as file:
        for c, (disturbance, method) in enumerate(CURVES):
            for i in range(plan.n_points - 1):
                at = plan.arguments(i)
                place = tuple(map(int, np.unravel_index(i, plan.shape)))
                k = k2(c, place)
                point = {name: at[name] for name in ("A", "B", "eta")}
                lost = Structure(n=2, impacts=False, gaps=False, order=False, word=True, rho=0.5, shift=0)
                found = Limit(
                    **point, disturbance=disturbance, method=method, criterion="impacts", k2=k, last_kept=3 * k, n=2,
                    lost=lost, how="gaps 2 became 3",
                )  # fmt: skip
                write_limit(file, c, place, found)
    return path


def test_status_is_written_after_the_data_between_two_flushes(tmp_path, monkeypatch):
    """With this order, even after a loss of power, no limit counts as computed before its data are written."""
    order, put, flush = [], h5py.Dataset.__setitem__, h5py.File.flush
    monkeypatch.setattr(h5py.Dataset, "__setitem__", lambda data, *more: order.append(data.name) or put(data, *more))
    monkeypatch.setattr(h5py.File, "flush", lambda file: order.append("flush") or flush(file))
    written(tmp_path / "x.h5", SCENE)
    assert order[-1] == "flush"
    *_, data, status = (set(between) for data, between in groupby(order, "flush".__ne__) if data)
    assert status == {"/status"}
    assert data == {
        "/n",
        "/how",
        *(f"/{name}" for name in (*QUANTITIES["k2"].numbers, "velocity_mm_s", "velocity_last_mm_s")),
    }


@pytest.mark.parametrize(("text", "shape"), [(OVER_A, (3,)), (OVER_TWO, (2, 3))])
def test_limits_survive_a_round_trip(tmp_path, text, shape):
    found = load(written(tmp_path / "x.h5", text))
    assert tuple(map(len, found.axes.values())) == shape
    done = np.ones((3, *shape), dtype=bool)
    done[:, *(-1,) * len(shape)] = False
    assert np.array_equal(found.done, done)
    expected = 1e-3 * (1 + sum(np.indices((3, *shape))))
    eta = found.axes.get("eta", 50.5)
    factor = found.axes["A"] * eta if shape == (3,) else np.broadcast_to(2.5 * eta, shape)
    velocity = expected * np.stack([factor, np.ones(shape), np.ones(shape)])
    for name, values in (("k2", expected), ("last_kept", 3 * expected), ("velocity", velocity)):
        assert np.allclose(found.numbers[name], np.where(done, values, np.nan), rtol=1e-15, equal_nan=True), name
    assert np.allclose(found.numbers["velocity_last"], 3 * found.numbers["velocity"], rtol=1e-15, equal_nan=True)
    assert (found.n == np.where(done, 2, 0)).all()
    assert set(found.how[done]) == {"gaps 2 became 3"}
    assert np.isnan(found.numbers["rho_kept"]).all()
    assert (found.numbers["rho_lost"][done] == 0.5).all()
    assert found.mm_s is None


def test_fixed_contains_parameters_that_are_no_axes(tmp_path):
    assert load(written(tmp_path / "x.h5", OVER_A)).fixed == {"B": 0.1, "eta": 50.5}
    found = load(written(tmp_path / "y.h5", OVER_TWO))
    assert found.fixed == {"A": 2.5}
    with pytest.raises(ValueError, match=r"^axes = B, eta: must be A only$"):
        _ = found.A


def test_dimensions_are_the_axes_in_order_and_the_diagram_is_over_a_only(tmp_path):
    with xarray.open_dataset(written(tmp_path / "a.h5", OVER_A), engine="h5netcdf") as data:
        assert data["k2"].dims == data["velocity"].dims == ("curve", "A")
        assert data["section_dxi"].dims == ("A_fine", "period")
        assert data["A"].values.tolist() == [2.5, 2.8, 3.04]
        assert "velocity_mm_s" not in data
    with xarray.open_dataset(written(tmp_path / "two.h5", OVER_TWO), engine="h5netcdf") as data:
        assert data["k2"].dims == data["velocity_last"].dims == data["status"].dims == ("curve", "B", "eta")
        assert set(data.sizes) == {"curve", "B", "eta"}
    assert load(tmp_path / "two.h5").diagram is None


def test_scene_in_si_units_has_its_velocities_in_mm_s(tmp_path):
    path = written(tmp_path / "x.h5", SCENE)
    found = load(path)
    unit = 0.6 * 9.80665 * math.cos(math.radians(3.4)) / 150.0 * 1e3
    assert found.mm_s == pytest.approx(unit, rel=1e-14)
    with xarray.open_dataset(path, engine="h5netcdf", decode_timedelta=False) as data:
        for name in ("velocity", "velocity_last"):
            own = data[f"{name}_mm_s"]
            assert own.attrs["units"] == "mm s-1"
            assert np.allclose(own.values, unit * found.numbers[name], rtol=1e-14, equal_nan=True)
            assert np.isfinite(own.values).sum() == 3
    said = dict(summary(path).lines)
    assert said["eps"].endswith(f"({unit * 1e-3 * 50.5 * found.fixed['A']:.3g} to 6.06 mm/s)")


def test_summary_names_axes_fixed_parameters_and_velocities(tmp_path):
    found = summary(written(tmp_path / "x.h5", OVER_TWO), thorough=True)
    assert not found.faults
    assert found.share == 5 / 6
    assert found.lines[:4] == [
        ("axis", "B = 0.1 to 0.2, 2 values"),
        ("axis", "eta = 20.3 to 101.3, 3 values"),
        ("fixed", "A = 2.5"),
        ("criterion", "impacts"),
    ]
    assert found.lines[4] == ("eps", "certified: 5 of 6 limits, 0.001 to 0.003, V = 0.0508 to 0.76")
    assert found.lines[5] == ("dtau", "fixed: 5 of 6 limits, 0.002 to 0.004, V = 0.002 to 0.004")


def test_file_of_a_later_schema_is_refused_in_one_line(tmp_path):
    path = written(tmp_path / "x.h5", OVER_A)
    with h5py.File(path, "r+") as file:
        file.attrs["limits_schema"] = 4
    with pytest.raises(NoResult, match=r"x.h5: limits_schema = 4: must be 2 or 3 in vibrodrive .*; read it with "):
        load(path)


def test_ratio_is_nan_if_a_limit_is_missing(tmp_path):
    """The limit in ε is infinite at the first A, the limit in Δτ at the second. At the last A no limit is computed."""
    table = {(0, 0): math.inf, (1, 1): math.inf}
    four = OVER_A.replace("[2.5", "[2.4, 2.5")
    ratio = load(written(tmp_path / "x.h5", four, lambda c, place: table.get((c, *place), 1e-3 * (1 + c)))).ratio()
    assert ratio.shape == (4,)
    assert np.isnan(ratio[[0, 1, 3]]).all()
    assert ratio[2] == pytest.approx(2e-3 / (1e-3 * 50.5 * 2.8), rel=1e-15)
