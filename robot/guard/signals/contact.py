"""Contact on a link: a touch and its place, for the reaction and for the events."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from coneskin.geometry.pose import Vector
from coneskin.robot.reaction.rules import RuleSet
from coneskin.robot.reaction.types import ContactOnLink, Reaction
from coneskin.skin.detection.events import TouchEvent
from coneskin.skin.detection.frame.reading import TouchReading

_CHI_SQUARED_95 = 5.991  # chi-squared of two degrees of freedom that holds 95 %
_AXIS_STEP = 1e-4  # m along, rad around; from the place to one that shows the direction


@dataclass(frozen=True, slots=True)
class GuardedSensor:
    """Sensor on a link.

    Attributes:
        link_name: of the link, for people.
        link: index of the link's DH frame.
        place: (u [m], phi [rad]) -> point [m] and outward unit normal, in the link's DH frame.
        threshold: level from which it is touched.
        firm: level from which a touch has a place, so that one without a place is a doubtful one.
        force: level -> force and its standard deviation [N], or None beyond what a calibration knows, or without one.
    """

    name: str
    link_name: str
    link: int
    place: Callable[[float, float], tuple[Vector, Vector]]
    threshold: float = 0.0
    firm: float = 0.2
    force: Callable[[float], tuple[float, float] | None] | None = None


@dataclass(frozen=True, slots=True)
class Contact:
    """Touch on a link. Its place is worked out only where it is asked for, because a stop does not wait for it."""

    touch: TouchEvent | TouchReading  #: as the skin reports it, in an event or in a frame
    where: GuardedSensor
    number: int  #: of the touch, from 1 on. One that begins anew has a new number.

    def on_link(self) -> ContactOnLink:
        """Return what the reaction has to know."""
        touch, where = self.touch, self.where
        point, normal = where.place(touch.u, touch.phi)
        return ContactOnLink(
            where.link, point, normal, touch.level, touch.location_valid, where.threshold, self.number, where.firm
        )

    def summary(self) -> dict[str, Any]:
        """Return which touch it is: number, sensor, link, place on the sensor [m, rad] and level."""
        touch = self.touch
        return {
            "number": self.number,
            "sensor": self.where.name,
            "link": self.where.link_name,
            "u": touch.u,
            "phi": touch.phi,
            "level": touch.level,
            "location_valid": touch.location_valid,
        }

    def details(self) -> dict[str, Any]:
        """Return the details that an event carries of it. Lengths in m, angles in rad, vectors in the link's frame."""
        touch = self.touch
        point, normal = self.where.place(touch.u, touch.phi)
        stamp = {"clock_us": touch.clock_us, "sequence": touch.sequence}
        known = {
            "covariance": touch.covariance,
            "ellipse": self._ellipse(point),
            "radius": touch.radius,
            "radius_deviation": touch.radius_deviation,
            "elongation": touch.elongation,
            "velocity": touch.velocity,
        }
        if touch.elongation is not None:  # half of the line on which contacts lie about the place
            known["line"] = _in_plane(*touch.elongation, *self._axes(point))
        if self.where.force is not None:
            known["force"] = self.where.force(touch.level)
        return {**self.summary(), "point": point, "normal": normal, **known, **stamp}

    def _axes(self, point: Vector) -> tuple[Vector, Vector]:
        """Return the unit vectors along the side and around, at the place, in the link's frame."""
        u, phi, place = self.touch.u, self.touch.phi, self.where.place
        return _unit(point, place(u + _AXIS_STEP, phi)[0]), _unit(point, place(u, phi + _AXIS_STEP)[0])

    def _ellipse(self, point: Vector) -> tuple[Vector, Vector] | None:
        """Return the two half axes of the ellipse that holds the place with 95 %, in the link's frame [m]."""
        touch = self.touch
        if touch.covariance is None:
            return None
        uu, us, ss = touch.covariance
        axes = self._axes(point)
        middle, apart = 0.5 * (uu + ss), math.hypot(0.5 * (uu - ss), us)
        angle = 0.5 * math.atan2(2.0 * us, uu - ss)
        longer = math.sqrt(_CHI_SQUARED_95 * max(middle + apart, 0.0))
        shorter = math.sqrt(_CHI_SQUARED_95 * max(middle - apart, 0.0))
        return _in_plane(longer, angle, *axes), _in_plane(shorter, angle + 0.5 * math.pi, *axes)


def _in_plane(size: float, turn: float, along: Vector, around: Vector) -> Vector:
    """Return the vector of a length at an angle between two axes, from the first towards the second."""
    x, y = size * math.cos(turn), size * math.sin(turn)
    return x * along[0] + y * around[0], x * along[1] + y * around[1], x * along[2] + y * around[2]


def _unit(start: Vector, end: Vector) -> Vector:
    x, y, z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    length = math.sqrt(x * x + y * y + z * z) or 1.0
    return x / length, y / length, z / length


class TouchRecord:
    """Record of the touches since one came to an arm that nothing touched.

    Attributes:
        contacts: touches that there are now, by every frame.
        placed: the same, as last seen while the arm stopped.
    """

    def __init__(self, rules: RuleSet) -> None:
        self._rules = rules
        self.contacts: Sequence[ContactOnLink] = ()
        self.placed: Sequence[ContactOnLink] = ()
        #: speed of the leading joint when the first began [rad/s], and the firmest level of each link
        self._since: tuple[float, dict[int, float]] = math.inf, {}
        self._newest: Sequence[Contact] = ()

    @property
    def all_placed(self) -> bool:
        """True where the place of every touch is certain."""
        return all(contact.location_valid for contact in self.placed)

    def begin(self, contact: Contact, speed: float) -> None:
        """Forget the touches before this one, which came at a speed of the leading joint [rad/s]."""
        self._since = speed, {contact.where.link: contact.touch.level}

    def update(self, contact: Contact) -> Reaction:
        """Take how firm a touch is now, and return the reaction to it."""
        link, level, (speed, levels) = contact.where.link, contact.touch.level, self._since
        if level > levels.get(link, 0.0):
            levels[link] = level
        return self._rules.choose(link, level, speed)

    def feed(self, contacts: Sequence[Contact], stopping: bool) -> None:
        """Take what the newest frame says of every touch that there is. ``stopping`` while the arm stops."""
        self._newest = contacts
        self.contacts = [contact.on_link() for contact in contacts]
        if contacts and stopping:  # a touch that fades keeps the place that it had; a firm one must have it now
            before = {contact.number: contact for contact in self.placed}
            self.placed = [
                contact
                if contact.location_valid or contact.level >= contact.firm
                else before.get(contact.number, contact)
                for contact in self.contacts
            ]

    def find(self, number: int) -> Contact | None:
        """Return the touch with this number, or the firmest there is. None where nothing touches."""
        return max(self._newest, key=lambda contact: (contact.number == number, contact.touch.level), default=None)

    def hardest(self) -> Reaction:
        """Return the reaction to all of them, each as firm as it has been."""
        speed, levels = self._since
        return self._rules.hardest(levels.items(), speed)
