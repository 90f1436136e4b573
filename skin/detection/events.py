"""Events of the skin: frozen values that carry both clocks, compare by value and can be written to a file.

A touch begins with one event and ends with another. Between them one is due where the level or the place has changed
by a step since the last, where the place became certain or ceased to be, and once where a line was found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

from .frame.faults import Fault
from .frame.reading import TouchReading
from .frame.settings import DetectorSettings

_FULL_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class SkinEvent:
    """An event of one sensor.

    Attributes:
        sensor: name of the sensor. Empty where it concerns the whole stream.
        time: host clock when the frame arrived [s].
        clock_us: device clock of the frame [us], modulo 2**32.
        sequence: sequence number of the frame.
    """

    sensor: str
    time: float
    clock_us: int
    sequence: int


@dataclass(frozen=True, slots=True)
class TouchEvent(SkinEvent):
    """An event of a touch.

    Attributes:
        level: how firmly, 0..1, the drift of the untouched sensor taken off.
        u: slant distance from end 1 [m].
        phi: azimuth [rad].
        location_valid: u and phi can be trusted. Where they cannot, the touch is certain all the same.
        doubt: why they cannot, for people.
        covariance: of the place of one contact: (uu, us, ss) [m^2], s the distance around, along the circle. None where
            it is not known.
        radius: of a round contact [m]. None where the frames do not tell.
        radius_deviation: standard deviation of the radius' logarithm. None where the radius is.
        elongation: of what is not one disc: half the length [m] of the line on which contacts lie about the place, and
            its direction from u towards growing phi [rad]. How unequal they are is not identifiable. None where it may
            be one disc.
        velocity: along the side and around [m/s]. It is 0 where it rests, or where that is not known.
    """

    level: float
    u: float
    phi: float
    location_valid: bool
    doubt: str = ""
    covariance: tuple[float, float, float] | None = None
    radius: float | None = None
    radius_deviation: float | None = None
    elongation: tuple[float, float] | None = None
    velocity: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class TouchBegan(TouchEvent):
    """The start of a touch: its level passed the touch threshold."""


@dataclass(frozen=True, slots=True)
class TouchMoved(TouchEvent):
    """A change of a touch: it moved, its level changed clearly, or its location became valid or invalid."""


@dataclass(frozen=True, slots=True)
class TouchEnded(TouchEvent):
    """The end of a touch: its level fell below the release threshold. The place is the last certain one, if any."""


@dataclass(frozen=True, slots=True)
class SkinFault(SkinEvent):
    """A fault: from now on the sensor, or the stream, must not be believed.

    Attributes:
        fault: what is wrong.
        detail: numbers that belong to it, for people.
    """

    fault: Fault
    detail: str = ""

    @property
    def message(self) -> str:
        """One clear line for people."""
        line = f"{self.sensor}: {self.fault.value}" if self.sensor else self.fault.value
        return f"{line} ({self.detail})" if self.detail else line


class ReportedTouch:
    """The touches of one sensor as its events tell them.

    Args:
        sensor: the sensor.
        settings: by how much a touch has to change.
    """

    def __init__(self, sensor: Sensor, settings: DetectorSettings) -> None:
        self._sensor = sensor
        self._radius = max(sensor.frustum.radius1, sensor.frustum.radius2)
        self._step, self._far = settings.level_step, settings.move_distance
        # level, place and doubt; a place was certain, a line was found
        self._told = 0.0, 0.0, 0.0, "", False, False

    def begin(self, touch: TouchReading) -> TouchBegan:
        """Return the event with which a touch begins.

        Args:
            touch: the frame that confirms it.
        """
        time, level, u, phi, valid, doubt, clock, sequence = touch[:8]
        self._told = level, u, phi, doubt, not doubt, False
        return TouchBegan(self._sensor.name, time, clock, sequence, level, u, phi, valid, doubt, *touch[8:])

    def move(self, touch: TouchReading) -> TouchMoved | None:
        """Return the event that a frame of a touch makes due. None where it tells nothing new.

        Args:
            touch: the frame, above the release threshold.
        """
        level_told, u_told, phi_told, doubted, placed, extended = self._told
        valid, step = touch.location_valid, touch.level - level_told
        shape = None if valid else touch.elongation
        if (
            valid is not (not doubted)
            or not -self._step <= step <= self._step
            or (valid and self._distance(touch.u - u_told, touch.phi - phi_told) > self._far)
            or (shape is not None and not extended)
        ):
            time, level, u, phi, valid, doubt, clock, sequence = touch[:8]
            certain = (u_told, phi_told) if placed and not valid else (u, phi)
            if shape is None:
                u, phi = certain  # the last place that was certain is the better guess; a line has its own
            self._told = level, *certain, doubt, placed or not doubt, extended or shape is not None
            return TouchMoved(self._sensor.name, time, clock, sequence, level, u, phi, valid, doubt, *touch[8:])
        return None

    def end(self, frame: Frame, now: float, level: float) -> TouchEnded:
        """Return the event with which a touch ends, at the last place that was told.

        Args:
            frame: the one that confirms the end.
            now: host clock when it arrived [s].
            level: its level, the drift taken off.
        """
        _, u, phi, _, placed, _ = self._told
        return TouchEnded(self._sensor.name, now, frame.clock_us, frame.sequence, level, u, phi, placed)

    def _distance(self, u: float, phi: float) -> float:
        """Return the distance of two places that differ by this [m], never too small."""
        return math.hypot(u, self._radius * math.remainder(phi, _FULL_TURN))
