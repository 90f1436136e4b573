"""Cause of a protective stop of the simulated arm, under the number that a controller gives it in its log.

Source: Universal Robots, "Error Codes", PolyScope 5: numbers, arguments and titles. What exactly makes a real
controller give each is not published; docs/look-up/sim-ur.md has what makes this one give it.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = [
    "CLOSE_TO_JOINT_LIMITS",
    "INVALID_SETPOINT",
    "IN_SINGULARITY",
    "NEAR_SINGULARITY",
    "SUDDEN_CHANGE",
    "TRIGGERED",
    "StopCause",
    "deviation",
]

_JOINT_NAMES = ("Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3")


@dataclass(frozen=True, slots=True)
class StopCause:
    """Cause of a protective stop.

    Attributes:
        code: number after the C.
        argument: number after the A.
        title: that it has in the published list.
    """

    code: int
    argument: int
    title: str

    def __str__(self) -> str:
        return f"C{self.code}A{self.argument}"


CLOSE_TO_JOINT_LIMITS = StopCause(150, 0, "Position close to joint limits")
IN_SINGULARITY = StopCause(154, 0, "Position in singularity")
SUDDEN_CHANGE = StopCause(204, 1, "Path sanity check failed: Sudden change in target position")
INVALID_SETPOINT = StopCause(204, 5, "Path sanity check failed: Robot program resulted in invalid setpoint")
NEAR_SINGULARITY = StopCause(
    204, 7, "Path sanity check failed: Robot approaching singularity - Acceleration threshold failed"
)
TRIGGERED = StopCause(209, 0, "A protective stop was triggered (for test purposes only)")


def deviation(joint: int) -> StopCause:
    """Return the cause of a joint, counted from 0, that cannot follow its path."""
    return StopCause(153, joint, f"Position deviates from path: Detected by the {_JOINT_NAMES[joint]} joint.")
