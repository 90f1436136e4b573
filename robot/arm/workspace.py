"""Room that the arm has while it moves away from a touch: above the table, and clear of its own links. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.geometry.pose import Vector

from .joint_limits import REACTION_TIME
from .model import ArmModel
from .self_collision import close_pairs
from .skeleton import skeleton

__all__ = ["TablePlane", "Workspace"]


@dataclass(frozen=True, slots=True)
class TablePlane:
    """Horizontal plane in the base frame that the arm does not go below.

    The arm is taken as the line along the axes of its tubes (``skeleton``), from the shoulder on, because the base
    stands on the table. The thickness of the tubes and the length of the tool belong in the height.

    Attributes:
        height: height of the plane above the base frame's origin [m].
    """

    height: float

    def below(self, corners: Sequence[Vector]) -> bool:
        """Return whether a corner of a skeleton is below the plane."""
        return any(corner[2] < self.height for corner in corners[1:])

    def entered(self, here: Sequence[Vector], there: Sequence[Vector]) -> bool:
        """Return whether a corner would be below the plane, and lower than now.

        Args:
            here: the arm's skeleton now [m].
            there: its skeleton after the motion [m].
        """
        return any(
            after[2] < self.height and after[2] < before[2] for before, after in zip(here[1:], there[1:], strict=True)
        )


@dataclass(frozen=True, slots=True)
class Workspace:
    """Room that an arm has.

    Attributes:
        model: the arm.
        table: plane below which it must not go, or None.
        avoid_self: True where the arm's own links count; False on a path along which it has just come.
    """

    model: ArmModel
    table: TablePlane | None = None
    avoid_self: bool = True

    def obstruction(self, q: Sequence[float], qd: Sequence[float], braking: float) -> str:
        """Return what is in the way of joints that move so, braking distance included; empty where nothing is.

        A part that is already where it must not be may move out.

        Args:
            q: joint positions [rad].
            qd: wanted joint speeds [rad/s].
            braking: deceleration of the leading joint [rad/s^2].
        """
        leading = max(map(abs, qd))
        if not leading or not (self.avoid_self or self.table):
            return ""
        ahead = REACTION_TIME + leading / (2.0 * braking)
        there = skeleton(self.model, [angle + ahead * speed for angle, speed in zip(q, qd, strict=True)])
        low = self.table is not None and self.table.below(there)
        near = close_pairs(self.model, there) if self.avoid_self else []
        if not (low or near):  # nearly always; then the present skeleton is not needed
            return ""
        here = skeleton(self.model, q)
        if self.table is not None and low and self.table.entered(here, there):
            return f"the table at {1e3 * self.table.height:g} mm is in the way"
        return next((pair.why for pair in near if pair.distance < pair.distance_in(here)), "")
