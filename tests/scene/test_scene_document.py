"""Examples of docs/look-up/scene.md load. Its tables are made by scripts/reference.py."""

import importlib.util
import re

import pytest

from coneskin.scene.reader import parse_scene
from coneskin.skin.electronics import Polarity, Thresholds, match_electronics
from coneskin.skin.sensor import Sensor
from tests.support.paths import ROOT

DOCUMENT = (ROOT / "docs" / "look-up" / "scene.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```toml.*?\n(.*?)```", DOCUMENT, re.DOTALL)


def test_the_defaults_of_a_sensor_are_those_of_its_parts() -> None:
    """The table and the classes say the same, so that a sensor of a program and one of a scene are the same sensor."""
    text = '[[link]]\nname = "a"\n[[link.sensor]]\nradius1_mm = 54\nradius2_mm = 54\nheight_mm = 434\n'
    (item,) = parse_scene(text).sensors
    assert item.sensor == Sensor(item.sensor.frustum)
    assert (item.sensor.polarity, item.sensor.thresholds) == (Polarity(), Thresholds())
    assert item.sensor.electronics == match_electronics(item.sensor.radial_ohms, item.sensor.angular_ohms)


def test_the_tables_of_its_keys_are_what_a_scene_allows() -> None:
    """Limits and defaults that a person reads there are those that count."""
    spec = importlib.util.spec_from_file_location("reference", ROOT / "scripts" / "reference.py")
    assert spec is not None
    assert spec.loader is not None
    spec.loader.exec_module(reference := importlib.util.module_from_spec(spec))
    assert reference.page("scene.md") == DOCUMENT


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
