"""Settings that a scene has once every default is filled in: another version may choose others for the same scene."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from .values.sensor_facts import sensor_facts

if TYPE_CHECKING:
    from .values.scene import Scene

__all__ = ["changed_settings", "resolved_settings"]


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
        scene: the same scene, as it was read today.
    """
    return list(_changes("", recorded, resolved_settings(scene))) if isinstance(recorded, Mapping) else []


def _changes(name: str, before: Any, now: Any) -> Iterator[str]:
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for key in before:
            if key in now:
                yield from _changes(f"{name}.{key}" if name else str(key), before[key], now[key])
    elif before != now:
        yield f"{name} {json.dumps(before)} -> {json.dumps(now)}"
