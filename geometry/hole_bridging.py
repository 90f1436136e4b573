"""Holes and grooves of a height grid, spanned at the height of their rims."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def bridge_holes(height: Floats, step: float, arc: float, max_bridge: float, around: bool = True) -> Floats:
    """Fill holes and grooves that are narrower than a bridge, in length or in arc, up to their rims.

    This is a grey-scale closing by a rectangle.

    Args:
        height: not negative, 0 where there is no surface, shape (k, p).
        step: distance between rows [m].
        arc: distance between columns [m].
        max_bridge: side of the square that must fit into a hole for the hole to remain [m].
        around: True where the last column is followed by the first.

    Returns:
        the heights with the holes filled, shape (k, p).
    """
    from scipy.ndimage import maximum_filter, minimum_filter

    rows, columns = height.shape
    # a window of all rows already reaches the highest on either side of a row: a longer one changes nothing
    tall = min(2 * int(min(max_bridge / step, 2.0 * rows) / 2.0) + 1, rows + 1 - rows % 2)
    wide = min(2 * int(min(max_bridge / arc, columns) / 2.0) + 1, columns - 1 + columns % 2)
    if tall == wide == 1:
        return height
    padded = np.pad(height, ((tall, tall), (0, 0)))
    padded = np.pad(padded, ((0, 0), (wide, wide)), mode="wrap" if around else "constant")
    closed = minimum_filter(maximum_filter(padded, (tall, wide)), (tall, wide))
    return np.asarray(closed[tall : tall + rows, wide : wide + columns])
