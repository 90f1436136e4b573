"""Simulated arm: positions, speeds, its tool, and the checks of its safety system.

Positions and speeds are those that the trajectory generator commands; what the plant makes of them is ``measured``. The
default one tracks ideally: no friction, no vibration. What the motors cannot do is not done: a motion that takes more
torque than they have, with the payload that the program has set, ends in a protective stop, and a stop takes longer.

A controlled stop is a ramp of joint speeds to zero. A stop of category 0, of a protective or an emergency stop, brakes
as hard as the motors can, and softer towards its end. Its law is fitted to Universal Robots' tables: ``python -m bench
stopping-times`` prints both.

Source of the causes of a stop: Universal Robots, "Error Codes", PolyScope 5: numbers, arguments and titles. What
exactly makes a real controller give each is not published. docs/look-up/sim-ur.md has what makes this one give it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from coneskin.core.errors import RobotRefused
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.inertia import arm_inertia, highest_acceleration, joint_torques, loaded
from coneskin.robot.arm.kinematics import flange_jacobian, forward
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.sim.urscript.values import solve_linear

from .plant import CYCLE as CYCLE
from .plant import KinematicPlant, PlantState

_JOINT_NAMES = ("Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3")


@dataclass(frozen=True, slots=True)
class StopCause:
    """Cause of a protective stop."""

    code: int  #: number after the C
    argument: int  #: number after the A
    title: str  #: that it has in the published list

    def __str__(self) -> str:
        return f"C{self.code}A{self.argument}"


_CLOSE_TO_JOINT_LIMITS = StopCause(150, 0, "Position close to joint limits")
_IN_SINGULARITY = StopCause(154, 0, "Position in singularity")
SUDDEN_CHANGE = StopCause(204, 1, "Path sanity check failed: Sudden change in target position")
INVALID_SETPOINT = StopCause(204, 5, "Path sanity check failed: Robot program resulted in invalid setpoint")
_NEAR_SINGULARITY = StopCause(
    204, 7, "Path sanity check failed: Robot approaching singularity - Acceleration threshold failed"
)
TRIGGERED = StopCause(209, 0, "A protective stop was triggered (for test purposes only)")


CONTROLLER_DECELERATION = 10.0  #: of the leading joint where the command gives none [rad/s^2]; an assumption
JOINT_ACCELERATION = 40.0  #: highest acceleration of a joint, as a UR5e reports it in its configuration [rad/s^2]
MAX_ACCELERATION = 100.0  #: of a joint; a step of speed beyond it is a trajectory fault [rad/s^2]
_STANDSTILL_SPEED = 1e-3  # rad/s; measured speeds up to it count as none: a plant with dynamics never rests entirely
_SPEED_MARGIN = 1.01  # share of its highest speed at which the safety system stops a joint
_EASY_ACCELERATION = 5.0  # rad/s^2, of every joint; what no arm's motors lack the torque for: it is not worked out
_HARDEST_BRAKING = 50.0  # rad/s^2 of the leading joint; an assumption for arms without a load
_WEAKEST_BRAKING = 0.5  # rad/s^2 of a joint whose motor has no torque left; a real one would sag
_FADING_POWER = 1.0 / 3.0  # of speed over highest speed, with which a stop of category 0 softens; fitted
_LEAST_SHARE = 1e-3  # of a joint's highest speed; below, a stop softens no further
_MAX_PAYLOAD, _MAX_PAYLOAD_LEVER = 100.0, 2.0  # kg, m; a payload beyond is none of an arm, and is not simulated
_SMALLEST_PIVOT = 1e-4  # of the Jacobian; below, the position is singular
_BRAKING_CYCLES = 4  # between two calculations of what the motors can do


class MotionFault(Exception):
    """Trajectory that cannot go on: the controller makes a protective stop of it."""

    def __init__(self, cause: StopCause, detail: str) -> None:
        super().__init__(f"{cause}: {cause.title}: {detail}")
        self.cause = cause


class Motion(Protocol):
    """Command that moves the arm."""

    done: bool  #: it has come to its end
    brakes: bool  #: it is a stop, which the checks let pass

    def update(self, arm: SimulatedArm, scale: float, hold: bool) -> tuple[list[float], list[float]]:
        """Return joint positions [rad] and speeds [rad/s] after one cycle.

        Args:
            scale: speed slider, 0..1.
            hold: slow down to a standstill.
        """


class SimulatedArm:
    """State of the arm, and the motion that drives it.

    Attributes:
        q: commanded joint positions [rad].
        qd: commanded joint speeds [rad/s].
        qdd: commanded joint accelerations [rad/s^2].
        measured: what the plant has made of them.
        kinematic: True where the plant does exactly what is commanded.
        tcp: tool centre point in the flange frame.
        motion: command that moves the arm; None where the arm brakes or stands.
        deceleration: of the controller where a command gives none [rad/s^2].
        category_0: True where it has to stop as hard as it can.

    Raises:
        RobotRefused: the first position is outside the limits of a joint.
    """

    def __init__(self, model: ArmModel, q: Sequence[float]) -> None:
        for joint, (low, angle, high) in enumerate(zip(model.joint_lower, q, model.joint_upper, strict=True), 1):
            if not low <= angle <= high:
                raise RobotRefused(
                    f"the start position of joint {joint} of the {model.name} must be from {math.degrees(low):g} to "
                    f"{math.degrees(high):g} deg, got {math.degrees(angle):g} deg"
                )
        self.model = model
        self.inertia = arm_inertia(model)
        self.q = [float(angle) for angle in q]
        self.qd = [0.0] * 6
        self.qdd = [0.0] * 6
        self.measured: PlantState = KinematicPlant().update(self.q, self.qd)
        self.kinematic = True
        self.tcp = Pose()
        self.motion: Motion | None = None
        self.category_0 = False
        self.deceleration = CONTROLLER_DECELERATION
        self._feasible, self._feasible_for = 0.0, 0  # what the motors can brake with [rad/s^2], and for how many cycles

    def carry(self, mass: float, centre: Sequence[float]) -> None:
        """Let the arm carry a payload of a mass [kg] whose centre of mass is at a place in the flange's frame [m]."""
        possible = mass <= _MAX_PAYLOAD and max_abs(centre) <= _MAX_PAYLOAD_LEVER
        self.inertia = loaded(arm_inertia(self.model), mass, centre) if possible else arm_inertia(self.model)

    def update(self, scale: float, hold: bool) -> MotionFault | None:
        """Advance by one cycle; return why the safety system must stop the arm, if it must."""
        fault = None
        motion = self.motion
        if motion is None and not any(self.qd) and not any(self.qdd):
            return None
        try:
            if motion is None:
                q, qd = self.brake()
            else:
                if not (hold or motion.brakes):
                    self._feasible_for = 0
                q, qd = motion.update(self, scale, hold)
                self._check(q, qd)
                if not (hold or motion.brakes):
                    self._check_torques(qd)
        except (MotionFault, ArithmeticError, ValueError) as exc:  # numbers of a program that are finite, but huge
            fault = exc if isinstance(exc, MotionFault) else MotionFault(INVALID_SETPOINT, str(exc))
            self.motion = None
            q, qd = self.brake()
        if motion is not None and motion.done:
            self.motion = None
        self.qdd = [(new - old) / CYCLE for new, old in zip(qd, self.qd, strict=True)]
        self.q, self.qd = q, qd
        return fault

    def going(self, qd: list[float]) -> tuple[list[float], list[float]]:
        """Return positions and speeds one cycle later, the speeds changing evenly to these."""
        return [a + 0.5 * (b + c) * CYCLE for a, b, c in zip(self.q, self.qd, qd, strict=True)], qd

    def brake(self, rate: float = 0.0) -> tuple[list[float], list[float]]:
        """Return positions and speeds after a cycle of braking, all joints in proportion; see `braking`."""
        lead = max_abs(self.qd)
        if lead == 0.0:
            return list(self.q), [0.0] * 6
        share = max(0.0, 1.0 - self.braking(rate) * CYCLE / lead)
        slower = [speed * share for speed in self.qd]
        return self.going(slower)

    def braking(self, rate: float = 0.0) -> float:
        """Return the deceleration of the leading joint in this cycle [rad/s^2].

        Args:
            rate: that is asked for; 0 for the controller's own. It is less where the motors cannot do it.
        """
        if self._feasible_for <= 0 and any(self.qd):
            lead = max_abs(self.qd)
            most = self.feasible_acceleration([-speed / lead for speed in self.qd])
            self._feasible, self._feasible_for = min(max(most, _WEAKEST_BRAKING), _HARDEST_BRAKING), _BRAKING_CYCLES
        self._feasible_for -= 1
        if not self.category_0:
            return min(rate or self.deceleration, self._feasible)
        share = max_abs([speed / highest for speed, highest in zip(self.qd, self.model.joint_speed, strict=True)])
        return self._feasible * math.pow(min(1.0, max(share, _LEAST_SHARE)), _FADING_POWER)

    def put(self, q: Sequence[float]) -> None:
        """Put an arm that stands at joint positions [rad], without a motion."""
        self.q = [float(angle) for angle in q]
        self.measured = KinematicPlant().update(self.q, self.qd)

    @property
    def moving(self) -> bool:
        """True while any joint is commanded to turn."""
        return any(self.qd)

    @property
    def turning(self) -> bool:
        """True while any joint turns, as measured, or is commanded to."""
        return self.moving or max_abs(self.measured.qd) > _STANDSTILL_SPEED

    @property
    def blends(self) -> bool:
        """True while a path goes on that the program no longer waits for, as it has a blend radius."""
        return bool(getattr(self.motion, "blends", False))

    def _check(self, q: list[float], qd: list[float]) -> None:
        model = self.model
        of_tool = getattr(self.motion, "of_tool", False)  # whose joints are quick where the arm is nearly singular
        for i in range(6):
            speed = qd[i]
            if not math.isfinite(q[i] + speed):
                raise MotionFault(INVALID_SETPOINT, f"joint {i + 1}: its position or its speed is not a number")
            if abs(speed - self.qd[i]) > MAX_ACCELERATION * CYCLE:
                detail = f"joint {i + 1}: speed jumps by {speed - self.qd[i]:.2f} rad/s in one cycle"
                raise MotionFault(_NEAR_SINGULARITY if of_tool else SUDDEN_CHANGE, detail)
            if abs(speed) > _SPEED_MARGIN * model.joint_speed[i]:
                detail = f"joint {i + 1}: speed {speed:.2f} rad/s above its limit {model.joint_speed[i]:.2f}"
                raise MotionFault(_NEAR_SINGULARITY if of_tool else INVALID_SETPOINT, detail)
            if speed:
                rest = q[i] + speed * abs(speed) / (2.0 * CONTROLLER_DECELERATION)  # where braking at once would end
                if (speed > 0.0 and rest > model.joint_upper[i]) or (speed < 0.0 and rest < model.joint_lower[i]):
                    detail = f"joint {i + 1}: position {q[i]:.3f} rad is about to leave its limits"
                    raise MotionFault(_CLOSE_TO_JOINT_LIMITS, detail)

    def _check_torques(self, qd: list[float]) -> None:
        """Refuse a motion for which a motor has not the torque: a real arm would fall behind it."""
        qdd = [(new - old) / CYCLE for new, old in zip(qd, self.qd, strict=True)]
        if max_abs(qdd) < _EASY_ACCELERATION:
            return
        torques = joint_torques(self.model, self.inertia, self.q, qd, qdd)
        for i, (torque, limit) in enumerate(zip(torques, self.inertia.torque, strict=True)):
            if abs(torque) > limit:
                detail = f"it takes {abs(torque):.0f} N m, and the motor has {limit:.0f} N m"
                title = f"Position deviates from path: Detected by the {_JOINT_NAMES[i]} joint."
                raise MotionFault(StopCause(153, i, title), detail)

    def feasible_acceleration(self, direction: Sequence[float]) -> float:
        """Return the highest acceleration in a direction for which the motors have the torque."""
        return min(MAX_ACCELERATION, highest_acceleration(self.model, self.inertia, self.q, self.qd, direction))

    # tool

    def tcp_pose(self, q: Sequence[float] | None = None) -> Pose:
        """Return the pose of the tool centre point in the base frame, by default at the present position."""
        return forward(self.model, self.q if q is None else q) @ self.tcp

    def jacobian(self, q: Sequence[float] | None = None) -> list[list[float]]:
        """Return the Jacobian of the tool centre point: three rows of velocity [m/rad], three of angular velocity."""
        at = self.q if q is None else q
        rows = [list(row) for row in flange_jacobian(self.model, at)]
        x, y, z = forward(self.model, at).rotate(self.tcp.translation)
        for i in range(6):
            wx, wy, wz = rows[3][i], rows[4][i], rows[5][i]
            rows[0][i] += wy * z - wz * y
            rows[1][i] += wz * x - wx * z
            rows[2][i] += wx * y - wy * x
        return rows

    def twist(self) -> list[float]:
        """Return the commanded velocity [m/s] and angular velocity [rad/s] of the tool centre point."""
        return self._twist(self.q, self.qd)

    def measured_twist(self) -> list[float]:
        """Return velocity [m/s] and angular velocity [rad/s] of the tool centre point as measured."""
        return self._twist(self.measured.q, self.measured.qd)

    def _twist(self, q: Sequence[float], qd: Sequence[float]) -> list[float]:
        if not any(qd):
            return [0.0] * 6
        return [sum(a * b for a, b in zip(row, qd, strict=True)) for row in self.jacobian(q)]

    def joint_speeds(self, twist: Sequence[float]) -> list[float]:
        """Return the joint speeds [rad/s] that give the tool centre point a velocity and an angular velocity.

        Raises:
            MotionFault: the arm is in, or within 1e-4 of, a singular position.
        """
        speeds = solve_linear(self.jacobian(), twist, _SMALLEST_PIVOT)
        if speeds is None:
            raise MotionFault(_IN_SINGULARITY, "the arm is in a singular position")
        return speeds


def max_abs(values: Sequence[float]) -> float:
    """Return the greatest magnitude: that of the leading joint."""
    return max(abs(value) for value in values)
