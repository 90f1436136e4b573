"""Settings of a scene by name: overrides for a what-if, the detector's own, and all values once defaults are filled in.

A name is the way to a key, such as ``reaction.rule.0.kind``. The detector's own settings stand in no scene: only a
what-if sets them. Resolved settings tell what another version of the code would fill in otherwise.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, fields
from typing import Any

from coneskin.core.errors import SceneError, SensorError
from coneskin.core.keys import Key, check
from coneskin.core.text import suggest

from .reader import TABLES
from .tables.sensor_tables import sensor_tables
from .values.scene import Scene, sensor_facts

_NAME_EXAMPLE = (
    "write reaction.kind=stop, monitoring.settle_ms=100, reaction.rule.0.kind=slow, sensor.0.touch_level=0.08, "
    "detection.touch_level=0.08 for all sensors, or detector.release_frames=5"
)
_ALL_SENSORS = "detection"  # keys of every [[link.sensor]]
_ONE_SENSOR = "sensor"  # the sensors of all links in the order of the file
_BARE_POINT = re.compile(r"(?<![\w.\"'])([+-]?)\.(?=\d)")  # of a number such as .08, which is none in TOML
#: tables of which a replay uses nothing, and why
_NO_EFFECT = {
    "source": "the skin's bytes are the recorded ones",
    "motion": "the arm moved as it was recorded",
    "recording": "nothing is recorded",
}
_NAME_PART = re.compile(r'"([^"]*)"|([^."]+)')


def parse_settings(words: Iterable[str]) -> dict[str, Any]:
    """Return the settings in words such as "reaction.kind=stop": name -> value, as TOML reads it, or a text.

    Raises:
        SceneError: a word has no name or no value.
    """
    settings = {}
    for word in words:
        name, text = _split(word)
        settings[name] = _value(text)
    return settings


def parse_choices(word: str) -> tuple[str, list[Any]]:
    """Return the name and the values in a word such as "detection.touch_level=0.06,0.08"; errors as above."""
    name, text = _split(word)
    values = _value(f"[{text}]")
    return name, values if isinstance(values, list) else [_value(part.strip()) for part in text.split(",")]


def _split(word: str) -> tuple[str, str]:
    name, equals, text = word.partition("=")
    if not equals or not name.strip() or not text.strip():
        raise SceneError([f"a setting is TABLE.KEY=VALUE, got {word!r}; {_NAME_EXAMPLE}"], "settings")
    return name.strip(), text.strip()


def _value(text: str) -> Any:
    try:
        return tomllib.loads("value = " + _BARE_POINT.sub(r"\g<1>0.", text))["value"]
    except (ValueError, RecursionError, KeyError):
        return text  # a word without quotation marks


def override_detector(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return those settings that are the detector's own, by the names of their fields, in SI.

    Raises:
        SceneError: one of them is unknown, or its value not possible.
    """
    parted = [(*name.partition(".")[::2], value) for name, value in settings.items()]
    own = {key: value for table, key, value in parted if table == _DETECTOR_NAME}
    if not own:
        return {}
    from coneskin.skin.detection.frame.settings import DetectorSettings

    problems: list[str] = []
    checked = check(own, _detector_keys(), _DETECTOR_NAME, problems)
    found = {name: value for name, value in checked.items() if value is not None}
    try:
        DetectorSettings(**({} if problems else found))
    except SensorError as exc:
        problems.append(str(exc))
    if problems:
        raise SceneError(problems, "settings")
    return found


def override_settings(text: str, settings: Mapping[str, Any]) -> str:
    """Return the text of a scene with other values.

    Args:
        text: of the scene, with the keys of its sensor files in it, as a recording carries it.
        settings: name -> value, in the unit of the key's name. A name is the way to a key, with dots between its parts:
            tables by their names, lists by the number of the item from 0, or by its name: "reaction.rule.0.kind",
            "link.forearm.frame". "sensor" stands for the sensors of all links, "detection" for every one of them. What
            is the detector's own is left out: see ``override_detector``.

    Raises:
        SceneError: the text is not TOML, or there is no such place. Whether the last key is known and its value
            possible is checked where the scene is read.
    """
    import tomli_w

    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as exc:
        raise SceneError([f"not TOML: {exc}"], "settings") from exc
    problems: list[str] = []
    for name, value in settings.items():
        parts = [quoted or plain for quoted, plain in _NAME_PART.findall(name)]
        if parts[:1] == [_DETECTOR_NAME]:
            continue
        try:
            _override(tables, parts, value)
        except _NoPlace as exc:
            problems.append(f"{name}: {exc}")
    if problems:
        raise SceneError(problems, "settings")
    return tomli_w.dumps(tables)


class _NoPlace(Exception):
    """A name leads nowhere."""


def _override(tables: dict[str, Any], parts: list[str], value: Any) -> None:
    if len(parts) < 2:
        raise _NoPlace(f"a setting is named TABLE.KEY; {_NAME_EXAMPLE}")
    if parts[0] in _NO_EFFECT:
        raise _NoPlace(f"it would have no effect in a replay: {_NO_EFFECT[parts[0]]}; leave it out")
    sensors = sensor_tables(tables)
    if parts[0] in (_ALL_SENSORS, _ONE_SENSOR) and not sensors:
        raise _NoPlace("the scene has no sensor")
    if parts[0] == _ALL_SENSORS:
        for sensor in sensors:
            _put(sensor, parts[1:], value, parts[0])
    elif parts[0] == _ONE_SENSOR:
        place = _step(sensors, parts[1], _ONE_SENSOR)
        _put(place, [part for part in parts[2:3] if part != _ALL_SENSORS] + parts[3:], value, ".".join(parts[:2]))
    elif parts[0] in TABLES:
        _put(tables.setdefault(parts[0], {}), parts[1:], value, parts[0])
    else:
        raise _NoPlace(_unknown("table", parts[0], [*TABLES, _ONE_SENSOR, _ALL_SENSORS, _DETECTOR_NAME]))


def _put(place: Any, parts: list[str], value: Any, where: str) -> None:
    """Set the value at the end of the way through tables and lists."""
    if not parts:
        raise _NoPlace(f"{where} is no value but a table: name one of its keys")
    for part in parts[:-1]:
        place = _step(place, part, where)
        where = f"{where}.{part}"
    last = parts[-1]
    if isinstance(place, dict):
        place[last] = value
    elif isinstance(place, list):
        number = _index(place, last, where, room=isinstance(value, dict))
        place[number : number + 1] = [value]
    else:
        raise _NoPlace(f"{where} is {place!r}, which has no parts")


def _step(place: Any, part: str, where: str) -> Any:
    if isinstance(place, list):
        return place[_index(place, part, where)]
    if not isinstance(place, dict):
        raise _NoPlace(f"{where} is {place!r}, which has no parts")
    if part not in place:
        inner = [name for name, value in place.items() if isinstance(value, dict | list)]
        raise _NoPlace(f"in {where} " + _unknown("table or list", part, inner))
    return place[part]


def _index(items: list[Any], part: str, where: str, room: bool = False) -> int:
    """Return the number of an item that a part of a name stands for; with room, it may be the next one."""
    if part.isdecimal() and int(part) < len(items) + room:
        return int(part)
    names = [str(item["name"]) for item in items if isinstance(item, dict) and "name" in item]
    for number, item in enumerate(items):
        if isinstance(item, dict) and item.get("name") == part:
            return number
    numbers = f"{where} has {len(items)} item{'s'[: len(items) != 1]}, counted from 0"
    raise _NoPlace(f"{numbers}; " + (_unknown("item", part, names) if names else f"got {part!r}"))


def _unknown(what: str, part: str, known: list[str]) -> str:
    return f"there is no {what} {part}; {suggest(part, known)}"


_DETECTOR_NAME = "detector"  # what their names begin with
_DETECTOR_UNITS = {
    "settle_distance": "_mm",
    "move_distance": "_mm",
    "largest_contact": "_mm",
    "lasting_touch": "_s",
    "drift_rate": "_per_s",
    "current_drift": "_per_s",
    "second_contact": "_siemens",
}
_OF_THE_SCENE = frozenset({"stuck_frames", "timing"})  # [monitoring] has them


def _detector_keys() -> tuple[Key, ...]:
    """Return a key for each field of ``DetectorSettings`` that no scene sets; the unit is in its name."""
    from coneskin.skin.detection.frame.settings import DetectorSettings

    own = (item for item in fields(DetectorSettings) if item.name not in _OF_THE_SCENE)
    return tuple(Key(item.name + _DETECTOR_UNITS.get(item.name, ""), type(item.default), None, low=0.0) for item in own)


def resolved_settings(scene: Scene) -> dict[str, Any]:
    """Return electronics, sheets and thresholds of each sensor, reaction, monitoring limits, for JSON; SI."""
    sensors = {
        item.sensor.name: {**sensor_facts(item.sensor), "thresholds": asdict(item.sensor.thresholds)}
        for item in scene.sensors
    }
    found = {"sensors": sensors, "monitoring": asdict(scene.monitoring_limits)}
    if scene.arm is not None:
        found["reaction"] = asdict(scene.default_reaction)
    plain: dict[str, Any] = json.loads(json.dumps(found))
    return plain


def changed_settings(recorded: Any, scene: Scene) -> list[str]:
    """Return what today's code fills in otherwise, such as ``monitoring.settle 0.3 -> 0.5``; SI.

    Args:
        recorded: settings as a recording has them; what it does not have is not compared.
    """
    return list(_changes("", recorded, resolved_settings(scene))) if isinstance(recorded, Mapping) else []


def _changes(name: str, before: Any, now: Any) -> Iterator[str]:
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for key in before:
            if key in now:
                yield from _changes(f"{name}.{key}" if name else str(key), before[key], now[key])
    elif before != now:
        yield f"{name} {json.dumps(before)} -> {json.dumps(now)}"
