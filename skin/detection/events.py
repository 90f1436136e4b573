"""Events of the skin: tuples that carry both clocks, compare by value and can be written to a file.

A touch begins with one event and ends with another. Between them one is due where the level or the place has changed
by a step since the last, where the place became certain or ceased to be, and once where a line was found.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

from .frame.faults import Fault


class TouchEvent(NamedTuple):
    """An event of a touch.

    Attributes:
        sensor: name of the sensor.
        time: host clock when the frame arrived [s].
        level: how firmly, 0..1, the drift of the untouched sensor taken off.
        u: slant distance from end 1 [m].
        phi: azimuth [rad].
        location_valid: u and phi can be trusted. Where they cannot, the touch is certain all the same.
        doubt: why they cannot, for people.
        clock_us: device clock of the frame [us], modulo 2**32.
        sequence: sequence number of the frame.
        covariance: of the place of one contact: (uu, us, ss) [m^2], s the distance around, along the circle. None where
            it is not known.
        radius: of a round contact [m]. None where the frames do not tell.
        radius_deviation: standard deviation of the radius' logarithm. None where the radius is.
        elongation: of what is not one disc: half the length [m] of the line on which contacts lie about the place, and
            its direction from u towards growing phi [rad]. How unequal they are is not identifiable. None where it may
            be one disc.
        velocity: along the side and around [m/s]. It is 0 where it rests, or where that is not known.
    """

    sensor: str
    time: float
    level: float
    u: float
    phi: float
    location_valid: bool
    doubt: str
    clock_us: int
    sequence: int
    covariance: tuple[float, float, float] | None = None
    radius: float | None = None
    radius_deviation: float | None = None
    elongation: tuple[float, float] | None = None
    velocity: tuple[float, float] = (0.0, 0.0)


class TouchBegan(TouchEvent):
    """The start of a touch: its level passed the touch threshold."""

    __slots__ = ()


class TouchMoved(TouchEvent):
    """A change of a touch: it moved, its level changed clearly, or its location became valid or invalid."""

    __slots__ = ()


class TouchEnded(TouchEvent):
    """The end of a touch: its level fell below the release threshold. The place is the last certain one, if any."""

    __slots__ = ()


class SkinFault(NamedTuple):
    """A fault: from now on the sensor, or the stream, must not be believed.

    Attributes:
        sensor: name of the sensor. Empty where it concerns the whole stream.
        time: host clock when the frame arrived [s].
        clock_us: device clock of the frame [us], modulo 2**32.
        sequence: sequence number of the frame.
        fault: what is wrong.
        detail: numbers that belong to it, for people.
    """

    sensor: str
    time: float
    clock_us: int
    sequence: int
    fault: Fault
    detail: str = ""

    @property
    def message(self) -> str:
        """One clear line for people."""
        line = f"{self.sensor}: {self.fault.value}" if self.sensor else self.fault.value
        return f"{line} ({self.detail})" if self.detail else line


SkinEvent: TypeAlias = "TouchEvent | SkinFault"  #: of one sensor, or of the whole stream
