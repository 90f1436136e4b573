"""Positions and speeds that the joints of an arm keep during a reaction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .model import ArmModel, Joints
from .ur_models import MODEL_NAMES, arm_model

__all__ = ["MARGIN", "REACTION_TIME", "JointLimits", "reach"]

#: distance kept from a joint's limit [rad]
MARGIN = 0.02
#: time until a command acts: two controller cycles, the network, and one cycle to see it [s]
REACTION_TIME = 0.01


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Limits of the joints, with a margin.

    Attributes:
        lower: lowest joint positions, margin included [rad].
        upper: highest joint positions, margin included [rad].
        speed: highest joint speeds [rad/s].
        braking: deceleration available to a joint [rad/s^2].
        reach: upper bound of the distance of any point of the bare arm from each joint's axis [m].
    """

    lower: Joints
    upper: Joints
    speed: Joints
    braking: float
    reach: Joints

    @classmethod
    def of(cls, model: ArmModel, braking: float) -> JointLimits:
        """Return the limits of an arm whose joints brake with a deceleration [rad/s^2]."""
        lower, upper = model.joint_lower, model.joint_upper
        return cls(
            lower=_six([limit + MARGIN for limit in lower]),
            upper=_six([limit - MARGIN for limit in upper]),
            speed=model.joint_speed,
            braking=braking,
            reach=reach(model),
        )

    def blocked(self, q: Sequence[float], qd: Sequence[float], wanted: Sequence[float]) -> list[int]:
        """Return the indices of joints that could no longer brake before their limit if they moved as wanted.

        Args:
            q: joint positions [rad].
            qd: present joint speeds [rad/s].
            wanted: wanted joint speeds [rad/s]; may be shorter than q, the joints beyond stand.
        """
        found = []
        for i, speed in enumerate(wanted):
            if speed > 0.0:
                room = self.upper[i] - q[i]
                fast = qd[i] if qd[i] > speed else speed
            elif speed < 0.0:
                room = q[i] - self.lower[i]
                fast = -qd[i] if -qd[i] > -speed else -speed
            else:
                continue
            if not fast * (REACTION_TIME + fast / (2.0 * self.braking)) <= room:
                found.append(i)
        return found


def reach(model: ArmModel) -> Joints:
    """Return an upper bound of the distance of any point of the bare arm from each joint's axis [m].

    It is that of the nominal arm, because a calibrated table has frames that are not on the arm, plus 10 cm for the
    thickness of the links and the calibration.
    """
    nominal = arm_model(model.name) if model.name in MODEL_NAMES else model
    steps = [math.hypot(a, d) for a, d in zip(nominal.a, nominal.d, strict=True)]
    # a joint's own d lies along its axis
    return _six([abs(a) + sum(steps[i + 1 :]) + 0.1 for i, a in enumerate(nominal.a)])


def _six(values: Sequence[float]) -> Joints:
    first, second, third, fourth, fifth, sixth = values
    return first, second, third, fourth, fifth, sixth
