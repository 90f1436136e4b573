"""Axis of a surface of revolution of any profile: the line that all of its normals meet.

A line is given by its direction a and moment m = o x a (Pluecker coordinates). The normal line through p along n meets
it if n . m + (p x n) . a = 0, linear in (a, m): the axis is the smallest eigenvector of a 6 x 6 form. Flat ends agree
with it, so they need not be separated from the side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .surface_samples import SurfaceSamples

__all__ = ["find_revolution_axis"]

Floats = NDArray[np.float64]

_ROUNDS = 30  # reweighted solutions


def find_revolution_axis(
    samples: SurfaceSamples, start: tuple[Floats, Floats] | None = None, spread: float = 0.0005
) -> tuple[Floats, Floats] | None:
    """Find the axis that most normals meet.

    Args:
        samples: points and normals of the hull.
        start: origin [m] and direction near the axis; None to begin with equal weights of all normals.
        spread: distance of a normal line from the axis at which its final weight is a quarter [m]. The first round uses
            a hundred times that.

    Returns:
        origin [m], in the middle of the points, and unit direction; None where the normals have no common line (a
        plane, a box).
    """
    middle = samples.points.mean(axis=0)
    size = float(np.ptp(samples.points, axis=0).max())
    if size == 0.0:  # one point is all that is seen of it
        return None
    p, n = (samples.points - middle) / size, samples.normals
    rows = np.concatenate([np.cross(p, n), n], axis=1)
    if start is None:
        axis, moment = _smallest(rows, np.ones(len(rows)))
    else:
        axis, moment = start[1], np.cross((start[0] - middle) / size, start[1])
    for turn in range(_ROUNDS):
        lever = np.maximum(np.linalg.norm(np.cross(n, axis), axis=1), 0.05)
        miss = (rows @ np.concatenate([axis, moment])) / lever
        scale = max(spread, 100.0 * spread * 0.7**turn) / size
        axis, moment = _smallest(rows, 1.0 / (1.0 + (miss / scale) ** 2) ** 2 / lever**2)
    if not (np.isfinite(axis).all() and np.isfinite(moment).all()):
        return None
    origin = np.cross(axis, moment)
    if np.linalg.norm(origin) > 1.0:  # a line this far away is not an axis of this link
        return None
    return middle + size * origin, axis


def _smallest(rows: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Return the unit direction and moment of the line with the least weighted distance from the normals."""
    form = (rows * weights[:, None]).T @ rows
    aa, am, mm = form[:3, :3], form[:3, 3:], form[3:, 3:]
    solved = np.linalg.solve(mm + 1e-9 * np.trace(mm) * np.eye(3), am.T)
    axis = np.linalg.eigh(aa - am @ solved)[1][:, 0]
    moment = -solved @ axis
    return np.asarray(axis), np.asarray(moment - (moment @ axis) * axis)
