"""Sheets that the drawn arm would hide are seen through it; all else hides what is behind it."""

from dataclasses import replace

import numpy as np
import pytest

from coneskin.geometry.pose import Pose
from coneskin.robot.arm.link_frames import LINK_INDEX
from coneskin.scene.build import place_on_arm
from coneskin.scene.reader import parse_scene
from coneskin.testing.forearm import forearm_scene
from coneskin.view.stage.buried_sheets import CLEAR, clear_where_buried
from coneskin.view.stage.solid import barrel
from coneskin.view.stage.stage import Stage, set_stage

POSES = ((0.0, -1.57, 1.2, -1.2, -1.57, 0.0), (0.4, -0.9, -2.4, 2.0, 1.0, 0.5))


def stage() -> Stage:
    scene = parse_scene(forearm_scene(), "scene.toml")
    return set_stage(scene, place_on_arm(scene), "a scene")


def clear(given: Stage, q: tuple[float, ...]) -> list[str]:
    found = clear_where_buried(given.solids, given.sheets, given.poses(q))
    assert all(solid.opacity in (CLEAR, 1.0) for solid in found)
    return [solid.name for solid in found if solid.opacity < 1.0]


@pytest.mark.parametrize("q", POSES)
def test_a_sheet_that_lies_free_leaves_the_arm_as_it_is(q: tuple[float, ...]) -> None:
    assert clear(stage(), q) == []


@pytest.mark.parametrize("q", POSES)
@pytest.mark.parametrize("way", [0.08, 0.12])
def test_a_sheet_in_the_elbow_is_seen_through_what_covers_it(q: tuple[float, ...], way: float) -> None:
    """The forearm's sheet, moved along the forearm until it begins at the elbow's axis, or beyond."""
    given = stage()
    (sheet,) = given.sheets
    frame = sheet.item.frustum.link_frustum
    x, y, z = frame.translation
    frustum = replace(sheet.item.frustum, link_frustum=Pose(frame.rotation, (x + way, y, z)))
    buried = sheet._replace(item=replace(sheet.item, frustum=frustum))
    assert abs(x + 0.08 + given.model.a[2]) < 1e-3, "the elbow's axis is there"
    assert "forearm, near joint" in clear(replace(given, sheets=(buried,)), q)
    assert "forearm, far joint" not in clear(replace(given, sheets=(buried,)), q)


def test_what_is_inside_of_a_barrel_is_told_by_its_radius() -> None:
    given = stage()
    (sheet,) = given.sheets
    frame, cone = sheet.item.frustum.link_frustum, sheet.item.frustum.frustum
    link = LINK_INDEX["forearm"]
    poses = {index: Pose() for index in range(7)}
    for factor, opacity in ((0.9, 1.0), (1.1, CLEAR)):
        radius = factor * max(cone.radius1, cone.radius2)
        solid = barrel("b", link, frame, radius, (-1.0, 1.0), (1, 2, 3))
        (found,) = clear_where_buried([solid], [sheet], poses)
        assert found.opacity == opacity
        assert np.array_equal(found.vertices, solid.vertices)
        (found,) = clear_where_buried([solid._replace(closed=False)], [sheet], poses)
        assert found.opacity == 1.0, "the mesh of a link is what it is"
        (found,) = clear_where_buried([solid._replace(link=1)], [sheet], poses)
        assert found.opacity == 1.0, "what only passes a sheet does not bury it"
