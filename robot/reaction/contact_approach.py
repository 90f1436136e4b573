"""Approach of a moving arm to what touches it: how far the surface moves into each touch. Pure.

An arm that goes on slowly while it is touched must not clamp harder than one that is stopped. So what moves into a
touch is stopped, and at once where a stop takes it farther than a little: what its surface has moved into the touch,
and would still move if it were stopped now, v s / (2 a), is held against that little (v: its speed along the outward
normal; s, a: speed and deceleration of the leading joint). Sliding along the touch or away from it counts nothing.
Where the place is not certain, every motion counts beside that of the supposed place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.robot.arm.compiled_kinematics import compile_contact
from coneskin.robot.arm.joint_limits import reach
from coneskin.robot.arm.model import ArmModel, Joints

from .types import ContactOnLink

__all__ = ["ContactApproach"]

_BLIND_RATIO = 4.0  # to ``press``: way of any point while a touch has no certain place, which takes 2 frames or more


@dataclass(slots=True)
class _Approach:
    """Way into one touch [m]."""

    q: Joints  # where the arm was when it began [rad]
    link: int
    made: float = 0.0
    earlier: float = 0.0  # what was blind in the touches before that this one goes on from [m]
    blind: float = 0.0  # way of any point, while its place was not certain yet [m]
    placed: bool = False
    over: bool = False


class ContactApproach:
    """Approach of one arm to the touches that it goes on under.

    Args:
        model: the arm.
        q: joint positions at the touch, or just before [rad].
        qd: joint speeds then [rad/s].
        deceleration: of the leading joint in a stop [rad/s2].
        press: how far the surface may move into a touch, the way of a stop included [m].

    Attributes:
        speed: of the fastest touched surface, as last seen; where its place is not certain, of any point that the
            joints below could move [m/s].
        certain: True where that speed is the surface's own.
        exceeded: number of the touch into which the surface has moved too far; 0 where there is none.
        way: how far it would move into that one if it were stopped now [m].
    """

    def __init__(self, model: ArmModel, q: Joints, qd: Joints, deceleration: float, press: float) -> None:
        self._model = model
        self._reach = reach(model)
        self._q, self._qd = q, qd
        self._deceleration = deceleration
        self._press = press
        self._touches: dict[int, _Approach] = {}
        self.speed = 0.0
        self.certain = True
        self.exceeded = 0
        self.way = 0.0

    def note(self, q: Joints, qd: Joints, contacts: Sequence[ContactOnLink]) -> None:
        """Take measured joint positions [rad] and speeds [rad/s], and the touches there are by their newest frames."""
        speeds = []
        lasting = {contact.number for contact in contacts}
        for number, one in self._touches.items():
            one.over = number not in lasting
        for contact in contacts:
            touch = self._touches.get(contact.number)
            if touch is None:
                touch = self._touches[contact.number] = self._begin(contact)
            placed = contact.location_valid
            if placed and not touch.placed:  # only now it shows how far it has gone into it
                touch.placed, touch.blind, since = True, touch.earlier, touch.q
            else:
                since = self._q
            bound, speed, _ = self._motion(contact, since, q, qd, placed)
            step, _, approach = self._motion(contact, since, q, qd)
            speeds.append(speed)
            if placed:
                touch.made = max(0.0, touch.made + step)  # what has receded may be followed, and pressed again
            else:
                touch.blind += bound
            way = touch.made + self._stop(approach, qd)
            if (way > self._press or touch.blind > _BLIND_RATIO * self._press) and not self.exceeded:
                self.exceeded, self.way = contact.number, max(way, touch.blind)
        if speeds:
            self.speed = max(speeds)
            self.certain = all(contact.location_valid for contact in contacts)
        elif self._touches:  # nothing touches any more: what the arm is compared with is its own speed, in proportion
            before, now = max(map(abs, self._qd)), max(map(abs, qd))
            self.speed = self.speed * now / before if before > 0.0 else self.speed
        self._q, self._qd = q, qd

    def _begin(self, contact: ContactOnLink) -> _Approach:
        """Return a new touch; one that flickers is one, and goes on from the ways into those over on its link."""
        ended = [one for one in self._touches.values() if one.link == contact.link and one.over]
        made = max((one.made for one in ended), default=0.0)
        blind = max((one.blind for one in ended), default=0.0)
        return _Approach(self._q, contact.link, made, blind, blind)

    def _stop(self, speed: float, qd: Joints) -> float:
        """Return the way of a surface in a stop [m], from its speed into the touch [m/s] and the joints' [rad/s]."""
        return max(0.0, speed) * max(map(abs, qd)) / (2.0 * self._deceleration)

    def _motion(
        self, contact: ContactOnLink, before: Joints, q: Joints, qd: Joints, placed: bool = True
    ) -> tuple[float, float, float]:
        """Return the way into a touch from joints to joints [m], the speed of the surface, and that into it [m/s].

        Where it is not ``placed``: bounds of them, for any point of the link.
        """
        link = contact.link
        if link == 0:
            return 0.0, 0.0, 0.0
        if not placed:
            way = sum(abs(a - b) * far for a, b, far in zip(q[:link], before, self._reach, strict=False))
            bound = sum(abs(v) * far for v, far in zip(qd[:link], self._reach, strict=False))
            return way, bound, bound
        place = compile_contact(self._model, link).place
        x, y, z, nx, ny, nz, *columns = place(*q, *contact.point, *contact.normal)
        x0, y0, z0 = place(*before, *contact.point, *contact.normal)[:3]
        vx, vy, vz = (sum(columns[3 * i + k] * qd[i] for i in range(link)) for k in range(3))
        way = (x - x0) * nx + (y - y0) * ny + (z - z0) * nz
        return way, math.hypot(vx, vy, vz), vx * nx + vy * ny + vz * nz
