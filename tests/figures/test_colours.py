"""Colours that a reader must tell apart differ in normal vision, for colour-blind readers, and in a grey copy."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from vibrodrive.figures.colours import APART, SHADES
from vibrodrive.figures.looks import LOOKS

# Dichromats see linear red, green and blue as these mixtures: Machado, Oliveira and Fernandes, A physiologically-based
# model for simulation of color vision deficiency, IEEE Trans. Vis. Comput. Graph. 15 (2009) 1291-1298, severity 1.
VISIONS = {
    "normal": np.eye(3),
    "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    "grey": [[0.2126, 0.7152, 0.0722]] * 3,
}
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])  # of sRGB
DIFFERENT = 6.0  # in CIELAB (1976), where 2.3 is just noticeable


def seen(colours):
    """Return the coordinates L*, a*, b* of n colours in each vision: float64 (visions, n, 3)."""
    encoded = np.array([to_rgb(colour) for colour in colours])
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    mixed = np.clip(linear @ np.swapaxes(list(VISIONS.values()), 1, 2), 0.0, 1.0)
    share = mixed @ (XYZ / XYZ.sum(axis=1, keepdims=True)).T
    x, y, z = np.moveaxis(np.where(share > (6 / 29) ** 3, np.cbrt(share), share * (29 / 6) ** 2 / 3 + 4 / 29), -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def alike(groups):
    """Return the visions in which a colour of a group is too like one of another group. "none" is a hatched area."""
    places = [seen(group) for group in groups if "none" not in group]
    pairs = [np.linalg.norm(a[:, :, None] - b[:, None], axis=-1) for a, b in itertools.combinations(places, 2)]
    least = np.min([pair.min(axis=(1, 2)) for pair in pairs], axis=0)
    return [f"{vision}: {far:.1f}" for vision, far in zip(VISIONS, least, strict=True) if far < DIFFERENT]


@pytest.mark.parametrize("style", LOOKS)
def test_colours_are_told_apart_by_everyone(style):
    look, ends = LOOKS[style], [(colour,) for colour in (*LOOKS[style].beyond, LOOKS[style].lacking, APART)]
    groups = {"classes": [*zip(look.classes), *ends[2:]], "kept": [*zip(look.kept), *ends[2:]]}
    groups |= {"statuses": [*zip(look.statuses), ends[2]], "bands": [*zip(look.bands)]}
    groups |= {f"lines {ls}": [(colour,) for colour, own in look.lines if own == ls] for _, ls in look.lines[:2]}
    groups["results in the axes of the user"] = [*zip({colour for colour, _ in look.lines})]
    for name in ("shades", "signed"):
        groups[name] = [getattr(look, name)(np.linspace(0.0, 1.0, SHADES))[:, :3], *ends]
    groups["signs"] = np.split(groups["signed"][0], 2)
    assert not {name: found for name, group in groups.items() if (found := alike(group))}
