"""A plane that the arm does not go below while it retreats: the table, or the floor. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .limits import REACTION_TIME
from .skeleton import skeleton
from .ur_models import ArmModel

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

    def entered(self, model: ArmModel, q: Sequence[float], qd: Sequence[float], braking: float) -> bool:
        """Whether some point would be below the plane, and lower than now, before joints that move so could brake.

        Args:
            model: the arm.
            q: joint positions [rad].
            qd: joint speeds wanted [rad/s].
            braking: deceleration of the leading joint [rad/s^2].
        """
        leading = max(map(abs, qd))
        if not leading:
            return False
        ahead = REACTION_TIME + leading / (2.0 * braking)
        there = skeleton(model, [angle + ahead * speed for angle, speed in zip(q, qd, strict=True)])
        here = skeleton(model, q)
        return any(
            after[2] < self.height and after[2] < before[2] for before, after in zip(here[1:], there[1:], strict=True)
        )
