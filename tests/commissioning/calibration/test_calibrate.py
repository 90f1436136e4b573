"""A calibration with the process of a virtual skin, by the command itself: file, scene, refusals, marks."""

import argparse
import json
import math
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.commands.calibrate import _forces, _show
from coneskin.commissioning.calibration.calibrate import CalibrationResult
from coneskin.commissioning.calibration.touches import SensorTouches
from coneskin.scene.reader import load_scene, parse_scene
from coneskin.scene.values.calibration_file import CalibrationRecord, _read_calibrations
from tests.support.scenes import forearm_scene

TEXT = forearm_scene().replace("[[link.sensor]]", '[[link.sensor]]\nname = "forearm skin"\nwrap_deg = 350\ndevice = 7')
NAMED = TEXT.replace("device = 7", 'device = 7\ncalibration = "own"')
Output = pytest.CaptureFixture[str]


def saved(folder: Path, name: str, text: str) -> str:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.long
@pytest.mark.processes
def test_unknown_leads_are_found_and_taken_off(tmp_path: Path, capsys: Output) -> None:
    scene = saved(tmp_path, "scene.toml", NAMED)
    built = saved(tmp_path, "built.toml", TEXT.replace("radius1_mm", "lead_ohm = [4, 12, 9, 6]\nradius1_mm"))
    picture = tmp_path / "residuals.png"
    words = ["calibrate", scene, "--simulated", "--skin", built, "--by", "a test", "--picture", str(picture), "--json"]
    assert main([*words, "--marks", "4"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["kind"] for line in lines if line["kind"] != "reading"] == ["mark", "read"] * 4 + ["end"]
    end = lines[-1]
    assert end["before_rms_mm"] > 1.0
    assert end["after_rms_mm"] < 0.6  # by the other three
    assert end["extra_ohm"] == pytest.approx([3.0, 11.0, 8.0, 5.0], abs=1.5)  # 1 ohm is 0.2 mm
    assert end["file"] == str(tmp_path / "own" / "device-7.json")
    (record,) = _read_calibrations(tmp_path / "own" / "device-7.json", 7)
    assert (record.by, record.simulated, len(record.touches)) == ("a test", True, 4)
    assert picture.read_bytes().startswith(b"\x89PNG")
    sensor = load_scene(scene).sensors[0].sensor
    assert sensor.place_map is not None
    assert sensor.place_map.along == record.map_along
    touch = record.touches[0]
    u, phi = sensor.place_map.apply(1e-3 * touch.read_u_mm, math.radians(touch.read_phi_deg))
    off = math.hypot(1e3 * u - touch.u_mm, 37.6 * (phi - math.radians(touch.phi_deg)))
    assert off < 0.3
    assert main(["doctor", scene, "--check"]) == 0
    assert "device-7.json of" in capsys.readouterr().out


@pytest.mark.long
@pytest.mark.processes
def test_known_forces_give_a_threshold_in_newtons(tmp_path: Path, capsys: Output) -> None:
    scene = saved(tmp_path, "scene.toml", NAMED.replace("radius1_mm", "touch_force_n = 2\nradius1_mm", 1))
    words = ["calibrate", scene, "--simulated", "--marks", "4", "--forces", "1,3,8", "--json"]
    assert main(words) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["force_n"] for line in lines if line["kind"] == "press"] == [1.0, 3.0, 8.0] * 3
    assert lines[-1]["forces_n"] == [1.0, 3.0, 8.0]
    assert 0.02 <= lines[-1]["force_error"] < 0.3
    sensor = load_scene(scene).sensors[0].sensor
    assert sensor.force_table is not None
    assert sensor.force_table.force(sensor.thresholds.touch_level) == pytest.approx(
        (2.0, 2.0 * lines[-1]["force_error"])
    )


@pytest.mark.long
@pytest.mark.processes
def test_a_mirrored_sheet_is_refused_and_nothing_is_written(tmp_path: Path, capsys: Output) -> None:
    scene = saved(tmp_path, "scene.toml", TEXT)
    built = saved(tmp_path, "built.toml", TEXT.replace("radius1_mm", 'angular_positive = "D"\nradius1_mm'))
    assert main(["calibrate", scene, "--simulated", "--skin", built, "--marks", "4"]) == 1
    assert (
        "NOT calibrated: forearm skin cannot be calibrated: it reads as if C and D were exchanged"
        in capsys.readouterr().out
    )
    assert sorted(item.name for item in tmp_path.iterdir()) == ["built.toml", "scene.toml"]


def test_the_marks_are_listed_without_touching(tmp_path: Path, capsys: Output) -> None:
    scene = saved(tmp_path, "scene.toml", NAMED)  # its calibration is still to be made
    assert main(["calibrate", scene, "--simulated", "--list", "--marks", "16"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 16
    assert lines[0].startswith("  1  forearm skin: 26.0 mm from electrode B (end 1) along the side, which is 10 % of")
    assert main(["calibrate", scene, "--list", "--marks", "16"]) == 0  # nothing is touched, so nobody need be able to
    assert capsys.readouterr().out.splitlines() == lines


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "the skin of scene.toml is virtual, and nobody can touch it: use --simulated"),
        (["--skin", "scene.toml"], "--skin says how a virtual skin was built: give --simulated too"),
    ],
)
def test_what_cannot_be_touched_is_said(words: list[str], said: str, tmp_path: Path, capsys: Output) -> None:
    assert main(["calibrate", saved(tmp_path, "scene.toml", TEXT), *words]) == 1
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(("after_mm", "lead", "uneven", "leads"), [(0.7, -0.9, False, True), (4.7, -7.1, True, False)])
def test_an_uneven_sheet_is_said_with_what_to_do_and_has_no_lead_below_nothing(
    after_mm: float, lead: float, uneven: bool, leads: bool, capsys: Output
) -> None:
    sensor = parse_scene(TEXT).sensors[0].sensor
    words = {"sensor": 0, "name": "cuff", "date": "", "coneskin": "", "by": "", "simulated": True, "fingerprint": ""}
    errors = {"before_rms_mm": 7.2, "before_largest_mm": 9.0, "after_rms_mm": after_mm, "after_largest_mm": 7.7}
    numbers = {"map_along": (), "map_around": (), "fitted_along": "", "fitted_around": "", "map_error_mm": 1.0}
    ohms = {"extra_ohm": (1.3, 11.1, 11.7, lead), "sheet_ohm": (996.0, 996.0), "touches": ()}
    record = CalibrationRecord(**words, **errors, **numbers, **ohms)  # type: ignore[arg-type]
    result = CalibrationResult(SensorTouches(sensor, ()), None, record)
    _show(result, None, False, True)
    end = json.loads(capsys.readouterr().out)
    assert (end["uneven"], end["sensor"], end["touches"]) == (uneven, sensor.name, 0)
    _show(result, None, False, False)
    said = capsys.readouterr().out
    assert ("--marks 16" in said and "sheet_class" in said) is uneven
    assert (f"D {lead:+.1f} ohm more than lead_ohm" in said) is leads
    assert ("less than 0 ohm" in said) is not leads


def test_forces_are_two_or_more_that_a_gauge_can_show() -> None:
    assert _forces("1000,0.05") == (0.05, 1000.0)
    for text in ("0.049,1", "1,1001", "5", "5,5"):
        with pytest.raises(argparse.ArgumentTypeError, match=r"two or more forces from 0\.05 to 1000 N"):
            _forces(text)


def test_a_virtual_skin_with_other_sensors_is_refused(tmp_path: Path, capsys: Output) -> None:
    scene = saved(tmp_path, "scene.toml", TEXT)
    built = saved(tmp_path, "built.toml", TEXT.replace("forearm skin", "another"))
    assert main(["calibrate", scene, "--simulated", "--skin", built]) == 1
    assert "--skin must have the sensors of scene.toml: forearm skin, got another" in capsys.readouterr().err
