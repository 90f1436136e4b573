"""Place of the seam: behind what stands out from the link; anywhere where nothing does, and always the same."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from coneskin.geometry.bend import Bend
from coneskin.geometry.developable import Developable
from coneskin.geometry.fit.axis_plan import FittedSheet
from coneskin.geometry.fit.cones import LinkFit
from coneskin.geometry.fit.seam_place import place_seams
from coneskin.geometry.fit.touch_weights import TouchWeights
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.pose import Pose
from tests.support.ruled_tube import RuledTube, stadium_section

from ..synthetic import TILTED, frustum, joined, placed
from .shared_fits import cones


def tube_with_wing(azimuth: float | None) -> Mesh:
    """A tube of 50 mm, 0.2 m long, and beyond its end a block that stands out far at an azimuth."""
    corners, faces = frustum(0.05, 0.05, 0.2)
    if azimuth is None:
        return placed((corners, faces))
    low, high = np.array([0.0, -0.07, -0.10]), np.array([0.20, 0.07, -0.002])
    box = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    flat = np.array([face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))])
    c, s = math.cos(azimuth), math.sin(azimuth)
    return placed(joined((corners, faces), (box @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), flat)))


def fitted(mesh: Mesh) -> LinkFit:
    return cones(mesh, max_sheets=1, wrap=2 * math.pi)


@pytest.mark.long
def test_the_seam_lies_behind_what_stands_out() -> None:
    azimuth = 3.0
    mesh = tube_with_wing(azimuth)
    before = fitted(mesh)
    after, (reason,) = place_seams(before, mesh)
    placed_sheet = after.sheets[0].placed
    wing = TILTED.rotate((math.cos(azimuth), math.sin(azimuth), 0.0))
    cosine = sum(a * b for a, b in zip(wing, placed_sheet.link_frustum.rotate((1.0, 0.0, 0.0)), strict=True))
    assert math.degrees(math.acos(min(1.0, cosine))) < 10.5, "to a step of the search"
    shielded, least = (float(share) for share in re.findall(r"([\d.]+)%", reason))
    assert shielded > least + 2.0
    assert "the link itself shields" in reason
    old, new = before.sheets[0].placed.link_frustum, placed_sheet.link_frustum
    assert new.translation == pytest.approx(old.translation), "the cone itself stays"
    assert new.rotate((0.0, 0.0, 1.0)) == pytest.approx(old.rotate((0.0, 0.0, 1.0)))


@pytest.mark.long
def test_a_map_of_touches_turns_the_seam_away_from_them() -> None:
    mesh = tube_with_wing(None)
    before = fitted(mesh)
    sheet = before.sheets[0].placed
    busy, quiet = (sheet.point(0.1, phi) for phi in (0.0, math.pi))
    after, (reason,) = place_seams(before, mesh, TouchWeights(np.array([busy, quiet]), np.array([1.0, 0.1]), "map.csv"))
    _, phi, _ = after.sheets[0].placed.locate(quiet)
    assert abs(math.remainder(phi, 2 * math.pi)) < 0.5 * math.pi
    assert "touches count least by map.csv" in reason


def test_a_bare_tube_keeps_its_seam() -> None:
    mesh = tube_with_wing(None)
    before = fitted(mesh)
    after, (reason,) = place_seams(before, mesh)
    assert after.sheets[0].placed == before.sheets[0].placed
    assert "shields no side more than another" in reason


@pytest.mark.long
def test_the_seams_of_several_sheets_are_named_one_by_one() -> None:
    """Two sheets about one axis are turned together; a partial wrap beside them has no seam and is not named."""
    mesh = tube_with_wing(0.7)
    whole = fitted(mesh).sheets[0]
    half = replace(whole, placed=whole.placed.part(0.0, 0.05, 0.0, math.pi))
    for sheets, words in (
        ((whole, whole), "the seams of sheets 1 and 2 face ("),
        ((half, whole), "the seam of sheet 2 faces ("),
        ((whole, half, whole, whole), "the seams of sheets 1, 3 and 4 face ("),
    ):
        _, (reason,) = place_seams(replace(fitted(mesh), sheets=sheets), mesh)
        assert reason.startswith(words)
        assert "of the link's frame" in reason


def test_partial_wraps_have_no_choice() -> None:
    mesh = tube_with_wing(None)
    before = cones(mesh, max_sheets=1, wrap=math.pi)
    after, reasons = place_seams(before, mesh)
    assert reasons == ()
    assert after.sheets == before.sheets


def test_the_seam_of_a_stadium_lies_on_a_flat_of_it() -> None:
    """The sheet begins in the middle of a half circle, where its seam would peel."""
    tube = RuledTube(stadium_section(0.04, 0.03), 0.2, pose=TILTED)
    around, half = math.tau * 0.03 + 0.08, 0.5 * math.pi
    arcs = (half * 0.03, half), (0.04, 0.0), (math.pi * 0.03, math.pi), (0.04, 0.0), (half * 0.03, half)
    bends = tuple(Bend(math.tau * arc / around, turn) for arc, turn in arcs)
    radius = around / math.tau
    side = Developable(Frustum(radius, radius, 0.2), TILTED @ Pose(translation=(0.05 - radius, 0.0, 0.0)), bends)
    assert tube.distances(side.place(0.1, np.linspace(0.0, math.tau, 90))[0]).max() < 1e-6
    before = LinkFit((FittedSheet(side, 1e-4, 1e-4, 0.0, 0.0, 1.0, 1.0, 0.0),), None, 1e-3, 0.2, 0.05, (), "", 1)
    after, (reason,) = place_seams(before, tube.mesh())
    seam = after.sheets[0].placed
    one, two = (seam.normal(math.radians(angle)) for angle in (-14.0, 14.0))
    assert math.dist(one, two) < 1e-9, "no bend under the seam and its electrodes"
    assert seam.place(0.1, 0.7)[0] == pytest.approx(side.place(0.1, 0.7 + side.locate(seam.point(0.1, 0.0))[1])[0])
    assert "flattest" in reason
