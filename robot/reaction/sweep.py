"""Sweep of an arm during a reaction: how far any point of the bare arm is from where the motion began. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.skeleton import skeleton

__all__ = ["ArmSweep"]

_LINK_RADIUS = 0.06  # m from the middle line of a link to its surface


@dataclass(frozen=True, slots=True)
class ArmSweep:
    """Place of the whole arm when a motion began.

    Attributes:
        model: the arm.
        q: joint positions then [rad].
        corners: of its middle line then, in the base frame [m].
    """

    model: ArmModel
    q: Joints
    corners: tuple[Vector, ...]

    @classmethod
    def begin(cls, model: ArmModel, q: Joints) -> ArmSweep:
        """Return the sweep of a motion that begins at joint positions q [rad]."""
        return cls(model, q, tuple(skeleton(model, q)))

    def distance(self, q: Joints) -> float:
        """Return an upper bound of how far any point of the bare arm is from where it was [m].

        A point between two corners moves no farther than the farther one of them; one off the middle line moves in
        addition by its distance from it times the angle.
        """
        turn = sum(abs(a - b) for a, b in zip(q, self.q, strict=True))
        if turn == 0.0:
            return 0.0
        corners = skeleton(self.model, q)
        return max(math.dist(a, b) for a, b in zip(corners, self.corners, strict=True)) + _LINK_RADIUS * turn
