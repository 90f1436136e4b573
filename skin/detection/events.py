"""Events of the skin: frozen values that carry both clocks, compare by value and can be written to a file."""

from __future__ import annotations

from dataclasses import dataclass

from .frame.faults import Fault

__all__ = ["SkinEvent", "SkinFault", "TouchBegan", "TouchEnded", "TouchEvent", "TouchMoved"]


@dataclass(frozen=True, slots=True)
class SkinEvent:
    """An event of one sensor.

    Attributes:
        sensor: name of the sensor; empty where it concerns the whole stream.
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
        location_valid: u and phi can be trusted; where they cannot, the touch is certain all the same.
        doubt: why they cannot, for people.
        covariance: of the place of one contact: (uu, us, ss) [m^2], s the distance around, along the circle; None where
            it is not known.
        radius: of a round contact [m]; None where the frames do not tell.
        radius_deviation: standard deviation of the radius' logarithm; None with it.
        elongation: of what is not one disc: half the length [m] of the line on which contacts lie about the place, and
            its direction from u towards growing phi [rad]; how unequal they are is not identifiable. None where it may
            be one disc.
        velocity: along the side and around [m/s]; 0 where it rests, or where that is not known.
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
