"""The words for marks, followed by a person who knows nothing of the sensor's coordinates."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.commissioning.acceptance.marks import offer_marks, plan_marks
from coneskin.commissioning.misreadings import RIGHT, Place, misfit
from coneskin.commissioning.touching import Mark
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.kinematics import dh_mesh, link_pose, link_poses
from coneskin.robot.arm.models import arm_model
from coneskin.scene.build import place_on_frusta
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import Scene
from tests.support.scenes import START, forearm_scene

UR5E = arm_model("UR5e")
#: of the sheet on the link; the second lies end for end
POSES = ["[0, 0, 80]", "[0, 0, 340]\nrpy_deg = [180, 0, 30]", "[0, 0, 80]\nrpy_deg = [0, 0, -77]"]
joints = st.tuples(*[st.floats(-3.0, 3.0)] * 6)


def scene(link: str = "forearm", pose: str = "xyz_mm = [0, 0, 80]") -> Scene:
    return parse_scene(forearm_scene().replace('"forearm"', f'"{link}"').replace("xyz_mm = [0, 0, 80]", pose))


def clock_side(where: str, along: np.ndarray) -> np.ndarray:
    """The direction that the clock in the words means, as a person stands: along the link, with 12:00 up."""
    match = re.search(r"at (\d+):(\d\d) as seen from .* towards .* \(12:00 is (up|towards the base's \+x)\)", where)
    assert match, where
    angle = math.radians(30.0 * (int(match[1]) % 12) + 0.5 * int(match[2]))
    twelve = np.array([0.0, 0.0, 1.0] if match[3] == "up" else [1.0, 0.0, 0.0])
    twelve = twelve - along * (twelve @ along)
    twelve /= np.linalg.norm(twelve)
    three = np.cross(along, twelve)  # looking north with the head up, three o'clock is east
    return math.cos(angle) * twelve + math.sin(angle) * three


def physical_place(where: str, q: tuple[float, ...]) -> tuple[float, np.ndarray]:
    """Where a person puts the finger on the forearm: distance from the elbow [m], and side, from the words alone."""
    poses = link_poses(UR5E, q)
    elbow, wrist = np.array(poses[2].translation), np.array(poses[3].translation)
    along = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    distance = re.match(r"(\d+) mm from the axis of the elbow, along the forearm, ", where)
    assert distance, where
    return 1e-3 * int(distance[1]), clock_side(where, along)


STADIUM = math.tau * 30.0 + 80.0  # mm; around two flats of 40 mm and half circles of 60 mm, from the middle of one on
BENDS = [[94.2478 / 2, 90], [40, 0], [94.2478, 180], [40, 0], [94.2478 / 2, 90]]


@pytest.mark.parametrize("q", [tuple(START), (0.3, -1.2, 1.1, -0.4, 0.9, 0.2)])
@pytest.mark.parametrize("turn", [0.0, 70.0])
def test_the_words_lead_to_the_place_on_a_link_that_is_not_round(q: tuple[float, ...], turn: float) -> None:
    """The middle of the stadium lies on the link's axis, 20 mm from the axis of the frame in which it is described."""
    radius = STADIUM / math.tau
    total = sum(arc for arc, _ in BENDS)
    wraps, turns = [360.0 * arc / total for arc, _ in BENDS], [angle for _, angle in BENDS]
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    pose = f"xyz_mm = [{c * (50.0 - radius)}, {s * (50.0 - radius)}, 80]\nrpy_deg = [0, 0, {turn}]"
    text = forearm_scene().replace("xyz_mm = [0, 0, 80]", f"{pose}\nbend_wrap_deg = {wraps}\nbend_turn_deg = {turns}")
    text = re.sub(r"radius([12])_mm = [\d.]+", rf"radius\1_mm = {radius}", text)
    here = parse_scene(text)
    (placed,), (item,) = place_on_frusta(here), here.sensors
    found = offer_marks(item.sensor, placed, q)
    assert len(found) >= 9
    poses = link_poses(UR5E, q)
    elbow, wrist = np.array(poses[2].translation), np.array(poses[3].translation)
    along = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    for mark in found:
        distance, side = physical_place(mark.where, q)
        point, _ = placed.place_in_base(mark.u, mark.phi, q)
        off = np.array(point) - elbow
        assert off @ along == pytest.approx(distance, abs=0.6e-3)
        off -= along * (off @ along)
        tube = np.array(link_pose(UR5E, q, placed.link).apply(dh_mesh(UR5E, "forearm").apply((0.0, 0.0, 0.2)))) - elbow
        off -= tube - along * (tube @ along)
        assert 0.0299 < np.linalg.norm(off) < 0.0501
        assert math.degrees(math.acos(min(1.0, off @ side / np.linalg.norm(off)))) < 0.1


@pytest.mark.parametrize("link", ["upper_arm", "forearm"])
def test_the_words_lead_to_the_place_on_a_sheet_about_the_joint_at_the_end_of_a_link(link: str) -> None:
    """Such a sheet has no place along its link: its own ends are named, and the clock is seen along it."""
    here = scene(link, "xyz_mm = [0, 130, 0]\nrpy_deg = [90, 0, 0]")
    (placed,), (item,) = place_on_frusta(here), here.sensors
    found = offer_marks(item.sensor, placed, START)
    assert len({mark.where for mark in found}) == len(found) >= 9
    first, last = (np.array(placed.place_in_base(u, 1.0, START)[0]) for u in (0.0, item.sensor.frustum.slant))
    along = (last - first) / np.linalg.norm(last - first)
    for mark in found:
        said = re.match(rf"(\d+) mm from electrode B \(end 1\), about the end of the {link}, at ", mark.where)
        assert said, mark.where
        assert 1e-3 * int(said[1]) == pytest.approx(mark.u, abs=6e-4)
        normal = np.array(placed.place_in_base(mark.u, mark.phi, START)[1])
        assert normal @ clock_side(mark.where, along) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.long
@settings(max_examples=20, deadline=None)
@given(
    joints, st.sampled_from(["[0, 0, 80]", "[0, 0, 340]\nrpy_deg = [180, 0, 30]", "[0, 0, 80]\nrpy_deg = [0, 0, -77]"])
)
def test_the_words_lead_to_the_place(q: tuple[float, ...], pose: str) -> None:
    """Elbow and wrist from the kinematics; the sensor lies on the tube's axis. Independent of frusta and meshes."""
    here = scene(pose=f"xyz_mm = {pose}")
    (placed,), (item,) = place_on_frusta(here), here.sensors
    found = offer_marks(item.sensor, placed, q)
    assert len(found) >= 9
    for mark in found:
        distance, side = physical_place(mark.where, q)
        point, normal = placed.place_in_base(mark.u, mark.phi, q)
        poses = link_poses(UR5E, q)
        elbow, wrist = np.array(poses[2].translation), np.array(poses[3].translation)
        along = (wrist - elbow) / np.linalg.norm(wrist - elbow)
        assert (np.array(point) - elbow) @ along == pytest.approx(distance, abs=6e-4)  # the words have whole mm
        assert np.array(normal) @ side == pytest.approx(1.0, abs=1e-3)  # but for the cone's half angle


@pytest.mark.long
@settings(max_examples=25, deadline=None)
@given(joints)
def test_the_direction_in_the_world_is_named_as_it_is(q: tuple[float, ...]) -> None:
    here = scene()
    (placed,), (item,) = place_on_frusta(here), here.sensors
    for mark in offer_marks(item.sensor, placed, q):
        _, normal = placed.place_in_base(mark.u, mark.phi, q)
        said = mark.where.split("the side that points ")[1]
        for value, plus, minus in zip(normal, ("+x", "+y", "up"), ("-x", "-y", "down"), strict=True):
            assert (plus in said) == (value > 0.35) or abs(value - 0.35) < 0.01
            assert (minus in said) == (value < -0.35) or abs(value + 0.35) < 0.01


@pytest.mark.parametrize("link", ["base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"])
@pytest.mark.parametrize("q", [START, [0.0] * 6, [0.0, -math.pi / 2.0, 0.0, 0.0, 0.0, 0.0]])
def test_every_link_has_marks(link: str, q: list[float]) -> None:
    here = scene(link)
    (placed,), (item,) = place_on_frusta(here), here.sensors
    plan = plan_marks(item.sensor, offer_marks(item.sensor, placed, q))
    assert plan is not None
    assert len({mark.where for mark in plan}) == len(plan)


def touched(true: PlacedFrustum, at: Mark, believed: PlacedFrustum) -> Place:
    """What a correct sheet reads that is not where the scene says: the finger goes where the scene's pose says."""
    u, phi, _ = true.locate(believed.point(at.u, at.phi))
    return Place(u, phi)


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.0, 360.0),
    st.booleans(),
    st.floats(-0.2, 0.2),
    st.sampled_from([START, [0.0] * 6, [0.5, -1.0, 1.7, 0.3, 0.2, 0.1]]),
)
def test_a_sheet_that_is_not_where_the_scene_says_misses_a_mark(
    turn: float, over: bool, shift: float, q: list[float]
) -> None:
    """Any turn about the link, end for end or not, with any shift along it: within the tolerance, or it shows."""
    here = scene()
    (placed,), (item,) = place_on_frusta(here), here.sensors
    height = item.sensor.frustum.height
    flip = Pose.from_xyz_rpy((0.0, 0.0, height), (math.pi, 0.0, 0.0)) if over else Pose()
    off = Pose.from_xyz_rpy((0.0, 0.0, shift), (0.0, 0.0, math.radians(turn)))
    true = replace(placed.frustum, link_frustum=placed.frustum.link_frustum @ off @ flip)
    plan = plan_marks(item.sensor, offer_marks(item.sensor, placed, q))
    assert plan is not None
    marks = [mark.place for mark in plan]
    read = [touched(true, mark, placed.frustum) for mark in plan]
    missed = misfit(item.sensor, RIGHT, marks, read).largest
    angle = abs(math.remainder(math.radians(turn), 2.0 * math.pi))
    if over:
        assert missed > 3.0
    else:
        assert missed == pytest.approx(max(abs(shift) / 0.02, math.degrees(angle) / 25.0), abs=0.02)


def test_without_an_arm_the_words_name_the_electrodes() -> None:
    here = replace(scene(), arm=None)
    (placed,), (item,) = place_on_frusta(here), here.sensors
    found = offer_marks(item.sensor, placed, None)
    assert {round(mark.u / item.sensor.frustum.slant, 9) for mark in found} == {0.2, 0.5, 0.8}
    for mark in found:
        match = re.fullmatch(
            r"(\d+) mm from electrode B \(end 1\) and (\d+) mm along the arc from electrode D", mark.where
        )
        assert match
        assert int(match[1]) == pytest.approx(1e3 * mark.u, abs=0.6)
        arc = 1e3 * item.sensor.frustum.radius_at(mark.u) * mark.phi
        assert int(match[2]) == pytest.approx(arc, abs=0.6)


@pytest.mark.parametrize(("radius", "wrap", "first", "last"), [(30, 180, 30, 150), (50, 280, 30, 240)])
def test_a_mark_has_15_mm_for_a_finger_and_a_tenth_of_the_wrap_beside_an_edge(
    radius: int, wrap: int, first: int, last: int
) -> None:
    """At a radius of 30 mm that is 29 deg, more than the tenth; of a wrap of 280 deg the tenth is 28 deg."""
    text = re.sub(r"radius1_mm = [\d.]+", f"radius1_mm = {radius}\nwrap_deg = {wrap}", forearm_scene())
    here = replace(parse_scene(re.sub(r"radius2_mm = [\d.]+", f"radius2_mm = {radius}", text)), arm=None)
    (placed,), (item,) = place_on_frusta(here), here.sensors
    found = {round(math.degrees(mark.phi)) for mark in offer_marks(item.sensor, placed, None)}
    assert found == set(range(first, last + 1, 30))


@pytest.mark.parametrize(
    ("link", "tilt", "said"),
    [
        ("upper_arm", 0, "mm from the axis of the shoulder, along the upper_arm, "),
        ("forearm", 59, "mm from the axis of the elbow, along the forearm, "),
        ("forearm", 61, "mm from electrode B (end 1), about the end of the forearm, "),
    ],
)
def test_a_place_is_told_from_what_there_is_on_its_link(link: str, tilt: int, said: str) -> None:
    here = scene(link, f"xyz_mm = [0, 0, 80]\nrpy_deg = [0, {tilt}, 0]")
    (placed,), (item,) = place_on_frusta(here), here.sensors
    assert all(said in mark.where for mark in offer_marks(item.sensor, placed, START))


def test_a_request_tells_programs_the_place_to_a_tenth() -> None:
    (item,) = scene().sensors
    notice = Mark(0.04836, 1.01, "in the middle").request(item.sensor, 2, 5, again=True)
    assert (notice.kind, notice.text) == ("again", f"once more, 2 of 5: touch {item.sensor.name} in the middle")
    wanted = {"number": 2, "of": 5, "sensor": item.sensor.name, "where": "in the middle", "u_mm": 48.4, "phi_deg": 57.9}
    assert notice.details == wanted
