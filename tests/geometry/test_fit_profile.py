"""R(z, phi) of bodies whose profile is known, and the closing that bridges holes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from coneskin.geometry.fit_profile import AxisFrame, bridge_holes, outer_profile
from coneskin.geometry.pose import Pose
from coneskin.geometry.rays import Rays

from .synthetic import TILTED, Floats, frustum, holed, joined, moved, placed, revolve

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
    profile = outer_profile(mesh, Rays(mesh), AxisFrame.along(BASE, AXIS), 0.005, 37)
    assert len(profile.z) == 50
    assert profile.step == pytest.approx(0.005, abs=1e-6)
    assert profile.z[0] == pytest.approx(0.5 * profile.step, abs=1e-6)
    true = 0.05 - 0.08 * profile.z
    # 256 flats lie at most 50 mm (1 - cos(pi / 256)) = 3.8 um inside
    assert (profile.radius <= true[:, None] + 1e-9).all()
    assert (profile.radius >= true[:, None] - 4e-6).all()
    high, low = profile.bounds()
    assert (high >= low - 4e-6).all()


def test_the_outermost_body_counts_and_nothing_is_zero() -> None:
    inner, outer = frustum(0.02, 0.02, 0.2), moved(frustum(0.05, 0.05, 0.1), Pose(translation=(0.0, 0.0, 0.05)))
    far = moved(revolve([(0.0, 0.01), (0.05, 0.01)]), Pose(translation=(0.2, 0.0, 0.25)))
    mesh = placed(joined(inner, outer, far))
    profile = outer_profile(mesh, Rays(mesh), AxisFrame.along(BASE, AXIS, np.array(TILTED.rotation)[:, 0]), 0.01, 36)
    middle = profile.radius.mean(axis=1)
    assert middle[2] == pytest.approx(0.02, abs=1e-4)
    assert middle[10] == pytest.approx(0.05, abs=1e-4)
    row = profile.radius[27]  # at 0.275 there is only the far body, on one side
    assert row[0] == pytest.approx(0.21, abs=1e-4)
    assert (row[9:28] == 0.0).all()


def test_bolt_holes_are_bridged_and_wide_pits_are_not() -> None:
    for width, spanned in ((0.006, True), (0.020, False)):
        mesh = placed(holed(width=width))
        profile = outer_profile(mesh, Rays(mesh), AxisFrame.along(BASE, AXIS), 0.0015, 149, bridge=0.010)
        assert profile.radius.min() < 0.0445
        assert (profile.bridged.min() > 0.0499) == spanned


def by_definition(height: Floats, tall: int, wide: int, around: bool) -> Floats:
    """Closing: the lowest of the tops of all windows that hold the cell."""
    rows, columns = height.shape

    def cell(i: int, j: int) -> float:
        if not 0 <= i < rows or (not around and not 0 <= j < columns):
            return 0.0
        return float(height[i, j % columns])

    closed = np.empty_like(height)
    for i in range(rows):
        for j in range(columns):
            closed[i, j] = min(
                max(cell(a + k, b + m) for k in range(tall) for m in range(wide))
                for a in range(i - tall + 1, i + 1)
                for b in range(j - wide + 1, j + 1)
            )
    return closed


@settings(deadline=None, derandomize=True, max_examples=40)
@given(arrays(float, (6, 8), elements=st.floats(0.0, 1.0, width=16)), st.booleans())
def test_bridging_is_a_closing(height: Floats, around: bool) -> None:
    # a bridge of 3 rows and 3 columns of 1 m
    np.testing.assert_array_equal(bridge_holes(height, 1.0, 1.0, 2.0, around), by_definition(height, 3, 3, around))


def test_a_bridge_shorter_than_a_step_changes_nothing() -> None:
    height = np.random.default_rng(1).random((5, 6))
    np.testing.assert_array_equal(bridge_holes(height, 0.01, 0.01, 0.005), height)
    assert math.isclose(bridge_holes(height, 0.01, 0.01, 0.03).min(), height.min(), rel_tol=10.0)
