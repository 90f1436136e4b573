"""Regions of straight columns on profiles of known sections."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coneskin.geometry.fit.developable.ruling_candidates import _ruled_region

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
