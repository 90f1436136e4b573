"""Coverage notes: convex hulls are recognised, bare lengths have a reason."""

from __future__ import annotations

import numpy as np
import pytest

from coneskin.geometry.fit.axis_plan import AxisPlan
from coneskin.geometry.fit.bare_areas import bare_lengths, hull_note
from coneskin.geometry.fit.cones import find_cones
from coneskin.geometry.fit.side import StraightSide
from coneskin.geometry.fit.surface_samples import sample_surface
from coneskin.geometry.mesh import make_mesh
from coneskin.geometry.ray_casting import RayCaster

from ..synthetic import Floats, Indices, flipped, frustum, joined, revolve
from .profile_cases import profile_of


def note(body: tuple[Floats, Indices]) -> str:
    mesh = make_mesh(*body)
    return hull_note(mesh, sample_surface(mesh, RayCaster(mesh)))


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_convex_hull_is_recognised(share: float) -> None:
    box = flipped(revolve([(0.0, 0.05), (0.3, 0.05)], segments=4), share)
    assert "100 % of the surface lies on the convex hull" in note(box)
    assert note(revolve([(0.0, 0.06), (0.15, 0.04), (0.3, 0.06)])) == ""
    # the walls between two boxes are inside of their hull
    assert note(joined(box, (box[0] + [0.3, 0.0, 0.0], box[1]))) == ""
    assert note(frustum(0.05, 0.05, 0.3, rings=30)) == ""  # convex, but too fine for a collision body


def test_what_stays_bare_is_said() -> None:
    profile = profile_of(np.full(100, 0.05))
    profile.radius[60:80, :5] = 0.08  # a housing on one side
    profile.radius[90:, :9] = 0.0  # open at the end
    profile.bridged[:] = profile.radius
    side = StraightSide(10, 50, 0, 31, 0.05, 0.0)
    told = bare_lengths(profile, [side], 0.001, 0.025)
    assert [(round(a * 1e3, 1), round(b * 1e3, 1)) for a, b, _ in told] == [(-10.5, -0.5), (39.5, 89.5)]
    assert "round, but shorter than 25 mm" in told[0][2]
    ((_, _, opened),) = bare_lengths(profile, [StraightSide(0, 90, 0, 31, 0.05, 0.0)], 0.001, 0.025)
    assert opened == "open: no surface on one side of the axis"
    assert (
        "not round: the radius varies by 30.0 mm"
        in bare_lengths(profile, [StraightSide(10, 60, 0, 31, 0.05, 0)], 1e-3, 0.025)[1][2]
    )


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ((62, 98), "round, and straight over 40 mm, but no further sheet was allowed: raise the number of sheets"),
        ((90, 100), "round, and straight over 40 mm, but a sheet there would cover too little"),
        (None, "round, and straight over 40 mm, but a sheet there would cover too little"),
    ],
)
def test_a_straight_side_is_blamed_on_the_number_only_where_a_sheet_more_lies_there(
    rows: tuple[int, int] | None, words: str
) -> None:
    profile = profile_of(np.full(100, 0.05))
    further = None if rows is None else AxisPlan(profile, [StraightSide(*rows, 0, 31, 0.05, 0.0)])
    ((_, _, told),) = bare_lengths(profile, [StraightSide(0, 60, 0, 31, 0.05, 0.0)], 0.001, 0.025, further)
    assert words in told


def test_a_side_that_curves_is_said_to_curve() -> None:
    z = np.arange(100)
    profile = profile_of(np.where(z < 60, 0.05, 0.05 + 3e-5 * (z - 60) ** 2))
    ((_, _, told),) = bare_lengths(profile, [StraightSide(0, 61, 0, 31, 0.05, 0.0)], 1e-5, 0.025)
    assert told == "round, but it curves away from a straight side"


@pytest.mark.long
def test_a_third_part_is_bare_because_two_sheets_were_allowed() -> None:
    body = make_mesh(*revolve([(0.0, 0.03), (0.1, 0.05), (0.2, 0.03), (0.3, 0.05)], segments=96))
    fit = find_cones(body, max_sheets=2)
    assert len(fit.sheets) == 2
    assert ["no further sheet was allowed" in item.reason for item in fit.bare] == [True]
    assert len(find_cones(body, max_sheets=3).sheets) == 3, "the advice works"
