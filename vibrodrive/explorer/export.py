"""Files of a view: its configuration, its figure, the lines of Python that compute it, and its motion as CSV."""

from __future__ import annotations

import csv
import io
import tempfile
from pathlib import Path

from vibrodrive.batch.trajectory import Trajectory
from vibrodrive.explorer.view import SI, View
from vibrodrive.model import config
from vibrodrive.model.drawing import MAP
from vibrodrive.model.names import LOG
from vibrodrive.model.parameters import bad
from vibrodrive.model.results import Results
from vibrodrive.model.states import State

POINTS = 100  # of the motion in a CSV file, per excitation period


def file_name(view: View, kind: str) -> str:
    """Return a name that says what the file holds: "dxi_over_A.png", "motion_at_A_3.04.csv"."""
    if kind == "csv":
        return f"motion_at_{view.x}_{view.at:.6g}.csv"
    axes = f"{view.x}_{view.y}" if view.mode == MAP else view.x
    return f"{view.shade if view.mode == MAP else view.quantity}_over_{axes}.{kind}"


def drawn(view: View, results: Results, kind: str) -> bytes:
    """Return the figure of `vibrodrive sweep --plot` for the exported configuration, "png", "pdf" or "svg"."""
    from vibrodrive.figures.bifurcation import bifurcation  # imports Matplotlib; the page does not wait for it
    from vibrodrive.figures.map import map_figure
    from vibrodrive.figures.style import save

    if view.mode == MAP:
        figure = map_figure(results, view.shade, view.x, view.y, limits=view.limits)
    else:
        figure = bifurcation(results, view.quantity, view.x, view.limits)
    with tempfile.TemporaryDirectory() as folder:
        return save(figure, Path(folder) / f"view.{kind}").read_bytes()


def python(view: View) -> str:
    """Return a program that computes the sweep of this view, with the same bits, and draws it. Raises ValueError."""
    if view.scene == SI:
        raise ValueError(bad("scene", view.scene, "A and B for lines of Python: save the configuration (TOML) instead"))
    columns, rows = view.grid
    axes = {view.x: (view.low, view.high, columns, view.scale)}
    if view.mode == MAP:
        axes[view.y] = view.y_low, view.y_high, rows, view.y_scale
    lines = []
    for name, value in config.parse(view.toml()).arguments.items():
        if name in axes:
            low, high, num, scale = axes[name]
            text = f"np.{'geomspace' if scale == LOG else 'linspace'}({low!r}, {high!r}, {num})"
        else:
            text = repr(value.tolist() if hasattr(value, "tolist") else value)
        lines.append(f"    {name}={text},")
    shown = view.shade if view.mode == MAP else view.quantity
    call = ["results = vd.sweep(", *lines, ")", f"results.plot(quantity={shown!r}).savefig({file_name(view, 'png')!r})"]
    return "\n".join(["import numpy as np", "", "import vibrodrive as vd", "", *call, ""])


def motion_table(view: View, trajectory: Trajectory) -> str:
    """Return the motion of the selected column as CSV: tau, xi, dxi and state at POINTS times a period."""
    sample = trajectory.sample(POINTS)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["tau", "xi", "dxi", "state"])
    for tau, xi, dxi, state in zip(sample.tau, sample.xi, sample.dxi, sample.state, strict=True):
        writer.writerow([repr(float(tau)), repr(float(xi)), repr(float(dxi)), State(int(state)).name])
    return out.getvalue()


def check_motion(view: View) -> None:
    """Raise ValueError if no motion is selected."""
    if not view.follows:
        raise ValueError(bad("at", "nothing", "the place of a motion: click a column of a diagram first"))
