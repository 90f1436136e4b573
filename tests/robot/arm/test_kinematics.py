"""Forward kinematics and frames of links and meshes, against the published URDF and other libraries."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Vector
from coneskin.robot.arm.kinematics import (
    LINK_INDEX,
    dh_link,
    dh_mesh,
    flange_jacobian,
    forward,
    link_index,
    link_mesh,
    link_motion,
    link_name,
    link_pose,
    link_poses,
    place_point,
    point_jacobian,
)
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.models import MODEL_NAMES, arm_model
from tests.robot.arms import FAR_UR10, NEAR_UR10, NOMINAL, arms, joints, points, units
from tests.support.paths import SHARED_DATA
from tests.support.pinocchio_arm import pin_jacobian, pin_place, pin_rotation

pytest.importorskip("pinocchio", reason="the independent kinematics are pinocchio's (PyPI: pin)")

ARMS = pytest.mark.parametrize("arm", NOMINAL, ids=lambda arm: arm.name)
LINKS = st.integers(0, 6)


@ARMS
def test_places_and_jacobians_agree_with_pinocchio(arm: ArmModel) -> None:
    source = np.random.default_rng(1)
    for _ in range(40):
        q = list(source.uniform(-2 * np.pi, 2 * np.pi, 6))
        for link in range(7):
            x, y, z = (float(v) for v in source.uniform(-0.7, 0.7, 3))
            # 1e-12 m is what was asked for; six rotations of lengths of 1 m leave about 1e-15
            found = link_pose(arm, q, link).apply((x, y, z))
            np.testing.assert_allclose(found, pin_place(arm, q, link, (x, y, z)), rtol=0, atol=1e-14)
            np.testing.assert_allclose(
                point_jacobian(arm, q, link, (x, y, z)), pin_jacobian(arm, q, link, (x, y, z))[:3], rtol=0, atol=1e-14
            )
            np.testing.assert_allclose(link_pose(arm, q, link).rotation, pin_rotation(arm, q, link), rtol=0, atol=1e-14)
        np.testing.assert_allclose(flange_jacobian(arm, q), pin_jacobian(arm, q, 6, (0, 0, 0)), rtol=0, atol=1e-14)


def test_a_far_calibration_agrees_with_pinocchio_too() -> None:
    source = np.random.default_rng(2)
    for _ in range(100):
        q = list(source.uniform(-2 * np.pi, 2 * np.pi, 6))
        # 440 m forth and back: their rounding, 1e-13 m, stays
        np.testing.assert_allclose(
            forward(FAR_UR10, q).translation, pin_place(FAR_UR10, q, 6, (0, 0, 0)), rtol=0, atol=1e-12
        )


@given(arms(), joints(), LINKS, points())
def test_the_jacobian_is_the_derivative_of_the_place(
    arm: ArmModel, q: tuple[float, ...], link: int, p: tuple[float, float, float]
) -> None:
    h = 1e-5  # truncation h^2 |p| / 6 = 3e-11 per metre, rounding 1e-15 / h = 1e-10
    rows = np.array(point_jacobian(arm, q, link, p))
    for i in range(6):
        up, down = ([*q[:i], q[i] + step, *q[i + 1 :]] for step in (h, -h))
        slope = (np.array(link_pose(arm, up, link).apply(p)) - link_pose(arm, down, link).apply(p)) / (2 * h)
        np.testing.assert_allclose(rows[:, i], slope, rtol=0, atol=2e-9)


@given(arms(), joints(), LINKS, points(), units(), joints())
def test_a_point_turns_with_its_link_and_moves_as_its_jacobian_says(
    arm: ArmModel, q: Joints, link: int, p: Vector, n: Vector, qd: Joints
) -> None:
    pose, placed = link_pose(arm, q, link), place_point(arm, q, link, p, n)
    assert [*placed.point, *placed.direction] == pytest.approx([*pose.apply(p), *pose.rotate(n)], rel=0, abs=4e-15)
    velocity = np.array(point_jacobian(arm, q, link, p)) @ qd
    np.testing.assert_allclose(placed.velocity(qd), velocity, rtol=0, atol=1e-12)
    along, turn = link_motion(arm, q, qd, link)
    np.testing.assert_allclose(pose.rotate(tuple(np.add(along, np.cross(turn, p)))), velocity, rtol=0, atol=1e-12)


@pytest.mark.long
@given(arms(), joints(), LINKS, points(), points())
def test_links_are_rigid(
    arm: ArmModel, q: tuple[float, ...], link: int, a: tuple[float, float, float], b: tuple[float, float, float]
) -> None:
    pose = link_pose(arm, q, link)
    assert math.dist(pose.apply(a), pose.apply(b)) == pytest.approx(math.dist(a, b), abs=1e-14)


@ARMS
def test_at_zero_the_arm_lies_along_minus_x(arm: ArmModel) -> None:
    """The zero position of UR's drawings; also checked so in calibration_test.cpp of its ROS 2 driver."""
    x, y, z = forward(arm, (0.0,) * 6).translation
    assert x == pytest.approx(arm.a[1] + arm.a[2], abs=1e-15)
    assert y == pytest.approx(-(arm.d[3] + arm.d[5]), abs=1e-15)
    assert z == pytest.approx(arm.d[0] - arm.d[4], abs=1e-15)


@ARMS
def test_at_home_the_arm_stands_upright(arm: ArmModel) -> None:
    """UR's home position, joints 2 and 4 at -90 deg: a candle."""
    pose = forward(arm, (0.0, -math.pi / 2, 0.0, -math.pi / 2, 0.0, 0.0))
    height = arm.d[0] - arm.a[1] - arm.a[2] + arm.d[4]
    assert pose.translation == pytest.approx((0.0, -(arm.d[3] + arm.d[5]), height), abs=1e-15)


# What a simulated UR10 answered, printed in calibration_test.cpp of Universal_Robots_ROS2_Driver; its table had
# alpha = 1.570796327 for pi / 2.
@pytest.mark.parametrize(
    ("q", "place"),
    [
        (
            (
                -1.6007002035724084976209269370884,
                -1.7271001974688928726209269370884,
                -2.2029998938189905288709269370884,
                -0.80799991289247685699592693708837,
                1.59510004520416259765625,
                -0.03099996248354131012092693708837,
            ),
            (-0.179925914147547, -0.606869755162764, 0.230789102067257),
        ),
        (
            (
                1.32645022869110107421875,
                2.426007747650146484375,
                5.951572895050048828125,
                1.27409040927886962890625,
                -0.54105216661562138824592693708837,
                0.122173048555850982666015625,
            ),
            (
                0.39922988003280424074148413637886,
                0.59688365069340565405298093537567,
                -0.6677819040276375961440180617501,
            ),
        ),
    ],
)
def test_the_flange_is_where_universal_robots_says(q: tuple[float, ...], place: tuple[float, ...]) -> None:
    off = 1.570796327 - math.pi / 2
    simulated = arm_model("UR10").calibrated(delta_alpha=(off, 0.0, 0.0, off, -off, 0.0))
    assert forward(simulated, q).translation == pytest.approx(place, abs=2e-15)
    assert forward(arm_model("UR10"), q).translation == pytest.approx(place, abs=1e-9)


def test_all_poses_at_once_are_the_poses_one_by_one() -> None:
    q = (0.1, -1.0, 0.5, 0.3, 0.2, 0.9)
    assert link_poses(arm_model("UR5e"), q) == tuple(link_pose(arm_model("UR5e"), q, link) for link in range(7))


def test_columns_beyond_the_link_are_zero() -> None:
    rows = point_jacobian(arm_model("UR5e"), (0.1, -1.0, 0.5, 0.3, 0.2, 0.9), 3, (0.1, 0.2, 0.3))
    assert all(row[3:] == (0.0, 0.0, 0.0) for row in rows)
    assert all(any(row[i] for row in rows) for i in range(3))


@pytest.mark.parametrize("link", [-1, 7])
def test_a_link_that_is_not_there_is_refused(link: int) -> None:
    with pytest.raises(KinematicsError, match=r"link must be 0 \(base\) to 6 \(flange\), got"):
        link_pose(arm_model("UR5e"), (0.0,) * 6, link)


@pytest.mark.parametrize("q", [(0.0,) * 5, (0.0, math.nan, 0.0, 0.0, 0.0, 0.0), (math.inf,) * 6])
def test_joint_positions_that_cannot_be_are_refused(q: tuple[float, ...]) -> None:
    with pytest.raises(KinematicsError, match=r"q must be 6 finite joint positions"):
        forward(arm_model("UR5e"), q)


DATA = SHARED_DATA / "ur"

# Joint origins and mesh offsets as Universal_Robots_ROS2_Description publishes them, with its rounded right angles:
# shoulder z; forearm x; wrist_1 x, z; wrist_2 y; wrist_3 y; then mesh z of upper_arm, forearm and the three wrists
PUBLISHED = {
    "UR3": (0.1519, -0.24365, -0.21325, 0.11235, -0.08535, 0.0819, 0.1198, 0.0275, -0.085, -0.083, -0.082),
    "UR5": (0.089159, -0.425, -0.39225, 0.10915, -0.09465, 0.0823, 0.13585, 0.0165, -0.093, -0.095, -0.0818),
    "UR10": (0.1273, -0.612, -0.5723, 0.163941, -0.1157, 0.0922, 0.220941, 0.049042, -0.1149, -0.1158, -0.0922),
    "UR3e": (0.15185, -0.24355, -0.2132, 0.13105, -0.08535, 0.0921, 0.12, 0.027, -0.104, -0.08535, -0.0921),
    "UR5e": (0.1625, -0.425, -0.3922, 0.1333, -0.0997, 0.0996, 0.138, 0.007, -0.127, -0.0997, -0.0989),
    "UR10e": (0.1807, -0.6127, -0.57155, 0.17415, -0.11985, 0.11655, 0.1762, 0.0393, -0.135, -0.12, -0.1168),
    "UR16e": (0.1807, -0.4784, -0.36, 0.17415, -0.11985, 0.11655, 0.1762, 0.0393, -0.135, -0.12, -0.1168),
    "UR20": (0.2363, -0.862, -0.7287, 0.201, -0.1593, 0.1543, 0.26, 0.043, -0.0775, -0.0749, -0.07),
    "UR30": (0.2363, -0.637, -0.5037, 0.201, -0.1593, 0.1543, 0.26, 0.043, -0.0775, -0.0749, -0.07),
}


def urdf(name: str) -> str:
    """The chain of ur_macro.xacro, meshes as further links at their <origin>."""
    d1, a2, a3, d4, d5, d6, *offsets = PUBLISHED[name]
    pi, quarter = 3.141592653589793, 1.570796327
    aside = {"UR3": -0.002, "UR10": 0.001, "UR5e": -0.0005, "UR10e": -0.0005, "UR16e": -0.0005}.get(name, 0.0)
    chain = [
        ("base", "fixed", (0, 0, 0), (0, 0, pi), (0, 0, 0), (0, 0, pi)),
        ("shoulder", "revolute", (0, 0, d1), (0, 0, 0), (0, 0, 0), (0, 0, pi)),
        ("upper_arm", "revolute", (0, 0, 0), (quarter, 0, 0), (0, 0, offsets[0]), (pi / 2, 0, -pi / 2)),
        ("forearm", "revolute", (a2, 0, 0), (0, 0, 0), (0, 0, offsets[1]), (pi / 2, 0, -pi / 2)),
        ("wrist_1", "revolute", (a3, 0, d4), (0, 0, 0), (0, 0, offsets[2]), (pi / 2, 0, 0)),
        ("wrist_2", "revolute", (0, d5, 0), (quarter, 0, 0), (0, 0, offsets[3]), (0, 0, 0)),
        ("wrist_3", "revolute", (0, d6, 0), (1.570796326589793, pi, pi), (0, aside, offsets[4]), (pi / 2, 0, 0)),
    ]
    text, parent = ['<robot name="ur"><link name="base_link"/>'], "base_link"
    for link, kind, xyz, rpy, mesh_xyz, mesh_rpy in chain:
        text.append(f'<link name="{link}"/><link name="{link}_mesh"/>')
        for child, type_, above, place, turn in (
            (link, kind, parent, xyz, rpy),
            (f"{link}_mesh", "fixed", link, mesh_xyz, mesh_rpy),
        ):
            text.append(
                f'<joint name="{child}_joint" type="{type_}"><parent link="{above}"/><child link="{child}"/>'
                f'<origin xyz="{place[0]} {place[1]} {place[2]}" rpy="{turn[0]} {turn[1]} {turn[2]}"/>'
                '<axis xyz="0 0 1"/><limit lower="-7" upper="7" effort="1" velocity="1"/></joint>'
            )
        parent = link
    return "".join(text) + "</robot>"


@pytest.mark.parametrize("name", PUBLISHED)
def test_links_and_meshes_are_where_the_urdf_has_them(name: str) -> None:
    pin: Any = pytest.importorskip("pinocchio", reason="the URDF is read by pinocchio (PyPI: pin)")
    arm, chain = arm_model(name), pin.buildModelFromXML(urdf(name))
    data = chain.createData()
    half_turn = np.diag([-1.0, -1.0, 1.0])  # base_link against the controller's base
    source = np.random.default_rng(3)
    for _ in range(20):
        q = source.uniform(-2 * np.pi, 2 * np.pi, 6)
        pin.framesForwardKinematics(chain, data, q)
        for link, index in LINK_INDEX.items():
            base_dh = link_pose(arm, list(q), index)
            for frame, pose in ((link, base_dh @ dh_link(arm, link)), (f"{link}_mesh", base_dh @ dh_mesh(arm, link))):
                wanted = data.oMf[chain.getFrameId(frame)]
                # the published right angles are off by 2e-10 rad, six times over an arm of 2 m
                np.testing.assert_allclose(pose.translation, half_turn @ wanted.translation, rtol=0, atol=3e-9)
                np.testing.assert_allclose(pose.rotation, half_turn @ wanted.rotation, rtol=0, atol=3e-9)


@pytest.mark.parametrize("arm", NOMINAL, ids=lambda arm: arm.name)
def test_every_arm_has_its_meshes_near_its_links(arm: ArmModel) -> None:
    if arm.name in ("UR8 Long", "UR15", "UR18"):
        with pytest.raises(KinematicsError, match="meshes are known for UR3"):
            link_mesh(arm, "forearm")
        return
    for link in LINK_INDEX:
        x, y, z = link_mesh(arm, link).translation
        assert abs(x) == 0.0
        assert abs(y) <= 0.002
        assert abs(z) < 0.3


@pytest.mark.parametrize("arm", [NEAR_UR10, FAR_UR10], ids=["near", "far"])
def test_a_calibrated_arm_has_its_links_where_the_arm_is(arm: ArmModel) -> None:
    """Frames 2 and 3 of the far table are 440 m away, the links stay within millimetres and milliradians."""
    nominal = arm_model("UR10")
    source = np.random.default_rng(4)
    for _ in range(50):
        q = [float(x) for x in source.uniform(-np.pi, np.pi, 6)]
        for link, index in LINK_INDEX.items():
            real = link_pose(arm, q, index) @ dh_link(arm, link)
            ideal = link_pose(nominal, q, index) @ dh_link(nominal, link)
            # joint offsets of up to 0.08 rad (wrist 1) over 1.3 m of arm; a wrong frame is off by metres or radians
            assert math.dist(real.translation, ideal.translation) < 0.12
            np.testing.assert_allclose(real.rotation, ideal.rotation, rtol=0, atol=0.12)


@pytest.mark.parametrize("arm", [*NOMINAL, NEAR_UR10, FAR_UR10], ids=[*MODEL_NAMES, "near", "far"])
@pytest.mark.parametrize(("link", "after"), [("upper_arm", "forearm"), ("forearm", "wrist_1")])
def test_the_next_axis_crosses_a_tube_on_its_own_x_axis(arm: ArmModel, link: str, after: str) -> None:
    """The law that defines upper arm and forearm: the next axis crosses their plane z = 0 at (-length, 0, 0)."""
    index = LINK_INDEX[link]
    lengths = set()
    for turn in (0.0, 0.7, -2.0):
        q = [0.3, -0.4, 0.5, -0.6, 0.7, -0.8]
        q[index] = turn  # joint of the next link: its axis stays where it is
        base_link = link_pose(arm, q, index) @ dh_link(arm, link)
        axis = link_pose(arm, q, index)  # z of this DH frame is the next joint's axis
        direction = base_link.inverse().rotate(axis.rotate((0.0, 0.0, 1.0)))
        start = base_link.inverse().apply(axis.translation)
        x, y, z = (s - start[2] / direction[2] * d for s, d in zip(start, direction, strict=True))
        # 440 m along an axis that is 1 mrad off: rounding of 1e-13 m, and of 1e-16 rad over them
        assert (y, z) == pytest.approx((0.0, 0.0), abs=1e-12)
        lengths.add(round(x, 9))
        nominal = arm_model(arm.name)
        assert x == pytest.approx(nominal.a[index - 1], abs=0.003)  # what the factory corrects: 3 mm at the most
    assert len(lengths) == 1
    if link == "upper_arm":  # and there the forearm begins
        base_after = link_pose(arm, q, index + 1) @ dh_link(arm, after)
        assert (base_link.inverse() @ base_after).translation == pytest.approx((x, 0.0, 0.0), abs=1e-12)


def test_a_sensor_on_the_upper_arm_mesh_of_a_ur10_is_carried_with_its_tube() -> None:
    path = DATA / "ur10" / "collision" / "upperarm.stl"
    if not path.exists():
        pytest.skip(f"no mesh at {path}: shared data beside the repository")
    trimesh: Any = pytest.importorskip("trimesh", reason="reads the mesh")
    mesh = trimesh.load(path)
    arm = arm_model("UR10")
    pose = dh_mesh(arm, "upper_arm")
    a, b = (np.asarray(mesh.vertices)[mesh.edges_unique[:, k]] for k in (0, 1))
    cut = (a[:, 2] - 0.3) * (b[:, 2] - 0.3) < 0.0  # edges that cross the plane z = 0.3 m, half way along the tube
    a, b = a[cut], b[cut]
    ring = a + (b - a) * ((0.3 - a[:, 2]) / (b[:, 2] - a[:, 2]))[:, None]
    assert len(ring) > 20
    off = np.array([pose.apply((p[0], p[1], p[2])) for p in ring])
    # in the DH frame the tube runs along x, from the shoulder at 0.612 m to the elbow at 0; in the mesh its axis is
    # 45 mm aside of the joints' origin, at y = -0.045
    radius = np.hypot(off[:, 1], off[:, 2] - (0.220941 - 0.045))
    assert radius == pytest.approx(0.054, abs=1e-4)  # ../shared/data/README.md: a clean tube of 54.000 mm
    assert off[:, 0].min() > 0.0
    assert off[:, 0].max() < 0.612
    # both ends of the mesh are joint housings about the axes of joints 2 and 3
    assert pose.apply((0.0, 0.0, 0.0))[:2] == pytest.approx((0.612, 0.0), abs=1e-12)
    assert pose.apply((0.0, 0.0, 0.612))[:2] == pytest.approx((0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize("name", ["upper_arm", "upperarm", "Upper-Arm", "upper_arm_link", "UPPERARM"])
def test_a_link_may_be_written_as_people_write_it(name: str) -> None:
    assert link_index(name) == 2


@pytest.mark.parametrize("name", ["", "elbow", "wrist", "link_7", "link_x", "link_999"])
def test_an_unknown_link_is_refused_with_the_names_there_are(name: str) -> None:
    with pytest.raises(KinematicsError, match=r"link must be one of base, shoulder, upper_arm.*wrist_3.*, got"):
        dh_link(arm_model("UR5e"), name)


def test_an_arm_without_meshes_is_refused() -> None:
    arm = arm_model("UR5e")
    other = replace(arm, name="Own")
    with pytest.raises(KinematicsError, match=r"meshes are known for UR3, .*got the arm 'Own'"):
        link_mesh(other, "forearm")
    assert dh_link(other, "forearm") == dh_link(arm, "forearm")
    with pytest.raises(KinematicsError, match=r"URDF of the arm 'Own' is not known: use frame = .dh."):
        dh_link(replace(other, driver="another:DRIVER"), "forearm")


def test_links_of_any_arm_have_numbers() -> None:
    assert [link_index(name) for name in ("link_3", "Link 7", "forearm", "link_12")] == [3, 7, 3, 12]
    assert [link_name(index) for index in (0, 3, 7)] == ["base", "forearm", "link_7"]
