"""Supervision of a motion by the touches that it leaves, or goes on under. Pure.

`ContactSupervision` ends a motion away from a touch that does not do what it was made for. A retreat is made so that
the skin is pressed less. Where the arm, as measured, has moved away and the level of the touch does not fall, where the
level rises, its place jumps or becomes doubtful, or where another touch comes, the retreat presses on something, or
what it was planned from was not true. The first sign ends it. A compliant motion follows a push, whose level may rise;
there only a jump counts, and the law itself stands where a place is doubtful.

`ContactApproach` limits a slow motion under a touch: it must not clamp harder than an arm that is stopped. So what
moves into a touch is stopped, and at once where a stop takes it farther than a little. What its surface has moved into
the touch, and would still move if it were stopped now, v s / (2 a), is held against that little (v: its speed along the
outward normal; s, a: speed and deceleration of the leading joint). Sliding along the touch or away from it counts
nothing. Where the place is not certain, every motion counts beside that of the supposed place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.kinematics import place_point
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.vectors import dot, minus
from coneskin.robot.arm.workspace import reach

from .types import ContactOnLink

_MIN_AWAY = 0.001  # m that the surface has moved away, as measured, from which on the level has to fall
_MIN_BARE_AWAY = 0.0005  # m, likewise where a bare side may lead: a hard thing behind it gives 20 N within 1 mm
_MAX_APPROACH = 0.001  # m that the surface may move towards the touch: noise of the encoders, and of the control
_FALL_TIME = 0.05  # s in which the level has to fall by _MIN_FALL, again and again until the touch is light
_MIN_FALL = 0.01  # of the level; six times its noise, and above 20 N what half the force is
_MAX_RISE = 0.01  # of the level, above the least since the surface moved away
_MAX_JUMP = 0.02  # m along the skin; a fingertip rolls by less
_MAX_DOUBT = 0.004  # s for which a firm touch may be without a certain place; one that ends is for a few frames
_FRAME_WAIT = 0.05  # s for which a doubt waits for another frame to tell the same; none is older in a motion away
_SAME_SIDE = 0.5  # cosine; normals farther apart than 60 deg may hold the arm between them


@dataclass(slots=True)
class _Watched:
    """One touch: where its surface was when the motion began, and what its level has done since."""

    link: int
    point: Vector  # in the link's frame [m]
    start: Vector  # in the base frame [m]
    normal: Vector  # outward, in the base frame
    lowest: float
    window: float | None = None  # when the level was last found to have fallen [s]
    level: float = 0.0  # then
    doubted: tuple[float, ContactOnLink] | None = None  # since when its place is doubtful [s], and what was seen then


class ContactSupervision:
    """Supervision of one motion by the touches that it leaves.

    Args:
        q: joint positions at its start [rad].
        contacts: touches at its start.
        complying: True for a compliant motion.
        bare: True where a side that no skin covers may lead.
    """

    def __init__(
        self, model: ArmModel, q: Joints, contacts: Sequence[ContactOnLink], complying: bool = False, bare: bool = False
    ) -> None:
        self._model = model
        self._min_away = _MIN_BARE_AWAY if bare else _MIN_AWAY
        self._complying = complying
        self._watched = {contact.number: self._watch(q, contact) for contact in contacts if contact.link}

    def resistance(self, time: float, q: Joints, contacts: Sequence[ContactOnLink]) -> str:
        """Return why the motion must end; empty where it may go on.

        Args:
            time: host time [s].
            q: measured joint positions [rad].
            contacts: touches that there are, by the newest frame of each.
        """
        for contact in contacts:
            watched = self._watched.get(contact.number)
            if watched is None:
                if not self._complying:
                    return "another touch has come"
                self._watched[contact.number] = self._watch(q, contact)
            elif why := self._place(time, watched, contact) or self._level(time, q, watched, contact):
                return why
        return ""

    def _watch(self, q: Joints, contact: ContactOnLink) -> _Watched:
        place, normal, _ = place_point(self._model, q, contact.link, contact.point, contact.normal)
        return _Watched(contact.link, contact.point, place, normal, contact.level)

    def _place(self, time: float, watched: _Watched, contact: ContactOnLink) -> str:
        if contact.location_valid:
            watched.doubted = None
            jump = math.dist(contact.point, watched.point)
            if jump > _MAX_JUMP:
                return f"the place of the touch has jumped by {1e3 * jump:.0f} mm"
            if self._complying:
                watched.point = contact.point
        elif contact.level >= contact.firm:
            if watched.doubted is None:
                watched.doubted = time, contact
            since, first = watched.doubted
            if time - since >= (_FRAME_WAIT if contact == first else _MAX_DOUBT) and not self._complying:
                return "the place of the touch is not certain any more"
        return ""

    def _level(self, time: float, q: Joints, watched: _Watched, contact: ContactOnLink) -> str:
        if self._complying:
            return ""
        point, level = place_point(self._model, q, watched.link, watched.point).point, contact.level
        away = dot(minus(watched.start, point), watched.normal)
        if away < -_MAX_APPROACH:
            return f"the surface has moved {-1e3 * away:.1f} mm towards the touch"
        if watched.window is None:
            watched.lowest = level
            if away >= self._min_away:
                watched.window, watched.level = time, level
            return ""
        watched.lowest = min(watched.lowest, level)
        if level > watched.lowest + _MAX_RISE:
            return "the touch becomes firmer"
        if level <= watched.level - _MIN_FALL or level < contact.firm:
            watched.window, watched.level = time, level
        elif time - watched.window > _FALL_TIME:
            return f"the touch does not become lighter, though the surface has moved away by {1e3 * away:.1f} mm"
        return ""


def clamped(contacts: Sequence[ContactOnLink]) -> bool:
    """Tell whether touches may hold the arm between them: on two links, or more than 60 deg apart on one."""
    first = contacts[0] if contacts else None
    return first is not None and any(
        other.link != first.link or dot(first.normal, other.normal) < _SAME_SIDE for other in contacts[1:]
    )


def opposed(model: ArmModel, q: Joints, contacts: Sequence[ContactOnLink]) -> bool:
    """Tell whether two touches push against each other at q [rad]: their normals are over 90 deg apart in the base."""
    if len(contacts) < 2:
        return False
    normals = [place_point(model, q, c.link, c.point, c.normal).direction for c in contacts]
    return any(dot(a, b) < 0.0 for i, a in enumerate(normals) for b in normals[:i])


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
        q: joint positions at the touch, or just before [rad].
        qd: joint speeds then [rad/s].
        deceleration: of the leading joint in a stop [rad/s2].
        press: how far the surface may move into a touch, the way of a stop included [m].

    Attributes:
        speed: of the fastest touched surface, as last seen; where its place is not certain, of any point that the
            joints below could move [m/s]. And whether it is the surface's own.
        exceeded: number of the touch into which the surface has moved too far, 0 where there is none, and how far it
            would move into that one if it were stopped then [m].
    """

    def __init__(self, model: ArmModel, q: Joints, qd: Joints, deceleration: float, press: float) -> None:
        self._model = model
        self._reach = reach(model)
        self._last = q, qd
        self._deceleration = deceleration
        self._press = press
        self._touches: dict[int, _Approach] = {}
        self.speed = 0.0, True
        self.exceeded = 0, 0.0

    def update(self, q: Joints, qd: Joints, contacts: Sequence[ContactOnLink]) -> None:
        """Take measured joint positions [rad] and speeds [rad/s], and the touches there are by their newest frames."""
        speeds, (last_q, last_qd) = [], self._last
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
                since = last_q
            bound, speed, _ = self._motion(contact, since, q, qd, placed)
            step, _, approach = self._motion(contact, since, q, qd)
            speeds.append(speed)
            if placed:
                touch.made = max(0.0, touch.made + step)  # what has receded may be followed, and pressed again
            else:
                touch.blind += bound
            way = touch.made + self._stop(approach, qd)
            if (way > self._press or touch.blind > _BLIND_RATIO * self._press) and not self.exceeded[0]:
                self.exceeded = contact.number, max(way, touch.blind)
        if speeds:
            self.speed = max(speeds), all(contact.location_valid for contact in contacts)
        elif self._touches:  # nothing touches any more: what the arm is compared with is its own speed, in proportion
            before, now = max(map(abs, last_qd)), max(map(abs, qd))
            if before > 0.0:
                self.speed = self.speed[0] * now / before, self.speed[1]
        self._last = q, qd

    def _begin(self, contact: ContactOnLink) -> _Approach:
        """Return a new touch; one that flickers is one, and goes on from the ways into those over on its link."""
        ended = [one for one in self._touches.values() if one.link == contact.link and one.over]
        made = max((one.made for one in ended), default=0.0)
        blind = max((one.blind for one in ended), default=0.0)
        return _Approach(self._last[0], contact.link, made, blind, blind)

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
        here = place_point(self._model, q, link, contact.point, contact.normal)
        moved = minus(here.point, place_point(self._model, before, link, contact.point).point)
        velocity = here.velocity(qd)
        return dot(moved, here.direction), math.hypot(*velocity), dot(velocity, here.direction)
