"""Every figure: what was computed or loaded, as a Matplotlib Figure that shows itself in a notebook.

All take `style` and `width`, and `ax`, the axes to draw into; they then return the Figure that those are of: one Axes
where the figure has one panel, else a sequence of as many as it has panels.

Examples
--------
>>> import numpy as np
>>> import vibrodrive as vd
>>> r = vd.sweep(A=np.linspace(3.0, 3.25, 50), eps=[0.0, 2e-4], transient=100, periods=20)
>>> figure = vd.plot.bifurcation(r, quantity="xi")
>>> figure.savefig("diagram.pdf")

In axes of one's own, a motion beside its section:

>>> from matplotlib.figure import Figure
>>> figure = Figure(figsize=(8, 3), layout="constrained")
>>> left, right = figure.subplots(1, 2)
>>> motion = vd.simulate(A=3.04, transient=1000, periods=4)
>>> vd.plot.phase_curve(motion, ax=left) is vd.plot.poincare(motion, ax=right) is figure
True
"""

from __future__ import annotations

from vibrodrive.figures.bifurcation import bifurcation
from vibrodrive.figures.curves import phase_curve
from vibrodrive.figures.diagrams import poincare
from vibrodrive.figures.failures import failures_figure as failures
from vibrodrive.figures.limits import limits_figure as limits
from vibrodrive.figures.map import map_figure as map
from vibrodrive.figures.orbits import bifurcation_diagram as orbits
from vibrodrive.figures.orbits import cobweb
from vibrodrive.figures.orbits import multiplier_diagram as multipliers
from vibrodrive.figures.plane import curves_figure as curves
from vibrodrive.figures.scheme import scheme

__all__ = [
    "bifurcation",
    "cobweb",
    "curves",
    "failures",
    "limits",
    "map",
    "multipliers",
    "orbits",
    "phase_curve",
    "poincare",
    "scheme",
]

for _name in __all__:
    globals()[_name].__name__ = _name  # `help` shows the public name
