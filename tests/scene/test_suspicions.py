"""Values that are possible and hardly meant: each is warned of, with what to write; right scenes are not."""

import re
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.core.errors import MissingExtra, SceneError
from coneskin.robot.ur.ur_rtde import wheel_remedy
from coneskin.scene import required_packages
from coneskin.scene.reader import parse_scene
from coneskin.scene.suspicions import suspicions
from coneskin.session.session import guard
from tests.support.scenes import forearm_scene

from .scenes import DOCUMENT

PLAIN = forearm_scene(port="/dev/ttyUSB0")
SECOND = PLAIN.replace(
    "[source]", "[[link.sensor]]\nid = 2\nradius1_mm = 37\nradius2_mm = 37\nheight_mm = 50\n{}\n[source]"
)
MOTION = "[motion]\nwaypoints_deg = [[0, -90, 90, 0, 0, 0], [1, -1.5708, 1.5708, 0, 0, 0]]\n"
MOTION += "speed_deg_s = 30\nacceleration_deg_s2 = 90\n"
TOUCHED = PLAIN.replace('kind = "serial"', 'kind = "virtual"').replace(
    'port = "/dev/ttyUSB0"', "[[source.touch]]\nstart_s = 1\nend_s = 2\nu_mm = 50\nphi_deg = {}"
)


@pytest.fixture(autouse=True)
def _every_package_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """For some Pythons there is no ur-rtde."""
    monkeypatch.setattr(required_packages, "find_spec", lambda name: name)


def doubts(text: str) -> list[str]:
    return [finding.line for finding in suspicions(parse_scene(text))]


@pytest.mark.parametrize("text", re.findall(r"```toml.*?\n(.*?)```", DOCUMENT.read_text("utf-8"), re.DOTALL))
def test_the_scenes_of_the_document_raise_none(text: str) -> None:
    if "[[link]]" in text:
        assert doubts(text) == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[0, 0, 80]", "[0, 0, 80]\nrpy_deg = [0, 0, 1.5708]", "like radians: then write [0.0, 0.0, 90.0]"),
        ("[0, 0, 80]", "[0, 0, 0.08]", "looks like metres: then write [0.0, 0.0, 80.0]"),
        ('control = "internal"', "table_z_mm = -0.02", "arm.table_z_mm = -0.02 looks like metres: then write -20"),
        ("radius1_mm = 37.6", "radius1_mm = 75.2", "a radius of 75.2 mm fills more than half of the 131 mm"),
        ("[0, 0, 80]", "[0, 0, 280]", "reaches from 280 to 540 mm along the forearm, whose joints are at 0 and 392 mm"),
        ("[0, 0, 80]", "[100, 0, 80]", "lies 100 mm beside the axis of the forearm"),
        ("[0, 0, 80]", "[0, 0, 80]\nrpy_deg = [0, 40, 0]", "turned by 40 deg against it"),
        ('"/dev/ttyUSB0"', '"/dev/ttyUSB0"\nbaud = 9600', "9600 carries at most 27 frames/s of each of 1 sensors"),
        ('"/dev/ttyUSB0"', '"tcp://10.0.0.1:5000"', "tcp:// is no scheme of pyserial; it has socket://"),
        ("[reaction]", MOTION + "[reaction]", "motion.waypoints_deg[2] has no angle above 1.5708 deg"),
    ],
)
def test_what_is_hardly_meant_is_warned_of(old: str, new: str, said: str) -> None:
    assert doubts(PLAIN) == []
    changed = PLAIN.replace(old, new)
    assert changed != PLAIN
    (line,) = doubts(changed)
    assert said in line


@pytest.mark.parametrize(
    ("place", "right"), [("0, 130, 0", True), ("0, 130, 392", True), ("0, 130, 200", False), ("60, 130, 0", False)]
)
def test_a_sheet_about_the_joint_at_an_end_of_a_tube_is_right(place: str, right: bool) -> None:
    assert (doubts(PLAIN.replace("[0, 0, 80]", f"[{place}]\nrpy_deg = [90, 0, 0]")) == []) is right


@pytest.mark.parametrize(("degrees", "doubted"), [(1.5708, True), (161.6, False), (98.96, False)])
def test_an_angle_beyond_a_turn_in_radians_is_in_degrees(degrees: float, doubted: bool) -> None:
    assert TOUCHED != PLAIN
    assert any("phi_deg = 1.5708 looks like radians" in line for line in doubts(TOUCHED.format(degrees))) is doubted
    assert bool(doubts(TOUCHED.format(degrees))) is doubted


@pytest.mark.parametrize(
    ("where", "over"),
    [
        ("xyz_mm = [0, 0, 100]", True),
        ("xyz_mm = [0, 0, 20]", False),
        ("xyz_mm = [0, 0, 335]", True),
        ("xyz_mm = [0, 0, 345]", False),
    ],
)
def test_sensors_over_one_another_are_warned_of(where: str, over: bool) -> None:
    assert any("lie over one another" in line for line in doubts(SECOND.format(where))) is over


def test_two_halves_about_one_axis_lie_beside_each_other() -> None:
    half = SECOND.replace("height_mm", "wrap_deg = 170\nheight_mm")
    assert doubts(half.format("xyz_mm = [0, 0, 100]\nrpy_deg = [0, 0, 180]")) == []
    assert len(doubts(half.format("xyz_mm = [0, 0, 100]\nrpy_deg = [0, 0, 160]"))) == 1


def test_a_wrap_in_radians_is_refused_with_what_to_write() -> None:
    with pytest.raises(SceneError, match=r"wrap_deg = 6\.2832 looks like radians: then write 360"):
        parse_scene(PLAIN.replace("height_mm = 260", "height_mm = 260\nwrap_deg = 6.2832"))


def test_missing_packages_are_named_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(required_packages, "find_spec", lambda _: None)
    monkeypatch.setattr(required_packages, "wheel_remedy", lambda: wheel_remedy((3, 12), "linux-x86_64"))
    assert doubts(PLAIN) == ["2 packages that it needs are not installed: pip install pyserial ur-rtde"]


@pytest.mark.parametrize(
    "computer", [((3, 13), "linux-x86_64"), ((3, 12), "macosx-11.0-arm64"), ((3, 12), "linux-aarch64")]
)
def test_where_ur_rtde_has_no_wheel_nobody_is_led_to_build_one(
    monkeypatch: pytest.MonkeyPatch, computer: tuple[tuple[int, int], str]
) -> None:
    monkeypatch.setattr(required_packages, "find_spec", lambda _: None)
    monkeypatch.setattr(required_packages, "wheel_remedy", lambda: wheel_remedy(*computer))
    (told,) = doubts(PLAIN)
    assert "pip install pyserial; ur-rtde: it has wheels for Python 3.11 and 3.12" in told
    with pytest.raises(MissingExtra, match='control = "external"'):
        guard(parse_scene(PLAIN))


def test_check_prints_them_and_still_passes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(PLAIN.replace("[0, 0, 80]", "[0, 0, 0.08]"))
    assert main(["doctor", str(tmp_path / "scene.toml"), "--check"]) == 0
    assert capsys.readouterr().err.startswith("warning: link forearm, sensor 0/0: xyz_mm = [0.0, 0.0, 0.08]")
