"""Settings by the names of a scene's keys."""

import re
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest

from coneskin.core.errors import SceneError
from coneskin.core.keys import Key
from coneskin.robot.driver.liveness import MAX_ESCALATE
from coneskin.scene.reader import parse_scene
from coneskin.scene.settings import _detector_keys, override_detector, override_settings, parse_choices, parse_settings
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.sensor import Sensor

from .scenes import FULL


def test_words_become_values_as_in_a_scene_file() -> None:
    words = ["reaction.kind=stop", "detection.touch_level = 0.08", "arm.slider_stop=false", 'arm.host="a=b"', "a.b=.5"]
    assert parse_settings(words) == {
        "reaction.kind": "stop",
        "detection.touch_level": 0.08,
        "arm.slider_stop": False,
        "arm.host": "a=b",
        "a.b": 0.5,
    }


@pytest.mark.parametrize("word", ["", "reaction.kind", "=5", "reaction.kind="])
def test_a_word_without_name_or_value_is_refused(word: str) -> None:
    with pytest.raises(SceneError, match=r"a setting is TABLE\.KEY=VALUE"):
        parse_settings([word])


def test_a_key_of_detection_is_that_of_every_sensor_and_the_rest_stays() -> None:
    before = parse_scene(FULL)
    text = override_settings(FULL, {"detection.touch_level": 0.08, "monitoring.settle_ms": 70})
    scene = parse_scene(text)
    assert len(scene.sensors) == 2
    assert [item.sensor.thresholds.touch_level for item in scene.sensors] == [0.08, 0.08]
    assert scene.monitoring_limits.settle == pytest.approx(0.07)
    assert scene.arm == before.arm
    assert [item.placed for item in scene.sensors] == [item.placed for item in before.sensors]


def test_a_table_that_the_scene_has_not_is_added() -> None:
    text = override_settings("[[link]]\nname = 'a'\n", {"monitoring.settle_ms": 70})
    assert "settle_ms = 70" in text


def leaves(place: Any, way: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Yield the way to each value of a scene's tables."""
    if isinstance(place, dict | list):
        for part, inner in place.items() if isinstance(place, dict) else enumerate(place):
            yield from leaves(inner, (*way, str(part)))
    else:
        yield way


@pytest.mark.long
def test_every_value_of_a_scene_can_be_set_and_nothing_else_changes() -> None:
    rules = override_settings(FULL, {"reaction.rule": [{"link": "forearm", "kind": "stop"}], "arm.table_z_mm": 2})
    ways = [way for way in leaves(tomllib.loads(rules)) if way[0] not in ("source", "motion", "recording")]
    assert len(ways) > 20
    for way in ways:
        after = tomllib.loads(override_settings(rules, {".".join(way): 0.125}))
        changed = [one for one in leaves(after) if found(after, one) != found(tomllib.loads(rules), one)]
        assert changed == [way]


def found(place: Any, way: tuple[str, ...]) -> Any:
    for part in way:
        place = place[int(part) if isinstance(place, list) else part]
    return place


def test_an_item_of_a_list_goes_by_its_number_or_its_name() -> None:
    link, (first, second) = parse_scene(FULL).links[0].name, [item.name for item in sensors(FULL)]
    for settings in (
        {"sensor.1.touch_level": 0.08},
        {"sensor.1.detection.touch_level": 0.08},
        {f'sensor."{second}".touch_level': 0.08},
        {"link.0.sensor.1.touch_level": 0.08},
        {f'link."{link}".sensor."{second}".touch_level': 0.08},
    ):
        levels = {item.name: item.thresholds.touch_level for item in sensors(override_settings(FULL, settings))}
        assert levels == {first: 0.1, second: 0.08}, settings
    turned = override_settings(FULL, {"sensor.0.rpy_deg": [0, 0, 0], "sensor.0.xyz_mm": [0, 0, 0]})
    moved = parse_scene(override_settings(turned, {"sensor.0.xyz_mm.2": 12}))
    assert moved.sensors[0].placed.link_frustum.apply((0.0, 0.0, 0.0)) == pytest.approx((0.0, 0.0, 0.012))


def sensors(text: str) -> list[Sensor]:
    return [item.sensor for item in parse_scene(text).sensors]


def test_rules_are_set_and_added() -> None:
    one = override_settings(FULL, {"reaction.rule": [{"link": "forearm", "kind": "stop"}]})
    two = override_settings(
        one, {"reaction.rule.0.kind": "slow", "reaction.rule.1": {"level_above": 0.5, "kind": "stop"}}
    )
    assert [rule.reaction.kind for rule in parse_scene(two).rules] == ["slow", "stop"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("kind", "named TABLE.KEY"),
        ("raection.kind", "there is no table raection; did you mean reaction"),
        ("sensor.7.touch_level", "sensor has 2 items, counted from 0"),
        ("link.foream.frame", "there is no item foream; did you mean forearm"),
        ("reaction.kind.x", "reaction.kind is 'stop', which has no parts"),
        ("monitoring.a.b", "in monitoring there is no table or list a; there is none at all"),
        ("sensor.0", "sensor.0 is no value but a table"),
        ("source.touch.0.u_mm", "it would have no effect in a replay: the skin's bytes are the recorded ones"),
        ("motion.speed_deg_s", "it would have no effect in a replay: the arm moved as it was recorded"),
    ],
)
def test_a_name_that_leads_nowhere_is_refused(name: str, said: str) -> None:
    with pytest.raises(SceneError, match=re.escape(said)):
        override_settings(FULL, {name: 1})


def test_an_unknown_key_is_the_scene_readers_matter() -> None:
    for name in ("detection.touch_levle", "sensor.0.touch_levle"):
        with pytest.raises(SceneError, match="unknown key touch_levle; did you mean touch_level"):
            parse_scene(override_settings(FULL, {name: 0.08}))
    with pytest.raises(SceneError, match="has no sensor"):
        override_settings("", {"detection.touch_level": 0.08})


def test_the_detectors_own_settings_have_units_and_ranges() -> None:
    settings = {"detector.release_frames": 5, "detector.move_distance_mm": 3.0, "reaction.kind": "stop"}
    assert override_detector(settings) == {"release_frames": 5, "move_distance": 0.003}
    assert parse_scene(override_settings(FULL, settings)).default_reaction.kind == "stop"
    for name, value, said in (
        ("detector.relase_frames", 5, "did you mean release_frames"),
        ("detector.confirm_frames", 3, "must be 1 or 2"),
        ("detector.confirm_frames", 0.5, "must be a whole number"),
    ):
        with pytest.raises(SceneError, match=said):
            override_detector({name: value})
    everything = {f"detector.{key.name}": in_file(key, value) for key, value in defaults()}
    assert override_detector(everything) == pytest.approx({key.plain: value for key, value in defaults()})


def in_file(key: Key, value: Any) -> Any:
    return key.in_file_unit(value) if key.kind is float else value


def defaults() -> list[tuple[Key, Any]]:
    return [(key, getattr(DetectorSettings(), key.plain)) for key in _detector_keys()]


@pytest.mark.parametrize(
    ("word", "values"),
    [("a.b=1,2.5", [1, 2.5]), ("a.b=stop, retreat", ["stop", "retreat"]), ("a.b=[1,2],[3,4]", [[1, 2], [3, 4]])],
)
def test_choices_are_values_with_commas_between_them(word: str, values: list[Any]) -> None:
    assert parse_choices(word) == ("a.b", values)


def test_the_next_stop_path_waits_no_longer_than_what_a_measured_controller_is_held_against() -> None:
    table = "[monitoring]\nescalate_ms = {:g}\n"
    assert parse_scene(FULL.replace("[monitoring]\n", table.format(1e3 * MAX_ESCALATE), 1)) is not None
    with pytest.raises(SceneError, match="escalate_ms"):
        parse_scene(FULL.replace("[monitoring]\n", table.format(1e3 * MAX_ESCALATE + 1.0), 1))
