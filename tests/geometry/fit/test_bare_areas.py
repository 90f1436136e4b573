"""What stays bare has its true reason: a sheet too few, a flat end, no room, or a curve in two ways."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ..synthetic import frustum, placed, revolve, shoulder
from .shared_fits import cones


def shares(fit) -> dict[str, float]:  # type: ignore[no-untyped-def]
    return {area.reason: area.share for area in fit.bare_areas}


@pytest.mark.long
def test_a_sheet_too_few_is_told_and_what_it_would_cover() -> None:
    told = shares(cones(placed(shoulder()), max_sheets=1))
    two = cones(placed(shoulder()), max_sheets=2)
    assert told["a sheet more would cover it: max_sheets = 2, which takes 8 wires"] == pytest.approx(
        two.sheets[1].area_share, abs=0.02
    )
    assert not any("sheet more" in area.reason for area in two.bare_areas)


@pytest.mark.long
def test_the_ends_of_a_tube_are_flat() -> None:
    fit = cones(placed(frustum(0.05, 0.05, 0.2)))
    assert shares(fit) == {"flat": pytest.approx(0.1 / 0.5, abs=0.02)}  # 2 r^2 of 2 r h + 2 r^2
    (area,) = fit.bare_areas
    ends = (area.points - np.array(fit.sheets[0].placed.link_frustum.translation)) @ np.array(
        fit.sheets[0].placed.link_frustum.rotation
    )[:, 2]
    assert ((np.abs(ends) < 1e-3) | (np.abs(ends - 0.2) < 2e-3)).all()


@pytest.mark.long
def test_a_dome_is_curved_in_two_ways_and_a_short_ring_has_no_room() -> None:
    dome = [(0.06 + 0.04 * math.sin(t), 0.04 * math.cos(t)) for t in np.linspace(0.1, 1.4, 20)]
    told = shares(cones(placed(revolve([(0.0, 0.04), (0.06, 0.04), *dome])), max_sheets=1))
    assert told["curved in two ways, or in a corner"] > 0.15
    ring = [(0.0, 0.05), (0.1, 0.05), (0.1001, 0.03), (0.115, 0.03), (0.1151, 0.05), (0.2151, 0.05)]
    told = shares(cones(placed(revolve(ring, rings=6)), max_sheets=3))
    assert told["round, but without room for a sheet 25 mm long and 150 deg wide"] == pytest.approx(0.03, abs=0.012)
