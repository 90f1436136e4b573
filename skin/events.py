"""What the skin reports: frozen values that carry both clocks, compare by value and can be written to a file."""

from __future__ import annotations

from dataclasses import dataclass

from .diagnosis import Fault

__all__ = ["Event", "SkinFault", "Touch", "TouchBegan", "TouchEnded", "TouchMoved"]


@dataclass(frozen=True, slots=True)
class Event:
    """Something happened on a sensor.

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
class Touch(Event):
    """A state of a touch.

    Attributes:
        level: how firmly, 0..1, the drift of the untouched sensor taken off.
        u: slant distance from end 1 [m].
        phi: azimuth [rad].
        location_valid: u and phi can be trusted; where they cannot, the touch is certain all the same.
    """

    level: float
    u: float
    phi: float
    location_valid: bool


@dataclass(frozen=True, slots=True)
class TouchBegan(Touch):
    """The level passed the touch threshold."""


@dataclass(frozen=True, slots=True)
class TouchMoved(Touch):
    """The touch moved, changed its level clearly, or its location became valid or invalid."""


@dataclass(frozen=True, slots=True)
class TouchEnded(Touch):
    """The level fell below the release threshold; the place is the last one that was certain, if one ever was."""


@dataclass(frozen=True, slots=True)
class SkinFault(Event):
    """The sensor, or the stream, cannot be believed from now on.

    Attributes:
        fault: what is wrong.
        detail: numbers that belong to it, for people.
    """

    fault: Fault
    detail: str = ""

    @property
    def message(self) -> str:
        """One clear line."""
        line = f"{self.sensor}: {self.fault.value}" if self.sensor else self.fault.value
        return f"{line} ({self.detail})" if self.detail else line
