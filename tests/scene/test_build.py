"""From a scene to places on the arm."""

import math

import numpy as np
import pytest

from coneskin.core.errors import SceneError
from coneskin.robot.guard.phase import Phase
from coneskin.scene.build import build_core, place_on_arm
from coneskin.scene.reader import parse_scene
from tests.support.paths import SHARED_DATA

from .scenes import DOUBLE_CONE, SERIAL_RETREAT, SKIN_ONLY


def turned(axis: str, angle: float) -> np.ndarray:
    """4 x 4 rotation."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(4)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def shifted(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def test_a_point_on_a_mesh_by_a_chain_written_by_hand() -> None:
    """UR10e, upper arm: sensor -> mesh -> URDF link -> DH frame 2, each from Universal Robots' files.

    visual_parameters.yaml: rpy (pi/2, 0, -pi/2), xyz (0, 0, 0.1762). The DH frame 2 sits at the far end, a2 = -0.6127 m
    along the URDF frame's x axis, with the same directions.
    """
    scene = parse_scene(SERIAL_RETREAT.replace("xyz_mm = [0, 0, 100]", "xyz_mm = [5, -3, 100]\nrpy_deg = [10, 20, 30]"))
    (placed,) = place_on_arm(scene)
    assert (placed.name, placed.link_name, placed.link) == ("upper arm skin", "upper_arm", 2)
    u, phi = 0.123, 1.1
    rpy = turned("z", math.radians(30)) @ turned("y", math.radians(20)) @ turned("x", math.radians(10))
    mesh_sensor = shifted(0.005, -0.003, 0.1) @ rpy
    urdf_mesh = shifted(0.0, 0.0, 0.1762) @ turned("z", -math.pi / 2) @ turned("x", math.pi / 2)
    dh_urdf = shifted(0.6127, 0.0, 0.0)
    chain = dh_urdf @ urdf_mesh @ mesh_sensor
    on_sensor = np.array([0.0605 * math.cos(phi), 0.0605 * math.sin(phi), u, 1.0])  # a cylinder: u is z
    outward = np.array([math.cos(phi), math.sin(phi), 0.0, 0.0])
    point, normal = placed.place(u, phi)
    assert point == pytest.approx(tuple((chain @ on_sensor)[:3]), abs=1e-15)  # metres; a dozen roundings below 1
    assert normal == pytest.approx(tuple((chain @ outward)[:3]), abs=1e-15)


def test_the_dh_frame_is_taken_as_it_is() -> None:
    scene = parse_scene(SERIAL_RETREAT.replace('name = "upper_arm"', 'name = "upper_arm"\nframe = "dh"'))
    (placed,) = place_on_arm(scene)
    assert placed.place(0.2, 0.0)[0] == pytest.approx((0.0605, 0.0, 0.3), abs=1e-16)


def test_the_urdf_frame_is_at_the_start_of_the_link() -> None:
    """dh_urdf of the chain above: 0.6127 m along x, no turn."""
    scene = parse_scene(SERIAL_RETREAT.replace('name = "upper_arm"', 'name = "upper_arm"\nframe = "urdf"'))
    (placed,) = place_on_arm(scene)
    assert placed.place(0.2, 0.0)[0] == pytest.approx((0.6127 + 0.0605, 0.0, 0.3), abs=1e-15)


def test_a_mesh_takes_the_point_down_to_its_surface() -> None:
    """The upper arm of a UR10 is a tube of 54 mm whose axis is 45 mm off its mesh's origin."""
    mesh = SHARED_DATA / "ur" / "ur10" / "collision" / "upperarm.stl"
    if not mesh.is_file():
        pytest.skip(f"needs the link mesh {mesh.name} in the folder shared/data beside the repository")
    text = SERIAL_RETREAT.replace("UR10e", "UR10").replace('name = "upper_arm"', f'name = "upper_arm"\nmesh = "{mesh}"')
    text = text.replace("xyz_mm = [0, 0, 100]", "xyz_mm = [0, -45, 110]")
    (placed,) = place_on_arm(parse_scene(text))
    for u, phi in ((0.02, 0.0), (0.2, 2.0), (0.3, 5.0)):
        point, _ = placed.place(u, phi)
        # the sensor's radius is 60.5 mm; the facets of the mesh are 0.05 mm off the round
        assert placed.frustum.locate(point)[2] == pytest.approx(-0.0065, abs=0.0001)


def test_without_an_arm_the_frame_of_the_scene_is_kept() -> None:
    (placed,) = place_on_arm(parse_scene(SKIN_ONLY))
    assert placed.link == 0
    point, normal = placed.place(0.2, math.pi / 2)
    assert point == pytest.approx((0.0, 0.054, 0.2), abs=1e-16)
    assert normal == pytest.approx((0.0, 1.0, 0.0), abs=1e-16)


def test_the_core_knows_every_sensor() -> None:
    core = build_core(parse_scene(DOUBLE_CONE))
    assert core.phase is Phase.STARTING
    wrong = core.blockers(0.0)
    for name in ("towards the elbow", "towards the wrist", "the arm's driver is not ready", "the controller is silent"):
        assert any(name in line for line in wrong)


def test_a_core_needs_a_sensor() -> None:
    with pytest.raises(SceneError, match=r"a guard needs a \[\[link\]\] with a \[\[link.sensor\]\]"):
        build_core(parse_scene('[[link]]\nname = "a"\n'))
