"""Pose: group laws and URDF angles."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.core.errors import GeometryError
from coneskin.geometry.placed_frustum import double_cone
from coneskin.geometry.pose import Pose

angles = st.floats(-math.pi, math.pi)
lengths = st.floats(-2.0, 2.0)
triples = st.tuples(lengths, lengths, lengths)
poses = st.builds(Pose.from_xyz_rpy, triples, st.tuples(angles, angles, angles))
ATOL = 1e-14  # a few products of numbers below 10


@given(poses, poses, triples)
def test_poses_form_a_group(a, b, p):
    np.testing.assert_allclose((a @ b).apply(p), a.apply(b.apply(p)), rtol=0, atol=ATOL)
    np.testing.assert_allclose(a.inverse().apply(a.apply(p)), p, rtol=0, atol=ATOL)
    np.testing.assert_allclose((a @ a.inverse()).rotation, np.eye(3), rtol=0, atol=ATOL)
    assert math.dist(a.apply(p), a.apply((0, 0, 0))) == pytest.approx(math.dist(p, (0, 0, 0)), abs=ATOL)


@given(st.tuples(angles, angles, angles))
def test_rpy_names_the_same_rotation(rpy):
    pose = Pose.from_xyz_rpy(rpy=rpy)
    # within 1e-12 of gimbal lock roll takes what yaw would have: wrong by that much
    np.testing.assert_allclose(Pose.from_xyz_rpy(rpy=pose.rpy).rotation, pose.rotation, rtol=0, atol=3e-12)


def test_rpy_turns_about_fixed_axes_as_in_urdf():
    """URDF: yaw about z comes last. Roll takes y to z; yaw then takes x to y."""
    pose = Pose.from_xyz_rpy(rpy=(math.pi / 2, 0.0, math.pi / 2))
    np.testing.assert_allclose(pose.rotate((0, 1, 0)), (0, 0, 1), atol=ATOL)
    np.testing.assert_allclose(pose.rotate((1, 0, 0)), (0, 1, 0), atol=ATOL)


def test_bad_poses_are_refused():
    with pytest.raises(GeometryError, match="orthonormal and right-handed"):
        Pose(((1.0, 0, 0), (0, 1.0, 0), (0, 0, -1.0)))
    with pytest.raises(GeometryError, match="must be finite"):
        Pose(translation=(math.nan, 0.0, 0.0))
    with pytest.raises(GeometryError, match="3 numbers each"):
        Pose.from_xyz_rpy((0, 0))
    with pytest.raises(GeometryError, match="belt_radius must be above 0 m, got 0"):
        double_cone(0.1, 0, 0.1, 0.1, 0.1)
