"""Figure of a failure map: the shares of switches that a grid method misses, finds late or follows by a wrong state.

There is a panel for each method and kind of failure. A line shows where the structure of the motion, the repeated
pattern of its impacts (vibrodrive.stability), is lost.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from vibrodrive.figures.conditions import conditions
from vibrodrive.figures.looks import HATCHED
from vibrodrive.figures.style import equation, explain, letter, look, name_axes, narrow, new, note, styled
from vibrodrive.model.drawing import Style, Width
from vibrodrive.stability.failures import JUDGED, KINDS, METHODS
from vibrodrive.store.failures import FailureMap

LEAST = 1e-3  # smaller shares have the same tone; they are rare, because about a thousand switches are compared
LEAST_INK, LESS_INK = 0.2, 0.1


@styled
def failures_figure(
    found: FailureMap,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw the shares of missed switches, late switches and switches with a wrong next state over A and the
    disturbance.

    There are six panels, one for each method and kind of failure. Below the dashed line the structure of the motion,
    the repeated pattern of its impacts, is kept.

    Parameters
    ----------
    found : FailureMap
        from `load`, for a file of `vibrodrive failures`.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> found = vd.load("failures.h5", kind="failures")  # made by `vibrodrive failures`
    >>> figure = vd.plot.failures(found)
    >>> figure.axes[0].get_title(loc="left")
    'a) fixed: missed'
    """
    rows, cols = (len(KINDS), len(METHODS)) if narrow() else (len(METHODS), len(KINDS))
    fig, axes = new(rows, cols, height=9.4 if narrow() else 5.6, sharex=True, sharey=True)
    inks = ListedColormap(look().density(np.linspace(LEAST_INK, 1.0, 256)))
    scale = inks.with_extremes(under=look().density(LESS_INK))
    scale.colorbar_extend = "min"  # type: ignore[assignment]
    shades = LogNorm(LEAST, 1.0)
    first = found.settings["transient"] + 1
    lost = f"structure of the motion lost above this line (periods {first}–{first + found.settings['periods'] - 1})"
    mesh = None
    for c, kind in enumerate(KINDS):
        for m, method in enumerate(METHODS):
            row, col = (c, m) if narrow() else (m, c)
            ax = axes[row, col]
            share = found.share(kind)[m]
            ax.patch.set(**HATCHED)
            ax.pcolormesh(found.A, found.other, np.where(share == 0, 0.0, np.nan).T, cmap="Greys", rasterized=True)
            some = np.where(share > 0, share, np.nan)
            mesh = ax.pcolormesh(found.A, found.other, some.T, cmap=scale, norm=shades, rasterized=True)
            known = np.isfinite(found.limit[m])
            ax.plot(found.A[known], found.limit[m][known], "-", color="white", lw=2.2)
            ax.plot(found.A[known], found.limit[m][known], "--", color=look().other, lw=1.0, label=lost)
            letter(ax, row * cols + col, f"{method}: {kind}")
            ax.set_yscale("log")
            ax.set_ylim(found.other.min(), found.other.max())
            name_axes(ax, "A" if row == rows - 1 else None, found.name if col == 0 else None)
    apart = {"A", found.name, "method"}
    known = {n: value for n, value in found.shared.items() if n not in apart}
    said = conditions(known | {"periods": JUDGED}, apart, section=False)
    note(axes[0, -1], said + ([equation("dtau", found.shared["dtau"])] if found.name == "eps" else []))
    bar = fig.colorbar(mesh, ax=axes.ravel().tolist(), shrink=0.6, pad=0.02)
    bar.set_label(f"share of the switches of {JUDGED} periods (white: none)")
    unmoved = [Patch(**HATCHED, label="no switch: the mass never moves")]
    explain(fig, unmoved if (found.judged == 0).any() else [])
    return fig
