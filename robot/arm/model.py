"""Geometry and limits of a six-joint arm of any make.

Standard (distal) DH: frame i-1 goes to frame i by Rz(q_i + theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i), i = 1..6. Frame 0 is
the controller's *base*, frame 6 its *flange* (the TCP of an arm without a tool).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from coneskin.core.errors import KinematicsError

#: one number for each joint, from the base on
Joints = tuple[float, float, float, float, float, float]

_SIX_ZEROS: Joints = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

#: joint speeds of an arm at rest [rad/s]
ZERO_VELOCITY: Joints = _SIX_ZEROS


@dataclass(frozen=True, slots=True)
class ArmModel:
    """Geometry and limits of one six-joint arm.

    Attributes:
        name: name that its maker gives it, such as "UR10e".
        a: DH link lengths [m].
        d: DH joint offsets [m].
        alpha: DH twists [rad].
        joint_lower: lowest joint positions [rad]; -inf where a joint turns without end.
        joint_upper: highest joint positions [rad]; inf where a joint turns without end.
        joint_speed: highest joint speeds [rad/s].
        theta: DH joint angles at q = 0 [rad]; zero unless the arm is calibrated.
        family: of arms that one driver moves, such as "ur" (``coneskin.robot.driver.registry``).

    Raises:
        KinematicsError: a number is not finite, a joint's limits are not in order, or its speed is not above 0.
    """

    name: str
    a: Joints
    d: Joints
    alpha: Joints
    joint_lower: Joints
    joint_upper: Joints
    joint_speed: Joints
    theta: Joints = _SIX_ZEROS
    family: str = ""

    def __post_init__(self) -> None:
        for field in ("a", "d", "alpha", "theta", "joint_speed"):
            _check_six(getattr(self, field), f"{field} of {self.name}")
        for lower, upper, speed in zip(self.joint_lower, self.joint_upper, self.joint_speed, strict=True):
            if not lower < upper:
                raise KinematicsError(
                    f"joint_lower of {self.name} must be below joint_upper, got {lower} and {upper} rad"
                )
            if not speed > 0.0:
                raise KinematicsError(f"joint_speed of {self.name} must be above 0 rad/s, got {speed}")

    def calibrated(
        self,
        delta_a: Sequence[float] = _SIX_ZEROS,
        delta_d: Sequence[float] = _SIX_ZEROS,
        delta_alpha: Sequence[float] = _SIX_ZEROS,
        delta_theta: Sequence[float] = _SIX_ZEROS,
    ) -> ArmModel:
        """Return the arm with the factory calibration of one robot (``calibration.conf`` on its controller).

        Joints 2, 3 and 4 are almost parallel, so their delta_d may be tens of metres and cancel in the sum. Frames 2
        and 3 are then far from the arm, which `dh_link` takes into account.

        Args:
            delta_a: added to a [m], 6 numbers.
            delta_d: added to d [m], 6 numbers.
            delta_alpha: added to alpha [rad], 6 numbers.
            delta_theta: added to the joint angles [rad], 6 numbers.

        Raises:
            KinematicsError: a delta does not have six finite numbers.
        """
        return replace(
            self,
            a=_sum(self.a, delta_a, "delta_a"),
            d=_sum(self.d, delta_d, "delta_d"),
            alpha=_sum(self.alpha, delta_alpha, "delta_alpha"),
            theta=_sum(self.theta, delta_theta, "delta_theta"),
        )


def _check_six(values: Sequence[float], name: str) -> None:
    if len(values) != 6 or not all(math.isfinite(value) for value in values):
        raise KinematicsError(f"{name} must be 6 finite numbers, got {tuple(values)}")


def _sum(nominal: Joints, delta: Sequence[float], name: str) -> Joints:
    _check_six(delta, name)
    first, second, third, fourth, fifth, sixth = (x + dx for x, dx in zip(nominal, delta, strict=True))
    return first, second, third, fourth, fifth, sixth
