"""Many periods of a motion on top of each other: how many of them pass through each spot, as ink."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from vibrodrive.figures.bifurcation import FullestImage, swatches
from vibrodrive.figures.ink import FAINTEST
from vibrodrive.figures.style import look

SPOTS = (900, 600)

AROUND = 0.01


def draw_passes(ax: Axes, tau: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """A curve (n,) over τ, NaN where it is broken, as an image: each spot by the number of periods that pass there."""
    low = np.array([np.nanmin(x), np.nanmin(y)])
    high = np.array([np.nanmax(x), np.nanmax(y)])
    room = AROUND * np.where(high > low, high - low, 1.0)
    low, high = low - room, high + room
    period = np.floor((tau - tau[0]) / (2 * np.pi) + 1e-9).astype(int)
    ink = _ink(count_passes(np.stack([x, y], axis=1), period, low, high), int(period.max()) + 1)
    ink[1:] = np.maximum(ink[1:], ink[:-1])  # a line of one spot would be too thin
    ink[:, 1:] = np.maximum(ink[:, 1:], ink[:, :-1])
    extent = (low[0], high[0], low[1], high[1])
    image = FullestImage(
        ax, cmap=look().density, norm=Normalize(0, 1), origin="lower", extent=extent, interpolation="nearest"
    )
    image.set_data(ink)
    image.set_clip_path(ax.patch)
    ax.add_image(image)
    ax.update_datalim([low, high])
    ax.autoscale_view()


def _ink(counts: np.ndarray, periods: int) -> np.ndarray:
    """By the root of the share: most spots of an irregular motion are passed in few of its periods."""
    return np.where(counts > 0, FAINTEST + (1.0 - FAINTEST) * np.sqrt(counts / periods), 0.0)


def passes_key(periods: int) -> list[Artist]:
    """The key to the ink of a motion of so many periods."""
    counts = np.array([1, round(periods / 4), periods])
    names = [f"spot passed in 1 of {periods} periods", f"in {counts[1]}", "in all"]
    return swatches(_ink(counts, periods).tolist(), names)


def count_passes(points: np.ndarray, period: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Periods in which a polyline (n, 2) meets each spot between two corners: float64 (rows, columns).

    `period` (n,) numbers the period of each point; between points the line is followed in steps of half a spot.
    """
    place = (points - low) / (high - low) * np.array(SPOTS)
    whole = np.isfinite(place[:-1]).all(axis=1) & np.isfinite(place[1:]).all(axis=1)
    begin, end, of = place[:-1][whole], place[1:][whole], period[:-1][whole]
    steps = np.maximum(1, np.ceil(2.0 * np.abs(end - begin).max(axis=1))).astype(int)
    share = (np.arange(steps.sum()) - np.repeat(np.cumsum(steps) - steps, steps)) / np.repeat(steps, steps)
    along = np.repeat(begin, steps, axis=0) + share[:, None] * np.repeat(end - begin, steps, axis=0)
    column, row = np.clip(along.astype(int), 0, np.array(SPOTS) - 1).T
    spots = SPOTS[0] * SPOTS[1]
    met = np.unique(np.repeat(of, steps) * spots + row * SPOTS[0] + column)  # each spot once a period
    return np.bincount(met % spots, minlength=spots).reshape(SPOTS[::-1]).astype(float)
