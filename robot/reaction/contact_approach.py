"""Approach of a moving arm to what touches it: how far the surface has moved into each touch since it began. Pure.

An arm that goes on slowly while it is touched must press no farther than one that is stopped. A stop at the touch would
have taken the surface v s / (2 a) further into it: v its speed along the outward normal, s and a speed and deceleration
of the leading joint. What the surface has moved into the touch, and would still move if it were stopped now, is held
against that. Sliding along the touch or away from it counts nothing; where the place is not certain, every motion does.
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


@dataclass(slots=True)
class _Approach:
    """Way into one touch, and the way of a stop at its beginning [m]."""

    q: Joints  # where the arm was then [rad]
    qd: Joints  # and how fast [rad/s]
    stop: float
    made: float = 0.0
    blind: float = 0.0  # way of any point, while its place was not certain yet [m]
    placed: bool = False


class ContactApproach:
    """Approach of one arm to the touches that it goes on under.

    Args:
        model: the arm.
        q: joint positions at the touch, or just before [rad].
        qd: joint speeds then [rad/s].
        deceleration: of the leading joint in a stop [rad/s2].
        press: how much farther into a touch than a stop the surface may move [m].

    Attributes:
        speed: of the fastest touched surface, as last seen; where its place is not certain, of any point that the
            joints below could move [m/s].
        certain: True where that speed is the surface's own.
        exceeded: number of the touch into which the surface has moved too far; 0 where there is none.
        way: how far it has moved into that one [m].
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
        for contact in contacts:
            touch = self._touches.get(contact.number)
            if touch is None:
                _, _, before = self._motion(contact, self._q, self._q, self._qd)
                touch = self._touches[contact.number] = _Approach(self._q, self._qd, self._stop(before, self._qd))
            step, speed, approach = self._motion(contact, self._q, q, qd)
            speeds.append(speed)
            room = touch.stop + self._press
            if not contact.location_valid:  # it may have only begun: so little that a place may come yet
                touch.blind += step
                way, room = touch.made + touch.blind, room + self._press
            else:
                if not touch.placed:  # only now it shows how far a stop would have gone into it
                    step = self._motion(contact, touch.q, q, qd)[0]
                    touch.blind = 0.0
                    before = self._motion(contact, touch.q, touch.q, touch.qd)[2]
                    touch.stop = self._stop(before, touch.qd)
                touch.placed = True
                touch.made = max(0.0, touch.made + step)  # what has receded may be followed, and pressed again
                way = touch.made + touch.blind
            if way + self._stop(approach, qd) > room and not self.exceeded:
                self.exceeded, self.way = contact.number, way
        if speeds:
            self.speed = max(speeds)
            self.certain = all(contact.location_valid for contact in contacts)
        elif self._touches:  # nothing touches any more: what the arm is compared with is its own speed, in proportion
            before, now = max(map(abs, self._qd)), max(map(abs, qd))
            self.speed = self.speed * now / before if before > 0.0 else self.speed
        self._q, self._qd = q, qd

    def _stop(self, speed: float, qd: Joints) -> float:
        """Return the way of a surface in a stop [m], from its speed into the touch [m/s] and the joints' [rad/s]."""
        return max(0.0, speed) * max(map(abs, qd)) / (2.0 * self._deceleration)

    def _motion(self, contact: ContactOnLink, before: Joints, q: Joints, qd: Joints) -> tuple[float, float, float]:
        """Return the way into a touch from joints to joints [m], the speed of the surface, and that into it [m/s]."""
        link = contact.link
        if link == 0:
            return 0.0, 0.0, 0.0
        if not contact.location_valid:
            way = sum(abs(a - b) * far for a, b, far in zip(q[:link], before, self._reach, strict=False))
            bound = sum(abs(v) * far for v, far in zip(qd[:link], self._reach, strict=False))
            return way, bound, bound
        place = compile_contact(self._model, link).place
        x, y, z, nx, ny, nz, *columns = place(*q, *contact.point, *contact.normal)
        x0, y0, z0 = place(*before, *contact.point, *contact.normal)[:3]
        vx, vy, vz = (sum(columns[3 * i + k] * qd[i] for i in range(link)) for k in range(3))
        way = (x - x0) * nx + (y - y0) * ny + (z - z0) * nz
        return way, math.hypot(vx, vy, vz), vx * nx + vy * ny + vz * nz
