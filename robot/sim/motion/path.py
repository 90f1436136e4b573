"""Path of the simulated arm, in steps of 2 ms: speed along it, its beginning while the arm moves, its blend at the end.

Assumed, because no manual says it: the speed slider acts through the motion's own acceleration; the speed that an arm
has when a path begins fades out while the path sets in. That makes a blend too: a move with a blend radius ends for its
program at that distance from its goal, with a speed from which the arm could still stop there, and the next path
begins. Where none does, the arm goes on to the goal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.geometry.pose import Pose

from .arm import CYCLE, DEFAULT_DECELERATION, MotionFault, SimulatedArm, max_abs
from .stop_cause import INVALID_SETPOINT

__all__ = ["Path", "Residual"]


class _Profile:
    """Trapezoidal speed profile, computed cycle by cycle so that the slider and a pause can act on it."""

    def __init__(self, length: float, speed: float, acceleration: float) -> None:
        self.length, self.speed, self.acceleration = length, speed, acceleration
        self.s = self.sdot = 0.0

    def advance(self, top: float, brake: float) -> None:
        left = self.length - self.s - 0.5 * self.sdot * CYCLE
        step = self.acceleration * CYCLE
        # highest speed after this cycle from which the arm can still stop within the rest of the path
        ceiling = step * (math.sqrt(0.25 + 2.0 * max(left, 0.0) / (step * CYCLE)) - 0.5)
        if ceiling <= 0.5e-6 * step:
            self.s, self.sdot = self.length, 0.0
            return
        speed = min(self.sdot + step, max(top, self.sdot - brake * CYCLE, 0.0), ceiling)
        self.s = min(self.length, self.s + 0.5 * (self.sdot + speed) * CYCLE)
        self.sdot = speed


class Residual:
    """Speed that the arm still has when a new path begins: it fades out while the path sets in."""

    def __init__(self, qd: Sequence[float], rate: float) -> None:
        self.qd = list(qd)
        self.duration = max_abs(qd) / rate
        self.time = 0.0
        self.way = [speed * self.duration / 2.0 for speed in qd]  #: joint positions that it adds in all [rad]

    def step(self) -> tuple[list[float], list[float]] | None:
        """Advance by one cycle; return minus the way still to go [rad] and the speed [rad/s], None when it is over."""
        if self.time >= self.duration:
            return None
        self.time = min(self.time + CYCLE, self.duration)
        share = 1.0 - self.time / self.duration
        return [-way * share * share for way in self.way], [speed * share for speed in self.qd]


class Path:
    """Profile along a path that may begin while the arm moves: the common part of every move.

    Attributes:
        goal: tool pose at its end.
        done: the arm has arrived.
        blends: the program has gone on to its next statement, and the next path may replace this one.
    """

    goal: Pose
    brakes = False

    def __init__(self, arm: SimulatedArm, length: float, speed: float, acceleration: float, rate: float) -> None:
        if not (speed > 0.0 and acceleration > 0.0):
            detail = f"speed and acceleration must be above 0, got {speed} and {acceleration}"
            raise MotionFault(INVALID_SETPOINT, detail)
        self.profile = _Profile(length, speed, acceleration)
        self.residual = Residual(arm.qd, rate)
        self.done = self.blends = False

    def within(self, arm: SimulatedArm, radius: float) -> bool:
        """Tell whether the next path may begin: so close to the goal, in the second half of this one."""
        if radius <= 0.0 or self.profile.s < 0.5 * self.profile.length:
            return False
        return math.dist(arm.tcp_pose().translation, self.goal.translation) <= radius

    def advance(self, arm: SimulatedArm, scale: float, hold: bool) -> None:
        """Advance along the path by one cycle."""
        profile = self.profile
        lead = max_abs(arm.qd)
        brake = profile.acceleration
        if hold and lead > 0.0:
            brake = max(brake, DEFAULT_DECELERATION * profile.sdot / lead)
        profile.advance(0.0 if hold else profile.speed * scale, brake)

    def settle(self, q: list[float], qd: list[float]) -> tuple[list[float], list[float]]:
        """Return positions and speeds on the path with what is left of the speed before it."""
        rest = self.residual.step()
        if rest is None:
            self.done = self.profile.s >= self.profile.length
            return q, qd
        return [a + b for a, b in zip(q, rest[0], strict=True)], [a + b for a, b in zip(qd, rest[1], strict=True)]
