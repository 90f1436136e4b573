"""Scene of a UR5e with one sensor on its forearm, and a commissioning of it that nobody has carried out."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from coneskin.scene.commissioning_record import MIN_MARKS, CommissioningRecord, MarkResult, fingerprint, write_record
from coneskin.scene.values.scene import Commissioning, Scene

START = [math.radians(q) for q in (-40.0, -90.0, 90.0, -90.0, -90.0, 0.0)]  #: joint positions [rad]
GOAL = [math.radians(60.0), *START[1:]]  #: joint positions 100 deg of the base further [rad]
ESCALATE = 0.025  #: s; default of the scene's monitoring.escalate_ms

_SCENE_TEXT = """\
[arm]
model = "UR5e"
host = "{host}"
control = "{control}"
[[link]]
name = "forearm"
[[link.sensor]]
radius1_mm = 37.6
radius2_mm = 37.2
height_mm = 260
xyz_mm = [0, 0, 80]
[source]
{source}
[reaction]
{reaction}
"""


def forearm_scene(
    host: str = "127.0.0.1",
    control: str = "internal",
    port: str = "",
    reaction: str = 'kind = "stop"\ndeceleration_rad_s2 = 10',
    limits: str = "",
) -> str:
    """Return the text of the scene.

    Args:
        host: of the controller.
        control: "internal" or "external".
        port: of the skin's bytes; a virtual skin where it is empty.
        reaction: lines of [reaction].
        limits: lines of [monitoring]; the limits that are not named have their defaults.
    """
    source = f'kind = "serial"\nport = "{port}"' if port else 'kind = "virtual"'
    text = _SCENE_TEXT.format(host=host, control=control, source=source, reaction=reaction)
    return text + (f"[monitoring]\n{limits}\n" if limits else "")


def start_with(base_deg: float) -> list[float]:
    """Return ``START`` with the base turned to an angle [deg], as joint positions [rad]."""
    return [math.radians(base_deg), *START[1:]]


def commissioned(scene: Scene) -> Scene:
    """Return a scene whose reactions may move the arm away."""
    return replace(scene, commissioning=Commissioning(True, "declared by a test"))


def write_passed_record(scene: Scene) -> Path:
    """Write a record beside a scene's file as if it had been commissioned now, and return its path."""
    marks = tuple(
        MarkResult(item.sensor.name, "nowhere", u, 0.0, u, 0.0, 0.0, 1.0, 1, True)
        for item in scene.sensors
        for u in map(float, range(MIN_MARKS))
    )
    now = datetime.now(UTC).isoformat(timespec="seconds")
    ohms = {item.sensor.number: (item.sensor.upper_sheet_ohms, item.sensor.lower_sheet_ohms) for item in scene.sensors}
    return write_record(scene, CommissioningRecord(now, "", fingerprint(scene), True, "", "a test", marks, ohms))
