"""Simulation of a retreat: joint speeds ramped as URScript's speedj ramps them, with commands two cycles late."""

from __future__ import annotations

import math
import random
from collections import deque
from dataclasses import dataclass

from coneskin.robot.arm.kinematics import place_point
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.models import ZERO_VELOCITY
from coneskin.robot.reaction.retreat import RetreatPlan, retreat_step
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, JointVelocity

_CYCLE = 0.002  # s


@dataclass(frozen=True)
class FollowedRetreat:
    """Outcome of a retreat.

    Attributes:
        done: how it ended.
        made: way of the touched point along the direction planned, at standstill [m].
        drift: its way across that direction, at standstill [m].
        time: until standstill [s].
        joint_speed: highest, as a part of the joint's limit.
        acceleration: highest joint acceleration [rad/s^2].
        beyond: how far a joint got past its limit [rad]; negative: how far it stayed away.
        backwards: greatest way back along the direction planned [m].
        clipped: all that was reported clipped.
    """

    done: Done
    made: float
    drift: float
    time: float
    joint_speed: float
    acceleration: float
    beyond: float
    backwards: float
    clipped: frozenset[str]


def _ramped(qd: Joints, wanted: Joints, acceleration: float) -> Joints:
    """Return the speeds after one cycle: straight towards those wanted, the leading joint with the acceleration."""
    change = [w - v for w, v in zip(wanted, qd, strict=True)]
    leading = max(abs(value) for value in change)
    part = min(1.0, acceleration * _CYCLE / leading) if leading else 1.0
    a, b, c, d, e, f = (v + part * value for v, value in zip(qd, change, strict=True))
    return a, b, c, d, e, f


def follow(model: ArmModel, plan: RetreatPlan, q: Joints, qd: Joints = ZERO_VELOCITY, late: int = 2) -> FollowedRetreat:
    """Run a retreat to its end and brake.

    Args:
        model: the arm.
        plan: of the retreat.
        q: joint positions at its start [rad].
        qd: joint speeds at its start [rad/s].
        late: control cycles by which commands act late.
    """
    track = plan.tracks[0]

    def place(q: Joints) -> tuple[float, float]:
        point = place_point(model, q, track.link, track.point).point
        off = [p - s for p, s in zip(point, track.start, strict=True)]
        along = sum(o * u for o, u in zip(off, track.away, strict=True))
        return along, math.hypot(*(o - along * u for o, u in zip(off, track.away, strict=True)))

    time = plan.start_time
    waiting: deque[JointVelocity | Done] = deque()
    clipped: set[str] = set()
    done = None
    wanted, acceleration = ZERO_VELOCITY, plan.reaction.acceleration
    joint_speed = leading = furthest = backwards = 0.0
    beyond = -math.inf
    while True:
        if done is None:
            command = retreat_step(plan, ArmState(time, q, qd))
            waiting.append(command)
            if isinstance(command, Done):
                done = command
            else:
                clipped |= set(command.clipped_by)
        if len(waiting) > late or (done is not None and waiting):
            act = waiting.popleft()
            wanted = act.qd if isinstance(act, JointVelocity) else ZERO_VELOCITY
        before, qd = qd, _ramped(qd, wanted, acceleration)
        leading = max(leading, max(abs(v - b) for v, b in zip(qd, before, strict=True)) / _CYCLE)
        a, b, c, d, e, f = (x + v * _CYCLE for x, v in zip(q, qd, strict=True))
        q = (a, b, c, d, e, f)
        time += _CYCLE
        joint_speed = max(joint_speed, *(abs(v) / m for v, m in zip(qd, model.joint_speed, strict=True)))
        beyond = max(
            beyond, *(max(x - u, lo - x) for x, lo, u in zip(q, model.joint_lower, model.joint_upper, strict=True))
        )
        along, drift = place(q)
        furthest = max(furthest, along)
        backwards = max(backwards, furthest - along)
        if done is not None and not waiting and not any(qd):
            return FollowedRetreat(
                done, along, drift, time - plan.start_time, joint_speed, leading, beyond, backwards, frozenset(clipped)
            )


def joints_within(model: ArmModel, source: random.Random, part: float = 1.0) -> Joints:
    """Return joint positions anywhere within the limits, or within a part of them [rad]."""
    a, b, c, d, e, f = (
        part * source.uniform(max(low, -2.0 * math.pi), min(up, 2.0 * math.pi))
        for low, up in zip(model.joint_lower, model.joint_upper, strict=True)
    )
    return a, b, c, d, e, f


def touch(model: ArmModel, source: random.Random, link: int) -> ContactOnLink:
    """Return a touch on a tube of 6 cm radius: along upper arm and forearm, about the joint's axis elsewhere."""
    angle = source.uniform(0.0, 2.0 * math.pi)
    c, s = math.cos(angle), math.sin(angle)
    if link in (2, 3):
        along = source.uniform(0.0, -model.a[link - 1])
        return ContactOnLink(link, (along, 0.06 * c, 0.06 * s), (0.0, c, s))
    return ContactOnLink(link, (0.06 * c, 0.06 * s, source.uniform(-0.05, 0.05)), (c, s, 0.0))
