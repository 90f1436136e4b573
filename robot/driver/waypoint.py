"""Way points of a path: each with the kind of move that leads to it, and the blend with which the arm passes it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

__all__ = ["Waypoint"]


class Waypoint(NamedTuple):
    """One way point, made by ``move_j``, ``move_j_ik``, ``move_l`` or ``move_p``.

    Attributes:
        kind: of the move to it: "j" in joint space, "l" straight, "p" straight with a constant speed of the tool.
        joints: True where the target is joint positions, False where it is a pose of the tool.
        target: six joint positions [rad], or a pose (x, y, z [m], rotation vector [rad]).
        speed: of the leading joint [rad/s], or of the tool [m/s].
        acceleration: of the leading joint [rad/s2], or of the tool [m/s2].
        blend: how far from it the arm may turn off towards the next one [m]; 0 stops there, and so does the last.
    """

    kind: str
    joints: bool
    target: tuple[float, ...]
    speed: float
    acceleration: float
    blend: float = 0.0

    @classmethod
    def move_j(cls, q: Sequence[float], speed: float = 1.05, acceleration: float = 1.4, blend: float = 0.0) -> Self:
        """Return a way point at joint positions [rad], reached in joint space."""
        return cls("j", True, tuple(q), speed, acceleration, blend)

    @classmethod
    def move_j_ik(
        cls, pose: Sequence[float], speed: float = 1.05, acceleration: float = 1.4, blend: float = 0.0
    ) -> Self:
        """Return a way point at a pose, reached in joint space."""
        return cls("j", False, tuple(pose), speed, acceleration, blend)

    @classmethod
    def move_l(cls, pose: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, blend: float = 0.0) -> Self:
        """Return a way point at a pose, reached straight."""
        return cls("l", False, tuple(pose), speed, acceleration, blend)

    @classmethod
    def move_p(cls, pose: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, blend: float = 0.0) -> Self:
        """Return a way point at a pose, reached straight with a constant speed of the tool."""
        return cls("p", False, tuple(pose), speed, acceleration, blend)

    @classmethod
    def from_message(cls, message: Sequence[Any]) -> Self:
        """Return the way point that a list of its attributes describes.

        Raises:
            ValueError, TypeError: it describes none.
        """
        kind, joints, target, *numbers = message
        speed, acceleration, blend = map(float, numbers)
        if kind not in ("j", "l", "p") or len(target) != 6:
            raise ValueError(f"a way point has a kind j, l or p and a target of 6 numbers, got {message!r}")
        return cls(kind, bool(joints), tuple(map(float, target)), speed, acceleration, blend)
