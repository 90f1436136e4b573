"""Body that presses on a link: a stiff pad in the base frame, fixed or pushing; its force follows from geometry alone.

Nothing here knows what a skin reads. The pad is a plane across the outward normal of the true place as the link lay
when the two met; the force is the stiffness times how deep the link's surface is in it. A person's pad moves as well:
towards the link while the force is below the one that the person wants, away from it above, at a bounded speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from coneskin.geometry.pose import Pose, Vector


@dataclass(frozen=True, slots=True)
class Body:
    """Body, and the place of the skin that it will meet.

    Attributes:
        sensor: name of the sensor.
        u: of the place, slant distance from end 1 [m].
        phi: of the place, azimuth [rad].
        arrives: after the collision began [s].
        gap: between surface and pad when it arrives [m]; the link may come to it later, or never.
        stiffness: [N/m]; ISO/TS 15066, table A.3: 25 000 for a chest, 75 000 for a hand.
        hardest: force at which it gives way [N].
        push: force that a person wants [N]; 0 for a body that stays where it is.
        push_speed: at which a person follows, or yields, at most [m/s].
        grow_to: force that the person wants in the end [N]; not below ``push``.
        grow_time: until then [s].
        radius: of a flat face [m]; 0 for a round body.
    """

    sensor: str
    u: float
    phi: float
    arrives: float = 0.0
    gap: float = 0.0
    stiffness: float = 30e3
    hardest: float = 200.0
    push: float = 0.0
    push_speed: float = 0.25
    grow_to: float = 0.0
    grow_time: float = 1.0
    radius: float = 0.0

    def wanted(self, since: float) -> float:
        """Return the force that the person wants, so long after it arrived [N]."""
        share = min(1.0, since / self.grow_time)
        return self.push + max(0.0, self.grow_to - self.push) * share


@dataclass
class Pressing:
    """Body that has arrived at a link.

    Attributes:
        body: what presses.
        link: index of the link's DH frame.
        point: the true place in that frame [m].
        normal: outward unit normal there.
        force: now [N].
        began: when the two touched first, after the collision began [s]; NaN before.
        pushed_in: how far the link's surface has moved towards the body since then, at most [m].
        path: (time after the collision began [s], way towards the body [m], force [N]).
    """

    body: Body
    link: int
    point: Vector
    normal: Vector
    force: float = 0.0
    began: float = math.nan
    pushed_in: float = 0.0
    path: list[tuple[float, float, float]] = field(default_factory=list)
    _facing: Vector = (0.0, 0.0, 0.0)  # the outward normal as the body arrived, in the base frame
    _pad: float = 0.0  # place of the pad along it [m]
    _met: float = 0.0  # place of the surface along it when the two touched [m]
    _here: bool = False

    def update(self, base_link: Pose, time: float, step: float) -> None:
        """Let time pass with the link in this pose.

        Args:
            base_link: pose of the link's DH frame in the base frame.
            time: after the collision began [s].
            step: since the last call [s].
        """
        body = self.body
        if time < body.arrives:
            return
        point = base_link.apply(self.point)
        if not self._here:
            self._here = True
            self._facing = base_link.rotate(self.normal)
            self._pad = _along(self._facing, point) + body.gap
        surface = _along(self._facing, point)
        if body.push:
            most = body.push_speed
            wish = (body.wanted(time - body.arrives) - self.force) * most / 20.0
            self._pad -= step * max(-most, min(most, wish))
        depth = surface - self._pad
        self._pad += max(0.0, depth - body.hardest / body.stiffness)  # it gives way
        self.force = max(0.0, min(body.hardest, body.stiffness * depth))
        if math.isnan(self.began) and self.force > 0.0:
            self.began, self._met = time, surface
        if not math.isnan(self.began):
            self.pushed_in = max(self.pushed_in, surface - self._met)
            self.path.append((time, surface - self._met, self.force))


def _along(direction: Vector, point: Vector) -> float:
    return direction[0] * point[0] + direction[1] * point[1] + direction[2] * point[2]
