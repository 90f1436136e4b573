"""Moves of the simulated arm in steps of 2 ms: lines in joint space, lines and arcs of its tool.

Assumed, because no manual says it: the speed slider acts through the motion's own acceleration; the speed that an arm
has when a path begins fades out while the path sets in. That makes a blend too: a move with a blend radius ends for its
program at that distance from its goal, with a speed from which the arm could still stop there, and the next path
begins. Where none does, the arm goes on to the goal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.inverse_kinematics import nearest
from coneskin.robot.arm.vectors import cross, dot, minus, scaled
from coneskin.robot.sim.urscript.values import interpolate

from .arm import CONTROLLER_DECELERATION, INVALID_SETPOINT, JOINT_ACCELERATION, MotionFault, SimulatedArm, max_abs
from .plant import CYCLE


class _Profile:
    """Trapezoidal speed profile, computed cycle by cycle so that the slider and a pause can act on it."""

    def __init__(self, length: float, speed: float, acceleration: float) -> None:
        self.length, self.speed, self.acceleration = length, speed, acceleration
        self.s = self.sdot = 0.0

    def end_early(self) -> None:
        """End the path where one that brakes now comes to rest."""
        self.length = min(self.length, self.s + self.sdot * (0.5 * self.sdot / self.acceleration + CYCLE))

    def update(self, top: float, brake: float) -> None:
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


class _Residual:
    """Speed that the arm still has when a new path begins: it fades out while the path sets in."""

    def __init__(self, qd: Sequence[float], rate: float) -> None:
        self.qd = list(qd)
        self.duration = max_abs(qd) / rate
        self.time = 0.0
        self.way = [speed * self.duration / 2.0 for speed in qd]  #: joint positions that it adds in all [rad]

    def update(self) -> tuple[list[float], list[float]] | None:
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
        self.residual = _Residual(arm.qd, rate)
        self.done = self.blends = False

    def within(self, arm: SimulatedArm, radius: float) -> bool:
        """Tell whether the next path may begin: so close to the goal, in the second half of this one."""
        if radius <= 0.0 or self.profile.s < 0.5 * self.profile.length:
            return False
        return math.dist(arm.tcp_pose().translation, self.goal.translation) <= radius

    def _update_profile(self, arm: SimulatedArm, scale: float, hold: bool) -> None:
        """Advance along the path by one cycle."""
        profile = self.profile
        lead = max_abs(arm.qd)
        brake = profile.acceleration
        if hold and lead > 0.0 < profile.sdot:
            brake = arm.braking(max(brake * lead / profile.sdot, arm.deceleration)) * profile.sdot / lead
        profile.update(0.0 if hold else profile.speed * scale, brake)

    def settle(self, q: list[float], qd: list[float]) -> tuple[list[float], list[float]]:
        """Return positions and speeds on the path with what is left of the speed before it."""
        rest = self.residual.update()
        if rest is None:
            self.done = self.profile.s >= self.profile.length
            return q, qd
        return [a + b for a, b in zip(q, rest[0], strict=True)], [a + b for a, b in zip(qd, rest[1], strict=True)]


_TURN_LENGTH = 0.25  # path length that takes as long as a turn of 1 rad [m/rad]; an assumption
_LENGTH_SAMPLES = 40  # places on a path at which its joint speeds are looked at
# of a move with a time that is too short for it; assumptions: share of what the motors can do at first, m/s, m/s2
_TORQUE_SHARE, _MAX_TOOL_SPEED, _MAX_TOOL_ACCELERATION = 0.7, 1.0, 10.0
_STRAIGHT_SINE = 1e-6  # m^2; three positions that enclose less have no circle


class JointLine(Path):
    """Straight line in joint space (movej); speed and acceleration are those of the leading joint."""

    def __init__(
        self,
        arm: SimulatedArm,
        target: Sequence[float],
        acceleration: float,
        speed: float,
        time: float = 0.0,
        limits: Sequence[float] | None = None,
    ) -> None:
        acceleration = max(acceleration, 1e-6)
        way = _Residual(arm.qd, acceleration).way
        self.start = [a + b for a, b in zip(arm.q, way, strict=True)]
        delta = [a - b for a, b in zip(target, self.start, strict=True)]
        length = max_abs(delta)
        self.unit = [value / length for value in delta] if length else [0.0] * 6
        if time > 0.0:  # a time that is too short makes the move as fast as it can be
            speed, acceleration = max(1.5 * length / time, 1e-9), max(4.5 * length / time**2, 1e-9)
            most = _TORQUE_SHARE * arm.feasible_acceleration(self.unit)
            acceleration = min(acceleration, JOINT_ACCELERATION, most)
        for share, limit in zip(self.unit, limits or arm.model.joint_speed, strict=True):
            if abs(share) * speed > limit:
                speed = limit / abs(share)
        self.goal = arm.tcp_pose(target)
        super().__init__(arm, length, speed, acceleration, acceleration)

    def update(self, arm: SimulatedArm, scale: float, hold: bool) -> tuple[list[float], list[float]]:
        """Return joint positions [rad] and speeds [rad/s] after one cycle; see `Motion.update`."""
        self._update_profile(arm, scale, hold)
        s, sdot = self.profile.s, self.profile.sdot
        q = [a + b * s for a, b in zip(self.start, self.unit, strict=True)]
        return self.settle(q, [b * sdot for b in self.unit])


class _ToolPath(Path):
    """Path of the tool centre point, followed by closed-form inverse kinematics.

    Raises:
        MotionFault: the target is out of reach.
    """

    of_tool = True

    def __init__(self, arm: SimulatedArm, length: float, acceleration: float, speed: float, time: float) -> None:
        if time > 0.0:
            speed, acceleration = max(1.5 * length / time, 1e-9), max(4.5 * length / time**2, 1e-9)
            speed, acceleration = min(speed, _MAX_TOOL_SPEED), min(acceleration, _MAX_TOOL_ACCELERATION)
        self._place(arm, 1.0)  # raises if the target is out of reach, before the arm moves
        super().__init__(arm, length, speed, acceleration, self.rate)

    def _begin(self, arm: SimulatedArm, acceleration: float) -> None:
        """Set where it begins: where the arm would stop, in a blend with the acceleration of the path [m/s^2]."""
        self.rate = CONTROLLER_DECELERATION
        if arm.blends and (speed := math.hypot(*arm.twist()[:3])) > 0.0:
            self.rate = min(self.rate, max_abs(arm.qd) * max(acceleration, 1e-3) / speed)
        way = _Residual(arm.qd, self.rate).way
        self.q = [a + b for a, b in zip(arm.q, way, strict=True)]
        self.start = arm.tcp_pose(self.q)
        self.back = arm.tcp.inverse()

    def _pose(self, share: float) -> Pose:
        """Return the pose at a share of the path."""
        raise NotImplementedError

    def _place(self, arm: SimulatedArm, share: float) -> list[float]:
        try:
            return list(nearest(arm.model, self._pose(share) @ self.back, self.q))
        except KinematicsError as exc:
            raise MotionFault(INVALID_SETPOINT, str(exc)) from exc

    def update(self, arm: SimulatedArm, scale: float, hold: bool) -> tuple[list[float], list[float]]:
        """Return joint positions [rad] and speeds [rad/s] after one cycle; see `Motion.update`."""
        self._update_profile(arm, scale, hold)
        profile = self.profile
        q = self._place(arm, profile.s / profile.length) if profile.length else self.q
        before, self.q = self.q, q
        qd = [(a - b) / CYCLE for a, b in zip(q, before, strict=True)]
        if profile.s >= profile.length:  # arrived: the last step was shorter than the speed says
            qd = [0.0] * 6
        return self.settle(list(q), qd)


class ToolLine(_ToolPath):
    """Straight line of the tool centre point, its orientation turning about one axis (movel, movep).

    Raises:
        MotionFault: the target is out of reach.
    """

    def __init__(self, arm: SimulatedArm, target: Pose, acceleration: float, speed: float, time: float = 0.0) -> None:
        self._begin(arm, acceleration)
        a, b = self.start.translation, target.translation
        self.shift: Vector = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
        self.turn = (self.start.inverse() @ target).rotation_vector
        self.goal = target
        length = max(math.dist(a, b), _TURN_LENGTH * math.hypot(*self.turn))
        super().__init__(arm, length, acceleration, speed, time)

    def limit(self, arm: SimulatedArm, acceleration: float, speed: float) -> None:
        """Go at shares of what the joints are able to do, 0..1 (optimovel)."""
        length = self.profile.length
        if not length:
            return
        start, before, largest, quickest = self.q, self.q, math.inf, math.inf
        for i in range(1, _LENGTH_SAMPLES + 1):
            here = self.q = self._place(arm, i / _LENGTH_SAMPLES)
            for a, b, limit in zip(here, before, arm.model.joint_speed, strict=True):
                rate = max(abs(a - b) * _LENGTH_SAMPLES / length, 1e-9)  # of a joint, along the path [rad/m]
                largest, quickest = min(largest, limit / rate), min(quickest, JOINT_ACCELERATION / rate)
            before = here
        self.q = start
        # half of the acceleration is left for the bends of the joints' paths
        self.profile.speed, self.profile.acceleration = speed * largest, 0.5 * acceleration * quickest

    def _pose(self, share: float) -> Pose:
        return interpolate(self.start, self.shift, self.turn, share)


class ToolArc(_ToolPath):
    """Arc of a circle of the tool centre point (movec); a straight line where the three positions are on one.

    Args:
        via: position on the arc.
        target: its end.
        acceleration: of the tool [m/s^2].
        speed: of the tool [m/s].
        fixed: the tool turns with the arc, instead of to the orientation of the target.

    Raises:
        MotionFault: the target is out of reach.
    """

    def __init__(
        self, arm: SimulatedArm, via: Vector, target: Pose, acceleration: float, speed: float, fixed: bool
    ) -> None:
        self._begin(arm, acceleration)
        a, c = self.start.translation, target.translation
        u, w = minus(via, a), minus(c, a)
        normal = cross(u, w)
        area = dot(normal, normal)
        self.fixed = fixed
        self.turn = (self.start.inverse() @ target).rotation_vector
        self.shift = w
        if math.sqrt(area) < _STRAIGHT_SINE:
            self.angle, length = 0.0, math.sqrt(dot(w, w))
        else:
            uu, ww = dot(u, u), dot(w, w)
            to_centre = [
                (ww * x + uu * y) / (2.0 * area) for x, y in zip(cross(normal, u), cross(w, normal), strict=True)
            ]
            self.axis: Vector = scaled(normal, 1.0 / math.sqrt(area))
            self.centre: Vector = (a[0] + to_centre[0], a[1] + to_centre[1], a[2] + to_centre[2])
            self.arm_length: Vector = minus(a, self.centre)
            end = minus(c, self.centre)
            angle = math.atan2(dot(self.axis, cross(self.arm_length, end)), dot(self.arm_length, end))
            self.angle = angle % (2.0 * math.pi)  # about this axis the way leads over via
            length = self.angle * math.hypot(*self.arm_length)
        self.goal = self._pose(1.0)
        super().__init__(arm, max(length, _TURN_LENGTH * math.hypot(*self.turn)), acceleration, speed, 0.0)

    def _pose(self, share: float) -> Pose:
        if not self.angle:
            return interpolate(self.start, self.shift, self.turn, share)
        spin = Pose.from_rotation_vector(scaled(self.axis, self.angle * share))
        x, y, z = spin.rotate(self.arm_length)
        here = (self.centre[0] + x, self.centre[1] + y, self.centre[2] + z)
        if self.fixed:
            return Pose((spin @ Pose(self.start.rotation)).rotation, here)
        turned = Pose(self.start.rotation) @ Pose.from_rotation_vector(scaled(self.turn, share))
        return Pose(turned.rotation, here)
