"""Tables [arm] and [monitoring] of a scene: the arm, and how long what belongs to it may be silent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import ConeSkinError
from coneskin.scene.values.scene import ArmScene

from .schema import Key, check

if TYPE_CHECKING:
    from coneskin.robot.stop.limits import MonitoringLimits

__all__ = ["ARM_KEYS", "MONITORING_KEYS", "read_arm", "read_monitoring"]

ARM_KEYS = (
    Key("model", str),
    Key("host", str),
    Key("watchdog_hz", float, 4.0, low=1.0, high=100.0),
    Key("control", str, "internal", choices=("internal", "external")),
    Key("table_z_mm", float, None, low=-5000.0, high=5000.0),
    Key("slider_stop", bool, True),
    Key("speed_limit_from", str, None),
    Key("controller_heartbeat", str, "optional", choices=("required", "optional")),
)
MONITORING_KEYS = (
    Key("skin_silence_ms", low=2.0, high=1000.0),
    Key("skin_late_ms", low=2.0, high=1000.0),
    Key("clock_drift_ppm", low=1.0, high=50_000.0),
    Key("stuck_frames", int, low=0, high=1_000_000),
    Key("arm_silence_ms", low=4.0, high=1000.0),
    Key("escalate_ms", low=4.0, high=500.0),
    Key("standstill_rad_s", low=1e-4, high=0.1),
    Key("settle_ms", low=10.0, high=10_000.0),
    Key("program_silence_ms", low=60.0, high=5000.0),
)


def read_arm(tables: Mapping[str, Any], problems: list[str]) -> ArmScene | None:
    """Return the arm; None without one, or with a mistake, which is added to the problems."""
    if "arm" not in tables:
        return None
    values = check(tables["arm"], ARM_KEYS, "arm", problems)
    if "model" in values:
        from coneskin.robot.arm.ur_models import arm_model

        try:
            values["model"] = arm_model(values["model"]).name
        except ConeSkinError as exc:
            problems.append(f"arm.model: {exc}")
            del values["model"]
    if not values.get("host", "?").strip():
        problems.append("arm.host must name the controller, got an empty text")
    if len(values) < len(ARM_KEYS):
        return None
    del values["speed_limit_from"]  # the table stands in place of it
    return ArmScene(watchdog_hz=values.pop("watchdog"), **values)


def read_monitoring(tables: Mapping[str, Any], problems: list[str]) -> MonitoringLimits | None:
    """Return the limits of [monitoring], the defaults included; None where the scene has no such table."""
    if "monitoring" not in tables:
        return None
    from coneskin.robot.stop.limits import MonitoringLimits

    return MonitoringLimits(**_settings(MONITORING_KEYS, tables, "monitoring", problems))


def _settings(keys: tuple[Key, ...], tables: Mapping[str, Any], name: str, problems: list[str]) -> dict[str, Any]:
    """Return the values that a table sets; missing keys have the defaults of the dataclass that takes them."""
    required = {key.name for key in keys if key.kind is str}
    optional = tuple(key if key.name in required else replace(key, default=None) for key in keys)
    values = check(tables[name], optional, name, problems)
    return {key: value for key, value in values.items() if value is not None}
