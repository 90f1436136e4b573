"""The table of one sensor, and that what ``coneskin design`` writes is one."""

import math
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.scene.reader import parse_scene
from coneskin.scene.tables.sensor_tables import build_sensor, merge_sensor_file
from coneskin.skin.electronics import Electronics, LeadOhms, Polarity, Thresholds

SHAPE = {"radius1_mm": 40, "radius2_mm": 70, "height_mm": 150}


def test_every_key_reaches_its_place() -> None:
    problems: list[str] = []
    built = build_sensor(
        {
            **SHAPE,
            "wrap_deg": 270,
            "xyz_mm": [1, 2, 3],
            "rpy_deg": [0, 0, 90],
            "id": 4,
            "device": 5,
            "name": "six",
            "radial_positive": "A",
            "angular_positive": "D",
            "supply_v": 3.0,
            "adc_v": 5.0,
            "adc_bits": 16,
            "pulldown_ohm": 2000,
            "input_ohm": 3e6,
            "lead_ohm": 2,
            "current_full_scale_ma": 100,
            "upper_sheet_ohm": 700,
            "lower_sheet_ohm": 800,
            "touch_level": 0.2,
            "release_level": 0.1,
            "location_level": 0.3,
        },
        "s",
        problems,
    )
    assert problems == []
    assert built is not None
    sensor, placed = built
    assert (sensor.frustum.radius1, sensor.frustum.radius2, sensor.frustum.height) == (0.04, 0.07, 0.15)
    assert sensor.frustum.wrap == math.radians(270)
    assert (sensor.sensor_id, sensor.device_id, sensor.name) == (4, 5, "six")
    assert sensor.polarity == Polarity("A", "D")
    assert sensor.electronics == Electronics(3.0, 5.0, 16, 2000.0, 3e6, LeadOhms.equal(2.0), 0.1)
    assert (sensor.upper_sheet_ohms, sensor.lower_sheet_ohms) == (700.0, 800.0)
    assert sensor.thresholds == Thresholds(0.2, 0.1, 0.3)
    # end 1 at (1, 2, 3) mm, x turned to y: phi = 0 of end 1 lies 40 mm along y
    assert placed.point(0.0, 0.0) == pytest.approx((0.001, 0.042, 0.003), abs=1e-17)


def test_a_sensor_that_cannot_be_is_a_problem_not_an_exception() -> None:
    problems: list[str] = []
    assert build_sensor({**SHAPE, "height_mm": 0, "radius2_mm": 40}, "s", problems) is None
    assert problems == ["s: height must be above 0 where both radii are equal: the side has no length"]


def test_a_height_in_metres_is_said_to_be_one() -> None:
    problems: list[str] = []
    assert build_sensor({**SHAPE, "height_mm": 0.24}, "s", problems) is None
    assert problems == ["s.height_mm must be 0 or from 1 to 10000 mm, got 0.24 mm: is that in metres? Then write 240"]
    ring = {**SHAPE, "height_mm": 0, "current_full_scale_ma": 50}
    assert build_sensor(ring, "s", []) is not None


def test_a_file_gives_keys_and_the_table_wins(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("radius1_mm = 1\nlead_ohm = 2\n")
    problems: list[str] = []
    assert merge_sensor_file({"file": "a.toml", "lead_ohm": 3}, "s", tmp_path, problems) == {
        "radius1_mm": 1,
        "lead_ohm": 3,
    }
    assert merge_sensor_file({"lead_ohm": 3}, "s", tmp_path, problems) == {"lead_ohm": 3}
    assert problems == []
    assert merge_sensor_file({"file": "b.toml"}, "s", tmp_path, problems) == {}
    assert merge_sensor_file({"file": ""}, "s", tmp_path, problems) == {}
    assert len(problems) == 2


def test_unknown_keys_of_a_file_are_reported(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("radius_mm = 1\n")
    problems: list[str] = []
    build_sensor(merge_sensor_file({"file": "a.toml", **SHAPE}, "s", tmp_path, problems), "s", problems)
    assert problems == ["s: unknown key radius_mm; did you mean radius2_mm?"]


@pytest.mark.long
def test_the_files_of_a_design_are_sensors_of_a_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A rugby ball, from radii to cut files to the two sensors of a scene: one chain, no hand in it."""
    pytest.importorskip("ezdxf", reason="the extra coneskin[design] is not installed")
    first = ["--radius1-mm", "40", "--radius2-mm", "70", "--height-mm", "150"]
    second = ["--radius3-mm", "40", "--height2-mm", "150"]
    assert main(["design", *first, *second, "--no-pictures", "--json", "-o", str(tmp_path / "skin")]) == 0
    capsys.readouterr()
    sensors = "".join(f'[[link.sensor]]\nfile = "skin/sheet-{n}/sensor.toml"\n' for n in (1, 2))
    scene = parse_scene(f'[[link]]\nname = "ball"\n{sensors}', "ball.toml", tmp_path)
    lower, upper = (item.placed for item in scene.sensors)
    assert [item.sensor.sensor_id for item in scene.sensors] == [0, 1]
    for placed in (lower, upper):  # every corner of both is on the ball, at most the stack's 3 mm above the bare cones
        for u in (0.0, placed.frustum.slant):
            x, y, z = placed.point(u, 1.0)
            bare = 0.04 + 0.03 * (z / 0.15 if z < 0.15 else 2.0 - z / 0.15)
            assert 0.0 <= math.hypot(x, y) - bare < 0.004


def test_a_sheet_that_was_cut_is_given_no_other_cone(tmp_path: Path) -> None:
    (tmp_path / "sensor.toml").write_text("radius1_mm = 41\nradius2_mm = 41\nheight_mm = 200\n")
    problems: list[str] = []
    same = {"file": "sensor.toml", "radius1_mm": 41}
    assert merge_sensor_file(same, "sensor 1", tmp_path, problems)["height_mm"] == 200
    assert problems == []
    merge_sensor_file({**same, "radius2_mm": 20}, "sensor 1", tmp_path, problems)
    assert problems == ["sensor 1: radius2_mm = 20 is far from 41, for which the sheet of file was cut: leave it out"]
