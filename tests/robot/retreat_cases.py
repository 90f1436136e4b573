"""One arm, one touch on its forearm, and short ways to plan a retreat."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.models import arm_model
from coneskin.robot.reaction.retreat import RetreatPlan, plan_retreat
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, Reaction

UR10E = arm_model("UR10e")
Q: Joints = (0.3, -1.2, 1.1, 0.4, 0.5, 0.6)
FOREARM = ContactOnLink(3, (0.3, 0.0, 0.06), (0.0, 0.0, 1.0))


def planned(
    arm: ArmModel, q: Joints, contacts: list[ContactOnLink], reaction: Reaction | None = None, qd: Joints | None = None
) -> RetreatPlan | Done:
    return plan_retreat(arm, ArmState(0.0, q, qd or (0.0,) * 6), contacts, reaction or Reaction(kind="retreat"))


def six(values: Iterable[float]) -> Joints:
    a, b, c, d, e, f = (float(value) for value in values)
    return a, b, c, d, e, f


def elbow_limited(lower: float, upper: float) -> ArmModel:
    arm = UR10E
    return replace(
        arm,
        joint_lower=(*arm.joint_lower[:2], lower, *arm.joint_lower[3:]),
        joint_upper=(*arm.joint_upper[:2], upper, *arm.joint_upper[3:]),
    )
