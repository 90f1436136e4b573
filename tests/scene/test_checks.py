"""Links, lengths and joint limits against the arm."""

from pathlib import Path

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.robot.arm.models import MODEL_NAMES, arm_model
from coneskin.scene.reader import _check_links
from coneskin.scene.values.scene import ArmScene, LinkScene, MotionScene, PlacedSensor, Scene
from coneskin.skin.sensor import Sensor


def scene(arm: str | None, link: str, height: float = 0.1, waypoint: tuple[float, ...] = (0.0,) * 6) -> Scene:
    frustum = Frustum(0.05, 0.05, height)
    item = PlacedSensor(Sensor(frustum, name="skin"), PlacedFrustum(frustum))
    motion = MotionScene((waypoint,), 1.0, 1.0, 0)
    there = None if arm is None else ArmScene(arm, "host", 4.0)
    return Scene("s", "", Path(), arm=there, links=(LinkScene(link, "mesh", None, (item,)),), motion=motion)


def complaints(*args: object, **kwargs: object) -> list[str]:
    problems: list[str] = []
    _check_links(scene(*args, **kwargs), problems)  # type: ignore[arg-type]
    return problems


@pytest.mark.parametrize("arm", MODEL_NAMES)
@pytest.mark.parametrize(("link", "index"), [("upper_arm", 1), ("forearm", 2)])
def test_the_limit_is_the_distance_of_the_joints(arm: str, link: str, index: int) -> None:
    length = -arm_model(arm).a[index]
    assert complaints(arm, link, height=length) == []
    (line,) = complaints(arm, link, height=length * 1.001)
    assert line.startswith(f"link {link}, skin: height_mm must be at most {1e3 * length:g} mm")


def test_wrists_have_no_such_length() -> None:
    assert complaints("UR5e", "wrist_1", height=1.0) == []


def test_names_are_checked_even_where_the_arm_is_not_known() -> None:
    (line,) = complaints(None, "tail")
    assert line.startswith("link tail: an arm has no such link; it has base, shoulder")
    assert complaints(None, "forearm_link", height=1.5) == []


def test_every_joint_beyond_its_limit_is_named() -> None:
    lines = complaints("UR5e", "forearm", waypoint=(0.0, 6.3, 3.2, -6.3, 0.0, 0.0))  # 360 deg is 6.283 rad
    assert [line.split(" must be ")[0] for line in lines] == [
        f"motion.waypoints_deg[1]: joint {n} of the UR5e" for n in (2, 3, 4)
    ]
    assert complaints("UR3e", "forearm", waypoint=(0.0, 0.0, 0.0, 0.0, 0.0, 50.0)) == []  # its wrist 3 has no end
