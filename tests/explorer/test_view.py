"""A view (all settings of a page) is equivalent to its address, its configuration and its state (a dict). An invalid
view gives an error message of one line."""

import io
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("bokeh")

from bokeh.document import Document
from PIL import Image

import vibrodrive as vd
from vibrodrive.cli.sweep import sweep
from vibrodrive.errors import TooLarge
from vibrodrive.explorer import export
from vibrodrive.explorer.controls import part_shown
from vibrodrive.explorer.engine import LARGEST, Engine
from vibrodrive.explorer.exact import STABLE, UNSTABLE, Curve
from vibrodrive.explorer.image import painted
from vibrodrive.explorer.layout import build
from vibrodrive.explorer.motion import motion_at
from vibrodrive.explorer.session import adapted, overlay_of, read_address
from vibrodrive.explorer.shown import _edges, picture_of, place
from vibrodrive.explorer.starts import STARTS
from vibrodrive.explorer.tasks import _lay_over, send_file, work_of
from vibrodrive.explorer.view import RANGES, SPAN, View, view_of
from vibrodrive.explorer.work import Pace, Work
from vibrodrive.figures.colours import _CLASSIFY
from vibrodrive.jit.slices import Halt
from vibrodrive.model import config
from vibrodrive.model.drawing import OF_CLASSES
from vibrodrive.model.names import PARAMETERS, SCENE_AXES
from vibrodrive.model.physical import Scene

ROOT = Path(__file__).parents[2]

NUMBERS = st.floats(0.001, 1e3)


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_values_are_column_centres(scale):
    view = View.read({"low": 1.0, "high": 16.0, "columns": 5, "scale": scale})
    left, right = _edges(view, SPAN, view.columns)
    edges = np.linspace(left, right, 6)
    middles = 0.5 * (edges[1:] + edges[:-1])
    assert np.allclose(middles, place(view.plan().axes["A"], scale), rtol=1e-14)


def test_results_are_reused_for_views_of_the_same_sweep_only():
    some = {"columns": 9, "transient": 3, "periods": 4}
    session = SimpleNamespace(
        work=None, made_from=[], engine=SimpleNamespace(threads=1, make_room=lambda *arguments: None)
    )
    work = work_of(session, View.read(some))
    assert work_of(session, View.read(some | {"bottom": -1.0, "top": 1.0, "at": 2.0})) is work
    for name, value in {"transient": 4, "periods": 5, "section_phase": 1.0, "B": 0.2, "columns": 8}.items():
        assert work_of(session, View.read(some | {name: value})) is not work, name
        work = work_of(session, View.read(some))


def test_stable_and_unstable_orbits_have_different_lines():
    """Lines of stable orbits are solid, lines of unstable orbits are dashed."""
    drawn = SimpleNamespace(lines=SimpleNamespace(), marks=SimpleNamespace())
    session = SimpleNamespace(page=drawn, belongs=lambda overlay: True, show_key=lambda: None)
    A, low, high = np.array([2.0, 3.0]), np.array([1.0, 2.0]), np.array([5.0, 6.0])
    found = [Curve(A, low, STABLE, 1), Curve(A, high, UNSTABLE, 1)]
    _lay_over(session, View.read({"orbits": 1}), found, [Curve(2.5, 1.5, "fold", 1)])
    assert [y.tolist() for y in drawn.lines.data["y"]] == [[1.0, 2.0], [5.0, 6.0]]
    assert drawn.lines.data["dash"] == ["solid", "dashed"]
    assert (drawn.marks.data["A"], drawn.marks.data["y"]) == (["2.5"], [1.5])


def test_exact_curves_stay_while_only_the_window_moves():
    """`overlay_of` returns (settings of the curves, window). Only a change of these settings needs new curves."""
    over = {"low": 2.0, "high": 3.0, "orbits": 2}
    (what, window), other = overlay_of(View.read(over)), {"high": 3.1}
    assert overlay_of(View.read(over | other)) == (what, (2.0, 3.1)) != (what, window)
    changes = {"scale": "log", "B": 0.2, "orbits": 3, "quantity": "xi", "section_phase": 1.0}
    assert what not in [overlay_of(View.read(over | {name: value}))[0] for name, value in changes.items()]
    assert overlay_of(View.read(over | {"mode": "map", "columns": 9, "rows": 9, "y_low": 0.1})) is None


@settings(max_examples=40, deadline=None)
@given(
    x=st.sampled_from(sorted(set(PARAMETERS) - {"tol"})),
    low=NUMBERS,
    width=st.floats(1e-10, 10.0),
    B=st.floats(0.0, 10.0),
    eps=NUMBERS,
    method=st.sampled_from(["certified", "muller", "fixed"]),
    quantity=st.sampled_from(["dxi", "xi", "impact_speed", "impact_phase"]),
    periods=st.integers(1, 10**6),
    scale=st.sampled_from(["linear", "log"]),
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
    assert all(
        shown.scalars[n] == plan.scalars[n] for n in shown.scalars if n in plan.scalars and n not in ("dtau", "tol")
    )


@pytest.mark.parametrize(("values", "scale"), [("[2, 4]", "linear"), ("[2, 3, 4]", "linear"), ("[1, 2, 4]", "log")])
def test_axis_of_a_configuration_has_the_scale_of_its_values(values, scale):
    """Two values are spaced both evenly and geometrically, so their axis has the default scale."""
    assert view_of(config.parse(f"[sweep]\nA = {values}\n")).scale == scale


def test_SI_scene_keeps_its_figure_and_motions():
    wanted = config.read(ROOT / "configs/map_driver.toml")
    view = view_of(wanted)
    assert (view.scene, view.shade, view.x, view.y) == ("SI", "impact_power", "frequency", "a0")
    assert read_address(view.address()).state() == view.state()
    assert np.allclose(view.plan().points(0, 5), wanted.plan().points(0, 5), rtol=1e-15, equal_nan=True)


RANGED = """
[sweep]
A = {start = 2.8, stop = 3.25, num = 3}
B = [0.1, 0.2]
[run]
transient = 10
periods = 64
record = "summary"
[figure]
kind = "map"
quantity = "energy"
limits = [1.5, 2.5]
"""


@pytest.mark.jit
def test_colour_limits_of_a_map_follow_the_configuration():
    view = view_of(config.parse(RANGED))
    assert read_address(view.address()).state() == view.state()
    assert (view.mode, view.shade, view.limits) == ("map", "energy", (1.5, 2.5))
    assert config.parse(view.toml()).figure["limits"] == (1.5, 2.5)
    (level,) = (level for level in Work([view.plan()], 1).levels(Pace(), Halt()) if level.complete)
    limited, free = (painted(level, "energy", limits)[2] for limits in (view.limits, None))
    assert len(limited.numbers) > 2
    assert [share for share, _ in limited.numbers] == pytest.approx([float(t) - 1.5 for _, t in limited.numbers])
    assert {"less", "more"} & {name for _, name in free.swatches} == set()
    assert {"less", "more"} <= {name for _, name in limited.swatches}
    assert adapted(view.state(), "shade").limits is None
    with pytest.raises(ValueError, match=r"bottom and top = \(1\.5, 2\.5\): must be left out, .* period are classes"):
        View.read(view.state() | {"shade": "period"})


def test_limits_apply_to_the_drawn_quantity():
    """By default a sweep with sections and summaries is drawn with ξ'. Then `limits` is a range of ξ'."""
    both = RANGED.replace('record = "summary"', 'record = ["section", "summary"]')
    assert view_of(config.parse(both.replace('kind = "map"\nquantity = "energy"\n', ""))).limits is None
    assert view_of(config.parse(both)).limits == (1.5, 2.5)
    with pytest.raises(ValueError, match=r"limits = .*: must be left out, because the colours of period are classes"):
        view_of(config.parse(RANGED.replace("energy", "period")))


def test_classified_quantities_have_colours_for_each_value():
    assert {*OF_CLASSES} == {*_CLASSIFY}


def test_scene_with_a_separate_A_is_refused():
    text = "[physical]\nomega0 = 150.0\nalpha = 3.4\n[sweep]\nmu = [0.5, 0.6]\nA = 3.0"
    with pytest.raises(ValueError, match=r"A = 3\.0: must be an axis, or left out \(A then follows from a0\)"):
        view_of(config.parse(text))


@pytest.mark.parametrize(
    ("changed", "to", "scene", "x", "y"),
    [
        ("x", "omega0", "SI", "omega0", "a0"),
        ("x", "a0", "SI", "a0", "omega0"),
        ("y", "mu", "SI", "A", "mu"),
        ("scene", "SI", "SI", "A", "mu"),
        ("x", "eps", "dimensionless", "eps", "B"),
    ],
)
def test_axes_follow_the_scene(changed, to, scene, x, y):
    state = View.read({"mode": "map", "columns": 3, "rows": 3}).state() | {changed: to}
    view = adapted(state, changed)
    assert (view.scene, view.x, view.y) == (scene, x, y)
    back = adapted(view.state() | {"scene": "dimensionless"}, "scene")
    assert {back.x, back.y} <= {"A", "B", "eps"}
    assert adapted(view.state() | {"x": "B", "y": "A"}, "x").scene == "dimensionless"


def test_A_and_B_follow_from_a_scene():
    view = View.read({"scene": "SI", "x": "eps", "columns": 2, "A": 9.0, "B": 9.0})
    plan = view.plan()
    scene = Scene(view.a0, view.omega0, view.mu, view.alpha)
    assert plan.points(0, 1)[0][:2].tolist() == [scene.A, scene.B]
    over_A = View.read({"scene": "SI", "columns": 2}).plan()
    assert over_A.points(0, 1)[0][:2].tolist() == [2.4, scene.B]
    assert view.incline == scene.B


def test_every_parameter_and_quantity_of_a_scene_may_be_an_axis():
    assert {*RANGES} == {*PARAMETERS, *SCENE_AXES}


FUZZ = [
    "",
    "nan",
    "inf",
    "-1",
    "1e999",
    "0x1",
    "９",
    "1_0",
    "<b>",
    "'\"\n",
    "9" * 400,
    "None",
    [],
    {},
    None,
    True,
    1e308,
    -0.0,
]


@pytest.mark.parametrize("key", [*View().state(), "novelty"])
def test_any_input_is_accepted_or_refused_in_one_line(key):
    for value in FUZZ:
        try:
            view = View.read({key: value})
        except ValueError as error:
            text = str(error)
            assert "\n" not in text
            assert len(text) < 600
            assert key in text or key in ("low", "high", "y_low", "y_high", "bottom", "top")
        else:
            assert read_address(view.address()).state() == view.state()


def test_ranges_of_every_parameter_are_views():
    for name, (low, high, _) in RANGES.items():
        other = "xi0" if name in SCENE_AXES else "A" if name == "B" else "B"
        view = View.read({"x": name, "y": other, "mode": "map", "columns": 2, "rows": 2})
        assert (view.low, view.high) == (low, high)
        assert [*view.plan().axes] == [name, view.y]


def test_new_abscissa_has_its_default_range():
    state = View.read({"low": 3.0, "high": 3.1, "at": 3.05, "bottom": 0.8, "top": 1.3}).state()
    found = adapted(state | {"x": "dtau"}, "x").state()
    assert (found["low"], found["high"], found["scale"], found["at"]) == (*RANGES["dtau"], None)
    assert (found["bottom"], found["top"]) == (None, None)
    found = adapted(state | {"scene": "SI"}, "scene").state()
    assert (found["x"], found["bottom"]) == ("A", None)
    found = adapted(state | {"x": "B", "low": 0.1, "high": 0.2, "scene": "SI"}, "scene").state()
    assert (found["x"], found["bottom"]) == ("a0", None)


def test_logarithmic_axis_begins_above_zero():
    found = adapted(
        View.read({"x": "eps", "low": 0.0, "high": 1e-3, "scale": "linear"}).state() | {"scale": "log"}, "scale"
    )
    assert 0.0 < found.low < found.high


@pytest.mark.parametrize("start", STARTS, ids=lambda start: start.name)
def test_initial_views_are_valid_and_have_two_sentences(start):
    view = read_address(start.address)
    assert read_address(view.address()).state() == view.state()
    assert 2 <= start.text.count(". ") + start.text.endswith(".") <= 3


@pytest.mark.jit
@pytest.mark.parametrize(
    ("chosen", "name"),
    [
        ({}, "dxi_over_A_3_3.25.png"),
        ({"method": "fixed", "dtau": 0.05, "compare": "beside"}, "dxi_over_A_3_3.25_fixed_0.05_and_certified.png"),
        ({"method": "fixed", "compare": "difference"}, "dxi_over_A_3_3.25_fixed_0.1_minus_certified.png"),
        ({"mode": "map", "rows": 60, "periods": 64}, "period_over_A_3_3.25_B_0.02_0.3.png"),
    ],
    ids=str,
)
def test_saved_picture_has_the_pixels_of_its_images_and_the_exact_curves(chosen, name):
    view = View.read({"columns": 60, "low": 3.0, "transient": 20, "periods": 16, **chosen})
    views = [view, view.certified()] if view.compared else [view]
    *_, level = Work([v.plan() for v in views], 1).levels(Pace(), Halt())
    page, picture = build(Document(), view, ""), picture_of(view, level, 150)
    assert len(picture.images) == (2 if view.compare == "beside" else 1)
    assert export.file_name(view, "png") == name
    files = {kind: export.drawn(view, picture, page, kind) for kind in ("png", "pdf", "svg")}
    assert files["pdf"].startswith(b"%PDF")
    assert files["svg"].count(b"data:image/png") == len(picture.images) + len(picture.key.scale[:1])
    saved = np.array(Image.open(io.BytesIO(files["png"])).convert("RGB"))
    rows = 8 if view.mode == "map" else 1  # of a cell, which is 8 columns wide
    for image in picture.images:
        wanted = np.ascontiguousarray(picture.palette[image]).view(np.uint8).reshape(*image.shape, 4)[::-1, :, :3]
        wanted = wanted.repeat(rows, 0).repeat(8, 1)[2:-2, 2:-2]  # the frame of the axes covers the edges
        (height, width, _), left = wanted.shape, export.LEFT + 2
        columns = saved[:, left : left + width]
        assert any(np.array_equal(columns[top : top + height], wanted) for top in range(len(saved) - height))
    page.lines.data = {
        "x": [[3.0, 3.2]],
        "y": [[picture.y, picture.y + picture.dh]],
        "kind": ["unstable orbit"],
        "colour": ["blue"],
        "width": [1.5],
        "dash": ["dashed"],
    }
    assert export.drawn(view, picture, page, "png") != files["png"]


@pytest.mark.jit
@pytest.mark.parametrize(
    "chosen",
    [
        {"columns": 5, "method": "fixed", "dtau": 0.05, "eps": 1e-4},
        {"x": "eps", "columns": 4, "quantity": "impact_speed"},
        {"mode": "map", "columns": 4, "rows": 3, "periods": 64},
        {"scene": "SI", "x": "eps", "columns": 4, "a0": 7e-4, "mass": 200.0},
        {"scene": "SI", "x": "A", "columns": 4, "alpha": 5.0},
        {"x": "omega0", "columns": 4, "quantity": "xi"},
        {"mode": "map", "x": "mu", "y": "A", "columns": 4, "rows": 3, "periods": 64},
        {"mode": "map", "x": "omega0", "y": "a0", "columns": 4, "rows": 3, "periods": 64, "shade": "impact_power"},
    ],
    ids=str,
)
def test_exported_python_computes_the_bits_of_the_view(chosen, monkeypatch, tmp_path):
    view = View.read({"transient": 20, "periods": 16} | chosen)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(export.python(view), names)
    *_, level = Work([view.plan()], 1).levels(Pace(), Halt())
    expected = level.sweep.results[0]
    found = names["results"]
    assert found.axes.keys() == expected.axes.keys()
    for name, values in expected.axes.items():
        assert np.array_equal(found.axes[name], values)
    assert np.array_equal(found.status, expected.status)
    if view.mode == "map":
        assert np.array_equal(found.period, expected.period)
        assert np.array_equal(found.energy, expected.energy)
    elif view.quantity != "impact_speed":
        assert np.array_equal(found.section, expected.section, equal_nan=True)
    assert (tmp_path / export.file_name(view, "png")).exists()


@pytest.mark.jit
@pytest.mark.parametrize(
    "chosen",
    [
        {"columns": 5, "eps": 1e-4},
        {"x": "eps", "columns": 4, "quantity": "impact_speed"},
        {"mode": "map", "columns": 4, "rows": 3, "periods": 64},
    ],
    ids=str,
)
def test_saved_data_equal_the_file_of_the_exported_configuration(chosen, tmp_path):
    view = View.read({"transient": 20, "periods": 16} | chosen)
    *_, level = Work([view.plan()], 1).levels(Pace(), Halt())
    (tmp_path / "view.toml").write_text(view.toml())
    sweep.main([str(tmp_path / "view.toml"), "-o", str(tmp_path / "view.h5")], standalone_mode=False)
    assert export.result_file(view, level.sweep.results[0]) == (tmp_path / "view.h5").read_bytes()


def test_results_of_all_pages_use_at_most_half_of_the_memory(monkeypatch):
    monkeypatch.setattr("vibrodrive.explorer.engine.available_memory", lambda: 700)
    first, second, third = (SimpleNamespace(work=work and SimpleNamespace(bytes=work)) for work in (200, 100, None))
    engine = SimpleNamespace(pages={1: first, 2: second, 3: third})
    Engine.make_room(engine, 150, "periods = 5")  # the limit is (700 + 300) / 2 bytes for all pages together
    assert (first.work is None, second.work is None) == (False, False)
    Engine.make_room(engine, 250, "periods = 5")
    assert (first.work is None, second.work is None) == (True, False)
    with pytest.raises(TooLarge, match=r"^periods = 5: must be small enough for memory"):
        Engine.make_room(engine, 401, "periods = 5")
    monkeypatch.setattr("vibrodrive.explorer.engine.available_memory", lambda: 10**12)
    with pytest.raises(TooLarge, match=r"2\.0 GB are allowed"):
        Engine.make_room(engine, LARGEST + 1, "periods = 5")


@pytest.mark.parametrize(
    ("axes", "shown"),
    [
        ("A = [3.0, 3.1, 3.2]\neps = [0.0, 1e-4]", "ξ′ over A, ε = 0, the first of 2 values"),
        ("A = 3.0\neps = [0.0, 1e-4]", "ξ′ over ε"),
    ],
)
def test_part_shown_is_named(axes, shown):
    settings = config.parse("[sweep]\n" + axes)
    assert part_shown(view_of(settings), settings.plan()) == shown


@pytest.mark.jit
def test_motion_table_equals_simulate():
    view = View.read({"columns": 5, "low": 3.0, "high": 3.2, "at": 3.1, "transient": 20, "periods": 3})
    rows = export.motion_table(motion_at(view, Halt()).trajectory).splitlines()
    sample = vd.simulate(3.1, section_phase=view.section_phase, transient=20, periods=3).sample(export.POINTS)
    assert rows[0] == "tau,xi,dxi,state"
    assert [float(row.split(",")[1]) for row in rows[1:]] == sample.xi.tolist()
    assert export.file_name(view, "csv") == "motion_at_A_3.1.csv"
    with pytest.raises(ValueError, match="click a column"):
        send_file(SimpleNamespace(), View(), "csv", Halt())
