"""Facts of a sensor on which the places that it decodes depend, as JSON has them: what fingerprints are made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor

__all__ = ["round_facts", "sensor_facts"]

_DIGITS = 9  # of a number in a fingerprint; the last bits of a sine may differ between machines


def sensor_facts(sensor: Sensor) -> dict[str, Any]:
    """Return numbers, geometry, polarity, electronics and sheets of a sensor; not name, thresholds and place map."""
    return {
        "number": [sensor.device_id, sensor.sensor_id],
        "frustum": asdict(sensor.frustum),
        "polarity": asdict(sensor.polarity),
        "electronics": asdict(sensor.electronics),
        "sheets": [sensor.upper_sheet_ohms, sensor.lower_sheet_ohms],
    }


def round_facts(value: Any) -> Any:
    """Return facts with each number rounded, so that those of two machines agree."""
    if isinstance(value, float):
        return round(value, _DIGITS) + 0.0  # no negative zero
    if isinstance(value, Mapping):
        return {key: round_facts(item) for key, item in value.items()}
    return [round_facts(item) for item in value] if isinstance(value, list | tuple) else value
