"""Floor: lines on the plane z = 0, as one mesh of narrow bands.

viser's own grid is computed for each pixel of the floor anew: where a processor draws, that takes as long as the arm.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["SPACING", "floor_lines"]

SPACING = 0.25  #: m between two lines
_WIDTH = 0.006  # m; from 2 m off still more than a pixel


def floor_lines(reach: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices [m] and faces, seen from above, of lines that go as far as twice the reach each way.

    Args:
        reach: how far an arm on the floor can be from its base [m].
    """
    import numpy as np

    count = max(1, math.ceil(2.0 * reach / SPACING))
    at, end, half = SPACING * np.arange(-count, count + 1), SPACING * count, 0.5 * _WIDTH
    corners = [np.stack([at + side, np.full_like(at, far)], axis=1) for far in (-end, end) for side in (-half, half)]
    across = np.stack(corners, axis=1)  # lines along y: near left, near right, far left, far right
    along = across[..., ::-1][:, [0, 2, 1, 3]]  # the same along x
    flat = np.concatenate([across, along]).reshape(-1, 2)
    first = 4 * np.arange(2 * len(at))[:, None, None]
    faces = (first + np.array([(0, 1, 3), (0, 3, 2)])).reshape(-1, 3)
    return np.column_stack([flat, np.zeros(len(flat))]), faces
