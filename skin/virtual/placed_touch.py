"""Touch of a script on its sensor: where it is pressed at a time, and how far its contact reaches."""

from __future__ import annotations

import math
from typing import NamedTuple, Self

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.sensor import Sensor

from .scripted_touch import ScriptedTouch

__all__ = ["PlacedTouch"]

_SLIDE_STEP = 1e-3  # m between the places of a touch that slides; the exact field of a new one costs about 2 ms
_ROUNDING = 1e-12  # m, rad; of where a slide ends


class PlacedTouch(NamedTuple):
    """A touch on its sensor."""

    touch: ScriptedTouch
    cone: Frustum  #: the sensor's active area
    reach: float  #: radius that its contact will have at its firmest [m]
    dwell: float  #: time that it stays at one place as it slides [s]; 0 where it does not slide

    @classmethod
    def on(cls, sensor: Sensor, touch: ScriptedTouch, reach: float) -> Self:
        """Put a touch on a sensor.

        Raises:
            SensorError: it begins or ends off the sensor.
        """
        cone = sensor.frustum
        for u, phi in (touch.u, touch.phi), touch.place_at(touch.end):
            if not (-_ROUNDING <= u <= cone.slant + _ROUNDING and -_ROUNDING <= phi <= cone.wrap + _ROUNDING):
                raise SensorError(
                    f"a touch must lie on {sensor.name}: u up to {cone.slant:g} m and phi up to {cone.wrap:g} rad, got "
                    f"{u!r} m and {phi!r} rad"
                )
        way = math.hypot(touch.slide_u, max(cone.radius1, cone.radius2) * touch.slide_phi)
        dwell = (touch.end - touch.start) / math.ceil(way / _SLIDE_STEP) if way else 0.0
        return cls(touch, cone, reach, dwell)

    def place_at(self, time: float) -> tuple[float, float]:
        """Return u [m] and phi [rad] of its contact at a time [s], in steps of a millimetre where it slides."""
        touch, cone = self.touch, self.cone
        if not self.dwell:
            return touch.u, touch.phi
        u, phi = touch.place_at(touch.start + self.dwell * round((time - touch.start) / self.dwell))
        return min(max(u, 0.0), cone.slant), min(max(phi, 0.0), cone.wrap)
