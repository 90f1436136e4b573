"""Outermost of many points: the corners of their convex hull."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["outermost_points"]


def outermost_points(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return those of points [m], shape (n, 3), that are corners of their hull: as far as all reach, these reach.

    All are returned where the hull has no volume.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(points[np.sort(ConvexHull(points).vertices)])
    except QhullError:
        return points
