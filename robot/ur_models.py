"""The arms of the Universal Robots family: Denavit-Hartenberg tables, joint limits and joint speeds.

Standard (distal) DH: frame i-1 goes to frame i by Rz(q_i + theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i), i = 1..6. Frame 0 is
the controller's *base*, frame 6 its *flange* (the TCP of an arm without a tool).

Sources:
    Lengths: Universal Robots support article "DH Parameters for calculations of kinematics and dynamics" and
    ``default_kinematics.yaml`` of Universal_Robots_ROS2_Description, which agree digit for digit. The UR7e is a
    UR5e of higher payload: the same geometry and masses. The printed CB3 service manual has other numbers for old
    series (UR5 series 1 and 2, and UR10 rounded): for those, and for any work below a few millimetres, use
    ``calibrated``.
    Limits and speeds: user manuals as collected in ``joint_limits.yaml`` there. The elbow's 180 deg is that file's too:
    the controller would take 360 deg, but the forearm meets the upper arm before. Wrist 3 of UR3 and UR3e turns
    without end. Universal Robots publishes no joint acceleration.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from coneskin.errors import KinematicsError

__all__ = ["MODEL_NAMES", "ArmModel", "Joints", "model"]

Joints = tuple[float, float, float, float, float, float]

_ZEROS: Joints = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_QUARTER = math.pi / 2.0


@dataclass(frozen=True, slots=True)
class ArmModel:
    """Geometry and limits of one six-joint arm.

    Attributes:
        name: what Universal Robots calls it, such as "UR10e".
        a: DH link lengths [m].
        d: DH joint offsets [m].
        alpha: DH twists [rad].
        joint_lower: lowest joint positions [rad]; -inf where the joint turns without end.
        joint_upper: highest joint positions [rad]; inf where the joint turns without end.
        joint_speed: highest joint speeds [rad/s].
        theta: DH joint angles at q = 0 [rad]; not zero only in a calibrated arm.
    """

    name: str
    a: Joints
    d: Joints
    alpha: Joints
    joint_lower: Joints
    joint_upper: Joints
    joint_speed: Joints
    theta: Joints = _ZEROS

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
        delta_a: Sequence[float] = _ZEROS,
        delta_d: Sequence[float] = _ZEROS,
        delta_alpha: Sequence[float] = _ZEROS,
        delta_theta: Sequence[float] = _ZEROS,
    ) -> ArmModel:
        """The arm with the factory calibration of one robot (``calibration.conf`` on its controller).

        Joints 2, 3 and 4 are almost parallel, so their delta_d may be tens of metres and cancel in the sum: the frames
        2 and 3 are then far from the arm, which ``link_frames`` takes into account.

        Args:
            delta_a: what is added to a [m], 6 numbers.
            delta_d: what is added to d [m], 6 numbers.
            delta_alpha: what is added to alpha [rad], 6 numbers.
            delta_theta: what is added to the joint angles [rad], 6 numbers.

        Raises:
            KinematicsError: a delta has not six finite numbers.
        """
        return replace(
            self,
            a=_sum(self.a, delta_a, "delta_a"),
            d=_sum(self.d, delta_d, "delta_d"),
            alpha=_sum(self.alpha, delta_alpha, "delta_alpha"),
            theta=_sum(self.theta, delta_theta, "delta_theta"),
        )


def model(name: str) -> ArmModel:
    """The nominal arm of that name; case, spaces, hyphens and underscores do not matter ("ur-10e", "UR10 e").

    Raises:
        KinematicsError: no such arm; the message lists those there are.
    """
    found = _MODELS.get(re.sub(r"[\s_-]", "", name).lower())
    if found is None:
        raise KinematicsError(f"arm must be one of {', '.join(MODEL_NAMES)}, got {name!r}")
    return found


def _check_six(values: Sequence[float], name: str) -> None:
    if len(values) != 6 or not all(math.isfinite(value) for value in values):
        raise KinematicsError(f"{name} must be 6 finite numbers, got {tuple(values)}")


def _sum(nominal: Joints, delta: Sequence[float], name: str) -> Joints:
    _check_six(delta, name)
    first, second, third, fourth, fifth, sixth = (x + dx for x, dx in zip(nominal, delta, strict=True))
    return first, second, third, fourth, fifth, sixth


def _deg(*degrees: float) -> Joints:
    first, second, third, fourth, fifth, sixth = (math.radians(value) for value in degrees)
    return first, second, third, fourth, fifth, sixth


def _arm(name: str, lengths: tuple[float, ...], speeds: Joints, wrist_3_limit: float = math.radians(360.0)) -> ArmModel:
    """An arm from d1, a2, a3, d4, d5, d6 [m]: all the others of a UR arm's lengths are zero."""
    d1, a2, a3, d4, d5, d6 = lengths
    upper = (*_deg(360, 360, 180, 360, 360, 0)[:5], wrist_3_limit)
    return ArmModel(
        name=name,
        a=(0.0, a2, a3, 0.0, 0.0, 0.0),
        d=(d1, 0.0, 0.0, d4, d5, d6),
        alpha=(_QUARTER, 0.0, 0.0, _QUARTER, -_QUARTER, 0.0),
        joint_lower=(-upper[0], -upper[1], -upper[2], -upper[3], -upper[4], -upper[5]),
        joint_upper=upper,
        joint_speed=speeds,
    )


_SMALL = _deg(180, 180, 180, 360, 360, 360)
_MEDIUM = _deg(180, 180, 180, 180, 180, 180)
_LARGE = _deg(120, 120, 180, 180, 180, 180)
_HEAVY = _deg(120, 120, 150, 210, 210, 210)

_MODELS = {
    arm.name.lower(): arm
    for arm in (  # d1, a2, a3, d4, d5, d6 [m]
        _arm("UR3", (0.1519, -0.24365, -0.21325, 0.11235, 0.08535, 0.0819), _SMALL, math.inf),
        _arm("UR5", (0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823), _MEDIUM),
        _arm("UR10", (0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922), _LARGE),
        _arm("UR3e", (0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921), _SMALL, math.inf),
        _arm("UR5e", (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996), _MEDIUM),
        _arm("UR7e", (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996), _MEDIUM),
        _arm("UR10e", (0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655), _LARGE),
        _arm("UR16e", (0.1807, -0.4784, -0.36, 0.17415, 0.11985, 0.11655), _LARGE),
        _arm("UR20", (0.2363, -0.8620, -0.7287, 0.2010, 0.1593, 0.1543), _HEAVY),
        _arm("UR30", (0.2363, -0.6370, -0.5037, 0.2010, 0.1593, 0.1543), _HEAVY),
    )
}

#: The names that ``model`` knows.
MODEL_NAMES = tuple(arm.name for arm in _MODELS.values())
