"""How long silence may last, and what counts as standing."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Watch"]


@dataclass(frozen=True, slots=True)
class Watch:
    """The limits that a guard keeps.

    Attributes:
        skin_silence: longest age of a sensor's newest valid frame [s].
        skin_late: longest time that frames may lag behind the device's clock [s].
        stuck_frames: frames in which the drive currents or the supply show no noise at all, from which on the device
            counts as stuck; 0 where its readings truly have no noise.
        arm_silence: longest age of the controller's newest state [s].
        escalate: without slowdown for this long after a stop, the next way to stop is taken [s].
        standstill: joint speed below which the arm stands [rad/s].
        settle: how long everything must be sound before the guard arms [s].
    """

    skin_silence: float = 0.05
    skin_late: float = 0.05
    stuck_frames: int = 1000
    arm_silence: float = 0.05
    escalate: float = 0.025
    standstill: float = 0.01
    settle: float = 0.1

    def stop_budget(self, speed: float, deceleration: float) -> float:
        """Time within which an arm should stand after a stop: braking, and four times the patience [s].

        Args:
            speed: of the leading joint [rad/s].
            deceleration: of the stop [rad/s2].
        """
        return speed / deceleration + 4.0 * self.escalate
