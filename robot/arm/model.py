"""Geometry and limits of an arm of any make.

Standard (distal) DH: frame i-1 goes to frame i by Rz(q_i + theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i), i = 1..n. Frame 0 is
the controller's *base*, frame n its *flange* (the TCP of an arm without a tool).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from coneskin.core.errors import KinematicsError

from .joints import Joints as Joints


@dataclass(frozen=True, slots=True)
class JointCurrents:
    """What the motor currents of an arm say of the torques on its joints."""

    torque_per_ampere: Joints  #: of each joint [N m/A]
    min_unexplained: Joints  #: torque of each joint that counts as nothing, without noise and friction [N m]
    max_unexplained: Joints  #: the same, however large noise and friction are [N m]


@dataclass(frozen=True, slots=True)
class ArmModel:
    """Geometry and limits of one arm, of as many joints as its table has rows.

    Attributes:
        name: name that its maker gives it, such as "UR10e".
        a: DH link lengths [m].
        d: DH joint offsets [m].
        alpha: DH twists [rad].
        joint_lower: lowest joint positions [rad]; -inf where a joint turns without end.
        joint_upper: highest joint positions [rad]; inf where a joint turns without end.
        joint_speed: highest joint speeds [rad/s].
        theta: DH joint angles at q = 0 [rad]; empty where all are zero.
        driver: "module:object" of the driver of its controller (``coneskin.robot.driver.protocol``).
        currents: of its motors; None where it is not known what they say: then nothing moves the arm away.

    Raises:
        KinematicsError: a row is missing, a number is not finite, a joint's limits are not in order, or its speed is
            not above 0.
    """

    name: str
    a: Joints
    d: Joints
    alpha: Joints
    joint_lower: Joints
    joint_upper: Joints
    joint_speed: Joints
    theta: Joints = ()
    driver: str = ""
    currents: JointCurrents | None = None

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.a)

    def __post_init__(self) -> None:
        rows = {"a": self.a, "d": self.d, "alpha": self.alpha, "theta": self.theta or self.a, "speed": self.joint_speed}
        for name, values in rows.items():
            _check_row(values, max(1, self.joints), f"{name} of {self.name}")
        if not len(self.joint_lower) == len(self.joint_upper) == self.joints:
            raise KinematicsError(f"joint_lower and joint_upper of {self.name} must be {self.joints} numbers each")
        for lower, upper, speed in zip(self.joint_lower, self.joint_upper, self.joint_speed, strict=True):
            if not lower < upper:
                raise KinematicsError(
                    f"joint_lower of {self.name} must be below joint_upper, got {lower} and {upper} rad"
                )
            if not speed > 0.0:
                raise KinematicsError(f"joint_speed of {self.name} must be above 0 rad/s, got {speed}")

    def calibrated(
        self,
        delta_a: Sequence[float] = (),
        delta_d: Sequence[float] = (),
        delta_alpha: Sequence[float] = (),
        delta_theta: Sequence[float] = (),
    ) -> ArmModel:
        """Return the arm with the factory calibration of one robot (``calibration.conf`` on its controller).

        Joints 2, 3 and 4 are almost parallel, so their delta_d may be tens of metres and cancel in the sum. Frames 2
        and 3 are then far from the arm, which `dh_link` takes into account.

        Args:
            delta_a: added to a [m], for each joint; empty for none.
            delta_d: added to d [m], likewise.
            delta_alpha: added to alpha [rad], likewise.
            delta_theta: added to the joint angles [rad], likewise.

        Raises:
            KinematicsError: a delta does not have a finite number for each joint.
        """
        return replace(
            self,
            a=_sum(self.a, delta_a, "delta_a"),
            d=_sum(self.d, delta_d, "delta_d"),
            alpha=_sum(self.alpha, delta_alpha, "delta_alpha"),
            theta=_sum(self.theta or (0.0,) * self.joints, delta_theta, "delta_theta"),
        )


def _check_row(values: Sequence[float], joints: int, name: str) -> None:
    if len(values) != joints or not all(math.isfinite(value) for value in values):
        raise KinematicsError(f"{name} must be {joints} finite numbers, got {tuple(values)}")


def _sum(nominal: Joints, delta: Sequence[float], name: str) -> Joints:
    if not delta:
        return nominal
    _check_row(delta, len(nominal), name)
    return tuple(x + dx for x, dx in zip(nominal, delta, strict=True))
