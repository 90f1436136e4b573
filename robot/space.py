"""Where the arm must not go while it moves away from a touch: below the table, and into itself. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .limits import REACTION_TIME
from .own_body import meeting
from .skeleton import skeleton
from .table import Table
from .ur_models import ArmModel

__all__ = ["Space"]


@dataclass(frozen=True, slots=True)
class Space:
    """The room that an arm has.

    Attributes:
        model: the arm.
        table: what it must not go below, or None.
        itself: whether its own links count; not on a path that it has just come.
    """

    model: ArmModel
    table: Table | None = None
    itself: bool = True

    def left(self, q: Sequence[float], qd: Sequence[float], braking: float) -> str:
        """Why joints that move so would leave this room before they could brake; empty where they do not.

        A part that is where it must not be already may move out.

        Args:
            q: joint positions [rad].
            qd: joint speeds wanted [rad/s].
            braking: deceleration of the leading joint [rad/s^2].
        """
        leading = max(map(abs, qd))
        if not leading or not (self.itself or self.table):
            return ""
        ahead = REACTION_TIME + leading / (2.0 * braking)
        there = skeleton(self.model, [angle + ahead * speed for angle, speed in zip(q, qd, strict=True)])
        low = self.table is not None and self.table.below(there)
        near = meeting(self.model, there) if self.itself else []
        if not (low or near):  # nearly always, so where the arm is now need not be known
            return ""
        here = skeleton(self.model, q)
        if self.table is not None and low and self.table.entered(here, there):
            return f"the table at {1e3 * self.table.height:g} mm is in the way"
        return next((pair.why for pair in near if pair.distance < pair.of(here)), "")
