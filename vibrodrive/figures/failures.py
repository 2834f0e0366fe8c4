"""The failure map drawn: one panel for each method and kind of failure, the loss of structure across."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from vibrodrive.figures.style import GREYS, INK, equation, letter, name_axes, new, note, styled
from vibrodrive.stability.failures import KINDS, METHODS
from vibrodrive.store.failures import FailureMap

LEAST = 1e-3
"""Smaller shares are white: with a thousand switches compared they hardly occur."""


@styled
def failures_figure(found: FailureMap) -> Figure:
    """Share of missed, late and wrongly decided switches over A and the disturbance; below the line structure lasts."""
    fig, axes = new(len(METHODS), len(KINDS), height=5.0, width=7.4, sharex=True, sharey=True)
    norm = LogNorm(LEAST, 1.0)
    mesh = None
    for m, method in enumerate(METHODS):
        for c, kind in enumerate(KINDS):
            ax = axes[m, c]
            share = np.where(found.share(kind)[m] >= LEAST, found.share(kind)[m], np.nan)
            mesh = ax.pcolormesh(found.A, found.other, share.T, cmap=GREYS, norm=norm, rasterized=True)
            known = np.isfinite(found.limit[m])
            ax.plot(found.A[known], found.limit[m][known], "-", color="white", lw=2.2)
            ax.plot(found.A[known], found.limit[m][known], "--", color=INK, lw=1.0)
            letter(ax, m * len(KINDS) + c, f"{method}: {kind}")
            ax.set_yscale("log")
            ax.set_ylim(found.other.min(), found.other.max())
            name_axes(ax, "A" if m == len(METHODS) - 1 else None, found.name if c == 0 else None)
    across = "eps" if found.name == "dtau" else "dtau"
    note(axes[0, -1], equation(across, found.scalars[across]))
    bar = fig.colorbar(mesh, ax=axes.ravel().tolist(), shrink=0.6, pad=0.02)
    bar.set_label("share of switches")
    return fig
