"""What holds the bodies of a scene: springs whose rest a person moves, to push back or to grip. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field

from coneskin.geometry.pose import Vector
from coneskin.scene.values.body import BodyScene

__all__ = ["HeldPart"]

_BAND = 100.0  # N between the force wanted and felt at which a person moves at full speed; faster, hands would hammer


@dataclass
class HeldPart:
    """Part of a body on a spring, and where that spring rests.

    Attributes:
        body: of the scene.
        part: 1 for the second hand of a grip.
        rest: how far the spring's rest has been moved [m].
    """

    body: BodyScene
    part: int = 0
    rest: Vector = (0.0, 0.0, 0.0)
    _towards: Vector = field(default=(0.0, 0.0, 0.0))

    @property
    def acts(self) -> bool:
        """True where a person moves the rest."""
        return self.body.kind in ("person", "grip")

    def advance(self, since: float, force: float, away: Vector | None, step: float) -> bool:
        """Let a person move the rest; return whether it has moved.

        Args:
            since: the body was first touched [s]; negative before.
            force: that this part feels now [N].
            away: unit vector from the arm to the part where the two touch; None where they do not.
            step: time [s].
        """
        body = self.body
        if away is not None and body.kind == "person":
            self._towards = (-away[0], -away[1], -away[2])
        elif body.kind == "grip" and self._towards == (0.0, 0.0, 0.0):
            x, y, z = body.axis
            self._towards = (-x, -y, -z) if self.part else (x, y, z)
        if not self.acts or since < body.delay:
            return False
        share = max(-1.0, min(1.0, (body.force - force) / _BAND))
        way = share * body.speed * step
        x, y, z = (r + way * t for r, t in zip(self.rest, self._towards, strict=True))
        self.rest = (x, y, z)
        return True
