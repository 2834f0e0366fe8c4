"""The page in a real browser: it shows the computed results after any action of the mouse."""

import base64
import fcntl
import io
import itertools
import math
import os
import signal
import subprocess
import sys
import threading
from time import monotonic, sleep
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bokeh")

from PIL import Image

import vibrodrive as vd
from tests.support.chromium import browser, lacking
from vibrodrive.explorer import export
from vibrodrive.explorer.aside import SeparateProcess
from vibrodrive.explorer.image import values_of
from vibrodrive.explorer.motion import POINTS
from vibrodrive.explorer.session import Session, overlay_of, read_address
from vibrodrive.explorer.starts import STARTS
from vibrodrive.explorer.view import View
from vibrodrive.explorer.work import compute_into
from vibrodrive.figures.colours import SHADES
from vibrodrive.jit.slices import Halted
from vibrodrive.model import config
from vibrodrive.model.states import LASTING

pytestmark = [
    pytest.mark.jit,
    pytest.mark.slow("2 to 6 s each, more than a minute together: a browser and the computation of its pictures"),
    pytest.mark.browser,
    pytest.mark.skipif(bool(lacking()), reason=lacking() or "a browser is there"),
]

SMALL = "&columns=200&transient=100&periods=40"

DRAG_SECONDS = 3.0
NOTE = "document.getElementById('note').textContent"  # the note that exact curves are being computed


@pytest.fixture(autouse=True)
def one_browser_at_a_time(tmp_path_factory):
    """Run one browser at a time: Chromium draws in software and the explorer uses all cores."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        yield
        return
    with open(tmp_path_factory.getbasetemp().parent / "browser.lock", "w") as file:  # all workers use this file
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


@pytest.fixture(scope="module")
def explorer():
    found = vd.explore(threads=2)
    yield found
    found.close()


@pytest.fixture(scope="module")
def opened():
    with browser() as found:
        yield found


@pytest.fixture
def tab(opened):
    """Yield a browser whose console must contain no message after the test."""
    opened.complaints()
    yield opened
    assert opened.complaints() == []


def image(tab):
    """Return the picture as shades, uint8 (rows, columns), and its place on the axes: left, bottom, width, height."""
    found = tab.model(
        "const d = window.explorer.data, i = d.images[0]; return [Array.from(i), i.shape, d.x, d.y, d.dw, d.dh]"
    )
    return np.array(found[0], np.uint8).reshape(found[1]), found[2:]


def canvas(tab, figure=0):
    """Return the pixels of the canvas of a diagram and its position.

    The pixels are uint8 (rows, columns, 3) with the lowest row first. The position contains the left and the right end
    of the canvas as shares of the width of the frame.
    """
    found = tab.model(
        "const figures = all.filter((m) => m.type === 'Figure' && m.x_range.type === 'Range1d');"
        f"const view = Bokeh.index.find_one_by_id(figures[{figure}].id);"
        "const canvas = view.canvas_view.underlays_el.querySelector('canvas'), {width, height} = canvas;"
        "const copy = new OffscreenCanvas(width, height).getContext('2d', {willReadFrequently: true});"
        "copy.drawImage(canvas, 0, 0);"
        "const data = copy.getImageData(0, 0, width, height).data;"
        "const box = canvas.getBoundingClientRect(), {left} = view.canvas_view.el.getBoundingClientRect();"
        "const share = (x) => (x - left - view.frame.bbox.left) / view.frame.bbox.width;"
        "return [Array.from(data), [height, width, 4], [share(box.left), share(box.right)], canvas.hidden]"
    )
    pixels = np.array(found[0], np.uint8).reshape(found[1])
    assert not found[3]
    return pixels[::-1, :, :3], found[2]


def labels(tab, name):
    """Return the labels of the horizontal axis with this name, and their positions."""
    return tab.model(
        "const a = all.find((m) => m.type === 'LinearAxis' && m.axis_label === arguments[0]);"
        "const t = Bokeh.index.find_one_by_id(a.id).tick_coords.major[0];"
        "return [a.formatter.doFormat(t, {loc: 0}), t]",
        name,
    )


def shown(tab):
    """Return the `View` that the address of the page describes."""
    return read_address(tab.driver.current_url.split("?", 1)[1])


def test_final_picture_equals_the_sweep_of_the_exported_file(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=3.0")
    tab.ask("page.command({file: 'toml'})")
    tab.until("page.file !== null", "the exported file")
    text = base64.b64decode(tab.ask("page.file.base64")).decode()
    results = vd.sweep(**config.parse(text).arguments)
    painted, (x, y, dw, dh) = image(tab)
    columns = results.axes["A"]
    height = round(tab.frame()[3])
    assert (len(columns), painted.shape) == (200, (height, 200))
    assert x + dw * (np.arange(200) + 0.5) / 200 == pytest.approx(columns, abs=1e-12)
    spots = np.zeros(painted.shape, bool)
    values = values_of(results, "dxi")
    rows = np.floor((values - y) / dh * height).astype(int)
    spots[rows, np.arange(200)[:, None]] = True
    spots[1:] |= spots[:-1].copy()
    assert np.array_equal(painted > 0, spots)
    pixels, _ = canvas(tab)
    assert np.array_equal(pixels[..., 0] < 255, spots)
    assert (pixels == pixels[..., :1]).all()  # grey


def axis(low, high, count, scale):
    return (np.geomspace if scale == "log" else np.linspace)(low, high, count)


def sweep_of_scenes(view):
    """Return the scene of each point of a view in SI units, and the results of the sweep over their A and B."""
    axes = {view.x: axis(view.low, view.high, view.columns, view.scale)}
    if view.mode == "map":
        axes[view.y] = axis(view.y_low, view.y_high, view.rows, view.y_scale)
    points = [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]
    machine = {name: getattr(view, name) for name in ("a0", "omega0", "mu", "alpha", "mass", "g")}
    scenes = [vd.Scene.quiet(**machine | {n: v for n, v in p.items() if n in machine}) for p in points]
    together = {
        "A": [p.get("A", scene.A) for p, scene in zip(points, scenes, strict=True)],
        "B": [scene.B for scene in scenes],
        "eps": [p.get("eps", view.eps) for p in points],
    }
    common = {"section_phase": view.section_phase, "transient": view.transient, "periods": view.periods}
    return scenes, vd.sweep(points=together, record=("section", "impacts", "summary"), **common)


@pytest.mark.parametrize(
    "query",
    ["x=omega0", "x=a0&scale=log&low=5e-4&quantity=xi", "x=mu&quantity=impact_speed", "x=alpha&quantity=impact_phase",
     "scene=SI&x=A&low=3.0&alpha=4", "scene=SI&x=eps&scale=log&a0=7.5e-4"],
)  # fmt: skip
def test_diagrams_in_si_units_have_the_values_of_their_scenes(tab, explorer, query):
    tab.open(f"{explorer.address}&{query}&columns=80&transient=100&periods=40")
    view = shown(tab)
    _, results = sweep_of_scenes(view)
    number = {"xi": 0, "dxi": 1}.get(view.quantity)
    values = getattr(results, view.quantity) if number is None else results.section[..., number]
    painted, (_, y, _, dh) = image(tab)
    spots = np.zeros(painted.shape, bool)
    for column, found in enumerate(values):
        rows = np.floor((found[np.isfinite(found)] - y) / dh * len(spots)).astype(int)
        spots[rows, column] = True
        spots[rows + 1, column] = True
    assert spots.any(axis=0).mean() > 0.5
    assert np.array_equal(canvas(tab)[0][..., 0] < 255, spots)


def test_maps_in_si_units_have_the_values_of_their_scenes(tab, explorer):
    def drawn(query):
        tab.open(f"{explorer.address}&mode=map&{query}&columns=24&rows=16&transient=300&periods=66")
        view = shown(tab)
        scenes, results = sweep_of_scenes(view)
        pixels, _ = canvas(tab)
        keys = tab.driver.execute_script(
            "const numbers = (s) => getComputedStyle(s).backgroundColor.match(/[0-9]+/g).map(Number);"
            "return [...document.querySelectorAll('#status .swatch')]"
            ".map((s) => [s.nextSibling.textContent.trim(), numbers(s)])"
        )
        return scenes, results, pixels.transpose(1, 0, 2).reshape(-1, 3), dict(keys)

    for query in ("x=mu&y=alpha", "x=A&y=mu&scale=log", "x=omega0&y=a0"):
        _, results, pixels, key = drawn(query + "&shade=period")
        names = ["none", *map(str, range(1, 9))]
        rests = results.status == vd.Status.NEVER_LEAVES
        wanted = [
            ("rests" if rest else names[p] if p <= 8 else "more") for p, rest in zip(results.period, rests, strict=True)
        ]
        assert len({*wanted}) > 3
        assert [tuple(pixel) for pixel in pixels] == [tuple(key[name]) for name in wanted]

    scenes, results, pixels, key = drawn("x=omega0&y=a0&shade=impact_power&bottom=1&top=15")
    power = np.array([scene.power(energy) for scene, energy in zip(scenes, results.energy, strict=True)])
    palette = np.array(tab.ask("Array.from(page.data.palette)"))[:, None] >> [0, 8, 16] & 255
    shade = np.floor((power - 1.0) / 14.0 * SHADES).astype(int)
    wanted = palette[np.clip(shade, 0, SHADES - 1)]
    wanted[power < 1.0], wanted[power > 15.0] = key["less"], key["more"]
    wanted[results.status == vd.Status.NEVER_LEAVES] = key["rests"]
    assert ((power > 1.0) & (power < 15.0)).mean() > 0.2
    assert np.array_equal(pixels, wanted)


SIZES = [(3840, 2160), (900, 600), (390, 844)]
"""A large screen, a cell of a notebook, and a phone."""


@pytest.mark.parametrize("size", SIZES)
def test_page_fits_its_window_and_has_a_value_for_each_pixel(tab, explorer, size):
    try:
        tab.resize(*size, touch=size[0] < 500)
        tab.open(explorer.address + "&transient=50&periods=20")
        left, top, width, height = tab.frame()
        painted, _ = image(tab)
        assert painted.shape == (round(height), round(width))
        page, own, *window = tab.driver.execute_script(
            "const page = document.documentElement, own = document.getElementById('explorer');"
            "return [[page.scrollWidth, page.scrollHeight], own.scrollWidth, innerWidth, innerHeight]"
        )
        assert tuple(window) == size
        assert page[0] <= size[0]
        assert page[1] <= size[1]
        assert own <= size[0]  # on a phone the page scrolls vertically only
        assert 0 <= left < left + width <= size[0]
        assert 0 <= top < top + height <= size[1]
        assert width * height > 0.4 * size[0] * size[1]
        ink = "const c = document.getElementById('mechanism'), {data} = c.getContext('2d')" + (
            ".getImageData(0, 0, c.width, c.height); return data.filter((v, k) => k % 4 === 3 && v > 0).length"
        )
        assert tab.driver.execute_script(ink) > 100, "the drawing of the mechanism is there from the beginning"
    finally:
        tab.resize(1250, 810)


def test_ordinate_fits_the_values_until_it_is_moved(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=3.0")
    first = image(tab)[1][1]
    tab.choose("section_phase", "4.7")
    tab.settle()
    assert image(tab)[1][1] != first
    assert shown(tab).limits is None
    assert "No value" not in page_text(tab)
    left, top, width, height = tab.frame()
    middle = round(left + width / 2), round(top + height / 2)
    tab.drag(middle, [(middle[0], middle[1] - 40), (middle[0], middle[1] - 80)])
    tab.settle()
    moved = shown(tab).limits
    assert moved is not None
    tab.choose("section_phase", "1.5")
    tab.settle()
    assert shown(tab).limits == moved
    tab.ask("page.command({address: arguments[0]})", SMALL + "&low=3.0&bottom=50&top=60")
    tab.until(lambda: "No value is in this window" in page_text(tab), "a notice")
    tab.driver.execute_script("document.getElementById('follow').click()")
    tab.until("page.fit", "to follow")
    tab.settle()
    assert "No value" not in page_text(tab)


def test_control_without_effect_is_disabled_and_gives_the_reason(tab, explorer):
    tab.open(explorer.address + SMALL)

    def disabled():
        return {name for name in tab.ask("Object.keys(page.fields)")
                if tab.ask("page.fields[arguments[0]].input.disabled", name)}  # fmt: skip

    assert disabled() == {"A", "dtau", "tol", "compare", "eta"}
    assert "ε > 0" in tab.ask("page.fields.eta.control.title")
    tab.choose("eps", "1e-4")
    tab.choose("method", "muller")
    tab.settle()
    assert disabled() == {"A"}
    assert "ε > 0" not in tab.ask("page.fields.eta.control.title")
    tab.choose("quantity", "impact_phase")
    tab.choose("scene", "SI")
    tab.settle()
    assert disabled() == {"A", "section_phase", "mass", "a0", "omega0", "g"}


def test_slider_follows_an_expression_and_the_window_follows_its_fields(tab, explorer):
    tab.open(explorer.address + SMALL)
    tab.choose("eps", "1/5000")
    tab.settle()
    assert float(tab.ask("document.querySelector('[data-field=eps] [type=range]').value")) == pytest.approx(2e-4)
    for name, value in (("left", "3,0"), ("right", "3.2"), ("lower", "0.8"), ("upper", "1.6")):
        tab.driver.execute_script(
            "const f = document.getElementById(arguments[0]); f.value = arguments[1];"
            "f.dispatchEvent(new Event('change'))",
            name,
            value,
        )
    tab.settle()
    view = shown(tab)
    assert (view.low, view.high, view.bottom, view.top, view.eps) == (3.0, 3.2, 0.8, 1.6, 2e-4)
    tab.driver.execute_script("document.getElementById('reset').click()")
    tab.until("page.state().low !== 3", "the first view")
    tab.settle()
    ends = [float(tab.ask("document.getElementById(arguments[0]).value", name)) for name in ("left", "right")]
    assert ends == pytest.approx([shown(tab).low, shown(tab).high], abs=1e-3)


def test_drag_runs_one_computation_at_a_time_and_ends_on_the_last_view(tab, explorer, monkeypatch):
    running, most = [], []

    def counted(*arguments):
        running.append(1)
        most.append(len(running))
        try:
            compute_into(*arguments)
        finally:
            running.pop()

    monkeypatch.setattr("vibrodrive.explorer.work.compute_into", counted)
    tab.open(explorer.address + SMALL + "&eps=2e-4")
    before, frames = len(most), tab.ask("page.frames.length")
    begun = monotonic()
    _, _, width, _ = tab.frame()
    tab.mouse("Pressed", 500, 300)
    for k in itertools.count(1):
        place = 500 + round(150 * math.sin(k / 9)), 300 + k % 7
        tab.mouse("Moved", *place)
        if monotonic() - begun > DRAG_SECONDS and tab.ask("page.frames.length") > frames + 3:
            break
        assert monotonic() - begun < tab.PATIENCE, "pictures must appear while the mouse moves"
        sleep(0.01)
    tab.mouse("Released", *place)
    tab.settle()
    assert max(most) == 1
    assert len(most) > before
    state, view = tab.state(), shown(tab)
    assert (view.low, view.high, view.bottom) == (state["low"], state["high"], state["bottom"])
    moved = (place[0] - 500) / width * (3.25 - 2.4)
    assert state["low"] == pytest.approx(2.4 - moved, abs=5e-3)
    _, (x, _, dw, _) = image(tab)
    _, share = canvas(tab)
    places = state["low"] + np.array(share) * (state["high"] - state["low"])
    assert places == pytest.approx((x, x + dw), abs=1e-5)
    assert (x, x + dw) == pytest.approx((state["low"], state["high"]), abs=0.01)


def test_mouse_drags_if_it_moves_and_clicks_if_it_does_not(tab, explorer):
    tab.open(explorer.address + SMALL)
    before = shown(tab)
    tab.mouse("Pressed", 500, 300)
    sleep(0.6)
    for x in (480, 450):
        tab.mouse("Moved", x, 300)
    tab.mouse("Released", 450, 300)
    tab.settle()
    moved = shown(tab)
    assert moved.low - before.low == pytest.approx(50 / tab.frame()[2] * (3.25 - 2.4), abs=5e-3)
    assert tab.state()["at"] is None
    tab.mouse("Pressed", 500, 300)
    sleep(0.6)
    tab.mouse("Released", 500, 300)
    tab.until("page.state().at !== null", "a click")
    assert (tab.state()["low"], tab.state()["high"]) == (moved.low, moved.high)


def test_slow_computation_shows_pictures_during_a_drag(tab, explorer, monkeypatch):
    tab.open(explorer.address + SMALL)

    def slowly(results, plan, which, threads, halt, pace):
        for _ in range(40):  # 0.4 s, longer than a newer view usually waits for the running request
            sleep(0.01)
            if halt.called:
                raise Halted
        compute_into(results, plan, which, threads, halt, pace)

    monkeypatch.setattr("vibrodrive.explorer.work.compute_into", slowly)
    before = tab.ask("page.frames.length")
    tab.mouse("Pressed", 500, 300)
    end = monotonic() + tab.PATIENCE
    while tab.ask("page.frames.length") == before:
        assert monotonic() < end
        tab.mouse("Moved", round(500 + 100 * math.sin(9 * monotonic())), 300)
        sleep(0.02)
    tab.mouse("Released", 500, 300)
    tab.settle()


def test_long_delay_is_explained_until_it_ends(tab, explorer, monkeypatch):
    tab.open(explorer.address + SMALL)
    assert "200 motions" in page_text(tab)
    released = threading.Event()

    def late(*arguments):
        released.wait(tab.PATIENCE)
        compute_into(*arguments)

    monkeypatch.setattr("vibrodrive.explorer.work.compute_into", late)
    tab.choose("eps", "1e-4")
    tab.until(lambda: "compiles it" in page_text(tab), "an explanation of the delay")
    assert "200 motions" not in page_text(tab)
    released.set()
    tab.settle()
    assert "200 motions" in page_text(tab)
    assert "compiles it" not in page_text(tab)


def test_twenty_box_zooms_and_back(tab, explorer):
    tab.open(explorer.address + SMALL)
    addresses = []
    tab.model("const f = all.find((m) => m.type === 'BoxZoomTool'); f.active = true; return 1")
    for _ in range(20):
        addresses.append(shown(tab))
        # each step reduces the width to a third: 3**20 = 3.5e9
        left, _, width, _ = tab.frame()
        tab.drag((left + width // 3, 150), [(450, 250), (left + 2 * width // 3, 380)])
        tab.settle()
    deep = shown(tab)
    assert deep.high - deep.low < 1e-9
    (first, *rest), ticks = labels(tab, "A")
    assert float(first) == pytest.approx(ticks[0], abs=(deep.high - deep.low) / 100)
    for text, tick in zip(rest, ticks[1:], strict=True):
        assert text.startswith("+")
        assert float(text) == pytest.approx(tick - ticks[0], rel=0.01)
    tab.driver.back()
    tab.until(lambda: shown(tab) == addresses[-1], "the previous view")
    tab.settle()
    state = tab.state()
    assert (state["low"], state["high"]) == (addresses[-1].low, addresses[-1].high)


def test_grid_is_toggled_by_its_key(tab, explorer):
    tab.open(explorer.address + SMALL)
    grids = "return all.filter((m) => m.type === 'Grid').filter((m) => m.visible).length"
    assert tab.model(grids) == 0
    tab.driver.find_element("tag name", "body").send_keys("g")
    assert tab.model(grids) >= 4
    tab.driver.find_element("tag name", "body").send_keys("g")
    assert tab.model(grids) == 0


def test_link_restores_the_view(tab, explorer):
    query = "&x=eps&low=1e-06&high=0.001&scale=log&columns=100&quantity=impact_speed&transient=50&periods=20&B=0.2"
    tab.open(explorer.address + query)
    view = shown(tab)
    assert (view.x, view.low, view.high, view.scale, view.B) == ("eps", 1e-6, 1e-3, "log", 0.2)
    assert view.quantity == tab.ask("page.fields.quantity.value") == "impact_speed"
    texts, exponents = labels(tab, "ε")
    assert texts[:5] == ["1e-6", "2e-6", "5e-6", "1e-5", "2e-5"]
    assert texts[-1] == "0.001"
    assert list(map(float, texts)) == pytest.approx([10**u for u in exponents], rel=0.005)
    tab.driver.execute_script(
        "const s = document.getElementById('save'); s.value = 'link'; s.dispatchEvent(new Event('change'))"
    )
    text = tab.ask("document.querySelector('dialog[open] textarea').value")
    assert "token" not in text
    command, link, _ = text.split('"')
    assert command == "vibrodrive explore "
    assert read_address(link.partition("?")[2]) == view
    tab.driver.execute_script("document.getElementById('text').close()")


def test_click_shows_the_motion_of_simulate(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=3.0")
    left, _, width, _ = tab.frame()
    place = left + 0.39 * width
    tab.click(place, 300)
    source = "const s = all.find((m) => m.type === 'ColumnDataSource' && m.data.dxi);"
    tab.until(lambda: tab.model(source + "return s.data.time.length") > 0, "curves")
    curves = tab.model(
        source + "return Object.fromEntries(['time', 'xi', 'dxi'].map((k) => [k, s.data[k].map((v) => [...v])]))"
    )
    columns = np.linspace(3.0, 3.25, 200)
    at = tab.state()["at"]
    A = columns[np.argmin(abs(columns - at))]
    assert at == pytest.approx(3.0 + 0.25 * (place - left) / width, abs=2e-3)
    motion = vd.simulate(A, section_phase=math.pi / 2, transient=100, periods=12)
    sample = motion.sample(POINTS)
    time = (sample.tau - sample.tau[0]) / (2 * math.pi)
    at_all, *times = np.array(curves["time"])
    assert (times == at_all).all()
    for name, wanted in (("xi", sample.xi), ("dxi", sample.dxi)):
        for state, curve in zip(LASTING, np.array(curves[name], float)[:-1], strict=True):
            own, there = sample.state == state, ~np.isnan(curve)  # a curve has no values in other states
            assert there.any() == own.any()
            if own.any():
                assert np.interp(time[own], at_all[there], curve[there]) == pytest.approx(wanted[own], abs=1e-9)
    words = tab.ask("page.words")
    assert repr(float(A)) in words
    assert "OK" in words
    place = (A - 3.0) / 0.25
    tab.until(lambda: followed(tab) == pytest.approx(place, abs=1e-3), "the line at the column that is shown")
    tab.choose("scale", "log")
    tab.settle()
    columns = np.geomspace(3.0, 3.25, 200)
    A = columns[np.argmin(abs(columns - at))]
    log_place = math.log(A / 3.0) / math.log(3.25 / 3.0)
    assert log_place != pytest.approx(place, abs=3e-3)
    tab.until(lambda: followed(tab) == pytest.approx(log_place, abs=1e-3), "the line at the column of the new axis")


def test_drawing_plays_the_motion_and_steps_to_its_switches(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=3.0&at=3.1")
    tab.until("page.drawn_motion.forces !== null", "a motion")
    motion = vd.simulate(float(shown(tab).plan().axes["A"][np.argmin(abs(shown(tab).plan().axes["A"] - 3.1))]),
                         section_phase=math.pi / 2, transient=100, periods=12)  # fmt: skip
    switches = motion.switches["period"] - 100 + motion.switches["phase"] / (2 * math.pi)
    begins, *forces = tab.ask("[page.drawn_motion.forces].map((f) => [f.begins, f.time, f.H].map((a) => [...a]))[0]")
    assert begins == pytest.approx([0.0, *switches], abs=1e-12)
    sample = motion.sample(POINTS)
    assert forces[0] == pytest.approx((sample.tau - sample.tau[0]) / (2 * math.pi), abs=1e-12)
    assert forces[1] == pytest.approx(sample.H, abs=1e-12)
    for switch in np.unique(switches)[:3]:
        tab.driver.execute_script("document.getElementById('step').click()")
        assert tab.ask("page.drawn_motion.at") == pytest.approx(switch, abs=1e-12)
    width, *alpha = tab.driver.execute_script(
        "const c = document.getElementById('forces'), {width, height} = c;"
        "const row = Math.floor(height - 0.9 * parseFloat(getComputedStyle(c).fontSize));"  # above the bar of states
        "return [width, ...c.getContext('2d').getImageData(0, row, width, 1).data.filter((v, k) => k % 4 === 3)]"
    )
    drawn = np.rint([begin / 2.0 * width for begin in begins if begin < 2.0])  # the drawing shows two periods
    inked = {*np.nonzero(alpha)[0].tolist()}
    assert {*drawn.tolist()} <= inked
    assert len(inked) <= len({*drawn.tolist()}) + 3  # the line at the present time has up to 3 pixels
    before = tab.ask("page.drawn_motion.at")
    tab.driver.execute_script("document.getElementById('play').click()")
    tab.until(f"page.drawn_motion.at !== {before!r}", "a movement")
    assert tab.driver.execute_script(
        "const c = document.getElementById('mechanism');"
        "return c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v > 0)"
    )
    tab.driver.execute_script("document.getElementById('close').click()")
    tab.until("document.getElementById('motion').hidden", "no motion")


def test_each_initial_view_is_shown(tab, explorer):
    tab.open(explorer.address + SMALL)
    (number,) = (k for k, start in enumerate(STARTS) if start.name.startswith("Fig. 10"))
    tab.driver.execute_script(
        "const s = document.getElementById('start'); s.value = arguments[0]; s.dispatchEvent(new Event('change'))",
        number,
    )
    tab.until("page.state().method === 'fixed'", "the view")
    tab.settle()
    assert tab.notice() == ""
    assert "fixed steps of Δτ = 0.1" in page_text(tab)
    assert tab.ask("document.getElementById('start').value") == "", "the same view can be selected again"
    tab.choose("x", "eps")
    tab.settle()
    assert "fixed steps of Δτ = 0.1" not in page_text(tab), "the text describes another picture"


def test_motion_is_removed_with_its_column(tab, explorer):
    lasting = "const s = all.find((m) => m.type === 'ColumnDataSource' && m.data.dxi); return s.data.time.length"
    tab.open(explorer.address + SMALL + "&low=3.0&method=fixed&dtau=0.05&at=3.1")
    tab.until(lambda: "of the certified, undisturbed motion" in tab.ask("page.words"), "k₂ of the motion")
    assert "A = 3.1" in tab.ask("page.words")
    assert "grid of step Δτ = 0.05" in tab.ask("page.words")
    assert tab.model(lasting) > 0
    tab.ask("page.command({address: arguments[0]})", SMALL + "&low=3.15&method=fixed&dtau=0.05&at=3.1")
    tab.until(lambda: tab.model(lasting) == 0, "no curves")
    tab.settle()
    assert tab.ask("page.words") == ""
    assert tab.model(lasting) == 0
    tab.driver.back()
    tab.until(lambda: tab.model(lasting) > 0, "the curves again")
    assert "A = 3.1" in tab.ask("page.words")


def followed(tab):
    """Return the position of the line at the selected motion as a share of the width. Return None if the line is
    hidden."""
    return tab.model("""
        const plot = all.find((m) => m.name === 'first');
        const canvas = Bokeh.index.find_one_by_id(plot.id).canvas_view.underlays_el.querySelector('canvas');
        const line = canvas.nextSibling, box = canvas.parentElement, left = box.getBoundingClientRect().left;
        return line.hidden ? null : (line.getBoundingClientRect().left - left) / box.getBoundingClientRect().width;
    """)


def test_methods_side_by_side_and_their_difference(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=3.0&dtau=0.1")
    visible = "return all.filter((m) => m.type === 'Figure').filter((m) => m.visible).length"
    assert tab.model(visible) == 3
    tab.choose("method", "fixed")
    tab.settle()
    assert shown(tab).method == "fixed"
    alone, _ = image(tab)
    tab.choose("compare", "beside")
    tab.settle()
    assert tab.model(visible) == 4
    beside, _ = image(tab)
    assert len(beside) < len(alone)
    assert np.array_equal(canvas(tab)[0][..., 0] < 255, beside > 0)
    assert 0.0 < (canvas(tab, 1)[0][..., 0] < 255).mean() != (beside > 0).mean()
    tab.drag((500, 200), [(480, 200), (460, 200)])
    tab.settle()
    ranges = tab.model(
        "return all.filter((m) => m.type === 'Figure' && m.x_range.type === 'Range1d')"
        ".map((m) => [m.x_range.start, m.x_range.end, m.y_range.start, m.y_range.end])"
    )
    assert len(ranges) == 2
    assert ranges[0] == ranges[1]
    assert ranges[0][0] > 3.0
    tab.choose("compare", "difference")
    tab.settle()
    assert tab.model(visible) == 3
    found, _ = image(tab)
    assert {k for k in range(3) if ((found // 64 == k) & (found > 0)).any()} == {0, 1, 2}


def test_click_on_a_map_opens_the_diagram(tab, explorer):
    tab.open(explorer.address + "&mode=map&columns=60&rows=40&transient=100&periods=64")
    cells, _ = canvas(tab)
    assert cells.shape == (40, 60, 3)
    assert len(np.unique(cells.reshape(-1, 3), axis=0)) > 3  # each period has its colour
    left, top, width, height = tab.frame()
    tab.click(left + width // 2, top + height // 2)
    tab.until("page.fields.mode.value === 'diagram'", "the diagram")
    tab.settle()
    view = shown(tab)
    assert view.mode == "diagram"
    assert pytest.approx(0.16, abs=0.01) == view.B
    assert view.at == pytest.approx(2.825, abs=0.01)
    tab.driver.back()
    tab.until("page.fields.mode.value === 'map'", "the map again")
    tab.settle()
    assert followed(tab) is None


def test_mode_sets_axes_and_windows_and_locks_swept_parameters(tab, explorer):
    def choose(name, value):
        tab.choose(name, value)
        tab.settle()
        along = "Object.values(page.fields).filter((f) => f.control.title.includes('on an axis')).map((f) => f.name)"
        return shown(tab), sorted(tab.ask(along))

    small = "&columns=20&rows=10&transient=20&periods=20&eps=1e-5"  # the axis of ξ may begin below 0, that of B may not
    tab.open(explorer.address + small + "&y_low=0.05&y_high=0.2&quantity=xi&bottom=-0.5&top=2.5")
    view, locked = choose("mode", "map")
    assert (view.mode, view.y_low, view.y_high, view.limits) == ("map", 0.05, 0.2, None)
    assert locked == ["A", "B"]
    (_, low, _, height) = image(tab)[1]
    assert (low, low + height) == pytest.approx((0.05 - 0.15 / 18, 0.2 + 0.15 / 18))
    view, locked = choose("x", "xi0")
    assert (view.x, view.y_low, view.y_high) == ("xi0", 0.05, 0.2)
    assert locked == ["B", "xi0"]
    view, locked = choose("mode", "diagram")
    assert (view.mode, locked) == ("diagram", ["xi0"])
    view, _ = choose("x", "omega0")
    assert (view.scene, view.x, view.low, view.high) == ("SI", "omega0", 80.0, 200.0)
    view, locked = choose("scene", "dimensionless")
    assert (view.scene, view.x) == ("dimensionless", "A")
    assert locked == ["A"]


def test_colour_limits_of_a_map_stay_until_they_are_fitted(tab, explorer):
    ranged = "&mode=map&columns=12&rows=8&transient=20&periods=64&shade=energy&bottom=0.25&top=1.5"
    tab.open(explorer.address + ranged)
    assert shown(tab).limits == (0.25, 1.5)
    limited = canvas(tab)[0]
    tab.ask("page.fit_now()")
    tab.until("page.state().bottom === null", "a range that fits")
    tab.settle()
    assert shown(tab).limits is None
    assert not np.array_equal(canvas(tab)[0], limited)


def test_exact_orbits_match_the_diagram_and_bifurcations_are_named(tab, explorer):
    tab.open(explorer.address + "&columns=200&low=2.55&high=2.65&quantity=impact_speed&orbits=2")
    marks = "const s = all.find((m) => m.type === 'ColumnDataSource' && m.data.kind && m.data.A);"
    tab.until(lambda: tab.model(marks + "return s.data.A.length") > 0, "bifurcations")
    found = tab.model(marks + "return [Array.from(s.data.A), Array.from(s.data.kind)]")
    (doubling,) = vd.bifurcations((2.55, 2.65), max_period=1)
    assert (repr(doubling.A), "period doubling") in list(zip(*found, strict=True))
    tab.until(f"/━━ stable orbit.*○ period doubling/.test({NOTE})", "the key to the lines and circles")


def test_page_reports_pending_exact_curves(tab, explorer, monkeypatch):
    call, may_end = SeparateProcess.call, threading.Event()

    def slow(aside, halt, function, *arguments):
        while not may_end.wait(0.01):
            if halt.called:
                raise Halted
        return call(aside, halt, function, *arguments)

    monkeypatch.setattr(SeparateProcess, "call", slow)
    tab.open(explorer.address + "&columns=200&low=2.55&high=2.65")
    waits = f"{NOTE}.includes('exact curves are being computed')"
    assert not tab.ask(waits)
    tab.choose("orbits", "3")
    tab.until(waits, "a note that curves are being computed")
    tab.ask("page.command({address: 'low=x'})")
    tab.until("page.refused !== ''", "a refusal of another setting")
    may_end.set()
    tab.until("page.status.startsWith('200 motions') && !" + waits, "the end of the note")
    assert tab.model("return all.some((m) => m.type === 'ColumnDataSource' && m.data.kind && m.data.x.length > 0)")


def test_failed_picture_ends_the_search_for_curves_and_is_reported(tab, explorer, monkeypatch):
    def never(aside, halt, function, *arguments):
        while not halt.called:
            sleep(0.01)
        raise Halted

    def fails(*arguments, **more):
        raise ValueError("no picture today")

    monkeypatch.setattr(SeparateProcess, "call", never)
    tab.open(explorer.address + SMALL + "&orbits=3")
    tab.until(f"{NOTE}.includes('being computed')", "a note that curves are being computed")
    monkeypatch.setattr("vibrodrive.explorer.work.compute_into", fails)
    tab.choose("periods", "41")
    tab.until("page.refused.includes('no picture today')", "the error")
    tab.until(f"!{NOTE}.includes('being computed')", "the end of the note")


def test_late_curves_are_not_drawn_over_another_view():
    sought = overlay_of(View.read({"orbits": 2}))
    for shown, belong in [
        ({"orbits": 2, "low": 3.0}, True),
        ({"orbits": 0}, False),
        ({"orbits": 2, "quantity": "xi"}, False),
    ]:
        assert Session.belongs(SimpleNamespace(view=View.read(shown)), sought) is belong


def test_saved_picture_equals_the_page(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=3.0&method=fixed&compare=difference&orbits=1")
    tab.until(f"!{NOTE}.includes('being computed')", "exact orbits")
    tab.driver.execute_script(
        "page = window.explorer; page.file = null; const s = document.getElementById('save');"
        "s.value = 'png'; s.dispatchEvent(new Event('change'))"
    )
    tab.until("page.file !== null", "the picture")
    assert tab.ask("page.file.name") == "dxi_over_A_3_3.25_fixed_0.1_minus_certified.png"
    saved = np.array(Image.open(io.BytesIO(base64.b64decode(tab.ask("page.file.base64")))).convert("RGB")).astype(int)
    on_page = canvas(tab)[0][::-1].astype(int)
    on_page = on_page.repeat(round(export.CELL / on_page.shape[1]), 1)
    (height, width, _) = on_page.shape
    part = saved[:, export.LEFT : export.LEFT + width]
    same = [(part[top : top + height] == on_page).all(axis=2).mean() for top in range(len(part) - height)]
    assert max(same) > 0.9  # exact orbits and the frame of the axes cover the other pixels
    blue = (saved == (0, 114, 178)).all(axis=2).sum()
    assert blue > (on_page == (0, 114, 178)).all(axis=2).sum()  # stable orbits


def test_errors_are_shown_in_one_line(tab, explorer):
    tab.open(explorer.address + SMALL)
    for name, nonsense in (("eps", "<script>alert(1)</script>"), ("periods", "-1")):
        good = tab.ask("page.fields[arguments[0]].value", name)
        tab.choose(name, nonsense)
        tab.until("page.refused !== ''", f"a refusal of {name}")
        notice = tab.notice()
        assert notice.startswith(f"{name} = ")
        assert "must be" in notice
        assert "<" not in notice
        assert "\n" not in notice
        hint = tab.ask("document.getElementById(arguments[0]).textContent", name + "-hint")
        assert hint.startswith({"eps": "ε = '<script>", "periods": "periods = -1: must be"}[name])
        tab.choose(name, good)
        tab.until("page.refused === ''", "the end of the refusal")
    tab.settle()
    tab.open(explorer.address + SMALL + "&eps=-3&novelty=1")
    assert tab.notice().startswith(("eps = ", "key of a view = "))


def test_stopped_server_is_reported_until_it_continues(opened):
    command = [sys.executable, "-m", "vibrodrive", "explore", "--no-browser", "--port", "0"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        opened.open(server.stdout.readline().strip() + SMALL)
        server.send_signal(signal.SIGSTOP)
        opened.until(lambda: "does not answer" in page_text(opened), "a notice")
        server.send_signal(signal.SIGCONT)
        opened.until(lambda: "does not answer" not in page_text(opened), "the end of the notice")
        opened.choose("eps", "1e-4")
        opened.settle()
        server.kill()
        opened.until(lambda: "does not answer" in page_text(opened), "a notice that it has ended")
        for _ in range(40):  # the notice stays, although the page asks the server repeatedly
            assert "does not answer" in page_text(opened)
            sleep(0.2)
        assert "Client connection" not in page_text(opened)  # the message of Bokeh
    finally:
        server.kill()
        server.communicate()
    opened.complaints()  # discards the messages about the lost connection


def test_unusual_statuses_have_ticks_and_are_selectable(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=0.9&high=1.3&quantity=xi")
    view = shown(tab)
    status = vd.sweep(**config.parse(view.toml()).arguments).status
    (odd,) = np.nonzero(status)
    assert 0 < len(odd) < 200
    ticks = tab.ask(
        "(() => { const all = [...Bokeh.documents[0]._all_models.values()];"
        "const view = Bokeh.index.find_one_by_id(all.find((m) => m.name === 'first').id);"
        "const odd = view.canvas_view.underlays_el.querySelectorAll('canvas')[1];"
        "const canvas = view.canvas_view.underlays_el.querySelector('canvas');"
        "const [a, b] = [odd, canvas].map((c) => c.getBoundingClientRect());"
        "if (Math.abs(a.left - b.left) + Math.abs(a.right - b.right) > 1) return [];"
        "return [...odd.getContext('2d').getImageData(0, 0, odd.width, 1).data].filter((_, k) => k % 4 === 3); })()"
    )
    assert np.array_equal(np.flatnonzero(ticks), odd)
    columns = np.linspace(0.9, 1.3, 200)
    for column in odd[:2]:
        tab.driver.execute_script("document.querySelector('#status button').click()")
        tab.until(lambda: tab.state()["at"] is not None, "a motion")
        assert tab.state()["at"] == pytest.approx(columns[column], abs=1e-6)
        tab.until("page.words.includes('NEVER LEAVES')", "its description")


def test_values_under_the_mouse_and_ratio_of_marks(tab, explorer):
    def read():
        return tab.ask("['read', 'marks'].map((id) => document.getElementById(id).textContent).join('')")

    tab.open(explorer.address + SMALL + "&low=2.4&high=3.2&bottom=0.5&top=2.0")
    left, top, width, height = tab.frame()
    tab.mouse("Moved", left + width / 4, top + height / 3)
    tab.until(lambda: "ξ′" in read(), "values")
    found = dict(part.split(" = ") for part in read().split(", "))
    assert float(found["A"]) == pytest.approx(2.6, abs=0.8 / width)
    assert float(found["ξ′"]) == pytest.approx(1.5, abs=1.5 / height)
    tab.driver.find_element("tag name", "body").send_keys("m")
    places = [left + share * width for share in (0.2, 0.6, 0.7)]
    for k, x in enumerate(places):
        tab.click(x, top + height / 2)
        tab.until(f"page.marks.length === {k + 1}", "a mark")
    tab.until(lambda: "δ = " in read(), "δ")
    (a, b, c) = (2.4 + 0.8 * (round(x) - left) / width for x in places)
    assert float(read().partition("difference ")[2].partition(",")[0]) == pytest.approx(b - a, abs=2 * 0.8 / width)
    assert float(read().partition("ratio ")[2].partition(";")[0]) == pytest.approx(b / a, abs=1e-3)
    assert float(read().partition("δ = ")[2]) == pytest.approx((b - a) / (c - b), rel=0.05)
    assert tab.state()["at"] is None
    tab.driver.find_element("tag name", "body").send_keys("m")
    assert tab.ask("page.marks.length") == 0


def test_slider_runs_until_it_is_stopped(tab, explorer):
    tab.open(explorer.address + "&columns=64&transient=20&periods=20&low=3.0")
    press = "document.querySelector('[data-play=eps]').click()"
    tab.driver.execute_script(press)
    tab.until("Number(page.fields.eps.value) > 0 && page.frames.length > 2", "a larger ε")
    tab.driver.execute_script(press)
    tab.settle()
    assert tab.ask("page.played") == ""
    assert shown(tab).eps > 0.0


def test_slider_stops_where_the_structure_of_the_selected_motion_is_lost(tab, explorer):
    tab.open(explorer.address + "&columns=64&transient=20&periods=20&low=3.19&at=3.2")
    limit = vd.limit(shown(tab).plan().axes["A"][np.argmin(abs(shown(tab).plan().axes["A"] - 3.2))])
    tab.driver.execute_script("document.querySelector('[data-play=eps]').click()")
    tab.until(f"page.played === '' && {NOTE}.includes('stopped')", "the end of the movement")
    tab.settle()
    assert "the structure is lost" in tab.ask(NOTE)
    step = 1e-3 / 50
    assert shown(tab).eps == pytest.approx(step * math.ceil(limit.last_kept / step))


def test_fingers_move_zoom_and_select(tab, explorer):
    def touch(kind, *points):
        points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        tab.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    try:
        tab.resize(390, 844, touch=True)
        tab.open(explorer.address + SMALL)
        left, top, width, height = tab.frame()
        x, y = left + width / 2, top + height / 2
        touch("touchStart", (x, y))
        for k in range(1, 6):
            touch("touchMove", (x - 10 * k, y))
        touch("touchEnd")
        tab.until("page.state().low > 2.4", "a moved view")
        tab.settle()
        moved = shown(tab)
        assert moved.low > 2.4
        touch("touchStart", (x - 20, y), (x + 20, y))
        for k in range(1, 6):
            touch("touchMove", (x - 20 - 10 * k, y), (x + 20 + 10 * k, y))
        touch("touchEnd")
        tab.until(f"page.state().high - page.state().low < {0.9 * (moved.high - moved.low)}", "a closer view")
        tab.settle()
        touch("touchStart", (x, y))
        touch("touchEnd")
        tab.until("page.words.includes('A = ')", "a motion")
    finally:
        tab.resize(1250, 810)


def test_leaving_the_page_cancels_its_tasks_and_back_restores_it(opened, explorer):
    worker = explorer._explorer.engine.worker
    opened.driver.get(explorer.address + "&columns=4000&eps=5e-4&transient=100000&low=3.1")
    opened.until("!!page && page.begun", "a first picture")
    assert not worker.idle()
    opened.driver.get("about:blank")
    opened.until(worker.idle, "the end of all work")
    opened.driver.back()
    opened.until("!!page && page.begun", "a first picture again")
    assert shown(opened).low == 3.1
    opened.complaints()  # discards the messages about the closed connection


def page_text(tab):
    """Return all text of the page, including the shadow roots of its widgets."""
    return tab.driver.execute_script(
        "const text = (n) => [...n.childNodes].map((c) => (c.nodeType === 3 ? c.data : '') + text(c)"
        " + (c.shadowRoot ? text(c.shadowRoot) : '')).join(' '); return text(document.body)"
    )
