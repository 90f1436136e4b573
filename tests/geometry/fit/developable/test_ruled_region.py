"""Regions of straight columns on profiles of known sections, and the point in which known rulings meet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coneskin.geometry.fit.developable.ruling_candidates import _common_point, _ruled_region

from ..profile_cases import profile_of


def test_a_slot_that_a_sheet_spans_is_no_slope_of_the_section() -> None:
    """Where no ray meets the link a radius is 0, and the slopes beside it were infinite."""
    tube = profile_of(np.full(60, 0.05), around=60)
    radius = tube.radius.copy()
    radius[:, 7] = 0.0
    with np.errstate(all="raise"):
        region = _ruled_region(replace(tube, radius=radius), np.ones(60), 0.001, 25, np.full(60, 0.004), 25)
    assert region is not None
    assert (region.first, region.end, region.columns) == (0, 60, 60)


@pytest.mark.parametrize(("away", "found"), [(2.0, True), (20.0, False)])
def test_rulings_meet_in_the_apex_of_a_taper_unless_it_is_hardly_one(away: float, found: bool) -> None:
    """Of a link of 0.2 m and a radius of 50 mm: from one end to the other it loses 5 mm of it, or half a millimetre."""
    z, phi = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.1, 0.1, 8), np.arange(60) * np.pi / 30.0))
    radius, slope = 0.05 * (1.0 - z / away), np.full(len(z), 0.05 / away)
    points = np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=1)
    normals = np.stack([np.cos(phi), np.sin(phi), slope], axis=1) / np.hypot(1.0, slope)[:, None]
    apex = _common_point(points, normals, 0.2, np.array([0.0, 0.0, 1.0]))
    assert (apex is not None) is found
    assert apex is None or apex == pytest.approx([0.0, 0.0, away], abs=1e-9)
