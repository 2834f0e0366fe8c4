"""Response of the explorer: frames per second during dragging, and the time from an event to the painted picture.

A diagram is dragged in headless Chromium, which renders in software. Chromium and the computation run on the same
machine. The page measures each latency, from the mouse movement to the end of the animation frame that paints the
picture.
"""

import itertools
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
from websocket import create_connection  # installed with Selenium

from benchmarks.common import arguments, figure, look, say, write
from tests.support.chromium import Tab, browser, lacking

SCENES = {  # name: columns × (transient + recorded periods); value: query of the page
    "ε = 0, 1000 × (500 + 200)": "&periods=200",
    "ε = 2e-4, 1000 × (500 + 200)": "&eps=0.0002&periods=200",
    "ε = 2e-4, 1000 × (500 + 500)": "&eps=0.0002&periods=500",
    "fixed, Δτ = 0.1, 1000 × (500 + 200)": "&method=fixed&periods=200",
}

WINDOW = "&low=3.0&high=3.25&bottom=0.7&top=1.85&columns=1000"

CLICKS = 10

MOVEMENTS = 60
"""Mouse movements per second. A browser reports one movement for each refresh of the screen."""


def quantiles(values: list[float]) -> dict[str, float]:
    """Return the median and the 95th percentile of times, rounded to a tenth."""
    if not values:  # on a very busy machine there may be no frame
        return {"median": math.inf, "p95": math.inf}
    return {"median": round(float(np.median(values)), 1), "p95": round(float(np.quantile(values, 0.95)), 1)}


@contextmanager
def mouse(tab: Tab) -> Iterator[Callable[[int, int], None]]:
    """Yield a function that moves the pressed mouse. The function does not wait for the response, which can take
    several frames."""
    address = tab.driver.capabilities["goog:chromeOptions"]["debuggerAddress"]
    with urlopen(f"http://{address}/json") as answer:
        (page,) = (target for target in json.load(answer) if target["type"] == "page")
    line = create_connection(page["webSocketDebuggerUrl"], suppress_origin=True)
    numbers = itertools.count(1)

    def move(x: int, y: int) -> None:
        place = {"type": "mouseMoved", "x": x, "y": y, "button": "left", "buttons": 1}
        line.send(json.dumps({"id": next(numbers), "method": "Input.dispatchMouseEvent", "params": place}))

    try:
        yield move
    finally:
        line.close()


def drag(tab: Tab, seconds: float) -> dict[str, Any]:
    """Drag a diagram back and forth. Return the number and rate of frames, the latencies in ms and their quantiles, the
    seconds from the release to the complete picture, and the load of the machine."""
    tab.ask("(page.frames.length = page.latencies.length = 0)")
    tab.mouse("Pressed", 500, 300)
    with mouse(tab) as move:
        began, k = time.perf_counter(), 0
        while time.perf_counter() - began < seconds:
            k += 1
            move(500 + round(150 * math.sin(k / 20)), 300)
            time.sleep(max(0.0, began + k / MOVEMENTS - time.perf_counter()))
        took = time.perf_counter() - began
    frames, latencies = tab.ask("[page.frames.length, page.latencies]")
    tab.mouse("Released", 500, 300)
    released = time.perf_counter()
    tab.until("page.settled", "the complete picture")
    settled = time.perf_counter() - released
    return {
        "frames": frames,
        "frames_per_second": round(frames / took, 1),
        "milliseconds": quantiles(latencies),
        "latencies": latencies,
        "settled_seconds": round(settled, 2),
        "load": round(os.getloadavg()[0], 1),
    }


WATCH = """
window.released = null;
addEventListener('pointerup', () => { window.released = performance.now(); }, {once: true, capture: true});
"""


def click(tab: Tab) -> dict[str, float]:
    """Return the median and the 95th percentile of the milliseconds from a click to the painted curves."""
    times = []
    for k in range(CLICKS):
        tab.driver.execute_script(WATCH)
        tab.click(200 + 50 * k, 300)
        tab.until("window.released !== null && page.shown > window.released", "curves")
        times.append(tab.ask("page.shown - window.released"))
        tab.until("!!page.limits.eps", "the limit")
    return quantiles(times[1:])  # without the first click, which loads code


def resident(pid: int) -> float:
    """Return the memory of a process in MiB (Linux)."""
    with open(f"/proc/{pid}/statm", encoding="utf-8") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


@contextmanager
def served(**environment: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run `vibrodrive explore` with these environment variables. Yield its process and the address that it prints."""
    command = [sys.executable, "-m", "vibrodrive", "explore", "--no-browser"]
    server = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=os.environ | environment
    )
    try:
        assert server.stdout is not None
        yield server, server.stdout.readline().strip()
    finally:
        server.send_signal(signal.SIGINT)
        server.wait()


def main() -> None:
    options = arguments(__doc__ or "")
    if lacking():
        sys.exit(f"explorer: {lacking()}")
    seconds, frames = (2.0, 100) if options.quick else (6.0, 10_000)
    found: dict[str, Any] = {"scenes": {}}
    with browser() as tab, served() as (server, address):
        tab.open(address + WINDOW)
        tab.until("!!page.limits.eps", "k₂")  # now all kernels are loaded
        for name, query in SCENES.items():
            tab.open(address + WINDOW + query)
            drag(tab, 1.0)  # warm-up: the server measures its speed, and the browser compiles the scripts
            found["scenes"][name] = drag(tab, seconds)
            row = found["scenes"][name]
            say(f"{name}: {row['frames_per_second']} frames/s, {row['milliseconds']} ms, load {row['load']}")
        tab.open(address + WINDOW)
        found["click_milliseconds"] = click(tab)
        say(f"click to curves: {found['click_milliseconds']} ms")
        found["memory"] = memory(tab, server.pid, frames)
        say(f"memory: {found['memory']}")
    draw(found, options.output)


def memory(tab: Tab, pid: int, frames: int) -> dict[str, float]:
    """Return the growth of the server's memory over `frames` frames. Frames drawn before the measurement fill the
    server's caches."""
    grown = 0.0
    for count in (max(50, frames // 20), frames):
        before, seen = resident(pid), 0
        while seen < count:
            seen += drag(tab, 1.0 if frames < 1000 else 10.0)["frames"]
        grown = resident(pid) - before
    return {"frames": frames, "grown_MiB": round(grown, 1)}


def draw(found: dict[str, Any], directory: Path) -> None:
    fig, axes = figure()
    ax = axes[0, 0]
    for k, (name, row) in enumerate(found["scenes"].items()):
        latencies = np.sort(row.pop("latencies"))
        style = look(k, of_ours=True) | {"marker": ""}
        ax.plot(latencies, np.arange(1, len(latencies) + 1) / len(latencies), label=name, **style)
    ax.set(xlabel="ms from event to painted picture", ylabel="share of frames", ylim=(0, 1))
    ax.set_xlim(left=0)
    ax.legend()
    write("explorer", found, fig, directory)


if __name__ == "__main__":
    main()
