"""Touch of a virtual skin: where, when and how firmly; on its sensor, across the seam, and as a shape of several."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.sensor import Sensor

from .imperfections import Foam

_MEMORY_TIMES = 40.0  # relaxation times; after them nothing is left of a touch


@dataclass(frozen=True, slots=True)
class ScriptedTouch:
    """One touch of the script.

    Attributes:
        start: when it begins [s].
        end: when it ends [s]; may be infinite.
        u: slant distance from end 1 [m].
        phi: azimuth [rad].
        force: at its firmest [N].
        rise: time in which the force rises, and falls again [s].
        radius: of a flat body's face [m]; 0 for a round body, whose contact grows with the force.
        sensor: name of the sensor touched; empty: the first.
        grown_force: to which it changes once it has risen [N]; 0: it stays.
        growth_time: in which it grows, evenly [s]; above 0 where there is a grown force.
        slide_u: how far it slides along the side, evenly from its start to its end [m]; below 0 towards end 1.
        slide_phi: how far it slides around [rad]; below 0 towards the edge at 0.

    Raises:
        SensorError: it ends before it begins, a value is not finite, one but the slide's is negative, or it slides and
            has no end.
    """

    start: float
    end: float
    u: float
    phi: float
    force: float = 5.0
    rise: float = 0.01
    radius: float = 0.0
    sensor: str = ""
    grown_force: float = 0.0
    growth_time: float = 0.0
    slide_u: float = 0.0
    slide_phi: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start) and self.end > self.start):
            raise SensorError(f"a touch must end after it starts, got {self.start!r} s to {self.end!r} s")
        units = {"u": "m", "phi": "rad", "force": "N", "rise": "s", "radius": "m"}
        for name, unit in {**units, "grown_force": "N", "growth_time": "s"}.items():
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise SensorError(f"touch.{name} must be finite and not negative [{unit}], got {value!r}")
        if self.grown_force and not self.growth_time > 0.0:
            raise SensorError(
                f"touch.growth_time must be above 0 s where grown_force is given, got {self.growth_time!r}"
            )
        if not (math.isfinite(self.slide_u) and math.isfinite(self.slide_phi)):
            raise SensorError(
                "touch.slide_u and touch.slide_phi must be finite [m, rad], "
                f"got {self.slide_u!r} and {self.slide_phi!r}"
            )
        if self.slides and self.end == math.inf:
            raise SensorError("a touch that slides must have an end: its speed follows from it, got end = inf s")

    @property
    def slides(self) -> bool:
        """Whether it ends at another place than it starts at."""
        return self.slide_u != 0.0 or self.slide_phi != 0.0

    def place_at(self, time: float) -> tuple[float, float]:
        """Return u [m] and phi [rad] at a time: a straight line on the unrolled sensor, at constant speed."""
        if not self.slides:
            return self.u, self.phi
        part = min(max((time - self.start) / (self.end - self.start), 0.0), 1.0)
        return self.u + part * self.slide_u, self.phi + part * self.slide_phi

    def ended_at(self, time: float) -> ScriptedTouch:
        """Return the same touch with another end [s]; what slides keeps its speed."""
        if not self.slides:
            return replace(self, end=time)
        part = (time - self.start) / (self.end - self.start)
        return replace(self, end=time, slide_u=part * self.slide_u, slide_phi=part * self.slide_phi)

    @property
    def firmest(self) -> float:
        """Largest force that it may reach [N]."""
        return max(self.force, self.grown_force)

    @property
    def _slope(self) -> float:
        return (self.grown_force - self.force) / self.growth_time if self.grown_force else 0.0

    def _risen(self, since: float) -> float:
        """Return the force a time after it has risen [N]."""
        return self.force + self._slope * min(max(since, 0.0), self.growth_time)

    def force_at(self, time: float) -> float:
        """Return the force at a time [N]: it rises along half a cosine, may grow, and falls as it has risen."""
        begun, left = time - self.start, self.end - time
        since = min(begun, left)
        if since <= 0.0:
            return 0.0
        held = begun - self.rise if begun < left else self.end - self.start - 2.0 * self.rise
        force = self._risen(min(held, begun - self.rise))
        return force if since >= self.rise else 0.5 * force * (1.0 - math.cos(math.pi * since / self.rise))

    def seated_at(self, time: float, foam: Foam) -> float:
        """Return the force that would in the end press the foam as far as it is pressed at a time [N]."""
        since, length = time - self.start, self.end - self.start
        if since <= 0.0 or since > length + _MEMORY_TIMES * foam.relaxation_time:
            return 0.0
        swing, state, slope = 0.5 * self.force, 0.0, self._slope
        ramp = min(self.rise, 0.5 * length)  # a short touch turns back on its way up
        if ramp + self.growth_time + _MEMORY_TIMES * foam.relaxation_time < since <= length - ramp:
            return self._risen(self.growth_time)
        if ramp > 0.0:
            rate = math.pi / self.rise
            state = foam.advance_swing(state, swing, swing, rate, 0.0, min(since, ramp))
        held = min(max(since - ramp, 0.0), length - 2.0 * ramp)
        growing = min(held, self.growth_time)
        state = foam.advance(state, self.force, growing, slope)
        state = foam.advance(state, self._risen(growing), held - growing)
        swing = 0.5 * self._risen(growing)
        if ramp > 0.0 and since > length - ramp:
            state = foam.advance_swing(state, swing, swing, -rate, rate * ramp, min(since - length, 0.0) + ramp)
        state = foam.advance(state, 0.0, max(since - length, 0.0))
        return foam.seated(state, self.force_at(time))


_SLIDE_STEP = 1e-3  # m between the places of a touch that slides; the exact field of a new one costs about 2 ms
_PLACE_TOLERANCE = 1e-12  # m, rad; of where a slide ends


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
            if not (
                -_PLACE_TOLERANCE <= u <= cone.slant + _PLACE_TOLERANCE
                and -_PLACE_TOLERANCE <= phi <= cone.wrap + _PLACE_TOLERANCE
            ):
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


_MIN_SHARE = 0.01  # part of a contact; less on the other side does nothing


def across_seam(cone: Frustum, u: float, phi: float, reach: float) -> tuple[float, float] | None:
    """Return the part of a round contact that lies beyond the gap.

    Args:
        u: slant distance of its middle from end 1 [m].
        phi: azimuth of its middle [rad].
        reach: its radius [m].

    Returns:
        azimuth of that part's centroid [rad] and how much of the contact it is; None where nothing reaches so far.
    """
    radius = cone.radius_at(u)
    gap = 2.0 * math.pi - cone.wrap
    over_start = phi <= 0.5 * cone.wrap
    distance = radius * (gap + (phi if over_start else cone.wrap - phi))
    if not distance < reach:
        return None
    ratio = distance / reach
    sine = math.sqrt(1.0 - ratio * ratio)
    share = (math.acos(ratio) - ratio * sine) / math.pi
    if share < _MIN_SHARE:
        return None
    inside = (2.0 / 3.0 * sine**3 / (math.pi * share) - ratio) * reach / radius  # from the other edge
    return (cone.wrap - inside if over_start else inside), share


_PALM_RADIUS = 0.03  # m; radius of its face
_FINGER_DISTANCE = 0.02  # m along the link
#: Shape -> the touches that make it of the first one, on a sensor's active area.
TOUCH_SHAPES: dict[str, Callable[[Frustum, ScriptedTouch], list[ScriptedTouch]]] = {
    "finger": lambda _, touch: [touch],
    "palm": lambda _, touch: [replace(touch, radius=_PALM_RADIUS)],
    "fingers": lambda _, touch: [replace(touch, u=touch.u + k * _FINGER_DISTANCE) for k in (-1, 0, 1)],
    # a hand that closes around the link
    "grip": lambda _, touch: [touch, replace(touch, phi=(touch.phi + math.pi) % (2.0 * math.pi))],
    # a palm that lies over the seam, so far from each edge
    "seam": lambda cone, touch: [touch, replace(touch, phi=cone.wrap - touch.phi)],
}
