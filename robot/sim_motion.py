"""The commands that move the simulated arm, each 2 ms a step: continuous position and speed, bounded acceleration.

What no manual says, and is assumed here: the deceleration of a pause, of a protective stop and of a program that ends
while the arm moves (`BRAKE`), and that the speed slider acts through the motion's own acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.errors import KinematicsError
from coneskin.geometry.pose import Pose, Vector

from .inverse import nearest
from .sim_arm import BRAKE, CYCLE, LARGEST_ACCELERATION, Arm, MotionFault, braked, lead_of, moved
from .sim_values import interpolate, rotvec_between

__all__ = ["Line", "ServoJoints", "SpeedJoints", "SpeedTool", "StopJoints", "StopTool", "ToolLine"]

TURN_LENGTH = 0.25  #: a turn of 1 rad takes as long as this way [m]; an assumption
SERVO_ACCELERATION = 40.0  #: the largest of a joint that follows a stream of positions [rad/s2]; an assumption


class _Profile:
    """A way travelled with a trapezoidal speed, made up as it goes so that the slider and a pause can act on it."""

    def __init__(self, length: float, speed: float, acceleration: float) -> None:
        self.length, self.speed, self.acceleration = length, speed, acceleration
        self.s = self.sdot = 0.0

    def advance(self, top: float, brake: float) -> None:
        left = self.length - self.s - 0.5 * self.sdot * CYCLE
        step = self.acceleration * CYCLE
        # the speed after this cycle from which the rest of the way is just enough to stop
        ceiling = step * (math.sqrt(0.25 + 2.0 * max(left, 0.0) / (step * CYCLE)) - 0.5)
        if ceiling <= 0.5e-6 * step:
            self.s, self.sdot = self.length, 0.0
            return
        speed = min(self.sdot + step, max(top, self.sdot - brake * CYCLE, 0.0), ceiling)
        self.s = min(self.length, self.s + 0.5 * (self.sdot + speed) * CYCLE)
        self.sdot = speed


class _Residual:
    """Speed that the arm still has when a new path begins: it dies out while the path sets in."""

    def __init__(self, qd: Sequence[float], rate: float) -> None:
        self.qd = list(qd)
        self.duration = lead_of(qd) / rate
        self.time = 0.0
        self.way = [speed * self.duration / 2.0 for speed in qd]  #: all that it will add [rad]

    def step(self) -> tuple[list[float], list[float]] | None:
        """Way still to go (negative of it) and speed; None when it is over."""
        if self.time >= self.duration:
            return None
        self.time = min(self.time + CYCLE, self.duration)
        share = 1.0 - self.time / self.duration
        return [-way * share * share for way in self.way], [speed * share for speed in self.qd]


class _Path:
    """What movej and movel have in common: a profile along a path, begun at whatever speed the arm has."""

    def __init__(self, arm: Arm, length: float, speed: float, acceleration: float, rate: float) -> None:
        if not (speed > 0.0 and acceleration > 0.0):
            raise MotionFault(f"speed and acceleration must be above 0, got {speed} and {acceleration}")
        self.profile = _Profile(length, speed, acceleration)
        self.residual = _Residual(arm.qd, rate)
        self.done = False

    def advance(self, arm: Arm, scale: float, hold: bool) -> None:
        profile = self.profile
        lead = lead_of(arm.qd)
        brake = profile.acceleration
        if hold and lead > 0.0:
            brake = max(brake, BRAKE * profile.sdot / lead)
        profile.advance(0.0 if hold else profile.speed * scale, brake)

    def settle(self, q: list[float], qd: list[float]) -> tuple[list[float], list[float]]:
        rest = self.residual.step()
        if rest is None:
            self.done = self.profile.s >= self.profile.length
            return q, qd
        return [a + b for a, b in zip(q, rest[0], strict=True)], [a + b for a, b in zip(qd, rest[1], strict=True)]


class Line(_Path):
    """movej: a straight line in joint space; speed and acceleration are those of the leading joint."""

    def __init__(self, arm: Arm, target: Sequence[float], acceleration: float, speed: float, time: float = 0.0) -> None:
        acceleration = max(acceleration, 1e-6)
        way = _Residual(arm.qd, acceleration).way
        self.start = [a + b for a, b in zip(arm.q, way, strict=True)]
        delta = [a - b for a, b in zip(target, self.start, strict=True)]
        length = lead_of(delta)
        if time > 0.0:
            speed, acceleration = max(1.5 * length / time, 1e-9), max(4.5 * length / time**2, 1e-9)
        self.unit = [value / length for value in delta] if length else [0.0] * 6
        for share, limit in zip(self.unit, arm.model.joint_speed, strict=True):
            if abs(share) * speed > limit:
                speed = limit / abs(share)
        super().__init__(arm, length, speed, acceleration, acceleration)

    def step(self, arm: Arm, scale: float, hold: bool) -> tuple[list[float], list[float]]:
        """See `Motion`."""
        self.advance(arm, scale, hold)
        s, sdot = self.profile.s, self.profile.sdot
        q = [a + b * s for a, b in zip(self.start, self.unit, strict=True)]
        return self.settle(q, [b * sdot for b in self.unit])


class ToolLine(_Path):
    """movel: a straight line of the tool centre point, its orientation turning about one axis.

    Raises:
        MotionFault: the target is out of reach.
    """

    def __init__(self, arm: Arm, target: Pose, acceleration: float, speed: float, time: float = 0.0) -> None:
        way = _Residual(arm.qd, BRAKE).way
        self.q = [a + b for a, b in zip(arm.q, way, strict=True)]
        self.start = arm.tcp_pose(self.q)
        self.back = arm.tcp.inverse()
        a, b = self.start.translation, target.translation
        self.shift: Vector = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
        self.turn = rotvec_between(self.start, target)
        length = max(math.dist(a, b), TURN_LENGTH * math.hypot(*self.turn))
        if time > 0.0:
            speed, acceleration = max(1.5 * length / time, 1e-9), max(4.5 * length / time**2, 1e-9)
        self.goal = target
        self._place(arm, 1.0)  # refuses what is out of reach before the arm moves
        super().__init__(arm, length, speed, acceleration, BRAKE)

    def _place(self, arm: Arm, share: float) -> list[float]:
        pose = interpolate(self.start, self.shift, self.turn, share)
        try:
            return list(nearest(arm.model, pose @ self.back, self.q))
        except KinematicsError as exc:
            raise MotionFault(str(exc)) from exc

    def step(self, arm: Arm, scale: float, hold: bool) -> tuple[list[float], list[float]]:
        """See `Motion`."""
        self.advance(arm, scale, hold)
        profile = self.profile
        q = self._place(arm, profile.s / profile.length) if profile.length else self.q
        before, self.q = self.q, q
        qd = [(a - b) / CYCLE for a, b in zip(q, before, strict=True)]
        if profile.s >= profile.length:  # arrived: the last way was shorter than any step of speed
            qd = [0.0] * 6
        return self.settle(list(q), qd)


class SpeedJoints:
    """speedj: joint speeds, reached with one acceleration of the leading joint, kept until something else comes."""

    done = False

    def __init__(self, target: Sequence[float], acceleration: float) -> None:
        self.retarget(target, acceleration)

    def retarget(self, target: Sequence[float], acceleration: float) -> None:
        """A new speed [rad/s] and acceleration [rad/s2]."""
        self.target, self.acceleration = list(target), abs(acceleration)
        self.reached = False

    def step(self, arm: Arm, scale: float, hold: bool) -> tuple[list[float], list[float]]:
        """See `Motion`."""
        if hold:
            return braked(arm.q, arm.qd, BRAKE)
        delta = [scale * a - b for a, b in zip(self.target, arm.qd, strict=True)]
        lead, step = lead_of(delta), self.acceleration * CYCLE
        if lead <= step:
            self.reached = True
            qd = [scale * a for a in self.target]
        else:
            qd = [speed + change * step / lead for speed, change in zip(arm.qd, delta, strict=True)]
        return moved(arm.q, arm.qd, qd), qd


class SpeedTool:
    """speedl: velocity and angular velocity of the tool centre point, in the base frame."""

    done = False

    def __init__(self, arm: Arm, target: Sequence[float], acceleration: float, angular: float) -> None:
        self.twist = arm.twist()
        self.retarget(target, acceleration, angular)

    def retarget(self, target: Sequence[float], acceleration: float, angular: float) -> None:
        """A new velocity [m/s, rad/s], acceleration [m/s2] and angular acceleration [rad/s2]."""
        self.target, self.acceleration, self.angular = list(target), abs(acceleration), abs(angular)
        self.reached = False

    def step(self, arm: Arm, scale: float, hold: bool) -> tuple[list[float], list[float]]:
        """See `Motion`."""
        if hold:
            q, qd = braked(arm.q, arm.qd, BRAKE)
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
        return moved(arm.q, arm.qd, qd), qd


class ServoJoints:
    """servoj: follows a position that is streamed; smoothed by the look-ahead time, stiffened by the gain.

    Modelled as a critically damped or slower filter; the true controller's is not published. The slider does not act.
    """

    done = False

    def __init__(self, target: Sequence[float], lookahead: float, gain: float) -> None:
        self.retarget(target, lookahead, gain)

    def retarget(self, target: Sequence[float], lookahead: float, gain: float) -> None:
        """A new position [rad], look-ahead time [s] and gain."""
        self.target = list(target)
        self.lookahead = min(0.2, max(0.03, lookahead))
        self.rate = max(4.0 / self.lookahead, min(2000.0, max(100.0, gain)) / 3.0)

    def step(self, arm: Arm, scale: float, hold: bool) -> tuple[list[float], list[float]]:  # noqa: ARG002
        """See `Motion`."""
        if hold:
            return braked(arm.q, arm.qd, BRAKE)
        largest = SERVO_ACCELERATION * CYCLE
        blend = 1.0 - math.exp(-self.rate * CYCLE)
        qd = []
        for target, q, speed, limit in zip(self.target, arm.q, arm.qd, arm.model.joint_speed, strict=True):
            error = target - q
            wanted = max(-limit, min(limit, error / self.lookahead))
            change = max(-largest, min(largest, (wanted - speed) * blend))
            qd.append(0.0 if abs(error) < 1e-9 and abs(speed) < 1e-9 else speed + change)
        return moved(arm.q, arm.qd, qd), qd


class StopJoints:
    """stopj: joints slow down in proportion, the leading one at a deceleration [rad/s2]; the slider does not act."""

    def __init__(self, deceleration: float) -> None:
        self.deceleration = max(abs(deceleration), 1e-3)
        self.done = False

    def step(self, arm: Arm, scale: float, hold: bool) -> tuple[list[float], list[float]]:  # noqa: ARG002
        """See `Motion`."""
        q, qd = braked(arm.q, arm.qd, max(self.deceleration, BRAKE) if hold else self.deceleration)
        self.done = not any(qd)
        return q, qd


class StopTool:
    """stopl: the tool slows down at a deceleration [m/s2] (and [rad/s2]), joints in proportion."""

    def __init__(self, arm: Arm, deceleration: float, angular: float) -> None:
        twist = arm.twist()
        duration = max(
            math.hypot(*twist[:3]) / max(abs(deceleration), 1e-3), math.hypot(*twist[3:]) / max(abs(angular), 1e-3)
        )
        lead = lead_of(arm.qd)
        self.rate = min(lead / duration if duration > 0.0 else BRAKE, LARGEST_ACCELERATION / 2.0)
        self.done = False

    def step(self, arm: Arm, scale: float, hold: bool) -> tuple[list[float], list[float]]:  # noqa: ARG002
        """See `Motion`."""
        q, qd = braked(arm.q, arm.qd, max(self.rate, BRAKE) if hold else self.rate)
        self.done = not any(qd)
        return q, qd
