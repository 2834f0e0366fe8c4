"""Recorded values counted on the spots of an image, compiled: a frame has time for a quarter of a million of them."""

from __future__ import annotations

from vibrodrive.jit.compile import jit


@jit(_nrt=False)
def paint(values, columns, low, high, table, counts, image):
    """Darken the spots of an image on which values lie, and the spot above each: a line of one row would be too thin.

    values : float64 (n, k)
        the values of n columns; those outside [low, high) and NaN are left out.
    columns : int64 (n,)
        their places in the image.
    table : uint8 (k + 1,)
        shade of a spot by the number of values on it.
    counts : int64 (rows,)
        for the kernel's own use.
    image : uint8 (rows, all columns)
        what is painted: of the columns named, every spot is set.
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
