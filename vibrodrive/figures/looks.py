"""Colours of all figures in two styles: `screen`, which colour-blind readers can read, too, and `print` in black ink.

Elements with different colours also have different line styles, marks or lightness, so that colour-blind readers and
grey copies can tell them apart. In `print` they differ only in these. The lightness of a value beyond a scale is beyond
that of all shades of the scale, in `print` in the reverse order; still lighter are points without a value, and motions
at rest, which are white.
"""

from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import Colormap, LinearSegmentedColormap, to_hex

from vibrodrive.model.figure import Style
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
    coloured: bool  # bifurcations have their `colour` (figures/bifurcations.py) if True, and their `ink` there if False
    density: Colormap  # darkness of a cell of an image, from 0 to 1 (ink.py)
    classes: tuple[str, ...]  # classes of a map, each darker than the previous one; the last two are "other" and "none"
    shades: Colormap  # continuous quantity of a map
    signed: Colormap  # quantity of a map that may be negative; a step at 0, in the middle, shows the sign
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
        shades: Any = colormaps[cmap] if isinstance(cmap, str) else cmap
        ends = to_hex(shades.get_under(), True), to_hex(shades.get_over(), True)
        beyond = self.beyond if isinstance(cmap, str) else ends

        def spread(colours: tuple[str, ...]) -> Any:
            return tuple(to_hex(colour, True) for colour in shades(np.linspace(0.0, 1.0, len(colours))))

        shown = {name: spread(getattr(self, name)) for name in ("classes", "kept", "statuses")}
        return self._replace(density=shades, shades=shades, signed=shades, beyond=beyond, **shown)


def ramp(*colours: Any) -> Colormap:
    """Return a colour map through the colours, which are evenly spaced unless each is given with its place, 0 to 1."""
    return LinearSegmentedColormap.from_list("ink", list(colours))  # Matplotlib 3.8.0: a pair is (colour, opacity)


def _greys(count: int, light: float, dark: float) -> tuple[str, ...]:
    """Return greys in visually even steps between two lightnesses L* (0 black, 100 white)."""
    linear = ((np.linspace(light, dark, count) + 16.0) / 116.0) ** 3
    return tuple(f"{1.055 * y ** (1 / 2.4) - 0.055:.4f}" for y in linear)


_PATTERNS = ("-", "--", ":", "-.")
_HUES = ("#0072b2", "#d55e00", "#00a87b", "#8a4181", "#333333", "#5a4800")

# One scale from light blue over orange to dark purple, then two greys, in even steps of lightness.
_CLASSES = (
    "#c1d4e3", "#91bfe4", "#d59648", "#d27432", "#be563f", "#a0395d", "#6e2e70", "#412266", "#1c1c1c", "#000000",
)  # fmt: skip

LOOKS: dict[Style, Look] = {
    "screen": Look(
        main=_HUES[0],
        other=_HUES[1],
        support="0.55",
        lines=tuple((hue, _PATTERNS[k % 4]) for k, hue in enumerate(_HUES)),
        bands=("#80bee0", "#f5c6a0", "#ccedde"),
        coloured=True,
        density=ramp("#ffffff", "#8fc1e3", "#2a72b5", "#0b2e5c"),
        classes=_CLASSES,
        shades=ramp(*colormaps["cividis"](np.linspace(0.08, 0.84, 256))),
        signed=ramp((0.0, "#123467"), (0.5, "#4678ab"), (0.5, "#c2732b"), (1.0, "#e6bb5a")),
        beyond=("#4a1200", "#51e7eb"),
        kept=(_CLASSES[0], "#b5430d"),
        statuses=(_CLASSES[0], _CLASSES[1], _CLASSES[4], _CLASSES[8]),
        lacking="#e5e5e5",
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
        signed=ramp((0.0, "0.84"), (0.5, "0.65"), (0.5, "0.42"), (1.0, "0.18")),
        beyond=("0.92", "black"),
        kept=("0.9", "0.3"),
        statuses=("0.95", "0.75", "black", "0.45"),
        lacking="none",  # no further grey could be distinguished
    ),
}
