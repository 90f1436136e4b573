"""Table [[source.touch]] of a scene: a touch that a virtual skin plays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from .schema import Key, check

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor
    from coneskin.skin.virtual.scripted_touch import ScriptedTouch

__all__ = ["TOUCH_KEYS", "read_touch"]

TOUCH_KEYS = (
    Key("sensor", int, None, low=0, high=255),
    Key("start_s", low=0.0),
    Key("end_s", low=0.0),
    Key("u_mm", low=0.0, high=10_000.0),
    Key("phi_deg", low=0.0, high=360.0),
    Key("force_n", float, 5.0, low=0.0, high=1000.0),
    Key("radius_mm", float, 0.0, low=0.0, high=500.0),
    Key("grown_force_n", float, 0.0, low=0.0, high=1000.0),
    Key("growth_time_s", float, 0.0, low=0.0),
)


def read_touch(
    sensors: Sequence[Sensor | None], table: Mapping[str, Any], where: str, problems: list[str]
) -> ScriptedTouch | None:
    """Read a scripted touch; among the sensors, None stands for each that has a mistake."""
    from coneskin.skin.virtual.scripted_touch import ScriptedTouch

    before = len(problems)
    values = check(table, TOUCH_KEYS, where, problems)
    start, end = values.get("start", -math.inf), values.get("end", math.inf)
    if not start < end:
        problems.append(f"{where}: start_s must be before end_s, got {start:g} s and {end:g} s")
    wanted = values.pop("sensor")
    known = () if wanted is None and None in sensors else sensors  # the first of them may be one with a mistake
    sensor = next((one for one in known if one is not None and wanted in (None, one.sensor_id)), None)
    if sensor is None:
        if None not in sensors:  # otherwise it may be that one
            problems.append(f"{where}: there is no sensor {'to touch' if wanted is None else f'with the id {wanted}'}")
        return None
    cone = sensor.frustum
    u, phi = values.get("u", 0.0), values.get("phi", 0.0)
    if u > cone.slant or phi > cone.wrap:
        problems.append(
            f"{where} is off {sensor.name}, whose u_mm ends at {1e3 * cone.slant:g} and phi_deg at "
            f"{math.degrees(cone.wrap):g}: got {1e3 * u:g} mm and {math.degrees(phi):g} deg"
        )
    if values.get("grown_force") and not values.get("growth_time"):
        problems.append(f"{where}: grown_force_n needs a growth_time_s above 0 s")
    return ScriptedTouch(**values, sensor=sensor.name) if len(problems) == before else None
