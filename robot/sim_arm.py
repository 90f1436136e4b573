"""Where the simulated arm is: positions, speeds, its tool, and the checks of its safety system.

The model is ideal tracking: the arm does what the trajectory generator wants, so measured and wanted speeds are equal.
No dynamics, no friction, no vibration. Every way of stopping ends in a ramp of joint speeds down to zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from coneskin.geometry.pose import Pose

from .kinematics import flange_jacobian, forward
from .ur_models import ArmModel

__all__ = [
    "BRAKE",
    "CYCLE",
    "LARGEST_ACCELERATION",
    "Arm",
    "Motion",
    "MotionFault",
    "braked",
    "lead_of",
    "moved",
    "solve",
]

CYCLE = 0.002  #: the control cycle of an e-Series controller [s]
BRAKE = 10.0  #: deceleration of the leading joint where nothing else is said [rad/s2]; an assumption
LARGEST_ACCELERATION = 100.0  #: a step of joint speed beyond this is a fault of the trajectory [rad/s2]
SPEED_MARGIN = 1.01  #: how far beyond its greatest speed a joint may be before the safety system stops it


class MotionFault(Exception):
    """The trajectory cannot go on: the controller makes a protective stop of it."""


class Motion(Protocol):
    """One command that moves the arm."""

    done: bool

    def step(self, arm: Arm, scale: float, hold: bool) -> tuple[list[float], list[float]]:
        """Joint positions and speeds after one cycle; scale is the speed slider, hold slows down to a standstill."""


class Arm:
    """Where the arm is, how fast, and what moves it.

    Attributes:
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        qdd: joint accelerations [rad/s2].
        tcp: tool centre point in the flange frame.
    """

    def __init__(self, model: ArmModel, q: Sequence[float]) -> None:
        self.model = model
        self.q = [float(angle) for angle in q]
        self.qd = [0.0] * 6
        self.qdd = [0.0] * 6
        self.tcp = Pose()
        self.motion: Motion | None = None

    def step(self, scale: float, hold: bool) -> str:
        """One cycle. Returns why the safety system must stop the arm, or an empty string."""
        fault = ""
        motion = self.motion
        if motion is None and not any(self.qd) and not any(self.qdd):
            return ""
        try:
            if motion is None:
                q, qd = braked(self.q, self.qd, BRAKE)
            else:
                q, qd = motion.step(self, scale, hold)
                self._check(q, qd)
        except MotionFault as exc:
            fault = str(exc)
            self.motion = None
            q, qd = braked(self.q, self.qd, BRAKE)
        if motion is not None and motion.done:
            self.motion = None
        self.qdd = [(new - old) / CYCLE for new, old in zip(qd, self.qd, strict=True)]
        self.q, self.qd = q, qd
        return fault

    @property
    def moving(self) -> bool:
        """Any joint turns."""
        return any(self.qd)

    def _check(self, q: list[float], qd: list[float]) -> None:
        model = self.model
        for i in range(6):
            speed = qd[i]
            if abs(speed) > SPEED_MARGIN * model.joint_speed[i]:
                raise MotionFault(f"joint {i + 1}: speed {speed:.2f} rad/s above its limit {model.joint_speed[i]:.2f}")
            if abs(speed - self.qd[i]) > LARGEST_ACCELERATION * CYCLE:
                raise MotionFault(f"joint {i + 1}: speed jumps by {speed - self.qd[i]:.2f} rad/s in one cycle")
            if speed:
                rest = q[i] + speed * abs(speed) / (2.0 * BRAKE)  # where braking at once would end
                if (speed > 0.0 and rest > model.joint_upper[i]) or (speed < 0.0 and rest < model.joint_lower[i]):
                    raise MotionFault(f"joint {i + 1}: position {q[i]:.3f} rad is about to leave its limits")

    # the tool

    def tcp_pose(self, q: Sequence[float] | None = None) -> Pose:
        """Pose of the tool centre point in the base frame."""
        return forward(self.model, self.q if q is None else q) @ self.tcp

    def jacobian(self) -> list[list[float]]:
        """6 x 6: velocity [m/s] and angular velocity [rad/s] of the tool centre point from joint speeds."""
        rows = [list(row) for row in flange_jacobian(self.model, self.q)]
        x, y, z = forward(self.model, self.q).rotate(self.tcp.translation)
        for i in range(6):
            wx, wy, wz = rows[3][i], rows[4][i], rows[5][i]
            rows[0][i] += wy * z - wz * y
            rows[1][i] += wz * x - wx * z
            rows[2][i] += wx * y - wy * x
        return rows

    def twist(self) -> list[float]:
        """Velocity [m/s] and angular velocity [rad/s] of the tool centre point."""
        if not any(self.qd):
            return [0.0] * 6
        return [sum(a * b for a, b in zip(row, self.qd, strict=True)) for row in self.jacobian()]

    def joint_speeds(self, twist: Sequence[float]) -> list[float]:
        """Joint speeds that give the tool centre point a velocity and an angular velocity.

        Raises:
            MotionFault: the arm is in, or within 1e-4 of, a singular position.
        """
        return solve(self.jacobian(), twist)


def solve(rows: Sequence[Sequence[float]], right: Sequence[float]) -> list[float]:
    """Solve six linear equations (Gauss, partial pivoting).

    Raises:
        MotionFault: no pivot is above 1e-4: the arm is in a singular position.
    """
    m = [[*row, value] for row, value in zip(rows, right, strict=True)]
    n = len(m)
    for k in range(n):
        lead = max(range(k, n), key=lambda i: abs(m[i][k]))
        if abs(m[lead][k]) < 1e-4:
            raise MotionFault("the arm is in a singular position")
        m[k], m[lead] = m[lead], m[k]
        pivot = m[k]
        for i in range(k + 1, n):
            factor = m[i][k] / pivot[k]
            if factor:
                row = m[i]
                for j in range(k + 1, n + 1):
                    row[j] -= factor * pivot[j]
    x = [0.0] * n
    for k in range(n - 1, -1, -1):
        x[k] = (m[k][n] - sum(m[k][j] * x[j] for j in range(k + 1, n))) / m[k][k]
    return x


def lead_of(values: Sequence[float]) -> float:
    """The greatest magnitude: that of the leading joint."""
    return max(abs(value) for value in values)


def braked(q: Sequence[float], qd: Sequence[float], rate: float) -> tuple[list[float], list[float]]:
    """All joints slow down in proportion, the leading one at a rate [rad/s2]."""
    lead = lead_of(qd)
    if lead == 0.0:
        return list(q), [0.0] * 6
    share = max(0.0, 1.0 - rate * CYCLE / lead)
    slower = [speed * share for speed in qd]
    return moved(q, qd, slower), slower


def moved(q: Sequence[float], before: Sequence[float], after: Sequence[float]) -> list[float]:
    """Where joints are one cycle later, their speed changing evenly [rad]."""
    return [a + 0.5 * (b + c) * CYCLE for a, b, c in zip(q, before, after, strict=True)]
