"""The page in a real browser: it shows the computed results after any action of the mouse, of fingers and of keys."""

import base64
import fcntl
import io
import itertools
import json
import math
import os
import re
import signal
import subprocess
import sys
import threading
from functools import cache
from time import monotonic, sleep
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("tornado")

from PIL import Image

import vibrodrive as vd
from tests.support.chromium import browser, lacking
from vibrodrive.explorer.image import values_of
from vibrodrive.explorer.motion import POINTS
from vibrodrive.explorer.tasks import show_picture
from vibrodrive.explorer.view import read_address
from vibrodrive.explorer.work import compute_into
from vibrodrive.jit.slices import Halted
from vibrodrive.model import config

pytestmark = [
    pytest.mark.jit,
    pytest.mark.slow("2 to 6 s each, more than a minute together: a browser and the computation of its pictures"),
    pytest.mark.browser,
    pytest.mark.skipif(bool(lacking()), reason=lacking() or "a browser is there"),
]

SMALL = "&columns=200&transient=100&periods=40"
SIZE = 1250, 810


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
    with browser(*SIZE) as found:
        yield found


@pytest.fixture
def tab(opened):
    """Yield a browser whose console must contain no message after the test."""
    opened.complaints()
    yield opened
    assert opened.complaints() == []


def image(tab):
    """Return the picture as shades (rows, columns), and its place on the axes: left, bottom, width, height."""
    found = tab.ask("(({image: i, x, y, dw, dh}) => [Array.from(i), i.shape, x, y, dw, dh])(page.data)")
    return np.array(found[0]).reshape(found[1]), found[2:]


def canvas(tab):
    """Return the pixels of the picture, uint8 (rows, columns, 3) with the lowest row first, and the left and right end
    of its canvas as shares of the width of the frame."""
    found = tab.driver.execute_script(
        "const c = document.getElementById('picture'), {width, height} = c, box = c.getBoundingClientRect();"
        "const frame = document.getElementById('frame').getBoundingClientRect();"
        "const share = (x) => (x - frame.left) / frame.width;"
        "const copy = new OffscreenCanvas(width, height).getContext('2d', {willReadFrequently: true});"
        "copy.drawImage(c, 0, 0);"
        "return [[...copy.getImageData(0, 0, width, height).data], [height, width, 4], share(box.left),"
        "share(box.right)]"
    )
    return np.array(found[0], np.uint8).reshape(found[1])[::-1, :, :3], found[2:]


def shown(tab):
    """Return the `View` that the address of the page describes."""
    return read_address(tab.driver.current_url.split("?", 1)[1])


def text(tab, name):
    found = tab.driver.execute_script("return document.getElementById(arguments[0]).textContent", name)
    return found.replace("\xa0", " ")


def press_key(tab, key):
    script = "document.dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0], bubbles: true}))"
    tab.driver.execute_script(script, key)


def middle(tab):
    left, top, width, height = tab.frame()
    return round(left + width / 2), round(top + height / 2)


def wheel(tab, x, y, by):
    turned = {"type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": by}
    tab.driver.execute_cdp_cmd("Input.dispatchMouseEvent", turned)


def spots_of(values, y, dh, shape):
    """Mark, by an independent rasteriser, the pixel of each value of each column, and the pixel above."""
    spots = np.zeros(shape, bool)
    for column, found in enumerate(values):
        rows = np.floor((found[np.isfinite(found)] - y) / dh * shape[0]).astype(int)
        for row in (rows, rows + 1):
            spots[row[(row >= 0) & (row < shape[0])], column] = True
    return spots


def test_final_picture_equals_the_sweep_of_the_exported_file(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=3.0")
    tab.press("toml")
    tab.until("page.file !== null", "the configuration")
    results = vd.sweep(**config.parse(tab.ask("page.file.content")).arguments)
    painted, (x, y, dw, dh) = image(tab)
    assert painted.shape == (round(tab.frame()[3]), 200)
    assert x + dw * (np.arange(200) + 0.5) / 200 == pytest.approx(results.axes["A"], abs=1e-12)
    values = values_of(results, "dxi")
    assert y < values.min() < values.max() < y + dh < values.max() + 0.1 * dh
    spots = spots_of(values, y, dh, painted.shape)
    assert np.array_equal(painted > 0, spots)
    assert np.array_equal(canvas(tab)[0][..., 0] < 255, spots)


def test_map_has_the_colours_of_its_key_and_a_click_opens_the_diagram(tab, explorer):
    tab.open(explorer.address + "&mode=map&low=1&high=4&columns=24&rows=16&transient=300&periods=66")
    view, (pixels, _) = shown(tab), canvas(tab)
    results = vd.sweep(
        A=np.linspace(1, 4, 24), B=np.linspace(0.02, 0.3, 16), record="summary", transient=300, periods=66
    )
    key = dict(tab.driver.execute_script(
        "return [...document.querySelectorAll('#key .entry')].map((s) => [s.textContent,"
        "getComputedStyle(s.firstChild).backgroundColor.match(/[0-9]+/g).map(Number)])"))  # fmt: skip
    rests = results.status == vd.Status.NEVER_LEAVES
    names = np.where(rests, "rests", np.where(results.period > 8, "9 to 64", results.period.astype(str)))
    names = np.where((results.period == 0) & ~rests, "none found up to 64", names)
    assert len(np.unique(names)) > 3
    assert [tuple(p) for p in pixels.transpose(1, 0, 2).reshape(-1, 3)] == [tuple(key[n]) for n in names.ravel()]
    left, top, width, height = tab.frame()
    tab.click(round(left + 0.7 * width), round(top + 0.6 * height))
    tab.until("page.motion && page.view.at !== arguments[0]".replace("arguments[0]", repr(view.at)), "a motion")
    at, at_y = tab.ask("[page.view.at, page.view.at_y]")
    assert (at, at_y) == (pytest.approx(3.1, abs=0.01), pytest.approx(0.132, abs=0.002))
    tab.press("dive")
    tab.settle("page.view.mode === 'diagram'")
    assert (shown(tab).mode, shown(tab).B, shown(tab).at) == ("diagram", at_y, at)
    tab.driver.back()
    tab.settle("page.view.mode === 'map'")


CUT = """return [...document.querySelectorAll('#conditions, #foot, .value')].filter((e) =>
  e.offsetParent && (e.scrollWidth > e.offsetWidth || e.scrollHeight > e.offsetHeight)).map((e) => e.outerHTML)"""


@pytest.mark.parametrize("size", [(3840, 2160), (1280, 800), (1024, 768), (900, 600), (390, 844), (844, 390)])
def test_page_fits_its_window_and_has_a_value_for_each_dot(tab, explorer, size):
    touch = min(size) < 400
    try:
        tab.resize(*size, touch=touch)
        tab.open(explorer.address + "&transient=50&periods=20&eps=1.23456e-4")
        left, top, width, height = tab.frame()
        dot = 2 if size[0] > 3000 else 1  # a dot of one pixel would vanish on a projector
        assert image(tab)[0].shape == tuple(math.floor(round(length) / dot + 0.5) for length in (height, width))
        wide, tall = tab.ask("(({scrollWidth: w, scrollHeight: h}) => [w, h])(document.documentElement)")
        assert tab.driver.execute_script(CUT) == []
        assert wide <= size[0]
        assert touch or tall <= size[1]  # only on a phone the page scrolls
        assert 0 <= left < left + width <= size[0]
        assert 0 <= top < top + height <= size[1]
        assert height > 0.35 * size[1]
        small = tab.driver.execute_script(
            "return [...document.querySelectorAll('button, summary, select, input')].filter((e) => e.offsetParent &&"
            "Math.min(e.offsetWidth, e.offsetHeight) < 24 && e.type !== 'radio').map((e) => e.outerHTML)"
        )
        assert small == [], "targets of a finger"
        frame = tab.frame()
        plane = "&mode=map&low=1&high=4&y_low=0&y_high=0.5&columns=301&rows=51"
        tab.open(explorer.address + plane + "&transient=50&periods=64")
        assert "too close to a decision" in text(tab, "status")
        assert tab.driver.execute_script(CUT) == []
        if not touch:
            assert tab.frame() == frame, "no text changes the size of the picture"
    finally:
        tab.resize(*SIZE)


def test_ordinate_rests_while_the_mouse_is_down_and_moves_on_its_axis_only(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=3.0&high=3.25")
    x, y = middle(tab)
    before = tab.ask("page.fitted")
    tab.mouse("Pressed", x, y)
    tab.mouse("Moved", x + 300, y - 60)
    tab.until("page.state().low < 3 && !page.busy && !page.pending", "a moved view")
    assert tab.ask("page.fitted") == before
    tab.mouse("Released", x + 300, y - 60)
    tab.settle(lambda: tab.ask("page.fitted") != before)
    assert shown(tab).limits is None
    left = tab.frame()[0]
    tab.drag((left - 20, y), [(left - 20, y + 40)])
    tab.settle()
    moved = shown(tab).limits
    assert moved is not None
    tab.choose("B", "0.11")
    tab.settle()
    assert shown(tab).limits == moved
    press_key(tab, "f")
    tab.settle("page.view.bottom === null")


@pytest.mark.parametrize("slowly", [0, 40])  # 0.4 s: longer than a newer view first waits for the running request
def test_drag_shows_pictures_of_one_computation_at_a_time_and_ends_on_the_last_view(tab, explorer, monkeypatch, slowly):
    running, most = [], []

    def counted(results, plan, which, threads, halt, pace):
        running.append(1)
        most.append(len(running))
        try:
            for _ in range(slowly):
                sleep(0.01)
                if halt.called:
                    raise Halted
            compute_into(results, plan, which, threads, halt, pace)
        finally:
            running.pop()

    monkeypatch.setattr("vibrodrive.explorer.work.compute_into", counted)
    tab.open(explorer.address + SMALL + "&eps=2e-4")
    frames, begun, (_, _, width, _) = tab.ask("page.frames.length"), monotonic(), tab.frame()
    tab.mouse("Pressed", 500, 300)
    for k in itertools.count(1):
        place = 500 + round(150 * math.sin(k / 9)), 300 + k % 7
        tab.mouse("Moved", *place)
        if monotonic() - begun > 3.0 and tab.ask("page.frames.length") > frames + (1 if slowly else 3):
            break
        assert monotonic() - begun < tab.PATIENCE, "pictures must appear while the mouse moves"
        sleep(0.01)
    tab.mouse("Released", *place)
    tab.settle()
    assert max(most) == 1
    state, view = tab.state(), shown(tab)
    assert (view.low, view.high) == (state["low"], state["high"])
    assert state["low"] == pytest.approx(2.2 - (place[0] - 500) / width * 2.8, abs=5e-3)
    _, (x, _, dw, _) = image(tab)
    places = state["low"] + np.array(canvas(tab)[1]) * (state["high"] - state["low"])
    assert places == pytest.approx((x, x + dw), abs=1e-3)
    assert tab.state()["at"] == 3.04, "a drag is no click"


def test_zoom_ends_at_neighbouring_numbers_and_back_returns(tab, explorer):
    tab.open(explorer.address + SMALL)
    first = shown(tab)
    left, top, width, height = tab.frame()
    for _ in range(40):
        wheel(tab, left + width / 2, top + height / 2, -500)
    tab.settle("!page.busy && !page.pending")
    deep = shown(tab)
    assert 1e-13 < deep.high - deep.low < 1e-11
    (complete, *rest), places = tab.ask("[labels(ticks('x', 8), 'x'), ticks('x', 8)]")
    assert float(complete) == pytest.approx(places[0], abs=(deep.high - deep.low) / 50)
    assert len({*rest}) == len(rest) >= 3
    assert [float(label) for label in rest] == pytest.approx([p - places[0] for p in places[1:]], rel=0.02)
    for _ in range(80):
        wheel(tab, left + width / 2, top + height / 2, 500)
    tab.settle("!page.busy && !page.pending")
    assert shown(tab).low == 0.0, "the window ends at what is allowed"
    assert tab.notice() == ""
    while shown(tab) != first:
        here = shown(tab)
        tab.driver.back()
        tab.settle(lambda here=here: shown(tab) != here)
    assert tab.state()["low"] == first.low


def test_link_restores_the_view(tab, explorer):
    query = "&x=eps&low=1e-06&high=0.001&scale=log&columns=100&quantity=impact_speed&transient=50&periods=20&B=0.2"
    tab.open(explorer.address + query + "&at=2e-5")
    view = shown(tab)
    assert (view.x, view.low, view.high, view.scale, view.B, view.at) == ("eps", 1e-6, 1e-3, "log", 0.2, 2e-5)
    labels, exponents = tab.ask("[labels(ticks('x', 8), 'x'), ticks('x', 8)]")
    assert labels[:5] == ["1e-6", "2e-6", "5e-6", "1e-5", "2e-5"]
    assert list(map(float, labels)) == pytest.approx([10**u for u in exponents], rel=0.005)
    key = tab.ask("decades_in(Math.log10(0.003), Math.log10(0.03), 5)")
    assert [10**u for u in key] == pytest.approx([0.005, 0.01, 0.02]), "a key between two decades"
    command, link, _ = text(tab, "link").split('"')
    assert command == "vibrodrive explore "
    assert "token" not in link
    assert read_address(link) == view


def test_supplied_picture_is_shown_until_the_first_is_computed(tab, explorer, monkeypatch):
    go_on = threading.Event()
    monkeypatch.setattr(
        "vibrodrive.explorer.tasks.show_picture",
        lambda *arguments: go_on.wait(tab.PATIENCE) and show_picture(*arguments),
    )
    try:
        tab.driver.get(explorer.address)
        tab.until("!!page?.data", "the supplied picture")
        assert tab.ask("[page.data.seq, page.settled, page.data.count, page.frames.length]") == [None, False, 900, 0]
        assert text(tab, "subject").startswith("Velocity")
        (low, high), (_, (_, y, _, dh)) = tab.ask("page.fitted"), image(tab)
        assert (low, high) == (y, y + dh)
    finally:
        go_on.set()
    tab.settle()
    assert tab.ask("page.data.seq") > 0


def test_page_works_where_the_browser_keeps_nothing(tab, explorer):
    refused = "Object.defineProperty(window, name, {get() { throw 1; }})"
    refused = f"for (const name of ['localStorage', 'sessionStorage']) {refused}"
    page = tab.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": refused})
    try:
        tab.open(explorer.address + SMALL)
        assert tab.ask("(() => { try { return localStorage; } catch { return 'refused'; } })()") == "refused"
        press_key(tab, "2")
        tab.settle("page.view.low === 3")
        assert text(tab, "story").startswith("A ripple")
        tab.driver.execute_script("document.querySelector('#more summary').click()")
        tab.until("!!page.limits.eps", "the limit")
    finally:
        tab.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", page)


def test_click_shows_the_motion_of_simulate_with_its_limit(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=3.0&high=3.25")
    left, top, width, height = tab.frame()
    tab.click(round(left + 0.4 * width), round(top + 0.5 * height))
    tab.until("page.motion && !page.busy", "the motion")
    A = tab.state()["at"]
    assert pytest.approx(3.1, abs=1e-3) == A
    assert len(repr(A)) <= 7, "a round number"
    motion = vd.simulate(A, section_phase=math.pi / 2, transient=100, periods=12)
    time, xi = (np.array(v, float) for v in tab.ask("[[...page.motion.time], [...page.motion.xi]]"))
    sample, there = motion.sample(POINTS), np.isfinite(xi)
    at = (sample.tau - sample.tau[0]) / (2 * math.pi)
    assert np.interp(at, time[there], xi[there]) == pytest.approx(sample.xi, abs=1e-5)
    limit = vd.limit(A)
    tab.until("!!page.limits.eps", "the limit")
    assert float(tab.ask("page.limits.eps.k2")) == pytest.approx(limit.k2)
    assert f"A = {A!r} · period 4 · keeps its structure, the rhythm of its impacts, up to ε = " in text(tab, "sentence")
    assert motion.describe().splitlines()[3][:9] in text(tab, "words")
    words = tab.driver.execute_script("return document.getElementById('phase').ariaLabel")
    assert "period 4" in words


RINGS = """
window.rings = [];
new MutationObserver((all) => all.forEach(({addedNodes}) => addedNodes.forEach(({style}) =>
  window.rings.push([style.left, style.top].map(parseFloat))))).observe(frame, {childList: true});
"""


@pytest.mark.parametrize("query", ["&at=3.1", "&at=3.04&eps=2e-4", "&at=3.1&quantity=impact_phase"])
def test_each_impact_is_heard_at_its_time_and_flashes_on_its_dots(tab, explorer, query):
    tab.open(explorer.address + "&low=3&high=3.25&columns=200" + query)
    tab.until("!!page.motion", "a motion")
    tab.driver.execute_script(RINGS)
    assert tab.ask("[heard(), page.clicks.length]") == [False, 0], "muted at first"
    tab.driver.find_element("id", "sound").click()
    tab.until("page.clicks.length > 12", "clicks")
    clicks = np.array(tab.ask("page.clicks.map(({when, shake, speed}) => [when, shake, speed])"))
    view, (y0, y1) = shown(tab), tab.ask("span('y')")
    record = {"section_phase": view.section_phase, "transient": view.transient, "periods": 12}
    motion = vd.simulate(view.at, eps=view.eps, **record)
    hits = motion.switches[motion.switches["after"] == vd.State.IMPACT]
    times = hits["period"] + hits["phase"] / (2 * math.pi) - view.transient
    which = np.abs(clicks[:, 1, None] - times).argmin(axis=1)
    assert np.diff(which).tolist() == [1 if k else 1 - len(times) for k in which[1:]], "none is missing"
    assert clicks[:, 2] == pytest.approx(-hits["dxi"][which], rel=1e-5)
    apart = (np.diff(times[which]) % 12) / 2.5  # seconds
    assert np.diff(clicks[:, 0]) == pytest.approx(apart, abs=0.02)
    tab.until("window.rings.length > 8", "flashes")
    dots = motion.section[:, 1] if view.sectioned else motion.impacts["phase"]
    left, top = np.array(tab.ask("window.rings")).T
    assert left == pytest.approx(100 * (view.at - 3) / 0.25, abs=0.01)
    values = y1 - top / 100 * (y1 - y0)
    turns = (values[:, None] - dots) % (2 * math.pi) if not view.sectioned else values[:, None] - dots
    assert np.minimum(np.abs(turns), np.abs(turns - 2 * math.pi)).min(axis=1).max() < 1e-3
    tab.driver.refresh()
    tab.settle()
    assert tab.ask("[sound.on, heard()]") == [True, False], "a browser waits for an action"
    tab.click(*middle(tab))
    tab.until("heard() && page.clicks.length > 0", "sound, as before")
    press_key(tab, "m")
    tab.until("!heard()", "silence")
    assert tab.ask("page.clicks.filter(({when}) => when > sound.context.currentTime).length") == 0


def test_reduced_motion_is_heard_and_refused_sound_changes_nothing(tab, explorer):
    reduced = {"features": [{"name": "prefers-reduced-motion", "value": "reduce"}]}
    try:
        tab.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", reduced)
        tab.open(explorer.address + SMALL)
        tab.until("!!page.motion", "a motion")
        tab.driver.execute_script(RINGS)
        tab.driver.find_element("id", "sound").click()
        tab.until("page.clicks.length > 2", "clicks")
        assert tab.ask("window.rings") == [], "nothing moves"
        press_key(tab, "m")
        tab.until("!heard() && !clock.playing", "silence")
    finally:
        tab.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    tab.open(explorer.address + SMALL)
    tab.driver.execute_script("delete window.AudioContext; window.AudioContext = undefined")
    tab.driver.find_element("id", "sound").click()
    at = tab.ask("clock.at")
    tab.until(f"clock.at !== {at}", "the mass moves")
    assert tab.ask("[heard(), page.clicks.length, element('sound').ariaPressed]") == [False, 0, "false"]


def test_keys_move_a_slider_away_from_zero_and_back(tab, explorer):
    tab.open(explorer.address + SMALL)
    slider = tab.driver.find_element("css selector", "[data-field=eps] [type=range]")
    slider.send_keys("\ue014")  # the right arrow
    assert tab.ask("page.view.eps") == 1e-6
    slider.send_keys("\ue014")
    assert tab.ask("page.view.eps") > 1e-6
    slider.send_keys("\ue012" * 2)  # the left arrow
    assert tab.ask("page.view.eps") == 0.0


def test_knob_follows_keys_and_mouse_and_motions_at_rest_have_ticks_but_no_limit(tab, explorer):
    tab.open(explorer.address + SMALL)
    left, top, width, height = tab.frame()
    handle = tab.driver.find_element("id", "handle")
    handle.send_keys("\ue014" * 3)  # the right arrow
    tab.until("page.state().at > 3.04", "another motion")
    assert tab.state()["low"] == 2.2
    at = left + width * (tab.state()["at"] - 2.2) / 2.8
    tab.drag((round(at), round(top + height)), [(round(at) + 50 * k, round(top + height)) for k in range(1, 5)])
    tab.until("!page.busy", "the motion")
    assert tab.state()["at"] == pytest.approx(2.2 + 2.8 * (at + 200 - left) / width, abs=0.02)
    assert handle.get_attribute("aria-valuetext") == f"A = {tab.state()['at']:g}"
    tab.open(explorer.address + SMALL + "&low=0.5&high=1.3&at=0.7&quantity=xi")
    (odd,) = np.nonzero(vd.sweep(**config.parse(shown(tab).toml()).arguments).status)
    assert 0 < len(odd) < 200
    assert f"{len(odd)} at rest permanently" in text(tab, "status")
    ticks = tab.driver.execute_script(
        "const c = document.getElementById('odd');"
        "return [...c.getContext('2d').getImageData(0, 0, c.width, 1).data].filter((_, k) => k % 4 === 3)"
    )
    assert np.array_equal(np.flatnonzero(ticks), odd)
    tab.until(lambda: "rests for ever" in text(tab, "sentence"), "its sentence")
    tab.until(explorer._explorer.engine.worker.idle, "the end of all work")
    assert tab.ask("page.limits") == {}
    query = {"eps": 1e-4, "method": "muller", "dtau": 1e-3, "section_phase": math.pi / 2, "transient": 500}
    assert [vd.simulate(3.12294, periods=n, **query).status for n in (12, 500)] == ["OK", "TOO_CLOSE"]
    tab.open(explorer.address + "&low=3.1&columns=20&at=3.12294&eps=1e-4&method=muller&dtau=1e-3")
    tab.until(
        lambda: text(tab, "sentence").startswith("A = 3.12294 · comes too close to a decision · "), "its sentence"
    )


def test_slider_runs_until_the_structure_is_lost(tab, explorer):
    tab.open(explorer.address + "&columns=64&transient=20&periods=20&low=3.19&high=3.25&at=3.2")
    last_kept = vd.limit(3.2).last_kept
    tab.until("!!page.limits.eps", "the limit")
    watch(tab)
    tab.driver.execute_script("document.querySelector('[data-play=eps]').click()")
    tab.until("page.played === 'eps'", "the movement")
    tab.settle("page.played === ''")
    found = moments(tab)
    assert len({one["view"]["eps"] for one in found}) > 10
    assert {one["view"]["eps"] for one in found} == {one["view"]["eps"] for one in found if not one["late"]}
    assert [older for older, _ in itertools.groupby(one["older"] for one in found)] == [False, True, False]
    tab.until(lambda: "structure lost" in text(tab, "sentence"), "the sentence")
    assert last_kept < shown(tab).eps < 1.2 * last_kept
    assert "times the limit" in text(tab, "sentence")


def test_start_view_compares_a_step_with_certified_and_its_text_leaves_with_it(tab, explorer):
    tab.open(explorer.address + SMALL)
    press_key(tab, "3")
    tab.settle("page.view.method === 'fixed'")
    assert text(tab, "story").startswith("A time step invents a diagram")
    assert {k for k in range(3) if ((image(tab)[0] // 64 == k) & (image(tab)[0] > 0)).any()} == {0, 1, 2}
    assert text(tab, "key") == "bothfixed onlycertified only"
    tab.until("!!page.limits.dtau", "the limit in Δτ")
    assert "kept or lost by chance with the time step: your Δτ = 0.05 is 1.11 times the limit" in text(tab, "sentence")
    tab.choose("method", "certified")
    assert "invents" not in text(tab, "story")
    press_key(tab, "3")
    tab.settle("page.view.method === 'fixed'")
    tab.driver.execute_script("explorer.view.low += 1; explorer.view.high += 1; explorer.ask(true)")
    tab.settle()
    assert "invents" not in text(tab, "story")
    tab.choose("dtau", "0,04")  # a step asks for a grid
    tab.settle()
    assert (shown(tab).method, shown(tab).dtau) == ("fixed", 0.04)
    press_key(tab, "Home")
    tab.settle("page.view.method === 'certified'")
    assert shown(tab).address() == ""


def test_dark_page_keeps_the_colours_of_maps(tab, explorer):
    def theme(name):
        features = [{"name": "prefers-color-scheme", "value": name}]
        tab.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        sleep(0.2)
        return canvas(tab)[0]

    try:
        tab.open(explorer.address + SMALL)
        light, dark = theme("light"), theme("dark")
        assert light.max() == 255 > dark.max()
        assert np.array_equal(light[..., 0] < 255, dark[..., 0] > dark.min())
        tab.open(explorer.address + "&mode=map&columns=20&rows=10&transient=50&periods=64")
        assert np.array_equal(theme("dark"), theme("light"))
    finally:
        theme("light")


def test_high_contrast_shows_tracks_thumbs_choices_and_swatches(tab, explorer):
    forced = {"features": [{"name": "forced-colors", "value": "active"}]}
    try:
        tab.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", forced)
        tab.open(explorer.address + SMALL + "&low=3.0&method=fixed&compare=difference")
        pixels = np.array(Image.open(io.BytesIO(tab.driver.get_screenshot_as_png())).convert("RGB"))
        places = tab.driver.execute_script(
            "const place = (one, share) => { const b = one.getBoundingClientRect();"
            "return [b.top + b.height / 2, b.left + share * b.width].map(Math.round); };"
            "return [...[...document.querySelectorAll('#key i')].map((one) => place(one, 0.5)),"
            "...['#method :checked + span', '#method input:not(:checked) + span'].map((one) =>"
            "place(document.querySelector(one), 0.07)), ...[0.01, 0.5, 0.98].map((share) =>"
            "place(document.querySelector('[data-field=eps] [type=range]'), share))]"
        )
        both, fixed, certified, chosen, other, thumb, track, _ = found = [
            tuple(pixels[at]) for at in map(tuple, places)
        ]
        paper = tuple(pixels[2, 2])
        assert (len({both, fixed, certified, paper}), other) == (4, paper)
        assert paper not in (chosen, thumb, track)
        assert thumb != track == found[-1]
    finally:
        tab.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_late_picture_of_an_earlier_kind_is_not_painted(tab, explorer):
    tab.open(explorer.address + "&mode=map&columns=20&rows=10&transient=50&periods=64")
    assert tab.driver.title.startswith("Period, against")
    tab.ask("(window.late = page.data, window.seen = [])")
    sees = "requestAnimationFrame(look); window.seen.push([page.view.mode, page.data?.map, document.title])"
    tab.driver.execute_script(f"const page = window.explorer, look = () => {{ {sees} }}; look()")
    for key, x in (("1", "A"), ("4", "eps")):
        press_key(tab, key)
        tab.settle(f"page.view.mode === 'diagram' && page.view.x === '{x}'")
        tab.ask("paint(window.late, window.late)")
        assert tab.ask("page.data.map") is False
    assert tab.driver.title.startswith("Velocity ξ′ of the mass, once per shake, against ripple (ε)")
    for mode, of_map, title in tab.ask("window.seen"):
        assert of_map in (None, mode == "map")
        assert title == "vibrodrive" or title.startswith("Period") == (mode == "map")


def test_saved_picture_contains_the_picture_of_the_page(tab, explorer):
    tab.open(explorer.address + SMALL + "&low=3.0&method=fixed&compare=difference")
    saved = tab.ask("whole_picture().toDataURL()").partition(",")[2]
    saved = np.array(Image.open(io.BytesIO(base64.b64decode(saved))).convert("RGB")).astype(int)
    (left, top, width, height), pixels = tab.frame(), canvas(tab)[0][::-1].astype(int)
    edge = tab.driver.execute_script(
        "const a = document.getElementById('figure').getBoundingClientRect(), b = document.getElementById('title');"
        "const size = parseFloat(getComputedStyle(document.documentElement).fontSize);"
        "return [a.left - size, b.getBoundingClientRect().top - size]"
    )
    assert saved.shape[1] > 2 * width
    knob, floor = tab.driver.execute_script(
        "const {left, top} = document.getElementById('handle').getBoundingClientRect(); return [left, top]"
    )
    accent = saved[round(2 * (floor - edge[1])), round(2 * (knob - edge[0]))]
    assert tuple(accent) == (0x00, 0x72, 0xB2), "the knob"
    saved = saved[::2, ::2]
    part = saved[round(top - edge[1]) :, round(left - edge[0]) :][: round(height), : round(width)]
    assert len({tuple(p) for p in part.reshape(-1, 3)} & {tuple(p) for p in pixels.reshape(-1, 3)}) >= 8
    assert (part < 250).any(axis=2).mean() == pytest.approx((pixels < 250).any(axis=2).mean(), rel=0.05)
    assert (saved[: round(top - edge[1])] < 128).any(), "the title"


def test_saved_page_moves_and_is_heard_without_a_server_or_a_network(tab, explorer, tmp_path):
    tab.open(explorer.address + "&low=3&high=3.25&at=3.04&columns=300&transient=200")
    tab.until("!!page.limits.eps", "the limit")
    picture = image(tab)
    tab.press("send")
    tab.until("page.file !== null", "the page")
    (file := tmp_path / tab.ask("page.file.name")).write_text(tab.ask("page.file.content"), encoding="utf-8")
    assert file.name == "dxi_over_A.html"
    assert file.stat().st_size <= 2_000_000
    offline = {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0}
    tab.driver.execute_cdp_cmd("Network.enable", {})
    try:
        tab.driver.execute_cdp_cmd("Network.emulateNetworkConditions", offline)
        tab.driver.get(file.as_uri())
        tab.until("!!page?.motion && !!page.data && page.settled && page.begun", "picture and motion")
        for found, wanted in zip(image(tab), picture, strict=True):
            assert np.array_equal(found, wanted)
        assert text(tab, "title").startswith("Shake it harder")
        assert text(tab, "conditions").startswith("B = 0.1, ε = 0, seen at phase")
        assert "A saved page. The knob moves among 32 motions" in text(tab, "story")
        assert "A = 3.04 · period 2 · keeps its structure" in text(tab, "sentence")
        assert text(tab, "link").startswith('vibrodrive explore "?low=3.0')
        visible = "return [...document.querySelectorAll('button, input, select')].filter((e) => e.offsetParent)"
        assert {e.get_attribute("id") for e in tab.driver.execute_script(visible)} == {"sound", "full", "png"}
        left, top, width, height = tab.frame()
        for share in (0.3, 0.62, 0.9):
            tab.click(round(left + share * width), round(top + 0.4 * height))
            tab.until("!page.busy && page.motion.view.at === page.view.at", "the motion")
            at = tab.ask("page.view.at")
            assert abs(at - (3 + 0.25 * share)) <= 0.005
            motion = vd.simulate(at, section_phase=math.pi / 2, transient=200)
            period = f"period {motion.period}" if motion.period else "no period"
            assert text(tab, "sentence").startswith(f"A = {at:g} · {period}")  # perhaps with a limit of another test
        handle = tab.driver.find_element("id", "handle")
        handle.send_keys("\ue012")  # the left arrow
        tab.until(f"page.view.at < {at}", "the next motion")
        wheel(tab, left + width / 2, top + height / 2, -500)
        press_key(tab, "4")
        assert tab.ask("[page.view.low, page.view.high, page.view.x]") == [3, 3.25, "A"]
        tab.driver.find_element("id", "sound").click()
        tab.until("page.clicks.length > 2", "clicks")
        press_key(tab, "m")
        assert tab.complaints() == []
    finally:
        online = {"offline": False, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
        tab.driver.execute_cdp_cmd("Network.emulateNetworkConditions", online)


def test_error_is_shown_in_one_line_and_the_field_returns(tab, explorer):
    tab.open(explorer.address + SMALL)
    frame = tab.frame()
    tab.choose("eps", "<script>alert(1)</script>")
    tab.until("page.refused !== ''", "a refusal")
    assert tab.notice().startswith("eps = ")
    assert not {"<", "\n"} & {*tab.notice()}
    assert text(tab, "wrong").startswith("ε = '<script>")
    assert text(tab, "notice") == ""
    beside = "return document.getElementById('wrong').parentNode.dataset.field"
    assert tab.driver.execute_script(beside) == "eps"
    assert tab.frame() == frame, "no text changes the place of the picture"
    tab.until("page.view.eps === 0", "the last accepted value")
    field = tab.driver.find_element("id", "dtau")  # also while one types
    field.send_keys("\ue009a\ue000", "-1\ue007")
    tab.until(lambda: text(tab, "wrong").startswith("Δτ = -1"), "a refusal")
    tab.until("document.getElementById('dtau').value === '0.1'", "its value")
    assert tab.ask("page.view.method") == "certified", "a refused step chooses no grid"
    tab.choose("eps", "1e-5")
    assert text(tab, "wrong") == ""
    tab.open(explorer.address + "&mode=map&shade=lyapunov&columns=9&rows=9&periods=64")
    tab.choose("x", "eps")  # has no Lyapunov exponent
    tab.settle("page.refused.startsWith('shade = ') && page.view.x === 'A'")
    tab.open(explorer.address + SMALL + "&eps=-3&novelty=1")
    assert tab.notice().startswith(("eps = ", "key of a view = "))


def test_stopped_server_is_reported_until_it_continues(opened):
    command = [sys.executable, "-m", "vibrodrive", "explore", "--no-browser", "--port", "0"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        opened.open(server.stdout.readline().strip() + SMALL)
        server.send_signal(signal.SIGSTOP)
        opened.until(lambda: "does not answer" in text(opened, "notice"), "a notice")
        server.send_signal(signal.SIGCONT)
        opened.until(lambda: text(opened, "notice") == "", "the end of the notice")
        opened.choose("eps", "1e-4")
        opened.settle()
        opened.driver.execute_script("document.querySelector('[data-play=eps]').click()")
        server.kill()
        opened.until(lambda: "does not answer" in text(opened, "notice"), "a notice that it has ended")
        assert opened.ask("page.played") == ""
        sleep(3.0)  # the notice stays, although the page asks the server repeatedly
        assert "does not answer" in text(opened, "notice")
        server.communicate()
        port = opened.driver.current_url.split(":")[2].split("/")[0]
        server = subprocess.Popen([*command[:-1], port], stdout=subprocess.PIPE, text=True)
        opened.until(lambda: "Open the address that" in text(opened, "notice"), "how to get the right token")
    finally:
        server.kill()
        server.communicate()
    opened.complaints()  # discards the messages about the lost connection


def test_hidden_page_asks_when_it_is_shown_and_one_that_waits_says_for_whom(tab, explorer):
    hide = "Object.defineProperty(document, 'hidden', {value: arguments[0], configurable: true})"
    tab.open(explorer.address + SMALL)
    tab.driver.execute_script(hide, True)
    sent = tab.ask("(window.told = [], socket.onclose = connect, socket.close(), page.seq)")
    tab.until("page.frames.length > 0 && socket.readyState === 1", "the connection")
    sleep(0.3)
    assert tab.ask("page.seq") == sent
    tab.driver.execute_script(hide + "; document.dispatchEvent(new Event('visibilitychange'))", False)
    tab.until("page.seq > arguments[0] && page.settled".replace("arguments[0]", str(sent)), "its picture")
    engine = explorer._explorer.engine
    number = max(engine.pages)
    engine.pages[other := 10**6] = SimpleNamespace(view=read_address("mode=map"), work=None, news=print)
    try:
        tab.ask("Object.assign(page.data, {complete: false})")
        engine._waits(number, other)
        words = "waiting for another open page: Period, against how hard it is shaken (A) and slope (B)"
        tab.until(lambda: text(tab, "status") == words, "for whom it waits")
    finally:
        del engine.pages[other]


def test_fingers_move_zoom_and_select(tab, explorer):
    def touch(kind, *points):
        points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        tab.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    try:
        tab.resize(390, 844, touch=True)
        tab.open(explorer.address + SMALL)
        x, y = middle(tab)
        touch("touchStart", (x, y))
        for k in range(1, 6):
            touch("touchMove", (x - 10 * k, y))
        touch("touchEnd")
        tab.settle("page.state().low > 2.3")
        moved = shown(tab)
        touch("touchStart", (x - 20, y), (x + 20, y))
        for k in range(1, 6):
            touch("touchMove", (x - 20 - 10 * k, y), (x + 20 + 10 * k, y))
        touch("touchEnd")
        tab.settle(f"page.state().high - page.state().low < {0.9 * (moved.high - moved.low)}")
        before = tab.state()["at"]
        touch("touchStart", (x + 40, y))
        touch("touchEnd")
        tab.until(f"page.state().at !== {before!r}", "a motion")
    finally:
        tab.resize(*SIZE)


def test_leaving_the_page_cancels_its_work_and_back_restores_it(opened, explorer):
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


def test_page_is_used_without_a_mouse(tab, explorer):
    tab.open(explorer.address + SMALL)
    tab.until("!!page.limits.eps", "the limit")
    handle = tab.driver.find_element("id", "handle")
    for key, right in (("\ue00e", 3.32), ("\ue00f", 3.04), ("\ue010", 5.0), ("\ue011", 2.2)):
        handle.send_keys(key)  # Page Up, Page Down, End, Home
        assert tab.state()["at"] == pytest.approx(right, abs=0.01)
        told = [float(handle.get_attribute(f"aria-value{name}")) for name in ("min", "now", "max")]
        assert told == [2.2, tab.state()["at"], 5.0]
        assert handle.get_attribute("aria-valuetext") == f"A = {tab.state()['at']:g}"
    assert tab.state()["low"] == 2.2, "Home on the knob does not start over"
    sliders = tab.driver.find_elements("css selector", "#main [type=range]")
    told = [slider.get_attribute("aria-valuetext") for slider in sliders if slider.is_displayed()]
    assert told == ["ε = 0", "Δτ = 0.1", "B = 0.1"]
    assert text(tab, "title") == "Shake it harder: when does it lose its beat?"
    assert text(tab, "subject") == "Velocity ξ′ of the mass, once per shake, against how hard it is shaken (A)"
    assert tab.driver.title == text(tab, "subject") + " – vibrodrive"
    tab.driver.execute_script("document.getElementById('more').open = true")
    field = tab.driver.find_element("id", "eta")
    assert field.get_attribute("value") == "100.995"
    assert float(tab.ask("(arguments[0].focus(), arguments[0].value)", field)) == pytest.approx(vd.ETA, rel=1e-14)
    summary = tab.driver.find_element("css selector", ".menu summary")
    summary.send_keys("\ue007")
    assert text(tab, "starts").startswith("1 All of it")
    assert "8 Map" in text(tab, "starts")
    tab.driver.find_element("css selector", "#starts button").send_keys("\ue00c")  # Escape
    assert tab.driver.execute_script("return document.activeElement === arguments[0]", summary)
    live = "[document.getElementById('sentence').ariaLive, document.getElementById('status').ariaLive]"
    assert tab.ask(live) == ["polite", "polite"]
    tab.until("!!page.limits.eps", "the limit")
    tab.driver.execute_script("document.querySelector('[data-play=eps]').click()")
    assert tab.ask(live) == ["off", "off"]
    tab.driver.execute_script("document.querySelector('[data-play=eps]').click()")
    tab.settle("page.played === ''")
    assert tab.ask(live) == ["polite", "polite"]


def test_limits_and_the_knob_have_signs_at_edges_and_cover_no_digits(tab, explorer):
    tab.open(
        explorer.address + "&x=eps&low=0&high=3e-4&scale=linear&A=3.04&at=1e-4&columns=100&transient=50&periods=60"
    )
    tab.until("!!page.limits.eps", "the limit")
    watch(tab)
    drawn = "return window.axes_texts().filter(([word]) => /k₂/.test(word))"
    k2 = vd.limit(3.04).k2
    tab.ask("draw()")
    left, _, width, _ = tab.frame()
    ((word, x, _),) = tab.driver.execute_script(drawn)
    edge = tab.driver.execute_script("return document.getElementById('axes').getBoundingClientRect().left")
    assert (word, x + edge) == ("k₂", pytest.approx(left + width * k2 / 3e-4, abs=1))
    tab.ask("(set_span('x', 0, 1.5e-4), draw())")
    assert tab.driver.execute_script(drawn)[0][0] == "k₂ ▶"
    tab.ask("(set_span('x', 1.2e-4, 1.5e-4), draw())")
    assert text(tab, "handle") == "◀ ε = 10⁻⁴"
    assert tab.driver.execute_script("return document.getElementById('handle').className") == "away"
    tab.open(explorer.address + SMALL)
    watch(tab)
    for at in np.linspace(2.2, 5.0, 40):
        tab.ask("(page.view.at = arguments[0], draw())", round(at, 3))
        covered = tab.driver.execute_script(
            "const tag = document.querySelector('#handle output').getBoundingClientRect(), c = axes.getContext('2d');"
            "const middle = (tag.left + tag.right) / 2 - axes.getBoundingClientRect().left, box = box_of();"
            "return window.axes_texts().filter(([word, x, y]) => y > box.top + box.height && y < tag.bottom &&"
            "Math.abs(x - middle) < tag.width / 2)"
        )
        assert [word for word, *_ in covered if word != "A"] == []
    tab.ask("(set_span('x', 3, 3 + 7.9e-13), draw())")
    assert tab.ask("labels(ticks('x', 8), 'x')")[1:4] == ["+1e-13", "+2e-13", "+3e-13"]


@pytest.mark.parametrize("size", [(853, 533), (640, 400)])  # a window of 1280 × 800 at 150 and 200 %
def test_enlarged_page_shows_picture_and_controls_together(tab, explorer, size):
    try:
        tab.resize(*size)
        tab.open(explorer.address + SMALL)
        _, top, width, height = tab.frame()
        assert min(width, height) > size[1] / 2
        assert top + height < size[1]
        slider = "return document.querySelector('[data-field=eps] [type=range]').getBoundingClientRect().bottom"
        assert tab.driver.execute_script(slider) < size[1]
    finally:
        tab.resize(*SIZE)


def test_picture_stays_in_sight_while_a_slider_moves_in_a_narrow_column(tab, explorer):
    try:
        tab.resize(*(size := (390, 844)))
        tab.open(explorer.address + SMALL)
        script = "document.querySelector('[data-field=B]').scrollIntoView({block: 'end'}); return window.scrollY"
        assert tab.driver.execute_script(script) > 100
        _, top, _, height = tab.frame()
        assert top > 0
        assert height > 80
        below = "return document.querySelector('[data-field=B] [type=range]').getBoundingClientRect().top"
        assert top + height < tab.driver.execute_script(below) < size[1]
        wide = tab.driver.execute_script(
            "const h = document.getElementById('title'); return h.scrollWidth - h.offsetWidth"
        )
        assert wide <= 0, "the title is complete"
    finally:
        tab.resize(*SIZE)


def test_text_of_a_view_stays_after_a_reload_and_the_undisturbed_orbit_lies_behind(tab, explorer):
    tab.open(explorer.address)
    assert "Drag the blue knob" in text(tab, "story")
    press_key(tab, "2")
    tab.settle("page.view.low === 3")
    assert text(tab, "story").startswith("A ripple destroys the structure")
    assert tab.ask("page.motion.orbit_xi === undefined")
    tab.choose("eps", "1.5e-4")
    tab.settle()
    assert text(tab, "story").startswith("A ripple"), "this text invites to move ε"
    tab.until("!!page.motion.orbit_xi", "the orbit")
    motion = vd.simulate(3.04, transient=500, periods=12)
    time, xi = (np.array(v, float) for v in tab.ask("[[...page.motion.orbit_time], [...page.motion.orbit_xi]]"))
    sample, there = motion.sample(POINTS), np.isfinite(xi)
    assert np.interp((sample.tau - sample.tau[0]) / (2 * math.pi), time[there], xi[there]) == pytest.approx(
        sample.xi, abs=1e-5
    )
    tab.driver.refresh()
    tab.settle()
    assert text(tab, "story").startswith("A ripple")
    tab.open(explorer.address)
    assert text(tab, "story").startswith("All of it"), "the printed address begins anew"
    tab.driver.back()
    tab.settle("page.view.low === 3")
    assert text(tab, "story").startswith("A ripple")
    tab.choose("B", "0.11")
    assert text(tab, "story").startswith("A mass slides")
    tab.choose("quantity", "impact_speed")
    tab.settle("page.view.quantity === 'impact_speed'")
    assert "each dot the speed of one of its main impacts" in text(tab, "story")


RECORDER = """
window.axes_span = null;
const texts = [], axes = document.getElementById('axes');
const {clearRect, fillText} = CanvasRenderingContext2D.prototype;
CanvasRenderingContext2D.prototype.clearRect = function (...box) {
  if (this.canvas === axes) [texts.length, window.axes_span] = [0, span('x')];
  clearRect.apply(this, box);
};
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  if (this.canvas === axes) texts.push([text, x, y]);
  fillText.call(this, text, x, y);
};
window.seen = [];
window.axes_texts = () => texts;
const text = (id) => document.getElementById(id).textContent.replaceAll('\\u00a0', ' '), page = window.explorer;
const pick = (values) => Array.from({length: 25}, (_, k) => values[Math.floor(k * (values.length - 1) / 24)]);
const look = () => {
  requestAnimationFrame(look);
  const {left, width} = document.getElementById('frame').getBoundingClientRect();
  const now = {
    view: page.state(), span: window.axes_span, sentence: text('sentence'), words: text('words'),
    conditions: text('conditions'),
    late: document.getElementById('motion').matches('.late'), older: document.body.matches('.older'),
    curve: [...pick(page.motion.time), ...pick(page.motion.xi)].map((v) => (Number.isFinite(v) ? v : null)),
    bars: texts.filter(([word]) => /period/.test(word))
      .map(([word, x]) => [word, (x - left + axes.getBoundingClientRect().left) / width]),
    marks: ['eps', 'dtau'].map((name) => {
      const mark = document.querySelector(`[data-field=${name}] b`);
      if (!mark.offsetParent || mark.hidden) return null;
      const [own, slider] = [mark, mark.parentNode.firstElementChild].map((one) => one.getBoundingClientRect());
      const thumb = parseFloat(getComputedStyle(document.documentElement).fontSize);
      return [mark.textContent, (own.left + own.width / 2 - slider.left - thumb / 2) / (slider.width - thumb)];
    }),
  };
  const last = window.seen.at(-1), as_text = JSON.stringify(now);
  if (window.last !== as_text) window.seen.push(now);
  window.last = as_text;
};
look();
"""
SIGNS = {"A": "A", "B": "B", "eps": "ε", "dtau": "Δτ"}
SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def value(shown):
    """Return a number as the page prints it."""
    factor, _, power = (
        shown.partition("10") if "10" in shown and shown.rstrip("⁰¹²³⁴⁵⁶⁷⁸⁹⁻") != shown else (shown, "", "")
    )
    return float(factor.rstrip("·") or 1) * 10 ** (int(power.translate(SUPERSCRIPTS)) if power else 0)


@cache
def motion_of(A, B, eps, method, dtau, transient, periods):
    step = {} if method == "certified" else {"method": method, "dtau": dtau}
    return vd.simulate(A, B=B, eps=eps, **step, section_phase=math.pi / 2, transient=transient, periods=periods)


@cache
def limit_in(name, A, B, eps, method):
    return vd.limit(A, B=B) if name == "eps" else vd.limit(A, "dtau", method, B=B, eps=eps)


def judged(seen):
    """Compare all that a page has said at a moment with the package, at the setting that it showed then. Return how
    many statements were compared."""
    view, sentence, count = seen["view"], seen["sentence"], 0
    said = {sign: value(number) for sign, number in re.findall(r"(\S+) = ([^ ,]+)", sentence.split(" · ")[0])}
    at = {name: said.get(sign, view[name]) for name, sign in SIGNS.items()}  # from which knob or slider have moved on
    knob = (view["at"] if view["x"] == "A" else view["A"], view["B"], view["eps"], view["method"])
    common = at["A"], at["B"], at["eps"], view["method"]
    motion = motion_of(*common, at["dtau"], view["transient"], view["periods"] or 256)
    assert sentence.startswith(f"{SIGNS[view['x']]} = "), sentence
    assert " · …" not in sentence or list(said.values()) == [pytest.approx(view["at"], rel=1e-9)]
    if not seen["late"]:
        time, xi = np.array(seen["curve"], float).reshape(2, -1)
        short = motion_of(*common, at["dtau"], view["transient"], 12)
        there, sample = np.isfinite(xi), short.sample(8000)  # so many, because ξ has corners
        near = np.searchsorted((sample.tau - sample.tau[0]) / (2 * math.pi), time[there])
        near = sample.xi[np.clip(near[:, None] + np.arange(-8, 8), 0, len(sample.xi) - 1)]  # steps are jumps of ξ
        assert (xi[there] > near.min(axis=1) - 3e-3).all()
        assert (xi[there] < near.max(axis=1) + 3e-3).all()
        count += 1
    if found := re.search(r"period (\d+)|no period|rests for ever|too close", sentence):
        ended = {"NEVER_LEAVES": "rests for ever", "TOO_CLOSE": "too close"}.get(motion.status.name)
        assert found[0] == ended if ended else int(found[1] or 0) == motion.period, sentence
        count += 1
    for words, name in {"ε": "eps", "Δτ": "dtau"}.items():
        number = r"([\d.·⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)"
        if found := re.search(rf"up to {words} = {number}", sentence):
            assert value(found[1]) == pytest.approx(limit_in(name, *common).k2, rel=6e-3)
            count += 1
        verdict = rf"(kept or lost by chance|kept|lost) with [a-z ]+: your {words} = {number} is {number} (of|times)"
        if found := re.search(verdict, sentence):
            limit = limit_in(name, *common)
            right = (
                "kept" if at[name] < limit.k2 else "lost" if at[name] > limit.last_kept else "kept or lost by chance"
            )
            assert (found[1], value(found[2])) == (right, pytest.approx(at[name], rel=6e-3)), sentence
            assert value(found[3]) == pytest.approx(at[name] / limit.k2, rel=6e-2), sentence
            count += 1
    for mark, name, low, high in zip(seen["marks"], ("eps", "dtau"), (1e-6, 1e-4), (1e-2, 1.0), strict=True):
        if mark:
            share = math.log(limit_in(name, *knob).k2 / low) / math.log(high / low)
            share = share if name == "dtau" else 0.11 + 0.89 * share
            assert mark[0] == ("▲" if 0 <= share <= 1 else "◀" if share < 0 else "▶")
            assert mark[1] == pytest.approx(np.clip(share, 0, 1), abs=5e-3)
            count += 1
    for bar, share in seen["bars"]:
        A = seen["span"][0] + share * (seen["span"][1] - seen["span"][0])  # of the numbers at the axis
        middle = motion_of(
            A, view["B"], view["eps"], view["method"], view["dtau"], view["transient"], view["periods"] or 256
        )
        assert (0 if bar == "no period" else int(bar.split()[1])) == middle.period, (bar, A)
        count += 1
    if not seen["older"] and seen["conditions"] != "…":
        for name, sign in (("B", "B"), ("eps", "ε")):
            assert name == view["x"] or f"{sign} = {view[name]:.6g}," in seen["conditions"], seen["conditions"]
        count += 1
    if seen["words"] not in ("", "…") and not seen["words"].startswith("…"):
        said, _, _ = motion.describe().splitlines()[1].partition(", margin")  # which differs with the last digits of A
        assert seen["words"].startswith(said), seen["words"]
        count += 1
    return count


def watch(tab):
    tab.until("!!page.motion", "a motion")
    tab.driver.execute_script(RECORDER)


def moments(tab):
    return tab.driver.execute_script("return window.seen.splice(0)")


def move_slider(tab, name, start, end, steps=25):
    """Drag a slider between two shares of its length."""
    box = "const b = document.querySelector(`[data-field=${arguments[0]}] [type=range]`).getBoundingClientRect();"
    left, top, width, height = tab.driver.execute_script(box + "return [b.left, b.top, b.width, b.height]", name)
    places = [(left + 7 + s * (width - 14), top + height / 2) for s in np.linspace(start, end, steps)]
    tab.mouse("Pressed", *places[0])
    for place in places:
        tab.mouse("Moved", *place)
        sleep(0.04)
    tab.mouse("Released", *places[-1])


@pytest.mark.parametrize("query", ["&eps=2e-4", "", "&method=fixed&dtau=0.05"])
def test_whatever_is_said_belongs_to_the_setting_beside_it_also_while_this_moves(tab, explorer, query):
    tab.open(explorer.address + "&low=3&high=3.25&at=3.04&columns=300&transient=200" + query)
    tab.until("!!page.limits.eps", "the limit")
    watch(tab)
    for name, start, end in (("B", 0.17, 0.33), ("B", 0.33, 0.15), ("eps", 0.45, 0.6), ("dtau", 0.6, 0.75)):
        move_slider(tab, name, start, end)
    tab.settle()
    tab.choose("method", "muller")
    tab.choose("dtau", "0.02")
    tab.choose("method", "certified")
    tab.choose("eps", "1e-4")
    for field, typed in (("B", "0.12"), ("eps", "0"), ("transient", "150"), ("method", "certified")):
        tab.choose(field, typed)
        sleep(0.1)
    left, top, width, height = tab.frame()
    tab.drag((left + 0.2 * width, top + 40), [(left + 0.2 * width + 9 * k, top + 40) for k in range(12)])
    at = left + width * tab.ask("(page.view.at - page.view.low) / (page.view.high - page.view.low)")
    tab.drag((at, top + height), [(at + 8 * k, top + height) for k in range(20)])
    tab.settle()
    tab.until("!!page.limits.eps", "the limit")
    sleep(0.2)
    found = moments(tab)
    dragged = [one["sentence"] for one in found if one["view"]["eps"] == 0 and one["view"]["at"] != 3.04]
    dragged += [one["sentence"] for one in found if ", B" in one["sentence"]]
    assert len(dragged) > 20
    assert [
        sentence for sentence in dragged if not re.search(r"period|impacts per shake|structure|too close", sentence)
    ] == []
    assert len({json.dumps(one["view"]) for one in found}) > 60, "many settings"
    assert sum(map(judged, found)) > 100
