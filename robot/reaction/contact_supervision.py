"""Contact supervision of a motion away from a touch: it goes on only while what it was made for comes true. Pure.

A retreat is made so that the skin is pressed less. Where the arm, as measured, has moved away and the level of the
touch does not fall, where the level rises, its place jumps or becomes doubtful, or where another touch comes, the
retreat presses on something, or what it was planned from was not true. The first sign ends it. A compliant motion
follows a push, whose level may rise; there only a jump counts, and the law itself stands where a place is doubtful.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.compiled_kinematics import compile_contact
from coneskin.robot.arm.model import ArmModel, Joints

from .types import ContactOnLink

__all__ = ["ContactSupervision", "clamped", "opposed"]

_MIN_AWAY = 0.001  # m that the surface has moved away, as measured, from which on the level has to fall
_MAX_APPROACH = 0.001  # m that the surface may move towards the touch: noise of the encoders, and of the control
_FALL_TIME = 0.05  # s in which the level has to fall by _MIN_FALL, again and again until the touch is light
_MIN_FALL = 0.01  # of the level; six times its noise, and above 20 N what half the force is
_MAX_RISE = 0.01  # of the level, above the least since the surface moved away
_MAX_JUMP = 0.02  # m along the skin; a fingertip rolls by less
_MAX_DOUBT = 0.004  # s for which a firm touch may be without a certain place; one that ends is for a few frames
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
    doubted: float | None = None  # since when its place is not certain [s]


class ContactSupervision:
    """Supervision of one motion by the touches that it leaves.

    Args:
        model: the arm.
        q: joint positions at its start [rad].
        contacts: touches at its start.
        complying: True for a compliant motion.
    """

    def __init__(self, model: ArmModel, q: Joints, contacts: Sequence[ContactOnLink], complying: bool = False) -> None:
        self._model = model
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
        place = compile_contact(self._model, max(contact.link, 1)).place(*q, *contact.point, *contact.normal)
        x, y, z, nx, ny, nz = place[:6]
        return _Watched(contact.link, contact.point, (x, y, z), (nx, ny, nz), contact.level)

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
                watched.doubted = time
            if time - watched.doubted >= _MAX_DOUBT and not self._complying:
                return "the place of the touch is not certain any more"
        return ""

    def _level(self, time: float, q: Joints, watched: _Watched, contact: ContactOnLink) -> str:
        if self._complying or watched.link == 0:
            return ""
        x, y, z = compile_contact(self._model, watched.link).place(*q, *watched.point, 0.0, 0.0, 0.0)[:3]
        start, normal, level = watched.start, watched.normal, contact.level
        away = (start[0] - x) * normal[0] + (start[1] - y) * normal[1] + (start[2] - z) * normal[2]
        if away < -_MAX_APPROACH:
            return f"the surface has moved {-1e3 * away:.1f} mm towards the touch"
        if watched.window is None:
            watched.lowest = level
            if away >= _MIN_AWAY:
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
        other.link != first.link or _cosine(first.normal, other.normal) < _SAME_SIDE for other in contacts[1:]
    )


def opposed(model: ArmModel, q: Joints, contacts: Sequence[ContactOnLink]) -> bool:
    """Tell whether two touches push against each other: their normals in the base frame are over 90 deg apart.

    Args:
        model: the arm.
        q: joint positions [rad].
        contacts: the touches.
    """
    if len(contacts) < 2:
        return False
    normals = [compile_contact(model, max(c.link, 1)).place(*q, *c.point, *c.normal)[3:6] for c in contacts]
    return any(_cosine(a, b) < 0.0 for i, a in enumerate(normals) for b in normals[:i])


def _cosine(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
