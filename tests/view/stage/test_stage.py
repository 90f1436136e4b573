"""Solids and sheets: where they are, and that they are closed."""

import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from coneskin.geometry.pose import Pose
from coneskin.robot.arm.kinematics import LINK_INDEX, MESHED_ARMS, link_poses
from coneskin.robot.arm.models import arm_model
from coneskin.robot.arm.workspace import skeleton
from coneskin.scene.build import place_on_arm
from coneskin.scene.reader import parse_scene
from coneskin.view.stage.level_scale import level_colour
from coneskin.view.stage.solids import Solid, arm_solids, barrel, joined
from coneskin.view.stage.stage import CLEAR, Stage, _clear_where_buried, floor_lines, set_stage
from tests.scene.scenes import DOUBLE_CONE
from tests.support.scenes import forearm_scene

POSES = ((0.0, -1.57, 1.2, -1.2, -1.57, 0.0), (0.4, -0.9, -1.1, 2.0, 1.0, 0.5))


def test_a_barrel_is_closed_and_its_faces_look_out() -> None:
    solid = barrel("b", 0, Pose(translation=(0.1, 0.2, 0.3)), 0.05, (0.2, 0.0), (1, 2, 3))
    corners = solid.vertices[solid.faces]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    whole = math.pi * 0.05**2 * 0.2
    assert 0.93 * whole < volume < whole


def test_no_face_of_a_barrel_is_empty() -> None:
    """A fan about the axis: half of the faces of its rings would have no area."""
    solid = barrel("b", 0, Pose(), 0.05, (0.0, 0.2), (1, 2, 3))
    corners = solid.vertices[solid.faces]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert areas.min() > 1e-7


def test_joined_solids_have_the_faces_of_all_where_they_were() -> None:
    solids = arm_solids(arm_model("UR5e"))
    found = joined(solids)
    assert len(found) < len(solids)

    def corners(given: Sequence[Solid], link: int, colour: tuple[int, int, int]) -> np.ndarray:
        triangles = [
            one.vertices[one.faces].reshape(-1, 9) for one in given if (one.link, one.colour) == (link, colour)
        ]
        return np.sort(np.concatenate(triangles), axis=0)

    for solid in found:
        at = solid.link, solid.colour
        assert sum((one.link, one.colour) == at for one in found) == 1
        assert np.array_equal(corners(found, *at), corners(solids, *at))


def distance(points: np.ndarray, solid: Solid) -> np.ndarray:
    """How far points are from the nearest vertex of a solid [m]."""
    return np.linalg.norm(points[:, None] - solid.vertices[None], axis=2).min(axis=1)


@pytest.mark.parametrize("name", sorted(MESHED_ARMS))
@pytest.mark.parametrize("q", POSES)
def test_the_solids_of_an_arm_lie_about_its_axes(name: str, q: tuple[float, ...]) -> None:
    """Every corner of the skeleton is inside of a solid, and no solid stands off the arm."""
    model = arm_model(name)
    poses = link_poses(model, q)
    solids = arm_solids(model)
    thick = model.d[4]
    placed = [solid._replace(vertices=poses[solid.link].apply_all(solid.vertices)) for solid in solids]
    corners = np.array(skeleton(model, q))
    for corner in corners:
        assert min(distance(corner[None], solid)[0] for solid in placed) < 0.9 * thick
    for solid in placed:
        starts, ends = corners[:-1], corners[1:]
        along = ends - starts
        length2 = np.maximum((along**2).sum(axis=1), 1e-12)
        share = np.clip(((solid.vertices[:, None] - starts) * along).sum(axis=2) / length2, 0.0, 1.0)
        feet = starts + share[..., None] * along
        off = np.linalg.norm(solid.vertices[:, None] - feet, axis=2).min(axis=1)
        assert off.max() < 1.6 * thick, solid.name


@pytest.mark.parametrize("name", sorted(MESHED_ARMS))
@pytest.mark.parametrize("q", POSES)
def test_neighbouring_links_meet(name: str, q: tuple[float, ...]) -> None:
    model = arm_model(name)
    poses = link_poses(model, q)
    clouds: dict[int, list[np.ndarray]] = {}
    for solid in arm_solids(model):
        clouds.setdefault(solid.link, []).append(poses[solid.link].apply_all(solid.vertices))
    for link in range(6):
        here, there = np.concatenate(clouds[link]), np.concatenate(clouds[link + 1])
        gap = min(np.linalg.norm(there - point, axis=1).min() for point in here[::7])
        assert gap < 0.5 * model.d[4], (link, gap)


def test_a_tube_does_not_stand_out_of_the_sheet_on_it() -> None:
    scene = parse_scene(DOUBLE_CONE, "scene.toml")
    placed = place_on_arm(scene)
    stage = set_stage(scene, placed, "a scene")
    for item, sheet in zip(placed, stage.sheets, strict=True):
        if stage.model is None:
            continue
        (tube,) = [solid for solid in stage.solids if solid.link == item.link and solid.name.endswith("tube")]
        back = item.frustum.link_frustum.inverse().apply_all(tube.vertices)
        inside = (back[:, 2] > 0.0) & (back[:, 2] < item.frustum.frustum.height)
        assert np.hypot(back[inside, 0], back[inside, 1]).max(initial=0.0) < sheet.slimmest / 0.97 + 1e-3


def test_the_sheet_lies_on_its_frustum() -> None:
    scene = parse_scene(DOUBLE_CONE, "scene.toml")
    placed = place_on_arm(scene)
    for item, sheet in zip(placed, set_stage(scene, placed, "a scene").sheets, strict=True):
        _, _, off = item.frustum.locate_all(sheet.vertices)
        assert off == pytest.approx(np.full(len(off), 0.0015), abs=2e-6)


@pytest.mark.parametrize("radius", [0.03, 0.06, 0.3])
def test_the_flat_pieces_of_a_sheet_cover_its_link(radius: float) -> None:
    """Their middles lie deepest; what is sensed is 1.5 mm below their corners, and stays 1 mm below them."""
    text = re.sub(
        r"(radius\d_mm) = (\d+)", lambda found: f"{found[1]} = {float(found[2]) * radius / 0.046}", DOUBLE_CONE
    )
    scene = parse_scene(text, "scene.toml")
    assert max(item.sensor.frustum.radius1 for item in scene.sensors) == pytest.approx(radius)
    placed = place_on_arm(scene)
    for item, sheet in zip(placed, set_stage(scene, placed, "a scene").sheets, strict=True):
        middles = sheet.vertices[sheet.faces].mean(axis=1)
        edges = 0.5 * (sheet.vertices[sheet.faces] + sheet.vertices[np.roll(sheet.faces, 1, axis=1)]).reshape(-1, 3)
        for points in (middles, edges):
            assert item.frustum.locate_all(points)[2].min() > 0.999e-3


def test_the_rim_is_a_narrow_band_inside_of_the_active_area() -> None:
    scene = parse_scene(DOUBLE_CONE, "scene.toml")
    placed = place_on_arm(scene)
    for item, sheet in zip(placed, set_stage(scene, placed, "a scene").sheets, strict=True):
        cone = item.frustum.frustum
        corners = sheet.rim_vertices[sheet.rim_faces]
        area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        around = cone.wrap * (cone.radius1 + cone.radius2) + 2.0 * cone.slant
        assert area.sum() == pytest.approx(0.005 * around, rel=0.05)
        u, _, off = item.frustum.locate_all(sheet.rim_vertices)
        assert u.min() > -1e-9
        assert u.max() < cone.slant + 1e-9
        assert off.min() > 0.0019, "above the sheet"


@pytest.mark.parametrize("reach", [0.4, 1.3, 1.9])
def test_the_floor_has_a_line_every_quarter_of_a_metre(reach: float) -> None:
    vertices, faces = floor_lines(reach)
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert across[:, 2].min() > 0.0, "seen from above"
    lines = 2 * (2 * math.ceil(2.0 * reach / 0.25) + 1)
    far = vertices[:, :2].max()
    assert 2.0 * reach <= far < 2.0 * reach + 0.26
    assert 0.5 * across[:, 2].sum() == pytest.approx(lines * 0.006 * 2.0 * (far - 0.003), rel=1e-9)
    assert (np.abs(vertices[:, :2] / 0.25 - np.round(vertices[:, :2] / 0.25)).min(axis=1) < 0.0121).all()


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.6, -0.48, 0.64)])
def test_an_arrow_points_along_its_normal(normal: tuple[float, float, float]) -> None:
    pose = Pose.along(normal)
    Pose(pose.rotation)  # is a rotation
    assert pose.rotate((0.0, 0.0, 1.0)) == pytest.approx(normal)
    w, x, y, z = pose.quaternion
    turned = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
    assert turned == pytest.approx(normal)


@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), (3.0, 0.1, 0.2), (0.1, 3.1, 0.0), (0.2, 0.1, 3.1), (1.0, -1.0, 2.0)])
def test_a_quaternion_turns_as_its_pose(rpy: tuple[float, float, float]) -> None:
    pose = Pose.from_xyz_rpy(rpy=rpy)
    w, x, y, z = pose.quaternion
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    assert np.array(rows) == pytest.approx(np.array(pose.rotation), abs=1e-12)


def test_the_colour_tells_a_touch() -> None:
    quiet, touched, firm = (level_colour(level, 0.1) for level in (0.0, 0.1, 0.9))
    assert len({quiet, touched, firm}) == 3
    assert level_colour(0.09, 0.1)[0] < touched[0]


BURYING_POSES = ((0.0, -1.57, 1.2, -1.2, -1.57, 0.0), (0.4, -0.9, -2.4, 2.0, 1.0, 0.5))


def stage() -> Stage:
    scene = parse_scene(forearm_scene(), "scene.toml")
    return set_stage(scene, place_on_arm(scene), "a scene")


def clear(given: Stage, q: tuple[float, ...]) -> list[str]:
    found = _clear_where_buried(given.solids, given.sheets, given.poses(q))
    assert all(solid.opacity in (CLEAR, 1.0) for solid in found)
    return [solid.name for solid in found if solid.opacity < 1.0]


@pytest.mark.parametrize("q", BURYING_POSES)
def test_a_sheet_that_lies_free_leaves_the_arm_as_it_is(q: tuple[float, ...]) -> None:
    assert clear(stage(), q) == []


@pytest.mark.parametrize("q", BURYING_POSES)
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
        (found,) = _clear_where_buried([solid], [sheet], poses)
        assert found.opacity == opacity
        assert np.array_equal(found.vertices, solid.vertices)
        (found,) = _clear_where_buried([solid._replace(closed=False)], [sheet], poses)
        assert found.opacity == 1.0, "the mesh of a link is what it is"
        (found,) = _clear_where_buried([solid._replace(link=1)], [sheet], poses)
        assert found.opacity == 1.0, "what only passes a sheet does not bury it"
