"""docs/look-up/scene.md against the code: each key with its unit, range and default, and examples that load."""

import math
import re
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import pytest

from coneskin.robot.reaction.types import Reaction
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.scene import reader as scene_reader
from coneskin.scene.reader import parse_scene
from coneskin.scene.tables import (
    arm_table,
    body_table,
    link_tables,
    motion_table,
    reaction_table,
    schema,
    sensor_keys,
    source_table,
    speed_limit_table,
    touch_table,
)
from coneskin.scene.tables.schema import Key
from coneskin.skin.electronics import Polarity, Thresholds, match_electronics
from coneskin.skin.sensor import Sensor
from tests.support.paths import ROOT

DOCUMENT = (ROOT / "docs" / "look-up" / "scene.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```toml.*?\n(.*?)```", DOCUMENT, re.DOTALL)
SECTIONS: dict[str, tuple[Key, ...]] = {
    "[arm]": arm_table.ARM_KEYS,
    "[[link]]": link_tables.LINK_KEYS,
    "[[link.sensor]]": (Key("file", str, None), Key("calibration", str, None), *sensor_keys.SENSOR_KEYS),
    "[source]": source_table.source_keys(),
    "[[source.touch]]": touch_table.TOUCH_KEYS,
    "[reaction]": reaction_table.REACTION_KEYS,
    "[[reaction.rule]]": reaction_table.RULE_KEYS,
    "[monitoring]": arm_table.MONITORING_KEYS,
    "[recording]": scene_reader._RECORDING,
    "[motion]": motion_table.MOTION_KEYS,
    "[commissioning]": scene_reader._COMMISSIONING,
    "[[body]]": body_table.BODY_KEYS,
    "[padding]": body_table.PADDING_KEYS,
    "[speed_limit]": speed_limit_table.SPEED_LIMIT_KEYS,
}
#: what the document says in words, because the code says None, nothing, or works it out
IN_WORDS = {
    ("[recording]", "max_mb"): "none",
    ("[recording]", "keep"): "all",
    ("[arm]", "table_z_mm"): "none",
    ("[arm]", "speed_limit_from"): "none",
    ("[reaction]", "rule"): "none",
    ("[commissioning]", "max_age_days"): "none",
    **{
        ("[[reaction.rule]]", key.name): "any" if number < 3 else "as above"
        for number, key in enumerate(reaction_table.RULE_KEYS)
        if key.name != "kind"
    },
    ("[[link]]", "mesh"): "none",
    ("[[link]]", "sensor"): "none",
    ("[[link.sensor]]", "file"): "none",
    ("[[link.sensor]]", "calibration"): "none",
    ("[[link.sensor]]", "name"): "from its numbers",
    **{
        ("[[link.sensor]]", name): "matches the sheets"
        for name in ("supply_v", "adc_bits", "pulldown_ohm", "current_full_scale_ma")
    },
    ("[[link.sensor]]", "map_along"): "none",
    ("[[link.sensor]]", "map_around"): "none",
    ("[[link.sensor]]", "map_note"): "none",
    **{("[[link.sensor]]", name): "none" for name in ("touch_force_n", "forces_n", "force_levels")},
    **{("[[body]]", name): "none" for name in ("direction", "mass_kg", "stiffness_n_per_mm", "force_n")},
    ("[source]", "port"): "- with serial",
    ("[source]", "touch"): "none",
    ("[[source.touch]]", "sensor"): "the first",
}


def rows(section: str) -> dict[str, list[str]]:
    """Key -> unit, range, default, meaning."""
    body = DOCUMENT.split(f"\n## `{section}`\n", 1)[1].split("\n## ", 1)[0]
    found: dict[str, list[str]] = {}
    for line in body.splitlines():
        if match := re.match(r"\| `(\w+)` \| (.*) \|$", line):
            assert match[1] not in found, f"{section} has {match[1]} twice"
            found[match[1]] = [cell.strip() for cell in match[2].split("|")]
    return found


def default_in_si(section: str, key: Key) -> Any:
    """Return the default that counts: the key's own, or that of the value that the table is for."""
    settings = {"[reaction]": Reaction, "[monitoring]": MonitoringLimits}.get(section)
    if settings is not None and key.kind in (float, int):
        return next(field.default for field in fields(settings) if field.name == key.plain)
    return key.default


def default_text(section: str, key: Key) -> str:
    if (section, key.name) in IN_WORDS:
        return IN_WORDS[section, key.name]
    value = default_in_si(section, key)
    if value is ...:
        return "-"
    factor = schema._UNITS.get(key.suffix, (1.0, ""))[0]
    if key.kind is list and key.one_for_all and len(set(value)) == 1:
        return f"{value[0] / factor:g}"
    if key.kind is list:
        return "[" + ", ".join(f"{number / factor:g}" for number in value) + "]"
    if key.kind is bool:
        return str(value).lower()
    return f"{value / factor:g}" if key.kind is float else str(value)


def all_keys() -> Iterator[tuple[str, Key]]:
    for section, keys in SECTIONS.items():
        for key in keys:
            yield section, key


def test_the_document_has_a_section_for_each_table() -> None:
    assert re.findall(r"^## `(.*)`$", DOCUMENT, re.MULTILINE) == list(SECTIONS)
    assert {name.strip("[]").split(".")[0] for name in SECTIONS} == set(scene_reader.TABLES)


@pytest.mark.parametrize("section", SECTIONS)
def test_the_document_names_each_key_and_no_other(section: str) -> None:
    assert list(rows(section)) == [key.name for key in SECTIONS[section]]


@pytest.mark.parametrize(("section", "key"), list(all_keys()), ids=lambda item: getattr(item, "name", item))
def test_unit_range_and_default(section: str, key: Key) -> None:
    unit, bounds, default, meaning = rows(section)[key.name]
    assert default == default_text(section, key)
    assert meaning
    if key.suffix:
        assert unit.split(",")[0] == schema._UNITS[key.suffix][1]
    elif key.kind is int:
        assert unit == "whole number"
    if key.name == "waypoints_deg":
        key = motion_table._WAYPOINT[0]
    if key.choices:
        assert bounds == ", ".join(key.choices)
    elif math.isfinite(key.low) and math.isfinite(key.high):
        start = f"above {key.low:g}" if key.above else f"0 or {key.low:g}" if key.or_zero else f"{key.low:g}"
        end = f"{key.high}" if key.kind is int else f"{key.high:g}"
        assert bounds == f"{start} to {end}"
    elif math.isfinite(key.low):
        assert bounds == f"at least {key.low:g}"
    else:
        assert bounds == ""


def test_the_defaults_of_a_sensor_are_those_of_its_parts() -> None:
    """The table and the classes say the same, so that a sensor of a program and one of a scene are the same sensor."""
    text = '[[link]]\nname = "a"\n[[link.sensor]]\nradius1_mm = 54\nradius2_mm = 54\nheight_mm = 434\n'
    (item,) = parse_scene(text).sensors
    assert item.sensor == Sensor(item.sensor.frustum)
    assert (item.sensor.polarity, item.sensor.thresholds) == (Polarity(), Thresholds())
    assert item.sensor.electronics == match_electronics(item.sensor.radial_ohms, item.sensor.angular_ohms)


def test_there_are_four_examples() -> None:
    assert len(EXAMPLES) == 4


@pytest.mark.parametrize("number", range(4))
def test_the_examples_load(number: int) -> None:
    scene = parse_scene(EXAMPLES[number], f"example {number}")
    assert [len(link.sensors) for link in scene.links] == [[1], [1], [2], [2]][number]
    assert [scene.arm.model if scene.arm else None, scene.reaction.kind if scene.reaction else None] == [
        [None, None],
        ["UR10e", "retreat"],
        ["UR5e", "stop"],
        [None, None],
    ][number]


def test_the_two_sensors_of_the_double_cone_share_their_belt() -> None:
    (first, second) = parse_scene(EXAMPLES[2]).sensors
    for phi in (0.0, 1.0, 5.0):
        end = first.placed.point(first.sensor.frustum.slant, phi)
        assert end == pytest.approx(second.placed.point(0.0, phi), abs=1e-15)  # metres: one rounding of a sum
