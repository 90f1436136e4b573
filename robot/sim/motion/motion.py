"""Motions of the simulated arm that follow a speed or a stream of positions, and stops, in steps of 2 ms.

Continuous position and speed, bounded acceleration. Assumed, because no manual says it: the deceleration of a pause, of
a safeguard stop and of a program that ends while the arm moves (`Options.deceleration`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .arm import CYCLE, JOINT_ACCELERATION, MAX_ACCELERATION, SUDDEN_CHANGE, MotionFault, SimulatedArm, max_abs


class _Sustained:
    """Motion that goes on while the program repeats its command.

    Attributes:
        scaled: the speed slider acts on it, and stretches the time of its commands.
        surplus: part of the present cycle that the next command has already been given.
    """

    done = brakes = False
    scaled = True
    surplus = 0.0


class SpeedJoints(_Sustained):
    """Constant joint speeds, reached with one acceleration of the leading joint and held (speedj)."""

    def __init__(self, target: Sequence[float], acceleration: float) -> None:
        self.retarget(target, acceleration)

    def retarget(self, target: Sequence[float], acceleration: float) -> None:
        """Set a new speed [rad/s] and acceleration [rad/s^2]."""
        self.target, self.acceleration = list(target), abs(acceleration)
        self.reached = False

    def update(self, arm: SimulatedArm, scale: float, hold: bool) -> tuple[list[float], list[float]]:
        """Return joint positions [rad] and speeds [rad/s] after one cycle; see `Motion.update`."""
        if hold:
            return arm.brake()
        delta = [scale * a - b for a, b in zip(self.target, arm.qd, strict=True)]
        lead, step = max_abs(delta), self.acceleration * CYCLE
        if lead <= step:
            self.reached = True
            qd = [scale * a for a in self.target]
        else:
            qd = [speed + change * step / lead for speed, change in zip(arm.qd, delta, strict=True)]
        return arm.going(qd)


class SpeedTool(_Sustained):
    """Constant velocity and angular velocity of the tool centre point in the base frame (speedl)."""

    of_tool = True

    def __init__(self, arm: SimulatedArm, target: Sequence[float], acceleration: float, angular: float) -> None:
        self.twist = arm.twist()
        self.retarget(target, acceleration, angular)

    def retarget(self, target: Sequence[float], acceleration: float, angular: float) -> None:
        """Set a new velocity [m/s, rad/s], acceleration [m/s^2] and angular acceleration [rad/s^2]."""
        self.target, self.acceleration, self.angular = list(target), abs(acceleration), abs(angular)
        self.reached = False

    def update(self, arm: SimulatedArm, scale: float, hold: bool) -> tuple[list[float], list[float]]:
        """Return joint positions [rad] and speeds [rad/s] after one cycle; see `Motion.update`."""
        if hold:
            q, qd = arm.brake()
            self.twist = arm.twist()
            return q, qd
        delta = [scale * a - b for a, b in zip(self.target, self.twist, strict=True)]
        needed = max(
            math.hypot(*delta[:3]) / max(self.acceleration, 1e-9), math.hypot(*delta[3:]) / max(self.angular, 1e-9)
        )
        share = 1.0 if needed <= CYCLE else CYCLE / needed
        self.reached = share == 1.0
        self.twist = [a + b * share for a, b in zip(self.twist, delta, strict=True)]
        qd = arm.joint_speeds(self.twist) if any(self.twist) else [0.0] * 6
        return arm.going(qd)


class ServoJoints(_Sustained):
    """Follower of a stream of positions, smoothed by look-ahead time and gain (servoj).

    As the URScript manual has it: the gain is the P-term towards the position, and the look-ahead time projects the
    present position forward in time with the present speed; a short one overshoots. So the acceleration [rad/s^2] is
    gain (target - (q + lookahead qd)); its unit, 1/s^2, is an assumption. The speed slider does not act. A step of
    the target for which it is more than `MAX_ACCELERATION` is a sudden change, by assumption; otherwise it is held to
    what an arm's configuration has as its highest acceleration, and the speed to that of the joint.

    Raises:
        MotionFault: from ``update``: such a target.
    """

    scaled = False

    def __init__(self, target: Sequence[float], lookahead: float, gain: float) -> None:
        self._followed: list[float] | None = None  # target of the last cycle
        self.retarget(target, lookahead, gain)

    def retarget(self, target: Sequence[float], lookahead: float, gain: float) -> None:
        """Set a new position [rad], look-ahead time [s] and gain."""
        self.target = list(target)
        self.lookahead = min(0.2, max(0.03, lookahead))
        self.gain = min(2000.0, max(100.0, gain))

    def update(self, arm: SimulatedArm, scale: float, hold: bool) -> tuple[list[float], list[float]]:  # noqa: ARG002
        """Return joint positions [rad] and speeds [rad/s] after one cycle; see `Motion.update`."""
        if hold:
            return arm.brake()
        largest = JOINT_ACCELERATION * CYCLE
        qd = []
        self._check_jump(arm.q)
        for target, q, speed, limit in zip(self.target, arm.q, arm.qd, arm.model.joint_speed, strict=True):
            error = target - q
            change = max(-largest, min(largest, self.gain * (error - self.lookahead * speed) * CYCLE))
            still = abs(error) < 1e-9 and abs(speed) < 1e-9
            qd.append(0.0 if still else max(-limit, min(limit, speed + change)))
        return arm.going(qd)

    def _check_jump(self, q: Sequence[float]) -> None:
        before, self._followed = self._followed or q, self.target
        for joint, (target, last) in enumerate(zip(self.target, before, strict=True), 1):
            wanted = self.gain * abs(target - last)
            if wanted > MAX_ACCELERATION:
                detail = f"joint {joint}: servoj takes {wanted:.0f} rad/s^2 to a target {target - last:.2f} rad away"
                raise MotionFault(SUDDEN_CHANGE, detail)


class StopJoints:
    """Ramp of all joints to a standstill in proportion, the leading one at a deceleration [rad/s^2] (stopj).

    It is softer where the motors lack the torque. The speed slider does not act.
    """

    brakes = True

    def __init__(self, deceleration: float) -> None:
        self.deceleration = max(abs(deceleration), 1e-3)
        self.done = False

    def update(self, arm: SimulatedArm, scale: float, hold: bool) -> tuple[list[float], list[float]]:  # noqa: ARG002
        """Return joint positions [rad] and speeds [rad/s] after one cycle; see `Motion.update`."""
        rate = max(self.deceleration, arm.deceleration) if hold else self.deceleration
        q, qd = arm.brake(rate)
        self.done = not any(qd)
        return q, qd


class StopTool(StopJoints):
    """Ramp of the tool to a standstill at a deceleration [m/s^2, rad/s^2], joints in proportion (stopl)."""

    def __init__(self, arm: SimulatedArm, deceleration: float, angular: float) -> None:
        twist = arm.twist()
        duration = max(
            math.hypot(*twist[:3]) / max(abs(deceleration), 1e-3), math.hypot(*twist[3:]) / max(abs(angular), 1e-3)
        )
        rate = max_abs(arm.qd) / duration if duration > 0.0 else arm.deceleration
        super().__init__(min(rate, MAX_ACCELERATION / 2.0))
