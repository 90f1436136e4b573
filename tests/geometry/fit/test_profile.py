"""R(z, phi) of bodies whose profile is known, and the closing that bridges holes."""

from __future__ import annotations

import numpy as np
import pytest

from coneskin.geometry.fit.profile import AxisFrame, measure_profile
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster

from ..synthetic import TILTED, frustum, holed, joined, moved, placed, revolve

AXIS = np.array(TILTED.rotation)[:, 2]
BASE = np.array(TILTED.translation)


def test_frame_looks_to_the_seam() -> None:
    frame = AxisFrame.along(BASE, AXIS, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(frame.columns.T @ frame.columns, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame.columns) == pytest.approx(1.0)
    assert frame.columns[1, 0] > 0.0
    assert frame.local(BASE[None] + 0.2 * AXIS)[0] == pytest.approx([0.0, 0.0, 0.2])
    parallel = AxisFrame.along(BASE, AXIS, AXIS)  # no such seam: any other direction will do
    assert abs(parallel.columns[:, 0] @ AXIS) < 1e-12


def test_profile_of_a_cone() -> None:
    mesh = placed(frustum(0.05, 0.03, 0.25, segments=256))
    profile = measure_profile(mesh, RayCaster(mesh), AxisFrame.along(BASE, AXIS), 0.005, 37)
    assert len(profile.z) == 50
    assert profile.step == pytest.approx(0.005, abs=1e-6)
    assert profile.z[0] == pytest.approx(0.5 * profile.step, abs=1e-6)
    true = 0.05 - 0.08 * profile.z
    # 256 flats lie at most 50 mm (1 - cos(pi / 256)) = 3.8 um inside
    assert (profile.radius <= true[:, None] + 1e-9).all()
    assert (profile.radius >= true[:, None] - 4e-6).all()
    high, low = profile.bounds(0.001)
    assert (high >= low - 4e-6).all()


def test_the_outermost_body_counts_and_nothing_is_zero() -> None:
    inner, outer = frustum(0.02, 0.02, 0.2), moved(frustum(0.05, 0.05, 0.1), Pose(translation=(0.0, 0.0, 0.05)))
    far = moved(revolve([(0.0, 0.01), (0.05, 0.01)]), Pose(translation=(0.2, 0.0, 0.25)))
    mesh = placed(joined(inner, outer, far))
    profile = measure_profile(
        mesh, RayCaster(mesh), AxisFrame.along(BASE, AXIS, np.array(TILTED.rotation)[:, 0]), 0.01, 36
    )
    middle = profile.radius.mean(axis=1)
    assert middle[2] == pytest.approx(0.02, abs=1e-4)
    assert middle[10] == pytest.approx(0.05, abs=1e-4)
    row = profile.radius[27]  # at 0.275 there is only the far body, on one side
    assert row[0] == pytest.approx(0.21, abs=1e-4)
    assert (row[9:28] == 0.0).all()


def test_bolt_holes_are_bridged_and_wide_pits_are_not() -> None:
    for width, spanned in ((0.006, True), (0.020, False)):
        mesh = placed(holed(width=width))
        profile = measure_profile(mesh, RayCaster(mesh), AxisFrame.along(BASE, AXIS), 0.0015, 149, max_bridge=0.010)
        assert profile.radius.min() < 0.0445
        assert (profile.bridged.min() > 0.0499) == spanned


def test_the_extent_of_points_about_an_axis_is_that_of_their_places_in_its_frame() -> None:
    """Two points of a helix of radius 30 mm about an oblique axis, and one on the axis."""
    axis = np.array([2.0, 3.0, 6.0]) / 7.0
    frame = AxisFrame.along(np.array([0.1, -0.2, 0.3]), axis)
    first, second = frame.columns[:, 0], frame.columns[:, 1]
    places = [frame.origin - 0.05 * axis + 0.03 * first, frame.origin + 0.4 * axis - 0.03 * second]
    low, high, reach = frame.extent(np.array([*places, frame.origin]))
    assert (low, high, reach) == pytest.approx((-0.05, 0.4, 0.03), abs=1e-12)
