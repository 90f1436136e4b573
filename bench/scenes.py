"""The scene of the benches that guard an arm: a UR5e whose forearm carries one sensor."""

from __future__ import annotations

__all__ = ["ESCALATE", "START", "forearm_scene", "start_with"]

import math

START = [math.radians(q) for q in (-40.0, -90.0, 90.0, -90.0, -90.0, 0.0)]
ESCALATE = 0.025  # s, the default of the scene's watch.escalate_ms
_SCENE = """\
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


def start_with(base_deg: float) -> list[float]:
    """START with the base turned to an angle [deg]; joint positions [rad]."""
    return [math.radians(base_deg), *START[1:]]


def forearm_scene(
    host: str = "127.0.0.1",
    control: str = "owner",
    port: str = "",
    reaction: str = 'kind = "stop"\ndeceleration_rad_s2 = 10',
    watch: str = "",
) -> str:
    """The text of a scene.

    Args:
        host: of the controller.
        control: "owner" or "foreign".
        port: of the skin's bytes; a virtual skin where it is empty.
        reaction: lines of [reaction].
        watch: lines of [watch]; the limits that are not named have their defaults.
    """
    source = f'kind = "serial"\nport = "{port}"' if port else 'kind = "virtual"'
    text = _SCENE.format(host=host, control=control, source=source, reaction=reaction)
    return text + (f"[watch]\n{watch}\n" if watch else "")
