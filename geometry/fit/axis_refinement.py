"""Refinement of an axis by the centres of the slices, which do not depend on the normals of the mesh."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .profile import AxisFrame, RadialProfile
from .side import StraightSide

__all__ = ["refine_axis"]

Floats = NDArray[np.float64]


def refine_axis(profile: RadialProfile, sides: list[StraightSide], tolerance: float, seam: Floats) -> AxisFrame:
    """Shift and tilt an axis so that the slices under full wraps are centred on it.

    A shift s and a tilt t of the axis appear in the slice at height z as (s + t (z + r dr/dz)) cos(phi), the first
    harmonic of R(z, phi), for any profile.

    Args:
        profile: the hull about the axis so far.
        sides: full wraps about it; only their slices count.
        tolerance: cells further than twice this from the median of their slice, such as holes, are left out [m].
        seam: direction of azimuth 0.

    Returns:
        the refined axis; the given one where the correction exceeds 0.2 rad or is not finite.
    """
    heights, levers, harmonics = [], [], []
    for side in sides:
        z = profile.z[side.first : side.end]
        radius = profile.radius[side.first : side.end]
        middle = np.median(radius, axis=1, keepdims=True)
        radius = np.where(np.abs(radius - middle) <= 2.0 * tolerance, radius, middle)
        waves = np.stack([np.cos(profile.phi), np.sin(profile.phi)], axis=1)
        harmonics.append(radius @ waves * (2.0 / len(profile.phi)))
        levers.append(z + middle[:, 0] * side.slope)
        heights.append(z)
    lever, harmonic = np.concatenate(levers), np.concatenate(harmonics)
    weights = np.ones(len(lever))
    solution = np.zeros((2, 2))
    for _ in range(10):
        total = float(weights.sum())
        lm = float(weights @ lever) / total
        hm = weights @ harmonic / total
        spread = float(weights @ (lever - lm) ** 2)
        if spread <= 0.0:
            return profile.frame
        tilt = (weights * (lever - lm)) @ (harmonic - hm) / spread
        solution = np.stack([hm - tilt * lm, tilt])
        miss = np.linalg.norm(harmonic - solution[0] - lever[:, None] * solution[1], axis=1)
        scale = max(4.0 * float(np.median(miss)), 1e-3 * tolerance)
        weights = np.where(miss < scale, (1.0 - (miss / scale) ** 2) ** 2, 0.0)
    shift, tilt = solution
    if not np.isfinite(solution).all() or math.hypot(*tilt) > 0.2:
        return profile.frame
    columns = profile.frame.columns
    axis = columns[:, 2] + columns[:, :2] @ tilt
    origin = profile.frame.origin + columns[:, :2] @ shift
    return AxisFrame.along(origin, axis / np.linalg.norm(axis), seam)
