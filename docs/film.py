"""Take the pictures of the explorer, docs/explorer.gif and docs/explorer.png, in headless Chromium, and write the one
that it shows while kernels are compiled.

python -m docs.film
"""

from __future__ import annotations

import io
import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from tests.support.chromium import browser
from vibrodrive.explorer.engine import Pace
from vibrodrive.explorer.image import picture_of
from vibrodrive.explorer.session import message_of, stored
from vibrodrive.explorer.view import View
from vibrodrive.explorer.work import Work
from vibrodrive.jit.slices import Halt

HERE = Path(__file__).parent
FIRST = HERE.parent / "vibrodrive" / "explorer" / "first.json"

WIDTH = 880
"""Pixels of the film."""

SHORT, LONG = 160, 2500
"""Milliseconds for which a picture is shown: during a movement, and at the end of a scene."""


COLOURS = "#0072b2", "#c94f00", "#00795a"
"""Colours of thin lines, which would otherwise have none of their own in a picture of few colours."""


def palette(picture):
    """Return a picture with the colours of this one."""
    sample = picture.copy()
    for k, colour in enumerate(COLOURS):
        sample.paste(colour, (50 * k, 0, 50 * k + 50, 100))
    return sample.quantize(192, dither=Image.Dither.NONE)


class Film:
    """Pictures of a page, one after the other."""

    def __init__(self, tab):
        self.tab = tab
        self.pictures, self.times = [], []

    def screenshot(self):
        return Image.open(io.BytesIO(self.tab.driver.get_screenshot_as_png())).convert("RGB")

    def shoot(self, time=SHORT):
        self.tab.settle()
        whole = self.screenshot()
        height = round(whole.height * WIDTH / whole.width)
        self.pictures.append(whole.resize((WIDTH, height), Image.Resampling.LANCZOS))
        self.times.append(time)

    def write(self, path):
        colours = palette(self.pictures[-1])
        frames = [picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in self.pictures]
        frames[0].save(path, save_all=True, append_images=frames[1:], duration=self.times, loop=0, optimize=True)


def wheel(tab, x, y, by):
    """Turn the wheel of the mouse at a place."""
    turned = {"type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": by}
    tab.driver.execute_cdp_cmd("Input.dispatchMouseEvent", turned)


def play(film):
    """Drag the knob along the diagram, zoom into it, and move ε up until the structure of the motion is lost."""
    tab = film.tab
    film.shoot(LONG // 2)
    left, top, width, height = tab.frame()

    def place(A, low=2.2, high=5.0):
        return round(left + width * (A - low) / (high - low)), round(top + height)

    for A in (*np.linspace(2.4, 4.2, 10), *np.linspace(4.0, 3.04, 7)):
        tab.click(*place(A))
        tab.until("!page.busy", "the motion")
        film.shoot()
    film.shoot(LONG // 2)
    for _ in range(8):
        wheel(tab, place(3.08)[0], top + height / 2, -140)
        film.shoot()
    tab.until("!!page.limits.eps", "the limit")
    film.shoot(LONG // 2)
    for eps in np.geomspace(1e-6, 3e-4, 14):
        tab.choose("eps", f"{eps:.2g}")
        film.shoot()
    film.shoot(LONG)


def supply():
    """Write the first picture of the explorer."""
    view = View().sized(900, 400)
    *_, level = Work([view.plan()], None).levels(Pace(), Halt())
    FIRST.write_text(json.dumps([stored(message_of("picture", *picture_of(view, level, 400)))]) + "\n")


def main():
    supply()
    command = [sys.executable, "-m", "vibrodrive", "explore", "--no-browser"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        with browser(1280, 800) as tab:
            tab.open(server.stdout.readline().strip())
            film = Film(tab)
            play(film)
            film.write(HERE / "explorer.gif")
            whole = film.screenshot()
            whole.quantize(palette=palette(whole), dither=Image.Dither.NONE).save(HERE / "explorer.png", optimize=True)
    finally:
        server.send_signal(signal.SIGINT)
        server.wait()


if __name__ == "__main__":
    main()
