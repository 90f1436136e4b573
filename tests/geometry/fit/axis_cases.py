"""Samples of bodies about a known axis, and the error of an axis found."""

from __future__ import annotations

import math

import numpy as np

from coneskin.geometry.fit.surface_samples import SurfaceSamples, sample_surface
from coneskin.geometry.ray_casting import RayCaster

from ..synthetic import TILTED, Floats, Indices, placed

AXIS = np.array(TILTED.rotation)[:, 2]
BASE = np.array(TILTED.translation)


def hull(body: tuple[Floats, Indices], count: int = 6000) -> SurfaceSamples:
    mesh = placed(body)
    return sample_surface(mesh, RayCaster(mesh), count)


def off(origin: Floats, axis: Floats) -> tuple[float, float]:
    """Angle to the true axis [deg] and distance from it [mm]."""
    gap = origin - BASE
    tilt = math.degrees(math.asin(min(1.0, float(np.linalg.norm(np.cross(axis, AXIS))))))
    return tilt, 1e3 * float(np.linalg.norm(gap - (gap @ AXIS) * AXIS))
