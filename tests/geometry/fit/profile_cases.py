"""Profiles of known slices."""

from __future__ import annotations

import math

import numpy as np

from coneskin.geometry.fit.profile import AxisFrame, RadialProfile

from ..synthetic import Floats

Z = np.array([0.0, 0.0, 1.0])
FRAME = AxisFrame.along(np.zeros(3), Z)


def profile_of(radius: Floats, around: int = 31) -> RadialProfile:
    """A profile whose slices are 1 mm apart and round."""
    grid = np.repeat(radius[:, None], around, axis=1)
    z = np.asarray(0.001 * np.arange(len(radius)), float)
    return RadialProfile(FRAME, z, np.linspace(0.0, 2.0 * math.pi, around, endpoint=False), grid, grid.copy())
