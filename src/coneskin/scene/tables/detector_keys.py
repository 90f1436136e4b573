"""Keys of the detector's own settings. No scene has them: a what-if sets them, to see what they are worth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from coneskin.core.errors import SceneError, SensorError

from .schema import Key, check

__all__ = ["DETECTOR", "detector_keys", "detector_settings"]

DETECTOR = "detector"  #: what their names begin with
_UNITS = {
    "settle_distance": "_mm",
    "move_distance": "_mm",
    "largest_contact": "_mm",
    "lasting_touch": "_s",
    "drift_rate": "_per_s",
    "current_drift": "_per_s",
    "second_contact": "_siemens",
}
_OF_THE_SCENE = frozenset({"stuck_frames", "timing"})  # [monitoring] has them


def detector_keys() -> tuple[Key, ...]:
    """Return a key for each field of ``DetectorSettings`` that no scene sets; the unit is in its name."""
    from coneskin.skin.detection.frame.settings import DetectorSettings

    own = (item for item in fields(DetectorSettings) if item.name not in _OF_THE_SCENE)
    return tuple(Key(item.name + _UNITS.get(item.name, ""), type(item.default), None, low=0.0) for item in own)


def detector_settings(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values in SI by the names of the fields of ``DetectorSettings``.

    Args:
        values: by their keys, such as ``{"release_frames": 5, "move_distance_mm": 3.0}``.

    Raises:
        SceneError: a key is unknown, or a value is not possible.
    """
    problems: list[str] = []
    checked = check(values, detector_keys(), DETECTOR, problems) if values else {}
    found = {name: value for name, value in checked.items() if value is not None}
    if not problems and found:
        problems += _refusals(found)
    if problems:
        raise SceneError(problems, "settings")
    return found


def _refusals(values: Mapping[str, Any]) -> list[str]:
    from coneskin.skin.detection.frame.settings import DetectorSettings

    try:
        DetectorSettings(**values)
    except SensorError as exc:
        return [str(exc)]
    return []
