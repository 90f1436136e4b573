"""A search that has plans goes on: with others in their places, and with better axes near theirs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.geometry.fit.axis_plan import SheetRequirements
from coneskin.geometry.fit.candidates import AxisCandidate
from coneskin.geometry.fit.coarse_packing import survey_axes
from coneskin.geometry.fit.cones import FineStage
from coneskin.geometry.fit.profile import axes_apart
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.pose import Pose

from ..synthetic import barrel, joined, moved, placed, revolve
from .shared_fits import cones, sampled

Vector = tuple[float, float, float]
Pair = tuple[Vector, Vector]
WAYS = st.tuples(*(st.floats(-1.0, 1.0) for _ in range(3))).filter(lambda way: math.hypot(*way) > 0.1)


def stage(mesh: Mesh, axis: AxisCandidate) -> FineStage:
    """Return a search for one sheet that knows one axis only."""
    link, wanted = sampled(mesh), SheetRequirements(max_sheets=1)
    return FineStage(link, survey_axes(replace(link, axes=[axis]), wanted), wanted)


@given(st.tuples(WAYS, WAYS), st.tuples(WAYS, WAYS))
def test_axes_are_as_far_apart_as_cross_products_say(places: Pair, ways: Pair) -> None:
    (one, two), (a, b) = np.array(places), (np.array(way) / math.hypot(*way) for way in ways)
    tilt, shift = axes_apart((one, a), (two, b))
    assert tilt == pytest.approx(np.linalg.norm(np.cross(a, b)), abs=1e-7)
    assert shift == pytest.approx(np.linalg.norm(np.cross(one - two, b)), abs=1e-7)


def test_a_small_sheet_gives_way_to_the_large_one() -> None:
    """From the plan of the short tube alone, the search comes to that of the long one, about another axis."""
    short = moved(revolve([(0.0, 0.05), (0.1, 0.05)]), Pose.from_xyz_rpy((0.0, 0.0, 0.1), (0.0, math.pi / 2.0, 0.0)))
    mesh = placed(joined(revolve([(-0.2, 0.04), (0.2, 0.04)]), short), Pose())
    along = AxisCandidate(np.array([0.0, 0.0, 0.1]), np.array([1.0, 0.0, 0.0]), ())
    search = stage(mesh, along)
    small = search.completed(())
    assert len(small) == 1
    assert abs(small[0].profile.frame.axis[0]) > 0.99
    large = search.improved(small)
    assert abs(large[0].profile.frame.axis[2]) > 0.99
    assert search.worth(large) > 2.0 * search.worth(small)


def test_an_axis_beside_the_best_one_is_made_better() -> None:
    """On a barrel a sheet about an axis 1.2 mm and 0.3 deg off is shorter; the best one is found from there."""
    mesh = placed(barrel(bulge=0.004), Pose())
    best = cones(mesh, max_sheets=1).sheets[0].frustum.area
    tilted = np.array([math.sin(0.005), 0.0, math.cos(0.005)])
    search = stage(mesh, AxisCandidate(np.array([0.0012, 0.0, 0.0]), tilted, ()))
    here = search.completed(())
    better = search._polished(here)
    assert search.worth(here) < 0.9 * best
    assert search.worth(better) > 0.97 * best
