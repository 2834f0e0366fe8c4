"""Export of a view as a figure of the package."""

from __future__ import annotations

import tempfile
from pathlib import Path

from vibrodrive.explorer.view import View
from vibrodrive.model.drawing import MAP
from vibrodrive.model.results import Results


def drawn(view: View, results: Results, kind: str) -> bytes:
    """Return the figure of `vibrodrive sweep --plot` for the exported configuration, "png" or "pdf", as bytes."""
    from vibrodrive.figures.bifurcation import bifurcation  # imports Matplotlib; the page does not wait for it
    from vibrodrive.figures.map import map_figure
    from vibrodrive.figures.style import save

    if view.mode == MAP:
        figure = map_figure(results, view.shade, view.x, view.y, limits=view.limits)
    else:
        figure = bifurcation(results, view.quantity, view.x, view.limits)
    with tempfile.TemporaryDirectory() as folder:
        return save(figure, Path(folder) / f"view.{kind}").read_bytes()
