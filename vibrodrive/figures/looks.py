"""Colours of all figures in two styles: `screen`, which colour-blind readers can read, too, and `print` in black ink.

Elements with different colours also have different line styles, marks or lightness. In `print` they differ only in
these.
"""

from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import Colormap, LinearSegmentedColormap, to_hex

from vibrodrive.model.drawing import Style
from vibrodrive.model.parameters import bad, did_you_mean

INK = "black"
HATCHED: dict[str, Any] = {"facecolor": "white", "hatch": "//////", "edgecolor": "0.6", "linewidth": 0}


class Look(NamedTuple):
    """Colours of one style."""

    main: str  # main subject of a figure
    other: str  # contrast colour: a disturbed motion, an unstable orbit
    support: str  # auxiliary lines: a zero, the excitation, impacts
    lines: tuple[tuple[str, str], ...]  # colour and line style of the first, second, … curve
    bands: tuple[str, ...]  # areas of the first, second, … curve
    coloured: bool  # bifurcations have their `colour` (model/bifurcations.py) if True, and their `ink` there if False
    density: Colormap  # darkness of a cell of an image, from 0 to 1 (ink.py)
    classes: tuple[str, ...]  # classes of a map, each darker than the previous one; the last two are "other" and "none"
    shades: Colormap  # continuous quantity of a map
    signed: Colormap  # quantity of a map that may be negative; 0 is in the middle
    nil: str  # motions that rest, on a map with the colours `signed`
    beyond: tuple[str, str]  # values below and above a continuous scale
    kept: tuple[str, str]  # structure kept and lost
    statuses: tuple[str, str, str, str]  # statuses, in the order of SHOWN in figures/colours.py
    lacking: str  # computed points without a value; "none" if these points are hatched

    def with_map(self, cmap: str | Colormap | None) -> "Look":
        """Return these colours with those of a colour map for all shades and classes. Only a Colormap, not its name,
        also determines the colours of values beyond its ends. Raises ValueError with one sentence."""
        if cmap is None:
            return self
        if not isinstance(cmap, Colormap) and not (isinstance(cmap, str) and cmap in colormaps):
            allowed = "a Colormap of Matplotlib, or the name of one such as magma"
            raise ValueError(bad("cmap", cmap, allowed) + did_you_mean(cmap, colormaps))
        own: Any = colormaps[cmap] if isinstance(cmap, str) else cmap
        beyond = self.beyond if isinstance(cmap, str) else (to_hex(own.get_under(), True), to_hex(own.get_over(), True))

        def spread(known: tuple[str, ...]) -> Any:
            return tuple(to_hex(colour, True) for colour in own(np.linspace(0.0, 1.0, len(known))))

        shown = {name: spread(getattr(self, name)) for name in ("classes", "kept", "statuses")}
        return self._replace(density=own, shades=own, signed=own, beyond=beyond, **shown)


def ramp(*colours: Any) -> Colormap:
    """Return a colour map through the colours, which are evenly spaced unless each is given with its place, 0 to 1."""
    return LinearSegmentedColormap.from_list("ink", list(colours))  # Matplotlib 3.8.0: a pair is (colour, opacity)


def _greys(count: int, light: float, dark: float) -> tuple[str, ...]:
    """Return greys in visually even steps between two lightnesses L* (0 black, 100 white)."""
    linear = ((np.linspace(light, dark, count) + 16.0) / 116.0) ** 3
    return tuple(f"{1.055 * y ** (1 / 2.4) - 0.055:.4f}" for y in linear)


_PATTERNS = ("-", "--", ":", "-.")
_HUES = ("#0072b2", "#d55e00", "#009e73", "#8f4a86", "#7a6000", "#333333")

# One scale from light blue over orange to dark purple, then two greys. Each colour is darker than the previous one, so
# that a grey copy keeps their order. Colour-blind readers can distinguish them.
_CLASSES = (
    "#e1e9f0", "#b0cde6", "#eebb85", "#dc8c58", "#bf5f4c", "#953a5d", "#68286b", "#3f1f63", "#2b2b2b", "#000000",
)  # fmt: skip

LOOKS: dict[Style, Look] = {
    "screen": Look(
        main=_HUES[0],
        other=_HUES[1],
        support="0.55",
        lines=tuple((hue, _PATTERNS[k % 4]) for k, hue in enumerate(_HUES)),
        bands=("#a9d3ea", "#f6c6a2", "#bfe5d6"),
        coloured=True,
        density=ramp("#ffffff", "#8fc1e3", "#2a72b5", "#0b2e5c"),
        classes=_CLASSES,
        shades=colormaps["cividis"],
        signed=colormaps["RdBu_r"],
        nil="#e8c95a",
        beyond=("#009a7b", "#e0218a"),  # very different from all colours of `shades` and `signed`
        kept=("#d3e8f5", "#b5430d"),
        statuses=("#f2f2f2", _CLASSES[1], _CLASSES[4], _CLASSES[8]),
        lacking="#d0d0d0",
    ),
    "print": Look(
        main=INK,
        other=INK,
        support="0.55",
        lines=tuple((tone, pattern) for tone in (INK, "0.55") for pattern in _PATTERNS),
        bands=("0.55", "0.8", "0.9"),
        coloured=False,
        density=ramp("white", "black"),
        classes=_greys(8, 88.0, 4.0),  # more greys could not be distinguished
        shades=ramp(*_greys(6, 86.0, 20.0)),
        signed=ramp((0.0, "0.92"), (0.5, "0.7"), (0.5, "0.42"), (1.0, "0.0")),  # a step at 0 shows the sign
        nil="white",
        beyond=("0.94", "black"),
        kept=("0.9", "0.3"),
        statuses=("0.95", "0.75", "black", "0.45"),
        lacking="none",  # no further grey could be distinguished
    ),
}
