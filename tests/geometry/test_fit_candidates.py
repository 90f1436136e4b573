"""Starts and candidate axes: every body of revolution offers its own."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.geometry.fit_candidates import find_candidates
from coneskin.geometry.fit_revolution import revolution_axis
from coneskin.geometry.fit_samples import Samples, surface_samples
from coneskin.geometry.fit_starts import cone_starts
from coneskin.geometry.pose import Pose
from coneskin.geometry.rays import Rays

from .synthetic import TILTED, Floats, Indices, barrel, frustum, joined, moved, noisy, placed, revolve, rugby, shoulder

AXIS = np.array(TILTED.rotation)[:, 2]
BASE = np.array(TILTED.translation)


def hull(body: tuple[Floats, Indices]) -> Samples:
    mesh = placed(body)
    return surface_samples(mesh, Rays(mesh))


def off(origin: Floats, axis: Floats) -> tuple[float, float]:
    """Angle to the true axis [deg] and distance from it [mm]."""
    gap = origin - BASE
    tilt = math.degrees(math.asin(min(1.0, float(np.linalg.norm(np.cross(axis, AXIS))))))
    return tilt, 1e3 * float(np.linalg.norm(gap - (gap @ AXIS) * AXIS))


@pytest.mark.parametrize("half_angle", [0.0, 3.0, 12.0, 30.0, 60.0])
def test_a_start_lies_near_the_cone(half_angle: float) -> None:
    height = 0.1 if half_angle < 40 else 0.05
    body = frustum(0.04, 0.04 + height * math.tan(math.radians(half_angle)), height)
    starts = cone_starts(hull(body), 0.002)
    tilt, shift = off(starts[0].origin, starts[0].axis)
    assert tilt < 6.0
    assert shift < 6.0
    sign = 1.0 if starts[0].axis @ AXIS > 0.0 else -1.0
    assert math.degrees(starts[0].half_angle) * sign == pytest.approx(half_angle, abs=6.0)


def test_crossing_cylinders_give_both_axes() -> None:
    starts = cone_starts(hull(shoulder()), 0.002)
    along = [abs(float(start.axis @ np.array(TILTED.rotation)[:, k])) for start in starts[:2] for k in (2, 0)]
    assert along[0] > 0.99
    assert along[3] > 0.99


def test_a_handful_of_points_gives_nothing() -> None:
    few = hull(rugby())
    assert cone_starts(few.only(np.arange(len(few)) < 20), 0.002) == []


@pytest.mark.parametrize(
    ("body", "tilt", "shift"),
    [
        # design note: 0.015 to 0.03 deg and 0.04 to 0.08 mm on such bodies
        (rugby(), 0.01, 0.08),
        (barrel(), 0.05, 0.15),
        (revolve([(0.0, 0.04), (0.1, 0.07), (0.13, 0.05), (0.3, 0.045)], rings=12), 0.01, 0.08),
    ],
)
def test_the_revolution_axis_needs_no_profile(body: tuple[Floats, Indices], tilt: float, shift: float) -> None:
    line = revolution_axis(hull(body))
    assert line is not None
    found = off(*line)
    assert found[0] < tilt
    assert found[1] < shift


def test_the_revolution_axis_bears_a_housing() -> None:
    """A lump on one side, a tenth of the hull, has normals that miss the axis."""
    lump = moved(
        revolve([(-0.02, 0.03), (0.02, 0.03)], segments=4), Pose.from_xyz_rpy((0.06, 0.02, 0.2), (0.3, 0.2, 0.1))
    )
    line = revolution_axis(hull(joined(rugby(), lump)))
    assert line is not None
    tilt, shift = off(*line)
    assert tilt < 0.02
    assert shift < 0.25


def test_the_revolution_axis_from_a_start() -> None:
    points = hull(noisy(rugby(), 5e-5))
    far = AXIS + 0.1 * np.array(TILTED.rotation)[:, 0]
    line = revolution_axis(points, (BASE + 0.01, far / np.linalg.norm(far)))
    assert line is not None
    assert off(*line)[0] < 0.1


def test_candidates_are_told_apart() -> None:
    for body, cones in ((rugby(), 1), (frustum(0.05, 0.05, 0.3), 1), (shoulder(), 2)):
        found = find_candidates(hull(body), 0.001)
        with_cone = [c for c in found if c.cone is not None]
        assert len(with_cone) >= cones
        for one in found:
            twins = [
                two
                for two in found
                if np.linalg.norm(np.cross(one.axis, two.axis)) < 0.002
                and np.linalg.norm(np.cross(one.origin - two.origin, two.axis)) < 0.0002
                and (one.cone is None) == (two.cone is None)
                and (one.cone is None or two.cone is None or abs(one.cone.radius - two.cone.radius) < 0.002)
            ]
            assert twins == [one]
            assert one.axis[np.abs(one.axis).argmax()] > 0.0
            if one.cone is not None:
                np.testing.assert_array_equal(one.cone.axis, one.axis)


def test_the_half_angle_follows_the_direction_of_the_axis() -> None:
    """A cone that narrows along the positive direction keeps a negative half angle, whichever way it was found."""
    for radius in (0.025, 0.03, 0.035, 0.04):
        for ends, sign in (((radius + 0.02, radius), -1.0), ((radius, radius + 0.02), 1.0)):
            cones = [c.cone for c in find_candidates(hull(frustum(*ends, 0.2)), 0.001) if c.cone is not None]
            assert cones
            angle = math.degrees(cones[0].half_angle)
            assert angle == pytest.approx(sign * math.degrees(math.atan(0.1)), abs=0.01)
