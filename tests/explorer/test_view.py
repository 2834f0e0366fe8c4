"""A view (all settings of a page) is equivalent to its address, its configuration and its state (a dict). An invalid
view gives an error message of one line."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("tornado")

import vibrodrive as vd
from vibrodrive.explorer.controls import STARTS, title_of
from vibrodrive.explorer.engine import LARGEST, Engine
from vibrodrive.explorer.image import fitting_range, painted, picture_of, pictures, spans_of
from vibrodrive.explorer.tasks import work_of
from vibrodrive.explorer.view import RANGES, View, adapted, read_address, view_of
from vibrodrive.explorer.work import Pace, Work
from vibrodrive.jit.slices import Halt
from vibrodrive.model import config
from vibrodrive.model.names import PARAMETERS, SCENE_AXES

ROOT = Path(__file__).parents[2]

NUMBERS = st.floats(0.001, 1e3)


def test_results_are_reused_for_views_of_the_same_sweep_only():
    some, engine = {"columns": 9, "transient": 3, "periods": 4}, SimpleNamespace(threads=1, make_room=print)
    session = SimpleNamespace(work=None, made_from=[], engine=engine)
    work = work_of(session, View.read(some))
    assert work_of(session, View.read(some | {"bottom": -1.0, "top": 1.0, "at": 2.0})) is work
    for name, value in {"transient": 4, "periods": 5, "section_phase": 1.0, "B": 0.2, "columns": 8}.items():
        assert work_of(session, View.read(some | {name: value})) is not work, name
        work = work_of(session, View.read(some))


@settings(max_examples=40, deadline=None)
@given(
    x=st.sampled_from(sorted(set(PARAMETERS) - {"tol"})),
    low=NUMBERS,
    width=st.floats(1e-10, 10.0),
    eps=NUMBERS,
    method=st.sampled_from(["certified", "muller", "fixed"]),
    quantity=st.sampled_from(["dxi", "impact_speed"]),
    periods=st.integers(1, 10**6),
)
def test_address_and_configuration_keep_every_bit(**chosen):
    low, width = chosen.pop("low"), chosen.pop("width")
    if not low < low + width <= PARAMETERS[chosen["x"]].high:
        return
    view = View.read(chosen | {"low": low, "high": low + width, "columns": 3})
    assert read_address("?token=abc&" + view.address()).state() == view.state()
    plan = config.parse(view.toml()).plan()
    assert plan.axes[view.x][[0, -1]].tolist() == [low, low + width]
    assert all(plan.scalars[n] == getattr(view, n) for n in ("B", "eps", "eta", "xi0") if n != view.x)
    assert plan.settings.periods == view.periods


@pytest.mark.parametrize("name", ["fig07", "fig10", "map_AB", "orbits", "limits_eta", "map_driver"])
def test_configuration_is_shown_unchanged(name):
    wanted = config.read(ROOT / "configs" / f"{name}.toml")
    plan, shown = wanted.plan(), view_of(wanted).plan()
    x = next(iter(shown.axes))
    assert np.allclose(shown.axes[x], plan.axes[x], rtol=1e-15)
    assert shown.settings == plan.settings
    both = {*shown.scalars} & {*plan.scalars} - {"dtau", "tol"}
    assert {n: shown.scalars[n] for n in both} == {n: plan.scalars[n] for n in both}


RANGED = """
sweep = {A = {start = 2.8, stop = 3.25, num = 3}, B = [0.1, 0.2]}
run = {transient = 10, periods = 64, record = "summary"}
figure = {kind = "map", quantity = "energy"}
"""


@pytest.mark.jit
def test_colour_limits_of_a_map_are_in_its_key_and_its_configuration():
    view = View.read(view_of(config.parse(RANGED)).state() | {"bottom": 1.5, "top": 2.5})
    assert read_address(view.address()).state() == view.state()
    assert (view.mode, view.shade, view.limits) == ("map", "energy", (1.5, 2.5))
    assert config.parse(view.toml()).figure["limits"] == (1.5, 2.5)
    (level,) = (level for level in Work([view.plan()], 1).levels(Pace(), Halt()) if level.complete)
    key = painted(level, "energy", view.limits)[2]
    assert key["ends"] == (1.5, 2.5, False)
    assert {"less", "more"} <= {name for _, name in key["swatches"]}
    assert adapted(view.state(), "shade").limits is None


@pytest.mark.parametrize(
    ("state", "change", "wanted"),
    [
        ({}, {"x": "omega0"}, {"scene": "SI", "x": "omega0", "y": "a0"}),
        ({}, {"y": "mu"}, {"scene": "SI", "x": "A", "y": "mu"}),
        ({"x": "a0", "y": "omega0"}, {"x": "B"}, {"scene": "dimensionless", "x": "B", "y": "A"}),
        ({"low": 3.0, "bottom": 0.1, "top": 1.0, "shade": "energy"}, {"x": "eps"}, {"low": 1e-6, "limits": None}),
        ({"x": "eps", "low": 0.0, "high": 1e-3, "scale": "linear"}, {"scale": "log"}, {"low": 1e-6}),
    ],
)  # fmt: skip
def test_change_of_a_field_adapts_the_others(state, change, wanted):
    view = View.read({"mode": "map", "columns": 3, "rows": 3, **state})
    found = adapted(view.state() | change, next(iter(change)))
    assert {name: getattr(found, name) for name in wanted} == wanted
    assert found.low <= found.at <= found.high


def test_spacing_and_further_axes_of_a_configuration_and_refusal():
    view = view_of(config.parse("[sweep]\nA = [1, 2, 4]\neps = [0.0, 1e-4]"))
    assert (view.scale, title_of(view)[1].split(", ")[:2]) == ("log", ["B = 0.1", "ε = 0"])
    assert view_of(config.parse("[sweep]\nA = [2, 4]")).scale == "linear"  # two values are spaced both ways
    machine = "[physical]\na0 = 8e-4\nfrequency = 24.0\nmu = 0.6\nalpha = 3.4\n"
    told = "Ω₀ = 150.796 rad/s (24 Hz), μ = 0.6"  # and not a₀, which A replaces
    assert title_of(view_of(config.parse(machine)))[1].startswith(told)
    scene = "[physical]\nomega0 = 150.0\nalpha = 3.4\n[sweep]\nmu = [0.5, 0.6]\nA = 3.0"
    with pytest.raises(ValueError, match=r"A = 3\.0: must be an axis, or left out"):
        view_of(config.parse(scene))


@pytest.mark.parametrize(
    ("over", "words"),
    [
        ({"shade": "period", "bottom": 1.0, "top": 2.0}, "bottom and top = .* left out, .* period are classes"),
        ({"x": "eps", "shade": "lyapunov"}, "shade = 'lyapunov': must be another quantity: only certified"),
        ({"x": "B"}, "y = 'B': must be another parameter than x = B"),
        ({"low": 3.0, "high": 2.0}, "high = 2.0: must be greater than low = 3.0"),
        ({"columns": 4000, "rows": 4000}, "rows = 4000: must be <= 250 at 4000 columns"),
    ],
)  # fmt: skip
def test_map_without_meaning_is_refused(over, words):
    with pytest.raises(ValueError, match=words):
        View.read({"mode": "map", "columns": 2, "rows": 2} | over)


@pytest.mark.parametrize("x", sorted({*PARAMETERS, *SCENE_AXES} - {"tol"}))
def test_motion_is_that_of_a_sweep_at_its_place(x):
    """The plan of the motion has the parameters of the point of a sweep with this abscissa."""
    low, high, scale = RANGES[x]
    at = 0.3 * low + 0.7 * high
    view = View.read({"x": x, "low": low, "high": at, "columns": 2, "at": at, "method": "fixed", "scale": scale})
    assert view.plan().points(1, 2)[0] == pytest.approx(view.motion_plan().points(0, 1)[0], rel=1e-14)


FUZZ = ["", "nan", "inf", "-1", "1e999", "９", "1_0", "<b>", "'\"\n", "9" * 400, [], {}, None, True, 1e308, -0.0]


@pytest.mark.parametrize("key", [*View().state(), "novelty"])
def test_any_input_is_accepted_or_refused_in_one_line(key):
    for value in FUZZ:
        try:
            view = View.read({key: value})
        except ValueError as error:
            text = str(error)
            assert ("\n" in text, len(text) < 600) == (False, True)
            assert key in text or key in ("at", "low", "high", "y_low", "y_high", "bottom", "top")
        else:
            assert read_address(view.address()).state() == view.state()


@pytest.mark.parametrize("start", STARTS, ids=lambda start: start.name)
def test_initial_views_are_valid_and_have_two_sentences(start):
    view = read_address(start.address)
    assert read_address(view.address()).state() == view.state()
    assert 2 <= start.text.count(". ") + start.text.endswith(".") <= 3


def test_results_of_all_pages_use_at_most_half_of_the_memory(monkeypatch):
    monkeypatch.setattr("vibrodrive.model.size.available_memory", lambda: 700)
    first, second, third = (SimpleNamespace(work=work and SimpleNamespace(bytes=work)) for work in (200, 100, None))
    engine = SimpleNamespace(pages={1: first, 2: second, 3: third})
    Engine.make_room(engine, 150, "periods = 5")  # the limit is (700 + 300) / 2 bytes for all pages together
    assert (first.work is None, second.work is None) == (False, False)
    Engine.make_room(engine, 250, "periods = 5")
    assert (first.work is None, second.work is None) == (True, False)
    with pytest.raises(ValueError, match=r"^periods = 5: must be small enough for memory"):
        Engine.make_room(engine, 401, "periods = 5")
    monkeypatch.setattr("vibrodrive.model.size.available_memory", lambda: 10**12)
    with pytest.raises(ValueError, match=r"2\.0 GB are allowed"):
        Engine.make_room(engine, LARGEST + 1, "periods = 5")


def test_spans_name_the_period_of_wide_runs_of_columns():
    period = np.array([*[2] * 20, *[0] * 20, *[3] * 9, 7, *[-2] * 10])  # -2: the record is too short to tell
    assert spans_of(period, 0.0, 1.0) == [(0.0, 20 / 60, 2), (20 / 60, 40 / 60, 0), (40 / 60, 49 / 60, 3)]


@pytest.mark.jit
@pytest.mark.parametrize(
    "more", [{}, {"low": 0.9, "high": 1.9}, {"eps": 2e-4}, {"eps": 1e-9}, {"method": "fixed"}, {"section_phase": 0.0}]
)
def test_bar_names_the_period_of_simulate_or_there_is_none(more):
    """A slow beat under a ripple repeats nearly; at φₛ = 0 the mass rests, whatever its period."""
    view = View.read({"low": 2.2, "high": 2.8, "columns": 60} | more)
    level = list(Work([view.plan()], 1).levels(Pace(), Halt()))[-1]
    spans = picture_of(view, level)[0]["spans"]
    assert bool(spans) == ({*more} <= {"section_phase", "low", "high"})
    for left, right, period in spans:
        for A in np.linspace(left, right, 11)[1:-1]:
            motion = vd.simulate(A, transient=500, section_phase=view.section_phase)
            assert (motion.period, motion.status) == (period, "OK"), "a motion at rest has no bar"
    assert {span[2] for span in spans} <= {1, 2}


@pytest.mark.jit
def test_phases_are_cut_where_there_are_none():
    view = View.read({"quantity": "impact_phase", "low": 3.0, "high": 3.25, "columns": 40})
    level = list(Work([view.plan()], 1).levels(Pace(), Halt()))[-1]
    results = level.sweep.results[0]
    phases = results.impact_phase[np.isfinite(results.impact_phase)]
    for turn in (0.0, 2.0, 4.0, 6.0):  # wherever the values are on the circle
        results.impact_phase[np.isfinite(results.impact_phase)] = (phases + turn) % (2 * np.pi)
        low, high = fitting_range(level, "impact_phase")
        there = np.sort((phases + turn - low) % (2 * np.pi))
        assert there[-1] < high - low
        assert high - low < 1.2 * (2 * np.pi - np.diff(there, append=there[0] + 2 * np.pi).max())
        (image,) = pictures(level, "impact_phase", low, high)
        assert image.any(axis=0).all()
        assert image[:18].any() or image[-18:].any()
