"""Frusta on a link: places for numbers and arrays, from (u, phi) and from the paper's (r, theta), and back."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum, double_cone
from coneskin.geometry.pose import Pose

POSE = Pose.from_xyz_rpy((0.1, -0.2, 0.3), (0.3, -0.4, 1.1))
CONE = PlacedFrustum(Frustum(0.04, 0.07, 0.15, math.radians(270.0)), POSE)
NARROWING = PlacedFrustum(Frustum(0.07, 0.04, 0.15, math.radians(270.0)), POSE)
TUBE = PlacedFrustum(Frustum(0.05, 0.05, 0.2), POSE)

shares = st.floats(0.0, 1.0)


@pytest.mark.parametrize("placed", [CONE, NARROWING, TUBE])
@given(a=shares, b=shares)
def test_arrays_give_what_numbers_give(placed: PlacedFrustum, a: float, b: float) -> None:
    u, phi = a * placed.frustum.slant, b * placed.frustum.wrap
    points, normals = placed.place([u, 0.0], [phi, 0.1])
    assert points.shape == normals.shape == (2, 3)
    np.testing.assert_allclose(points[0], placed.point(u, phi), rtol=0, atol=1e-15)  # some roundings of 0.4 m
    np.testing.assert_allclose(normals[0], placed.normal(phi), rtol=0, atol=1e-15)


@pytest.mark.parametrize("placed", [CONE, NARROWING, TUBE])
@given(a=st.floats(0.01, 0.99), b=st.floats(0.01, 0.99), out=st.floats(-0.01, 0.01))
def test_back_from_a_point_beside_the_surface(placed: PlacedFrustum, a: float, b: float, out: float) -> None:
    u, phi = a * placed.frustum.slant, b * placed.frustum.wrap
    point, normal = placed.place(u, phi)
    found = placed.locate_all([[point + out * normal]])
    assert [value.shape for value in found] == [(1, 1)] * 3
    np.testing.assert_allclose(np.ravel(found), [u, phi, out], rtol=0, atol=1e-12)


def test_shapes_broadcast() -> None:
    points, normals = CONE.place(np.linspace(0.0, 0.1, 5)[:, None], np.linspace(0.0, 1.0, 7))
    assert points.shape == normals.shape == (5, 7, 3)
    assert CONE.locate_all(points)[0].shape == (5, 7)


def test_a_side_that_is_turned_has_its_seam_at_that_azimuth() -> None:
    turned = TUBE.turned(0.4)
    assert turned.point(0.03, 0.0) == pytest.approx(TUBE.point(0.03, 0.4), abs=1e-15)
    assert turned.point(0.2, 1.0) == pytest.approx(TUBE.point(0.2, 1.4), abs=1e-15)


def test_double_cone_shares_its_belt() -> None:
    body = Pose.from_xyz_rpy((0.1, 0.2, 0.3), (0.4, -0.5, 0.6))
    first, second = (part.moved(body) for part in double_cone(0.04, 0.07, 0.05, 0.15, 0.12))
    for phi in (0.0, 1.0, 5.0):
        np.testing.assert_allclose(first.point(first.frustum.slant, phi), second.point(0.0, phi), rtol=0, atol=1e-14)
    u, phi, distance = second.locate(second.point(0.05, 2.0))
    assert (u, phi, distance) == (pytest.approx(0.05), pytest.approx(2.0), pytest.approx(0.0, abs=1e-14))
    assert first.frustum.half_angle > 0 > second.frustum.half_angle
