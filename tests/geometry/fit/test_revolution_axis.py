"""Axis of revolution: found for any profile, with a housing on one side, and from a first guess."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coneskin.geometry.fit.candidates import _find_revolution_axis
from coneskin.geometry.pose import Pose

from ..synthetic import TILTED, Floats, Indices, barrel, joined, moved, noisy, revolve, rugby
from .axis_cases import AXIS, BASE, hull, off


@pytest.mark.parametrize(
    ("body", "tilt", "shift"),
    [
        # design note: 0.015 to 0.03 deg and 0.04 to 0.08 mm on such bodies
        (rugby(), 0.01, 0.08),
        (barrel(), 0.05, 0.15),
        (revolve([(0.0, 0.04), (0.1, 0.07), (0.13, 0.05), (0.3, 0.045)], rings=12), 0.01, 0.08),
    ],
)
@pytest.mark.long
def test_the_revolution_axis_needs_no_profile(body: tuple[Floats, Indices], tilt: float, shift: float) -> None:
    line = _find_revolution_axis(hull(body, 48_000))  # on flat facets 6000 leave up to 0.25 mm, by where they lie
    assert line is not None
    found = off(*line)
    assert found[0] < tilt
    assert found[1] < shift


def test_the_revolution_axis_bears_a_housing() -> None:
    """A lump on one side, a tenth of the hull, has normals that miss the axis."""
    lump = moved(
        revolve([(-0.02, 0.03), (0.02, 0.03)], segments=4), Pose.from_xyz_rpy((0.06, 0.02, 0.2), (0.3, 0.2, 0.1))
    )
    line = _find_revolution_axis(hull(joined(rugby(), lump)))
    assert line is not None
    tilt, shift = off(*line)
    assert tilt < 0.02
    assert shift < 0.25


def test_one_point_has_no_axis() -> None:
    """What is left of a mesh most of whose faces hide each other: a polygon of 50 000 corners over a tube."""
    tube = hull(rugby())
    assert _find_revolution_axis(replace(tube, points=np.broadcast_to(tube.points[:1], tube.points.shape))) is None


def test_the_revolution_axis_from_a_start() -> None:
    points = hull(noisy(rugby(), 5e-5))
    far = AXIS + 0.1 * np.array(TILTED.rotation)[:, 0]
    line = _find_revolution_axis(points, (BASE + 0.01, far / np.linalg.norm(far)))
    assert line is not None
    assert off(*line)[0] < 0.15  # by the noise of the normals, however many samples there are
