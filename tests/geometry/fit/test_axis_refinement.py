"""Axis refinement: the slices centre an axis that is off."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.geometry.fit.cones import refine_axis
from coneskin.geometry.fit.profile import AxisFrame, measure_profile
from coneskin.geometry.fit.side import fit_side
from coneskin.geometry.mesh import make_mesh
from coneskin.geometry.ray_casting import RayCaster

from ..synthetic import Floats, barrel, frustum, rugby


@pytest.mark.parametrize("body", [rugby(), barrel(), frustum(0.02, 0.12, 0.06)])
def test_slices_centre_an_axis_that_is_off(body: tuple[Floats, Floats]) -> None:
    """Half a degree and half a millimetre are gone in two rounds, on slight cones and steep ones."""
    mesh = make_mesh(*body)
    rays = RayCaster(mesh)
    length = float(mesh.size[2])
    axis = np.array([0.006, -0.006, 1.0])
    frame = AxisFrame.along(np.array([4e-4, -3e-4, 0.5 * length]), axis / np.linalg.norm(axis))
    for _ in range(2):
        profile = measure_profile(mesh, rays, frame, length / 100, 149)
        count = len(profile.z)
        halves = [(3, count // 2), (count // 2, count - 3)]
        sides = [fit_side(profile, a, b, 0, 149, 0.002) for a, b in halves]
        frame = refine_axis(profile, sides, 0.002, np.array([1.0, 0.0, 0.0]))
    assert math.degrees(math.hypot(*frame.axis[:2])) < 0.003
    offset = frame.origin[:2] - frame.origin[2] * frame.axis[:2]
    assert 1e3 * math.hypot(*offset) < 0.003
