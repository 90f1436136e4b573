"""The commissioning record: what makes it void, and that the arm then only stops."""

import json
import re
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from coneskin.core.errors import SceneError
from coneskin.robot.guard.signals.journal import GuardEvent
from coneskin.scene.build import build_core, known_sensors
from coneskin.scene.commissioning_record import (
    _read_record,
    _record_path,
    fingerprint,
    with_commissioning,
    write_record,
)
from coneskin.scene.reader import load_scene, parse_scene
from coneskin.scene.summary import summarize
from coneskin.scene.values.scene import Commissioning, Scene
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from tests.support.scenes import commissioned, write_passed_record
from tests.support.sweep import sweep

from .scenes import SERIAL_RETREAT, SKIN_ONLY, inputs

DAY = 86400.0
OHMS = {"0/1": (1000.0, 1000.0)}
VIRTUAL_RETREAT = SERIAL_RETREAT.replace('kind = "serial"', 'kind = "virtual"').replace(
    'port = "hwgrep://0403:6001"    # or /dev/ttyUSB0, COM3, socket://host:port\n', ""
)


def scene_in(folder: Path, text: str = SERIAL_RETREAT) -> Scene:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return load_scene(path)


def known(scene: Scene, days_later: float = 0.0) -> Commissioning:
    """What a guard that starts so many days after now knows."""
    found = with_commissioning(scene, datetime.now(UTC).timestamp() + DAY * days_later).commissioning
    assert found is not None
    return found


def test_a_record_that_passed_is_valid(tmp_path: Path) -> None:
    scene = scene_in(tmp_path)
    path = write_passed_record(scene)
    assert path == tmp_path / "scene.commissioning.json"
    assert known(scene) == Commissioning(True, f"passed on {datetime.now(UTC):%Y-%m-%d} by a test, 5 marks", OHMS)
    assert known(scene, 3650.0).valid, "without max_age_days it stays valid"
    assert [item.name for item in tmp_path.iterdir() if "part" in item.name] == []


@pytest.mark.promise("P12")
@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"marks": 4}, "marks at 4 places, and 5 are needed"),
        ({"u_mm": 7.0, "read_u_mm": 7.0}, "marks at 1 places, and 5 are needed"),
        ({"sensor": "a sensor that is not there"}, "marks on 2 sensors, and the scene has 1"),
        ({"read_u_mm": 90.0}, "was read 90 mm and 0 deg off, 20 mm and 25 deg are allowed"),
        ({"read_phi_deg": -30.0}, "was read 0 mm and 30 deg off"),
        ({"read_u_mm": float("nan")}, "was read nan mm"),
        ({"level": 0.0}, "has the level 0, at which nothing touches"),
        ({"sheet_ohm": {}}, "it has no `sheet_ohm`"),
        ({"sheet_ohm": {"0/1": [1000.0, 0.0]}}, "it has no `sheet_ohm`"),
        ({"sheet_ohm": {"0/1": [float("nan"), 1.0]}}, "by which a peeled electrode would show"),
    ],
)
def test_a_record_that_says_it_has_passed_and_is_not_complete_is_of_no_use(tmp_path: Path, change, said) -> None:
    """One mark for two sensors, a sensor that is not there, 90 mm off but passed, level 0: all were taken."""
    scene = scene_in(tmp_path)
    table = json.loads(write_passed_record(scene).read_text())
    table["marks"] = table["marks"][: change.get("marks", 5)]
    table["sheet_ohm"] = change.get("sheet_ohm", table["sheet_ohm"])
    for number, mark in enumerate(table["marks"]):
        if "u_mm" in change or not number:
            mark.update({name: value for name, value in change.items() if name not in ("marks", "sheet_ohm")})
    if "sensor" in change:
        table["marks"].append({**table["marks"][1]})
    _record_path(scene).write_text(json.dumps(table))
    found = known(scene)
    assert not found.valid
    assert said in found.note


def test_without_a_record_it_says_what_to_do(tmp_path: Path) -> None:
    assert known(scene_in(tmp_path)) == Commissioning(
        False, "there is no commissioning record scene.commissioning.json: see `coneskin commission`"
    )


@pytest.mark.promise("P12")
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("UR10e", "UR5e"),
        ('name = "upper_arm"', 'name = "forearm"'),
        ('name = "upper_arm"', 'name = "upper_arm"\nframe = "dh"'),
        ("id = 1", "id = 2"),
        ("radius2_mm = 60.5", "radius2_mm = 60.6"),
        ("wrap_deg = 300", "wrap_deg = 301"),
        ("[0, 0, 100]", "[0, 0, 101]"),
        ("[0, 0, 100]", "[0, 0, 100]\nrpy_deg = [0, 0, 5]"),
        ("id = 1", 'id = 1\nradial_positive = "A"'),
        ("id = 1", 'id = 1\nangular_positive = "D"'),
        ("id = 1", "id = 1\nadc_bits = 16"),
        ("id = 1", "id = 1\nupper_sheet_ohm = 900"),
        (SERIAL_RETREAT, VIRTUAL_RETREAT),
    ],
)
def test_a_record_of_another_scene_is_void(old: str, new: str, tmp_path: Path) -> None:
    write_passed_record(scene_in(tmp_path))
    text = SERIAL_RETREAT.replace(old, new)
    assert text != SERIAL_RETREAT
    found = known(scene_in(tmp_path, text))
    assert not found.valid
    assert "was of another scene" in found.note


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("distance_mm = 60", "distance_mm = 80"),
        ("192.168.1.10", "192.168.1.11"),
        ("upper arm skin", "another name"),
        ("id = 1", "id = 1\ntouch_level = 0.12"),
        ('name = "upper_arm"', 'name = "upperarm_link"'),
        ("hwgrep://0403:6001", "/dev/ttyUSB0"),
    ],
)
def test_what_the_places_do_not_depend_on_keeps_it_valid(old: str, new: str, tmp_path: Path) -> None:
    write_passed_record(scene_in(tmp_path))
    text = SERIAL_RETREAT.replace(old, new)
    assert text != SERIAL_RETREAT
    (sensor,) = known_sensors(with_commissioning(scene_in(tmp_path, text), 0.0))
    assert sensor.known_ohms == (1000.0, 1000.0)
    assert known(scene_in(tmp_path, text)).valid


@pytest.mark.promise("P58")
def test_it_ages_where_the_scene_says_so(tmp_path: Path) -> None:
    scene = scene_in(tmp_path, SERIAL_RETREAT + "[commissioning]\nmax_age_days = 30\n")
    write_passed_record(scene)
    assert known(scene, 29.9).valid
    assert "31.0 days old, 30 days are allowed (commissioning.max_age_days)" in known(scene, 31.0).note
    assert not known(scene, 31.0).valid
    assert "which is still to come; set the date" in known(scene, -2.0).note
    assert not known(scene, -2.0).valid


def test_one_that_failed_is_void(tmp_path: Path) -> None:
    scene = scene_in(tmp_path)
    record = _read_record(write_passed_record(scene))
    write_record(scene, replace(record, passed=False, cause="it reads as if C and D were exchanged"))
    assert "has failed, it reads as if C and D were exchanged" in known(scene).note
    assert not known(scene).valid
    write_record(scene, replace(record, marks=(replace(record.marks[0], passed=False),)))
    assert not known(scene).valid
    write_record(scene, replace(record, marks=()))
    assert not known(scene).valid


@pytest.mark.parametrize(
    "text",
    [
        "",
        "nonsense",
        "[]",
        "7",
        "{}",
        '{"marks": []}',
        '{"marks": 3}',
        "[" * 100_000,
        "9" * 5000,
        "\udcff",
        "x" * (1 << 21),
    ],
)
def test_nonsense_is_void_and_no_traceback(text: str, tmp_path: Path) -> None:
    scene = scene_in(tmp_path)
    _record_path(scene).write_bytes(text.encode("utf-8", "surrogateescape"))
    assert not known(scene).valid
    assert "is of no use" in known(scene).note


@pytest.mark.parametrize("key", ["passed", "date", "fingerprint", "marks", "sheet_ohm"])
@pytest.mark.parametrize("value", [None, "no", 1, [1], {"a": 1}])
def test_a_wrong_value_is_void(key: str, value: object, tmp_path: Path) -> None:
    scene = scene_in(tmp_path)
    path = write_passed_record(scene)
    path.write_text(json.dumps({**json.loads(path.read_text()), key: value}))
    assert not known(scene).valid


def test_a_folder_in_its_place_is_void(tmp_path: Path) -> None:
    scene = scene_in(tmp_path)
    _record_path(scene).mkdir()
    assert not known(scene).valid
    with pytest.raises(SceneError, match="cannot be written"):
        write_passed_record(scene)
    assert [item.name for item in tmp_path.iterdir() if "part" in item.name] == []


def test_a_scene_that_only_stops_is_not_looked_at(tmp_path: Path) -> None:
    stop = scene_in(tmp_path, SERIAL_RETREAT.replace('"retreat"', '"stop"'))
    assert with_commissioning(stop, 0.0) is stop
    alone = parse_scene(SKIN_ONLY)
    assert with_commissioning(alone, 0.0) is alone


@pytest.mark.promise("P12")
def test_the_check_lists_it(tmp_path: Path) -> None:
    scene = scene_in(tmp_path)
    said = summarize(with_commissioning(scene, 0.0))["commissioning"]
    assert said.startswith("NOT VALID: the arm only stops; there is no commissioning record")
    write_passed_record(scene)
    assert summarize(with_commissioning(scene, 0.0))["commissioning"].startswith("passed on ")


@pytest.mark.parametrize(
    ("bare_side", "kind"),
    [("stop", "retreat"), ("allowed", "retreat"), ("allowed", "comply"), ("fast", "comply"), ("stop", "stop")],
)
def test_the_check_names_what_no_skin_covers_where_it_may_not_lead(bare_side: str, kind: str) -> None:
    text = re.sub('bare_side = ".*"', f'bare_side = "{bare_side}"', SERIAL_RETREAT).replace('"retreat"', f'"{kind}"')
    told = summarize(parse_scene(text if kind == "retreat" else text.replace('bare_side = "stop"', "")))
    assert ("no skin on" in told) is ((bare_side, kind) in (("stop", "retreat"), ("allowed", "comply")))
    assert "wrist 3; where one would lead" in told.get("no skin on", "wrist 3; where one would lead")


RULE = '[[reaction.rule]]\nlevel_above = 0.2\nkind = "comply"\nbare_side = "fast"\n'
STOP_WITH_RULE = VIRTUAL_RETREAT.replace('kind = "retreat"', 'kind = "stop"') + RULE


@pytest.mark.promise("P12")
@pytest.mark.parametrize("text", sweep([VIRTUAL_RETREAT, STOP_WITH_RULE]), ids=["retreat", "a rule that complies"])
def test_without_a_record_the_arm_only_stops_and_says_so(text: str, tmp_path: Path) -> None:
    scene = scene_in(tmp_path, text)
    touch = ScriptedTouch(0.6, 0.8, 0.2, 2.5, sensor="upper arm skin")
    told = {}
    for name, known_scene in (("bare", with_commissioning(scene, 0.0)), ("commissioned", commissioned(scene))):
        core, outputs = build_core(known_scene), []
        for block in inputs(known_scene, touch, 0.9):
            core.feed(block, outputs)
        told[name] = [output for output in outputs if isinstance(output, GuardEvent)]
    assert "not_commissioned" not in [event.name for event in told["commissioned"]]
    assert "retreating" in [event.name for event in told["commissioned"]]
    names = [event.name for event in told["bare"]]
    assert names[:2] == ["activated", "not_commissioned"]
    assert "there is no commissioning record" in told["bare"][1].details["what"]
    assert "latched" in names
    assert "retreating" not in names


@pytest.mark.promise("P12")
def test_an_electrode_that_peeled_off_before_the_start_lets_nothing_retreat(tmp_path: Path) -> None:
    """The untouched sheets are not those of the commissioning; every activation says so, and a touch stops the arm."""
    scene = scene_in(tmp_path, VIRTUAL_RETREAT)
    peeled = replace(scene, commissioning=Commissioning(True, "by a test", {"0/1": (950.0, 1000.0)}))
    core, outputs = build_core(peeled), []
    for block in inputs(peeled, ScriptedTouch(0.8, 1.0, 0.2, 2.5, sensor="upper arm skin"), 1.3):
        core.feed(block, outputs)
    told = [output for output in outputs if isinstance(output, GuardEvent)]
    names = [event.name for event in told]
    assert names[:2] == ["activated", "message"]
    assert "no place on upper arm skin is certain: the upper sheet, or its bond to A or B" in told[1].details["what"]
    assert "latched" in names
    assert "retreating" not in names


def test_the_fingerprint_does_not_depend_on_the_last_bits(tmp_path: Path) -> None:
    """Another machine's sine may differ in the last bit."""
    scene = scene_in(tmp_path, SERIAL_RETREAT.replace("[0, 0, 100]", "[0, 0, 100]\nrpy_deg = [10, 20, 30]"))
    (link,) = scene.links
    (item,) = link.sensors
    pose = item.placed.link_frustum
    nudged = replace(pose, rotation=tuple(tuple(x * (1.0 + 1e-15) for x in row) for row in pose.rotation))
    moved = replace(item, placed=replace(item.placed, link_frustum=nudged))
    assert fingerprint(replace(scene, links=(replace(link, sensors=(moved,)),))) == fingerprint(scene)
