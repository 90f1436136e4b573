"""Arms of installed packages: found by name and alone imported; a scene that asks for too much is refused by name."""

import sys

import pytest

from coneskin.core.errors import KinematicsError, SceneError
from coneskin.robot.arm import models
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.protocol import (
    ExaminedDriver,
    HeartbeatDriver,
    ProgramDriver,
    ProgramStarter,
    SetpointDriver,
    SliderDriver,
    load_driver,
)
from coneskin.robot.driver.values import StopPath
from coneskin.robot.ur.driver import UR_DRIVER
from coneskin.robot.ur.stop_sockets import StopSockets
from coneskin.scene.build import build_core
from coneskin.scene.reader import parse_scene
from coneskin.scene.summary import missing_parts

ACME = """
from types import MappingProxyType
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.driver.values import StopPath
ROWS = [(value,) * 7 for value in (0.0, 0.3, 1.5, -3.0, 3.0, 2.0)]
ARM = ArmModel("Acme 7-b", *ROWS, driver="acme:DRIVER")
NO_ARM = 3
class Driver:
    lost_with = MappingProxyType({"socket": frozenset({StopPath.COMMAND})})
    decode_state = check_model = state_reader = stop_connections = None
DRIVER = Driver()
"""


@pytest.fixture(autouse=True)
def packages(tmp_path, monkeypatch):
    """Install packages that are there, broken, or there twice."""
    (tmp_path / "acme.py").write_text(ACME)
    (tmp_path / "broken.py").write_text("this is no Python")
    rows = {
        "acme": "Acme_7b = acme:ARM\nnumber = acme:NO_ARM\nother = acme:ARM\nabsent = nowhere:ARM",
        "broken": "Broken = broken:ARM\ntwice = broken:ARM",
        "third": "twice = acme:ARM",
    }
    for name, points in rows.items():
        folder = tmp_path / f"{name}-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (folder / "entry_points.txt").write_text(f"[coneskin.arms]\n{points}\n")
    monkeypatch.syspath_prepend(tmp_path)
    for module in ("acme", "broken"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    models._installed.cache_clear()
    yield
    models._installed.cache_clear()


def test_a_package_is_found_in_any_spelling_and_alone_imported():
    assert arm_model("acme 7B").joints == 7
    assert "broken" not in sys.modules
    assert load_driver(arm_model("Acme-7b").driver).lost_with == {"socket": {StopPath.COMMAND}}


def test_the_arms_of_coneskin_need_no_package():
    assert arm_model("ur-10 E").name == "UR10e"
    assert "acme" not in sys.modules


@pytest.mark.parametrize(
    ("name", "why"),
    [
        (
            "nobody",
            "arm must be one of UR3, .*UR30, Acme_7b, Broken, .*got 'nobody'; the arm of another maker is a pack",
        ),
        ("broken", "package of the arm 'broken' .broken, broken:ARM. cannot be imported: SyntaxError"),
        ("absent", "cannot be imported: ModuleNotFoundError: No module named 'nowhere'"),
        ("number", "must give the ArmModel of that name"),
        ("other", "must give the ArmModel of that name"),
        ("twice", "comes from more than one package: (third|broken), .* and .*; uninstall one"),
    ],
)
def test_what_is_wrong_with_a_package_is_one_line(name, why):
    with pytest.raises(KinematicsError, match=why) as caught:
        arm_model(name)
    assert "\n" not in str(caught.value)


def scene(arm='control = "external"', link='name = "link_3"\nframe = "dh"', reaction='kind = "stop"'):
    sensor = "[[link.sensor]]\nradius1_mm = 62\nradius2_mm = 62\nheight_mm = 240"
    head = f'[arm]\nmodel = "acme7b"\nhost = "127.0.0.1"\n{arm}'
    return f'{head}\n[[link]]\n{link}\n{sensor}\n[source]\nkind = "virtual"\n[reaction]\n{reaction}\n'


def test_the_first_tier_is_enough_to_stop_beside_another_program():
    found = parse_scene(scene(), "a scene")
    assert missing_parts(found) == []
    arm = build_core(found)._arm
    assert arm._stop.paths == (StopPath.COMMAND, StopPath.WATCHDOG)
    assert (arm.heartbeat, arm.needs.heartbeat, arm.needs.stops_by_slider) == (None, None, False)


CANNOT = 'Acme 7-b: this arm\'s driver cannot {}; reaction = "stop" with control = "external" works'


@pytest.mark.parametrize(
    ("changed", "lines"),
    [
        ({"arm": 'control = "internal"'}, [CANNOT.format("move it for a program")]),
        (
            {"reaction": 'kind = "retreat"'},
            [
                CANNOT.format("move it away from a touch"),
                'Acme 7-b: its model has no currents, so nothing may move it away; reaction = "stop" works',
            ],
        ),
        ({"reaction": 'kind = "slow"'}, [CANNOT.format("slow it down")]),
        (
            {"arm": 'control = "external"\ncontroller_heartbeat = "required"'},
            [CANNOT.format("end a program where the network is cut")],
        ),
    ],
)
def test_a_scene_that_asks_for_more_is_refused_by_name(changed, lines):
    assert missing_parts(parse_scene(scene(**changed), "a scene")) == lines


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"link": 'name = "link_3"'}, 'link link_3: meshes and URDF of the Acme 7-b are not known: use frame = "dh"'),
        (
            {"link": 'name = "link_8"\nframe = "dh"'},
            "link link_8: an arm has no such link; it has base, link_1 to link_7",
        ),
        (
            {"reaction": 'kind = "stop"\n[[reaction.rule]]\nlink = "link_8"\nkind = "stop"'},
            "rule 1: the arm has no link_8",
        ),
    ],
)
def test_a_link_that_the_arm_does_not_have_is_refused(changed, why):
    with pytest.raises(SceneError, match=why):
        parse_scene(scene(**changed), "a scene")


@pytest.mark.parametrize("tier", [SetpointDriver, SliderDriver, HeartbeatDriver, ProgramDriver, ExaminedDriver])
def test_the_driver_of_ur_arms_has_every_tier(tier):
    assert isinstance(UR_DRIVER, tier)
    assert isinstance(StopSockets("127.0.0.1"), ProgramStarter)
