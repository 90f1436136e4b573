"""A touch of a sensor that is on a link: where it is, for the reaction and for the events."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from coneskin.geometry.pose import Vector
from coneskin.skin.events import Touch

from .commands import ContactOnLink

__all__ = ["Contact", "GuardedSensor"]


@dataclass(frozen=True, slots=True)
class GuardedSensor:
    """A sensor on a link.

    Attributes:
        name: the sensor's.
        link_name: of the link, for people.
        link: index of the link's DH frame.
        place: (u [m], phi [rad]) -> point [m] and outward unit normal, in the link's DH frame.
        threshold: level from which it is touched.
    """

    name: str
    link_name: str
    link: int
    place: Callable[[float, float], tuple[Vector, Vector]]
    threshold: float = 0.0


@dataclass(frozen=True, slots=True)
class Contact:
    """A touch and its place.

    Attributes:
        touch: as the skin reports it.
        where: the sensor.
        point: in the link's DH frame [m].
        normal: outward unit normal there.
    """

    touch: Touch
    where: GuardedSensor
    point: Vector
    normal: Vector

    def on_link(self) -> ContactOnLink:
        """What the reaction has to know."""
        touch, where = self.touch, self.where
        return ContactOnLink(where.link, self.point, self.normal, touch.level, touch.location_valid, where.threshold)

    def details(self) -> dict[str, Any]:
        """What an event says of it."""
        touch = self.touch
        return {
            "sensor": touch.sensor,
            "link": self.where.link_name,
            "u": touch.u,
            "phi": touch.phi,
            "point": self.point,
            "normal": self.normal,
            "level": touch.level,
            "location_valid": touch.location_valid,
            "clock_us": touch.clock_us,
            "sequence": touch.sequence,
        }
