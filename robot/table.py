"""A plane that the arm does not go below while it moves away from a touch: the table, or the floor. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.geometry.pose import Vector

__all__ = ["Table"]


@dataclass(frozen=True, slots=True)
class Table:
    """A horizontal plane in the base frame.

    The arm is taken as the line along the middle of its tubes (``skeleton``), from the shoulder on: what stands on the
    table may stand on it. Its thickness, and the tool's length, belong into the height.

    Attributes:
        height: of the plane above the base frame's origin [m].
    """

    height: float

    def below(self, corners: Sequence[Vector]) -> bool:
        """Whether some corner of a skeleton is below the plane."""
        return any(corner[2] < self.height for corner in corners[1:])

    def entered(self, here: Sequence[Vector], there: Sequence[Vector]) -> bool:
        """Whether some corner would be below the plane, and lower than now.

        Args:
            here: the arm's skeleton now [m].
            there: its skeleton after the movement [m].
        """
        return any(
            after[2] < self.height and after[2] < before[2] for before, after in zip(here[1:], there[1:], strict=True)
        )
