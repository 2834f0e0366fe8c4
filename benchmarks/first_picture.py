"""Time from the command that starts the explorer to its first picture, in a browser that is already open.

The compiled kernels are on disk, and the scripts of the page are in the browser's cache. A browser compiles a script at
its second load, so the first two starts are not counted. The last start has an empty cache, so that it compiles.
"""

import sys
import time
from tempfile import TemporaryDirectory

from benchmarks.common import arguments, figure, look, say, write
from benchmarks.explorer import served
from tests.support.chromium import Tab, browser, lacking

UNCOUNTED, STARTS = 2, 9

STEPS = ("address printed", "page loaded", "picture painted")


def start(tab: Tab) -> list[float]:
    """Return the seconds from the command to each of STEPS."""
    began, reached = time.perf_counter(), []

    def note() -> None:
        reached.append(round(time.perf_counter() - began, 2))

    with served() as (_, address):
        note()
        tab.driver.get(address)
        note()
        tab.until("page?.frames?.length > 0", "a picture")  # before the scripts run, `page` is an HTML element
        note()
    return reached


def compiled(tab: Tab) -> float:
    """Return the seconds from the command, with an empty cache, until picture, motion and limit are there."""
    with TemporaryDirectory() as cache:
        began = time.perf_counter()
        with served(NUMBA_CACHE_DIR=cache) as (_, address):
            tab.open(address)
            tab.until("!!page.limits.eps", "k₂")
        return round(time.perf_counter() - began, 1)


def main() -> None:
    options = arguments(__doc__ or "")
    if lacking():
        sys.exit(f"first_picture: {lacking()}")
    with browser() as tab:
        starts = []
        for _ in range(UNCOUNTED + (2 if options.quick else STARTS)):
            starts.append(start(tab))
            say(", ".join(f"{step} after {s} s" for step, s in zip(STEPS, starts[-1], strict=True)))
        seconds = compiled(tab)
        say(f"with an empty cache all is compiled after {seconds} s")
    found = {step: sorted(seconds) for step, seconds in zip(STEPS, zip(*starts[UNCOUNTED:], strict=True), strict=True)}
    fig, axes = figure(height=2.0)
    ax = axes[0, 0]
    for k, (step, times) in enumerate(found.items()):
        ax.plot(times, [step] * len(times), **look(k, of_ours=True) | {"linestyle": ""})
    ax.set(xlabel="seconds after the command, of each start", xlim=(0, None), ylim=(2.5, -0.5))
    write("first_picture", {**found, "compiled": seconds}, fig, options.output)


if __name__ == "__main__":
    main()
