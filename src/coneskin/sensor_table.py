"""The table that describes one sensor: in a scene, or in the sensor.toml that ``coneskin design`` writes."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import ConeSkinError
from .schema import Key, check

if TYPE_CHECKING:
    from .geometry.placed import PlacedFrustum
    from .skin.sensor import Sensor

__all__ = ["SENSOR_KEYS", "build_sensor", "with_file"]

_SHAPE = (
    Key("radius1_mm", float, low=1.0, high=5000.0),
    Key("radius2_mm", float, low=1.0, high=5000.0),
    Key("height_mm", float, low=1.0, high=10_000.0, or_zero=True),  # 0 is a flat ring
    Key("wrap_deg", float, 6.283185307179586, low=0.0, high=360.0, above=True),
)
_PLACE = (
    Key("xyz_mm", list, (0.0, 0.0, 0.0), low=-10_000.0, high=10_000.0, length=3),
    Key("rpy_deg", list, (0.0, 0.0, 0.0), low=-360.0, high=360.0, length=3),
)
_WIRE = (
    Key("id", int, 0, low=0, high=255),
    Key("device", int, 0, low=0, high=65535),
    Key("name", str, ""),
)
_POLARITY = (
    Key("radial_positive", str, "B", choices=("A", "B")),
    Key("angular_positive", str, "C", choices=("C", "D")),
)
_ELECTRONICS = (
    Key("supply_v", float, 2.5, low=0.1, high=50.0),
    Key("adc_v", float, 3.3, low=0.1, high=50.0),
    Key("adc_bits", int, 12, low=8, high=16),
    Key("pulldown_ohm", float, 10e3, low=1.0, high=1e9),
    Key("input_ohm", float, 10e6, low=1.0, high=1e12),
    Key("lead_ohm", float, 1.0, low=0.0, high=1e6, above=True),
    Key("current_full_scale_ma", float, 0.02, low=1e-3, high=1e4),
)
_SHEETS = (
    Key("upper_sheet_ohm", float, 1000.0, low=1e-3, high=1e9),
    Key("lower_sheet_ohm", float, 1000.0, low=1e-3, high=1e9),
)
_THRESHOLDS = (
    Key("touch_level", float, 0.10, low=0.0, high=1.0, above=True),
    Key("release_level", float, 0.05, low=0.03, high=1.0, above=True),  # above the drift that a detector follows
    Key("location_level", float, 0.20, low=0.0, high=1.0, above=True),
)
SENSOR_KEYS = (*_SHAPE, *_PLACE, *_WIRE, *_POLARITY, *_ELECTRONICS, *_SHEETS, *_THRESHOLDS)


def with_file(table: Mapping[str, Any], where: str, folder: Path, problems: list[str]) -> dict[str, Any]:
    """A sensor's table with the keys of the ``file`` that it names; its own keys win over those.

    Args:
        table: of the scene.
        where: the table's name, for the messages.
        folder: where a relative ``file`` starts.
        problems: every mistake is added here.
    """
    own = dict(table)
    if "file" not in own:
        return own
    (name,) = check({"file": own.pop("file")}, (Key("file", str, None),), where, problems).values()
    return {**(_from_file(folder / name, where, problems) if name is not None else {}), **own}


def build_sensor(table: Mapping[str, Any], where: str, problems: list[str]) -> tuple[Sensor, PlacedFrustum] | None:
    """The sensor that a table describes, and its place.

    Args:
        table: its keys are SENSOR_KEYS.
        where: the table's name, for the messages.
        problems: every mistake is added here.

    Returns:
        the sensor and its placed frustum, or None where a mistake forbids it.
    """
    before = len(problems)
    values = check(table, SENSOR_KEYS, where, problems)
    if len(problems) > before:
        return None
    from .geometry.frustum import Frustum
    from .geometry.placed import PlacedFrustum
    from .geometry.pose import Pose
    from .skin.electronics import Electronics, Polarity, Thresholds
    from .skin.sensor import Sensor

    try:
        frustum = Frustum(values["radius1"], values["radius2"], values["height"], values["wrap"])
        sensor = Sensor(
            frustum=frustum,
            sensor_id=values["id"],
            device_id=values["device"],
            name=values["name"],
            electronics=Electronics(
                supply_volts=values["supply"],
                adc_volts=values["adc"],
                adc_bits=values["adc_bits"],
                pulldown_ohms=values["pulldown"],
                input_ohms=values["input"],
                lead_ohms=values["lead"],
                current_full_scale=values["current_full_scale"],
            ),
            polarity=Polarity(values["radial_positive"], values["angular_positive"]),
            thresholds=Thresholds(values["touch_level"], values["release_level"], values["location_level"]),
            upper_sheet_ohms=values["upper_sheet"],
            lower_sheet_ohms=values["lower_sheet"],
        )
        return sensor, PlacedFrustum(frustum, Pose.from_xyz_rpy(values["xyz"], values["rpy"]))
    except ConeSkinError as exc:
        problems.append(f"{where}: {_in_words_of_the_file(str(exc))}")
        return None


def _from_file(path: Path, where: str, problems: list[str]) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as exc:
        problems.append(f"{where}.file: {path} cannot be read: {exc.strerror or exc}")
    except (ValueError, RecursionError) as exc:  # not TOML, not UTF-8, or a whole number of 5000 digits
        problems.append(f"{where}.file: {path} is not TOML: {exc}")
    return {}


_WORDS = {
    "electronics.supply_volts": "supply_v",
    "adc_volts": "adc_v",
    "electronics.adc_bits": "adc_bits",
    "electronics.input_ohms": "input_ohm",
    "pulldown_ohms": "pulldown_ohm",
    "electronics.lead_ohms": "lead_ohm",
    "electronics.current_full_scale": "current_full_scale_ma",
}


def _in_words_of_the_file(message: str) -> str:
    """An error of the sensor's classes with the names that stand in the file."""
    for attribute, key in _WORDS.items():
        message = message.replace(attribute, key)
    return message
