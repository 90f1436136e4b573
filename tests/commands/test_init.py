"""``coneskin init``: from a design to a scene that a guard takes, without a line written by hand."""

import json
import os
import shutil
import tomllib
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.scene.reader import load_scene

Output = pytest.CaptureFixture[str]
CYLINDER = ["--radius1-mm", "54", "--height-mm", "200"]
BALL = ["--radius1-mm", "40", "--radius2-mm", "45", "--height-mm", "60", "--radius3-mm", "40", "--height2-mm", "60"]


@pytest.fixture(scope="module")
def designs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the designs of a cylinder and of a rugby ball."""
    folder = tmp_path_factory.mktemp("designs")
    for name, words in (("skin", CYLINDER), ("ball", BALL)):
        assert main(["design", *words, "-o", str(folder / name), "--no-pictures"]) == 0
    return folder


@pytest.fixture
def here(tmp_path: Path, designs: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with the designs beside it."""
    monkeypatch.chdir(tmp_path)
    for name in ("skin", "ball"):
        os.symlink(designs / name, tmp_path / name)
    return tmp_path


@pytest.mark.long
def test_a_design_ends_with_the_next_command(tmp_path: Path, capsys: Output) -> None:
    assert main(["design", *CYLINDER, "-o", str(tmp_path / "my skin"), "--no-pictures"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith(f"next: coneskin init '{tmp_path / 'my skin'}'")


@pytest.mark.long
def test_a_simulated_scene_has_all_that_a_guard_needs(here: Path, capsys: Output) -> None:
    assert main(["init", "skin", "--simulated", "--link", "upperarm"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "scene.toml: 1 sensor on the upper_arm, a UR5e at 127.0.0.1",
        "no arm was named, so it is a UR5e: --arm MODEL names another of UR's, --skin-only is none",
        "next: coneskin doctor scene.toml --simulated",
    ]
    scene = load_scene(here / "scene.toml")
    (item,) = scene.sensors
    designed = tomllib.loads((here / "skin" / "sensor.toml").read_text())
    assert 1e3 * item.sensor.frustum.height == pytest.approx(designed["height_mm"])
    assert item.placed.link_frustum.translation[2] == pytest.approx(
        0.5 * (0.425 - item.sensor.frustum.height), abs=1e-4
    )
    assert (scene.default_reaction.kind, scene.moves_away) == ("stop", False)
    assert main(["doctor", "scene.toml", "--check"]) == 0


@pytest.mark.long
def test_the_padding_is_as_thick_as_the_sheets_of_the_design(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    layers = ["--set", "layers.thickness_mm=[3, 0.2, 1, 0.2, 4]"]
    assert main(["design", *CYLINDER, *layers, "-o", "skin", "--no-pictures"]) == 0
    assert main(["init", "skin", "--simulated", "--link", "forearm"]) == 0
    padding = load_scene("scene.toml").padding
    assert padding is not None
    assert padding.thickness == pytest.approx(8.4e-3)
    assert padding.stiffness == pytest.approx(10e3)


def test_real_hardware_is_named_and_nothing_is_simulated(here: Path) -> None:
    words = ["--arm", "ur10e", "--host", "192.168.0.10", "--port", "/dev/ttyUSB0", "--link", "forearm"]
    assert main(["init", "ball", *words, "-o", "sub.toml"]) == 0
    scene = load_scene(here / "sub.toml")
    assert scene.arm is not None
    assert (scene.arm.model, scene.arm.host) == ("UR10e", "192.168.0.10")
    assert scene.source is not None
    assert (scene.source.kind, scene.source.settings["port"]) == ("serial", "/dev/ttyUSB0")
    assert [item.sensor.sensor_id for item in scene.sensors] == [0, 1]
    assert (scene.motion, scene.monitoring) == (None, None)


def test_the_scene_says_the_values_of_the_board_that_firmware_was_written_for(here: Path, capsys: Output) -> None:
    assert main(["firmware", "skin/sensor.toml", "-o", "board", "--board", "esp32", "--converter", "ads1115"]) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert said.startswith(
        "then: coneskin init DESIGN-FOLDER --board esp32 --converter ads1115 --port /dev/ttyUSB0 --arm"
    )
    words = ["--skin-only", "--port", "/dev/ttyACM0", "--board", "esp32", "--converter", "ads1115"]
    assert main(["init", "skin", *words]) == 0
    scene, page = load_scene(here / "scene.toml"), (here / "board" / "board.md").read_text()
    electronics = scene.sensors[0].sensor.electronics
    assert (electronics.adc_bits, electronics.adc_volts, electronics.lead_ohms[0]) == (15, 4.096, 3.0)
    assert scene.monitoring_limits.skin_silence == 0.1
    assert scene.source is not None
    assert scene.source.settings["baud"] == 921600
    for line in page.split("The scene:")[1].splitlines():
        if " = " in line and "port" not in line:
            assert line.strip().partition("  #")[0] in (here / "scene.toml").read_text()


def test_each_sensor_has_a_board_and_a_port_of_its_own(here: Path, capsys: Output) -> None:
    words = ["init", "ball", "--skin-only", "--board", "uno", "--port", "/dev/ttyACM0"]
    assert main(words) == 1
    assert "a board reads one sensor, and the design has 2: give --port 2 times" in capsys.readouterr().err
    assert main([*words, "--port", "/dev/ttyACM1"]) == 0
    scene = load_scene(here / "scene.toml")
    assert [item.sensor.electronics.adc_bits for item in scene.sensors] == [11, 11]
    assert scene.source is not None
    members = [settings for _, settings in scene.source.settings["members"]]
    assert [(item["port"], item["baud"]) for item in members] == [("/dev/ttyACM0", 500000), ("/dev/ttyACM1", 500000)]
    assert scene.monitoring_limits.clock_drift == 5e-3


def test_a_sheet_beside_the_axis_of_its_link_is_warned_of(here: Path, capsys: Output) -> None:
    sensor = here / "off" / "sensor.toml"
    shutil.copytree(here / "skin", here / "off")
    data = json.loads((here / "off" / "design.json").read_text())
    (here / "off" / "design.json").write_text(json.dumps({**data, "frame": "mesh", "link": "forearm"}))
    sensor.write_text(sensor.read_text().replace("xyz_mm = [0.0,", "xyz_mm = [300.0,"))
    assert main(["init", "off", "--simulated"]) == 0
    assert "warning: link forearm, sheet 1 lies 300 mm beside the axis of the forearm" in capsys.readouterr().err


@pytest.mark.long
def test_a_link_longer_than_the_arms_is_of_another_arm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Output
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["design", "--radius1-mm", "54", "--height-mm", "500", "-o", "skin", "--no-pictures"]) == 0
    assert main(["init", "skin", "--simulated", "--link", "upper_arm"]) == 1
    said = capsys.readouterr().err
    assert "nothing is written; other arms than UR5e: --arm, none: --skin-only" in said
    assert "height_mm must be at most 425 mm" in said
    assert not (tmp_path / "scene.toml").exists()
    assert main(["init", "skin", "--simulated", "--link", "upper_arm", "--arm", "UR10e"]) == 0
    assert "no arm was named" not in capsys.readouterr().out


def test_a_skin_alone_has_no_arm(here: Path, capsys: Output) -> None:
    assert main(["init", "skin", "--skin-only", "--simulated", "--link", "gripper"]) == 0  # a link of no arm of UR's
    assert capsys.readouterr().out.splitlines()[-1] == "next: coneskin doctor scene.toml"  # there is no arm to simulate
    scene = load_scene(here / "scene.toml")
    assert scene.links[0].name == "gripper"
    assert (scene.arm, scene.motion, len(scene.sensors)) == (None, None, 1)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["skin"], "add --arm MODEL and --host ADDRESS, or --skin-only"),
        (["skin", "--arm", "UR5e", "--host", "h"], "add --port, the serial port of the skin; present: "),
        (["skin", "--simulated"], "which link of the arm was it designed for? Add --link, one of base, shoulder"),
        (["skin", "--simulated", "--link", "wrist_1"], "choose --link upper_arm or forearm"),
        (["skin", "--simulated", "--link", "elbow"], "link must be one of base"),
        (["skin", "--simulated", "--port", "COM3"], "leave one of them out"),
        (["skin", "--simulated", "--link", "forearm", "-o", "none/x.toml"], "there is no folder none for x.toml"),
        (["skin", "--simulated", "--link", "forearm", "--arm", "UR5x"], "arm must be one of UR3, UR5, UR10, UR3e"),
        (["nothing", "--simulated"], "nothing is no design: No such file or directory"),
    ],
)
def test_what_is_missing_is_named_and_nothing_is_written(
    words: list[str], said: str, here: Path, capsys: Output
) -> None:
    assert main(["init", *words]) == 1
    assert said in capsys.readouterr().err
    assert not (here / "scene.toml").exists()


@pytest.mark.parametrize("content", ['{"frame": "mesh", "link": "forearm", "sheets": []}', "[" * 100_000])
def test_a_damaged_design_is_refused(content: str, here: Path, capsys: Output) -> None:
    (here / "odd").mkdir()
    (here / "odd" / "design.json").write_text(content)
    assert main(["init", "odd", "--simulated"]) == 1
    assert "odd is no design: " in capsys.readouterr().err
    assert not (here / "scene.toml").exists()


def test_a_scene_is_not_replaced_unasked(here: Path, capsys: Output) -> None:
    (here / "scene.toml").write_text("mine")
    words = ["init", "skin", "--simulated", "--link", "forearm"]
    assert main(words) == 1
    assert "scene.toml exists already" in capsys.readouterr().err
    assert (here / "scene.toml").read_text() == "mine"
    assert main([*words, "--force"]) == 0
