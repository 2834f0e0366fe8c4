"""Take the pictures of the explorer, docs/explorer.gif and docs/explorer.png, in headless Chromium.

python -m docs.film
"""

from __future__ import annotations

import io
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from tests.support.chromium import browser
from vibrodrive.explorer.layout import CURVES

HERE = Path(__file__).parent

WIDTH = 880
"""Pixels of the film."""

SHORT, LONG = 160, 2500
"""Milliseconds for which a picture is shown: during a movement, and at the end of a scene."""


def palette(picture):
    """Return a picture with the colours of this one."""
    sample = picture.copy()
    for k, (colour, _) in enumerate(CURVES):  # otherwise the thin lines of a legend get no colour of their own
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
    """Zoom into a diagram, disturb it, and look at one of its motions."""
    tab = film.tab
    film.shoot(LONG // 2)
    left, top, width, height = tab.frame()
    for _ in range(9):
        wheel(tab, left + 0.75 * width, top + height + 15, -100)  # on the axis: zooms along this axis only
        film.shoot()
    film.shoot(LONG // 2)
    for eps in np.linspace(0.0, 2e-4, 13)[1:]:
        tab.choose("eps", f"{eps:.3g}")
        film.shoot()
    film.shoot(LONG // 2)
    tab.click(left + 0.72 * width, 300)
    tab.until("page.words && !page.words.includes('being computed')", "the complete text of a motion")
    film.shoot(LONG)


def main():
    command = [sys.executable, "-m", "vibrodrive", "explore", "--no-browser"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        with browser(height=1000) as tab:
            tab.open(server.stdout.readline().strip() + "&bottom=0.6&top=1.9")
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
