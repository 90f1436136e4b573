"""Pose: group laws, URDF angles, rotation vectors."""

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


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(0.0, math.pi))
def test_a_rotation_vector_survives_its_matrix(axis, angle):
    length = math.hypot(*axis)
    if length < 1e-3:
        return
    x, y, z = (angle * part / length for part in axis)
    matrix = Pose.from_rotation_vector((x, y, z)).rotation
    again = Pose.from_rotation_vector(Pose(matrix).rotation_vector).rotation
    # near a half turn the axis is known to the square root of rounding at worst, its matrix to rounding
    for row, other in zip(matrix, again, strict=True):
        assert row == pytest.approx(other, abs=1e-11)


@pytest.mark.parametrize("angle", [0.0, 1e-13, 1e-9, 1e-5, 1.0, math.pi - 1e-5, math.pi - 1e-9])
def test_small_and_almost_half_turns(angle):
    vector = (angle / math.sqrt(3.0),) * 3
    # 1e-8: the sine of a turn that is 1e-9 short of a half one has eight digits less than the angle
    assert Pose.from_rotation_vector(vector).rotation_vector == pytest.approx(vector, abs=1e-8)


@pytest.mark.parametrize("short", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("axis", [(0.3, -0.5, 0.8), (-0.9, 0.1, 0.2), (0.1, -0.9, -0.3)])
def test_the_axis_is_not_lost_near_a_half_turn(axis, short):
    angle = (math.pi - short) / math.hypot(*axis)
    matrix = Pose.from_rotation_vector((angle * axis[0], angle * axis[1], angle * axis[2])).rotation
    for row, other in zip(matrix, Pose.from_rotation_vector(Pose(matrix).rotation_vector).rotation, strict=True):
        assert row == pytest.approx(other, abs=1e-14)  # from the sine alone it would be off by 1e-16 / short


def test_a_quarter_turn_about_z_is_what_it_is_called():
    assert Pose.from_rotation_vector((0.0, 0.0, math.pi / 2)).rotation[1] == pytest.approx((1.0, 0.0, 0.0))
