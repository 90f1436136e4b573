"""Body of a scene that the arm may run into, for the physics engine; no guard knows of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from coneskin.geometry.pose import Vector

__all__ = ["BODY_KINDS", "BodyScene"]

#: kind of a body -> what it is
BODY_KINDS = {
    "wall": "a plate that does not give way",
    "post": "a round bar that does not give way",
    "mass": "a free mass that nothing holds",
    "hand": "a mass on a spring: a hand, or a head",
    "person": "a hand that pushes back, some time after it was touched",
    "grip": "two hands that close on the link from both sides, some time after one was touched",
}


@dataclass(frozen=True, slots=True)
class BodyScene:
    """Body that the arm may run into. Stiffness and effective mass are the user's: none is known that holds for all.

    Attributes:
        kind: of `BODY_KINDS`.
        place: of its middle, in the base frame [m]; of a wall, the middle of its face; of a grip, of the first hand.
        direction: outward normal of a wall, axis of a post, way from the first to the second hand of a grip.
        radius: of a ball or a bar [m]; half the edge of a wall.
        length: of a bar [m].
        mass: effective mass [kg].
        stiffness: of the spring that holds it [N/m].
        damping: of that spring, as a share of what is critical.
        force: that a person wants, or each hand of a grip [N].
        speed: at which a person follows or yields at most [m/s].
        delay: from the first contact to the person's push, or the closing of the grip [s].
    """

    kind: str
    place: Vector
    direction: Vector = (1.0, 0.0, 0.0)
    radius: float = 0.04
    length: float = 0.3
    mass: float = 1.0
    stiffness: float = 0.0
    damping: float = 0.3
    force: float = 0.0
    speed: float = 0.25
    delay: float = 0.15

    @property
    def gives_way(self) -> bool:
        """True for a body that moves when it is pushed."""
        return self.kind not in ("wall", "post")

    @property
    def parts(self) -> tuple[Vector, ...]:
        """Places of its parts [m]: two of a grip, one of any other."""
        if self.kind != "grip":
            return (self.place,)
        x, y, z = (p + d for p, d in zip(self.place, self.direction, strict=True))
        return self.place, (x, y, z)

    @property
    def axis(self) -> Vector:
        """Unit vector of ``direction``."""
        x, y, z = self.direction
        length = math.sqrt(x * x + y * y + z * z)
        return x / length, y / length, z / length
