"""Shade of each pixel by its number of values. The function is compiled, because a frame has up to 250 000 values.

It has a module of its own, because an edit of a module with compiled functions, or of one that it imports, compiles all
kernels again.
"""

from __future__ import annotations

import numpy as np

from vibrodrive.jit.compile import array, jit

_COUNTS, _SHADES = array(1, np.int64), array(1, np.uint8)


@jit(like=(array(2), _COUNTS, 0.0, 0.0, _SHADES, _COUNTS, array(2, np.uint8)), _nrt=False)
def darken(values, columns, low, high, table, counts, image):
    """Darken the pixels that contain values, and the pixel above each of them, because lines of one row are too thin.

    `values`, float64 (n, k), belong to the columns `columns`, int64 (n,), of `image`, uint8 (rows, all columns). NaN
    and values outside [low, high) are ignored. `table`, uint8 (k + 1,), contains the shade of a pixel with 0, 1, … k
    values. `counts`, int64 (rows,), is a workspace.
    """
    rows = image.shape[0]
    scale = rows / (high - low)
    for i in range(values.shape[0]):
        counts[:] = 0
        for j in range(values.shape[1]):
            place = (values[i, j] - low) * scale
            if 0.0 <= place < rows:
                counts[int(place)] += 1
        below = table[0]
        for row in range(rows):
            shade = table[counts[row]]
            image[row, columns[i]] = max(shade, below)
            below = shade
