"""The calibration file of a device: history, whole writes, and what a scene takes from it or refuses."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from coneskin.core.errors import SceneError
from coneskin.scene.commissioning_record import (
    CommissioningRecord,
    MarkResult,
    fingerprint,
    with_commissioning,
    write_record,
)
from coneskin.scene.reader import load_scene, parse_scene
from coneskin.scene.summary import summarize
from coneskin.scene.values import calibration_file
from coneskin.scene.values.calibration_file import (
    CalibrationRecord,
    TouchResult,
    _read_calibrations,
    add_calibration,
    sensor_fingerprint,
)
from tests.support.scenes import forearm_scene

PLAIN = forearm_scene(reaction='kind = "retreat"').replace(
    "[[link.sensor]]", '[[link.sensor]]\nname = "skin"\ndevice = 7'
)
NAMED = PLAIN.replace("device = 7", 'device = 7\ncalibration = "calibrations"')
OHMS = {"7/0": (990.0, 1010.0)}
ALONG, AROUND = (0.001, 0.0123456789012345, 0.0, 0.0, 0.0, 0.0), (0.0, -0.02, 0.0, 0.01, 0.0, 0.0)


def a_record(text: str = PLAIN, **changes: Any) -> CalibrationRecord:
    sensor = parse_scene(text).sensors[0].sensor
    touches = tuple(TouchResult(20.0 + k, 90.0, 21.0 + k, 91.0, True) for k in range(9))
    words = ("offset and gain", "offset, gain and bend")
    facts = (0, "skin", "2026-11-22T10:00:00+00:00", "0.1.0", "a test", True, sensor_fingerprint(sensor))
    record = CalibrationRecord(
        *facts, ALONG, AROUND, *words, 1.5, 2.9, 0.31, 0.6, 0.2, (3.0, 4.0, 5.0, 6.0), (990.0, 1010.0), touches
    )
    return replace(record, **changes)


def saved(folder: Path, text: str = NAMED) -> Path:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_scene_takes_the_newest_calibration_of_its_device(tmp_path: Path) -> None:
    file = tmp_path / "calibrations" / "device-7.json"
    add_calibration(file, 7, a_record(map_along=(0.04, 0.0, 0.0, 0.0, 0.0, 0.0)))
    add_calibration(file, 7, a_record())
    add_calibration(file, 7, a_record(sensor=1, map_along=(0.03, 0.0, 0.0, 0.0, 0.0, 0.0)))
    assert [item.map_along[0] for item in _read_calibrations(file, 7)] == [0.04, 0.001, 0.03]
    scene = load_scene(saved(tmp_path))
    found = scene.sensors[0].sensor.place_map
    assert found is not None
    assert (found.along, found.around, scene.sensors[0].sensor.known_ohms) == (ALONG, AROUND, OHMS["7/0"])
    assert summarize(scene)["calibration of skin"].startswith(
        "device-7.json of 2026-11-22, 9 touches, 1.50 mm became 0.31"
    )
    assert load_scene(saved(tmp_path), calibrated=False).sensors[0].sensor.place_map is None


def test_a_recording_carries_the_numbers_and_names_no_file(tmp_path: Path) -> None:
    add_calibration(tmp_path / "own.json", 7, a_record())
    scene = load_scene(saved(tmp_path, NAMED.replace('"calibrations"', '"own.json"')))
    assert "calibration" not in tomllib.loads(scene.text)["link"][0]["sensor"][0]
    again = parse_scene(scene.text, recorded=True)
    assert again.sensors == scene.sensors
    assert again.sensors[0].sensor.place_map is not None
    with pytest.raises(SceneError, match="a recording carries the numbers of its calibrations"):
        parse_scene(NAMED, recorded=True)


@pytest.mark.parametrize(
    ("changes", "text", "words"),
    [
        (
            {},
            NAMED.replace("radius1_mm = 37.6", "radius1_mm = 38"),
            "made with another geometry, wiring or electronics",
        ),
        (
            {},
            NAMED.replace("device = 7", "device = 7\nlead_ohm = 2"),
            "made with another geometry, wiring or electronics",
        ),
        ({"simulated": False}, NAMED, "no calibration of the virtual sensor 0"),
        ({"simulated": False}, NAMED.replace("[source]", "[[source]]"), "no calibration of the virtual sensor 0"),
        ({"sensor": 3}, NAMED, "no calibration of the virtual sensor 0"),
        ({}, NAMED.replace("device = 7", "device = 8"), "there is no calibration"),
        ({"map_along": (0.06, 0.0, 0.0, 0.0, 0.0, 0.0)}, NAMED, "place_map.along must be 6 numbers of at most 0.05"),
        ({}, NAMED.replace("device = 7", "device = 7\nmap_note = 'mine'"), "map_note cannot stand beside calibration"),
    ],
)
def test_a_calibration_that_does_not_apply_is_refused(
    changes: dict[str, Any], text: str, words: str, tmp_path: Path
) -> None:
    add_calibration(tmp_path / "calibrations" / "device-7.json", 7, a_record(**changes))
    with pytest.raises(SceneError, match=words):
        load_scene(saved(tmp_path, text))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b'{"device": 7}',
        b'{"device": 7, "calibrations": [1]}',
        b"\xff",
        b'{"device": 8, "calibrations": []}',
    ],
)
def test_a_damaged_file_is_refused_and_never_written_over(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "calibrations" / "device-7.json"
    file.parent.mkdir()
    file.write_bytes(content)
    with pytest.raises(SceneError, match=r"is no calibration file|has the calibrations of device 8"):
        load_scene(saved(tmp_path))
    with pytest.raises(SceneError, match="was not written"):
        add_calibration(file, 7, a_record())
    assert file.read_bytes() == content
    assert list(file.parent.iterdir()) == [file]


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("after_rms_mm", "small", "something else where a number should be"),
        ("force_error", "0.1", "something else where a number should be"),
        ("force_error", True, "something else where a number should be"),
        ("force_error", -0.1, "a number that cannot be"),
        ("map_along", [float("nan")] * 6, "a number that cannot be"),
        ("map_error_mm", None, "something else where a number should be"),
        ("sensor", "0", "sensor = '0', no int"),
        ("simulated", 1, "simulated = 1, no bool"),
        ("by", 7, "by = 7, no str"),
    ],
)
def test_a_value_of_another_kind_is_refused(tmp_path: Path, key: str, value: object, said: str) -> None:
    file = tmp_path / "calibrations" / "device-7.json"
    add_calibration(file, 7, a_record())
    table = json.loads(file.read_text())
    table["calibrations"][0][key] = value
    file.write_text(json.dumps(table))
    with pytest.raises(SceneError, match=said):
        load_scene(saved(tmp_path))


def test_a_long_history_is_kept_beside_a_new_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calibration_file, "_MAX_BYTES", 12_000)
    file = tmp_path / "device-7.json"
    for number in range(12):
        add_calibration(file, 7, a_record(sensor=number % 2, by=f"person {number}"))
    kept = [_read_calibrations(path, 7) for path in sorted(tmp_path.iterdir())]
    assert len(kept) > 1
    assert {record.by for records in kept for record in records} == {f"person {number}" for number in range(12)}
    assert {record.sensor for record in _read_calibrations(file, 7)} == {0, 1}
    assert all(path.stat().st_size <= 12_000 for path in tmp_path.iterdir())


def test_a_new_calibration_makes_a_commissioning_void(tmp_path: Path) -> None:
    file = tmp_path / "calibrations" / "device-7.json"
    add_calibration(file, 7, a_record())
    scene = load_scene(saved(tmp_path))
    marks = tuple(MarkResult("skin", "here", u, 2.0, u, 2.0, 0.0, 0.5, 1, True) for u in (1.0, 2.0, 3.0, 4.0, 5.0))
    write_record(
        scene, CommissioningRecord("2026-11-22T10:00:00+00:00", "0.1.0", fingerprint(scene), True, "", "", marks, OHMS)
    )
    known = with_commissioning(load_scene(saved(tmp_path)), 1795341600.0).commissioning
    assert known is not None
    assert known.valid
    add_calibration(file, 7, a_record(map_along=(0.002, 0.0, 0.0, 0.0, 0.0, 0.0)))
    known = with_commissioning(load_scene(saved(tmp_path)), 1795341600.0).commissioning
    assert known is not None
    assert not known.valid
    assert "electronics or calibration of a sensor" in known.note
