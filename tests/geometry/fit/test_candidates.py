"""Candidate axes: told apart, each with the cone that belongs to it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.geometry.fit.candidates import _cylinders, _same_side, find_axis_candidates
from coneskin.geometry.fit.cone_fit import InfiniteCone

from ..synthetic import frustum, rugby, shoulder
from .axis_cases import hull


@pytest.mark.long
def test_candidates_are_told_apart() -> None:
    for body, cones in ((rugby(), 1), (frustum(0.05, 0.05, 0.3), 1), (shoulder(), 2)):
        found = find_axis_candidates(hull(body, 2000))
        with_cone = [c for c in found if c.cones]
        assert len(with_cone) >= cones
        for one in found:
            twins = [
                two
                for two in found
                if np.linalg.norm(np.cross(one.axis, two.axis)) < 0.002
                and np.linalg.norm(np.cross(one.origin - two.origin, two.axis)) < 0.0002
            ]
            assert twins == [one]
            assert one.axis[np.abs(one.axis).argmax()] > 0.0
            for cone in one.cones:
                tilt = np.linalg.norm(np.cross(cone.axis, one.axis))
                assert tilt < 0.002
                assert cone.axis @ one.axis > 0.0


def test_two_normals_of_a_cylinder_give_its_radius() -> None:
    _, _, radius, _ = _cylinders(hull(frustum(0.05, 0.05, 0.3), 2000), np.random.default_rng(1))
    assert len(radius) > 1000
    assert np.mean(np.abs(radius / 0.05 - 1.0) < 0.1) > 0.9  # the others have a point of an end, or near the border


def test_one_cone_seen_from_two_points_of_its_axis_is_one() -> None:
    axis, ahead = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 0.1])
    cone = InfiniteCone(np.zeros(3), axis, 0.05, math.atan(0.3))
    assert _same_side(cone, InfiniteCone(ahead, axis, 0.08, math.atan(0.3)))
    assert not _same_side(cone, InfiniteCone(ahead, axis, 0.02, math.atan(0.3)))


@pytest.mark.long
def test_the_half_angle_follows_the_direction_of_the_axis() -> None:
    """A cone that narrows along the positive direction keeps a negative half angle, whichever way it was found."""
    for radius in (0.025, 0.03, 0.035, 0.04):
        for ends, sign in (((radius + 0.02, radius), -1.0), ((radius, radius + 0.02), 1.0)):
            cones = [c.cones[0] for c in find_axis_candidates(hull(frustum(*ends, 0.2))) if c.cones]
            assert cones
            angle = math.degrees(cones[0].half_angle)
            assert angle == pytest.approx(sign * math.degrees(math.atan(0.1)), abs=0.01)
