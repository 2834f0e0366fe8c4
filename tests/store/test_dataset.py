"""`Results.to_xarray` equals the Dataset that xarray reads from the file. Without xarray the error is one line."""

import warnings

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from tests.support import fake
from vibrodrive.model.config import parse
from vibrodrive.model.physical import Scene
from vibrodrive.model.quantities import QUANTITIES
from vibrodrive.model.records import RECORDS, quantities
from vibrodrive.store.layout import Origin
from vibrodrive.store.load import load

AXES = "[sweep]\nA = {start = 3.0, stop = 3.2, num = 5}\neps = [0.0, 1e-4]\n[run]\nperiods = 3\ntransient = 0\n"
SCENE = "[physical]\nomega0 = 150\nmu = 0.6\nalpha = 3\nmass = 250\n[sweep]\na0 = [1e-3, 2e-3]\n[run]\nperiods = 3\n"
TEXTS = {
    "section": AXES,
    "everything": AXES + 'record = ["section", "summary", "impacts"]\n',
    "summary": AXES + 'record = "summary"\n',
    "points": "[sweep.points]\nA = [3.0, 3.1]\nxi0 = [0, 1]\n[run]\nperiods = 3\n",
    "scene": SCENE,
}


everything = pytest.mark.parametrize("path", ["everything"], indirect=True)


@pytest.fixture(params=TEXTS)
def path(request, tmp_path):
    config = parse(TEXTS[request.param])
    fake.write(tmp_path / "x.h5", config.plan(), Origin(config.text, title="A title"))
    return tmp_path / "x.h5"


def test_dataset_equals_the_file_read_by_xarray(path):
    made = load(path).dimensionless().to_xarray()
    with xr.open_dataset(path, engine="h5netcdf") as read:
        xr.testing.assert_equal(made, read)
        for name in made.variables:
            told = dict(made[name].attrs)
            told["long_name"] = told["long_name"].removesuffix(", dimensionless")
            if "flag_values" in told:
                np.testing.assert_array_equal(told.pop("flag_values"), read[name].attrs["flag_values"])
            assert told == {key: value for key, value in read[name].attrs.items() if key != "flag_values"}, name
            assert made[name].dtype == read[name].dtype, name
        assert {name: read.attrs[name] for name in made.attrs} == made.attrs
    results = load(path)
    alone = {name: results.scalars[name] for name in ("B", "tau0")} | {"record": ", ".join(results.record)}
    assert alone.items() <= made.attrs.items()


def test_dataset_of_a_scene_is_in_si_units(tmp_path):
    """Each value is that of the scene of its point; without a mass, energies are per kilogram."""
    axes = "[sweep]\nfrequency = [20, 25]\neps = [0, 1e-4]\nmass = [200, 250]\n"
    text = f'[physical]\na0 = 8e-4\nmu = 0.6\nalpha = 3\n{axes}[run]\nperiods = 3\nrecord = ["section", "summary"]\n'
    fake.write(tmp_path / "x.h5", parse(text).plan(), Origin(text))
    results = load(tmp_path / "x.h5")
    made = results.to_xarray()
    for at in np.ndindex(results.shape):
        f, _, mass = (axis[k] for axis, k in zip(results.axes.values(), at, strict=True))
        scene, here = Scene(a0=8e-4, frequency=f, mu=0.6, alpha=3, mass=mass), made.isel(frequency=at[0], eps=at[1])
        here, p, v = here.isel(mass=at[2]), 1.0 / f, 0.6 * 9.80665 * np.cos(np.radians(3)) / (2 * np.pi * f)
        wanted = {"xi_max": v * p / (2 * np.pi), "dxi_min": v, "momentum": mass * v, "drive_work": mass * v**2}
        wanted |= {"impacts": 1 / p, "share_rest": 1.0, "margin": 1.0, "period": 1.0}
        for name, one in wanted.items():
            found = here["motion_period" if name == "period" else name]
            assert float(found) == pytest.approx(one * float(getattr(results, name)[at]), rel=1e-12), name
        assert here.section_xi.values == pytest.approx(scene.length(results.section[at][:, 0]), rel=1e-12)
        assert float(here.impact_power) == pytest.approx(scene.power(results.energy[at]), rel=1e-12)
        assert float(here.energy) == pytest.approx(float(here.impact_power) * p, rel=1e-12)
    units = {name: made[name].attrs["units"] for name in ("xi_max", "momentum", "energy", "impacts", "margin")}
    assert units == {"xi_max": "m", "momentum": "N s", "energy": "J", "impacts": "s-1", "margin": "1"}
    assert "ξ" not in "".join(variable.attrs["long_name"] for variable in made.data_vars.values())
    text = text.replace("mass = [200, 250]\n", "")
    fake.write(tmp_path / "y.h5", parse(text).plan(), Origin(text))
    assert load(tmp_path / "y.h5").to_xarray().energy.attrs["units"] == "J kg-1"


def test_every_quantity_has_a_unit_or_none():
    """Who adds a quantity says in UNITS how it scales, or here that it does not."""
    unscaled = {"share_up", "share_down", "share_stick", "share_rest", "impact_phase", "certain_until"}
    unscaled |= {"k2", "last_kept", "share_kept", "half_kept", "k2_always", "starts_width"}  # a disturbance
    numbers = {q.name for q in quantities(RECORDS) if q.dtype.startswith("<f")}
    assert {name for name in numbers if not QUANTITIES[name].scales} == unscaled


@everything
def test_dataset_survives_a_round_trip(path, tmp_path):
    made = load(path).to_xarray()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made.to_netcdf(tmp_path / "again.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "again.nc", engine="h5netcdf") as again:
        xr.testing.assert_equal(made, again)
        assert again.attrs["method"] == "certified"


def test_a_column_in_si_units_has_its_unit_in_its_name(tmp_path):
    """So a name that dimensionless tables and tables in SI units share has the same numbers in both."""
    text = SCENE + 'record = ["section", "impacts", "summary", "error"]\n'
    fake.write(tmp_path / "x.h5", parse(text).plan(), Origin(text))
    results = load(tmp_path / "x.h5")
    for of in ("points", "section", "impacts"):
        table, plain = results.to_dataframe(of), results.dimensionless().to_dataframe(of)
        for name in set(table) & set(plain):
            pd.testing.assert_series_equal(table[name], plain[name])
        in_si = {name: unit for name, unit in table.attrs["units"].items() if name not in plain}
        assert "1" not in in_si.values()
        assert len(table.columns) - len(plain.columns) == (of == "points")  # the power, which needs a scene
    table, data = results.to_dataframe(), results.to_xarray()
    for name, quantity in {
        "x_max_m": "xi_max", "v_min_m_per_s": "dxi_min", "impact_speed_max_m_per_s": "impact_speed_max",
        "impacts_per_s": "impacts", "momentum_N_s": "momentum", "energy_J": "energy", "impact_power_W": "impact_power",
        "lyapunov_per_s": "lyapunov", "error_x_m": "error_xi", "error_v_m_per_s": "error_dxi", "margin": "margin",
        "period": "motion_period", "a0": "a0",
    }.items():  # fmt: skip
        assert table[name].tolist() == data[quantity].values.tolist()
    text = text.replace("mass = 250\n", "")
    fake.write(tmp_path / "y.h5", parse(text).plan(), Origin(text))
    assert {"momentum_N_s_per_kg", "drive_work_J_per_kg", "impact_power_W_per_kg"} <= {
        *load(tmp_path / "y.h5").to_dataframe()
    }


@everything
def test_section_and_impacts_are_tables_in_long_form(path):
    results = load(path)
    section = results.to_xarray()[["section_xi", "section_dxi"]].to_dataframe().reset_index()
    section = section.rename(columns={"section_xi": "xi", "section_dxi": "dxi"})  # the names in tables of a motion
    pd.testing.assert_frame_equal(results.to_dataframe("section"), section)
    results.impact_phase[1, 0, 2:] = np.nan  # this motion has two main impacts
    impacts = results.to_dataframe("impacts")
    assert len(impacts) == results.impact_phase.size - 4
    there = impacts[impacts.A.eq(results.axes["A"][1]) & impacts.eps.eq(0)]
    assert there.impact.tolist() == [1, 2]
    assert there.impact_speed.tolist() == results.impact_speed[1, 0, :2].tolist()
