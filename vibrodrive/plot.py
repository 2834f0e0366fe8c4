"""Functions that draw results and return a Matplotlib Figure.

A notebook displays it as the value of a cell. In a script `figure.show()` opens a window and waits until it is closed,
and `figure.savefig("figure.png")` writes a file; `pyplot.show()` knows only figures of pyplot, into whose axes you can
draw with `ax`.

Each function has the arguments `style`, `width`, `notes` and `ax`. `ax` gives the axes to draw into: one Axes for a
figure with one panel, otherwise a sequence with one Axes for each panel. The function then returns the Figure of these
axes. A new figure does not depend on the settings of your matplotlibrc, and your axes keep them.

Examples
--------
>>> import numpy as np
>>> import vibrodrive as vd
>>> r = vd.sweep(A=np.linspace(3.0, 3.25, 50), eps=[0.0, 2e-4], transient=100, periods=20)
>>> figure = vd.plot.bifurcation(r, quantity="xi")
>>> figure.savefig("diagram.pdf")

In existing axes, a motion next to its section:

>>> from matplotlib.figure import Figure
>>> figure = Figure(figsize=(8, 3), layout="constrained")
>>> left, right = figure.subplots(1, 2)
>>> motion = vd.simulate(A=3.04, transient=1000, periods=4)
>>> vd.plot.phase_curve(motion, ax=left) is vd.plot.poincare(motion, ax=right) is figure
True

Two diagrams in the same axes, in two colours:

>>> ax = Figure().subplots()
>>> for eps in (2e-4, 0.0):
...     figure = vd.plot.bifurcation(r.select(eps=eps), ax=ax)
>>> len(ax.get_legend().get_texts())
2
"""

from vibrodrive.figures.curves import phase_curve
from vibrodrive.figures.limits import limits_figure as limits
from vibrodrive.figures.map import map_figure as map
from vibrodrive.figures.orbits import cobweb
from vibrodrive.figures.sections import bifurcation, poincare

__all__ = [
    "bifurcation",
    "cobweb",
    "limits",
    "map",
    "phase_curve",
    "poincare",
]

for _name in __all__:
    globals()[_name].__name__ = _name  # `help` shows the public name


def __dir__() -> list[str]:
    return sorted(__all__)
