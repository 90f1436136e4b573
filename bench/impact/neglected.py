"""What the model of a contact leaves out in a push, estimated before any physics engine has seen it.

The model has one mass on one servo, on a straight line. An arm has six, coupled by its mass matrix: where one brakes,
its servo and those of the others give way. And its surface does not go straight: the link turns, and slides past the
ball. Both are added here to first order: six joints whose masses and levers stay those of the first contact, and the
way of the sheet towards the ball as its kinematics have it. Where that changes the answer little, the model holds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coneskin.impact.permissible_speed.contact_course import ContactCourse
from coneskin.robot.arm.inertia import arm_inertia
from coneskin.robot.arm.kinematics import link_pose

from .pushes import HORIZON, LINK, LINK_CONE, MODEL, RADIUS, SERVO_RATE, Push

CHANGE_LIMIT = 0.05  # change of peak, impulse or compression up to which the model is said to hold
TORQUE_LIMIT = 0.99  # of a joint's highest torque
_WAY_SHIFT = 0.01  # share of the way by which this estimate may itself be off
_FACET_DEPTH = 1e-5  # m by which the engine's sheet, a prism of 96 sides, is off
_STEP, _LOOKS = 2e-5, 61  # s of the integration; at which the way is looked at


@dataclass(frozen=True)
class Neglected:
    """What is left out, as the greatest relative change of peak, impulse and compression.

    Attributes:
        joints: by six joints in place of one.
        way: by the way of the surface as well; infinite where it leaves the sheet.
        most: by both where the way is also off by what is known of it.
        torque: greatest share of a joint's highest torque.
    """

    joints: float
    way: float
    most: float
    torque: float

    @property
    def holds(self) -> bool:
        """Whether the model holds."""
        return self.most < CHANGE_LIMIT and self.torque < TORQUE_LIMIT

    @property
    def reason(self) -> str:
        """First of the parts for which it does not; empty where it does."""
        if self.holds:
            return ""
        if self.torque >= TORQUE_LIMIT:
            return "a joint at its highest torque"
        if self.joints >= CHANGE_LIMIT:
            return "six joints, not one"
        return "the surface turns or slides" if self.way >= CHANGE_LIMIT else "1 % of the way, or facets, change it"


def neglected(push: Push, course: ContactCourse) -> Neglected:
    """Return what a course leaves out of a push."""
    bend = _bend(push, course.braked)
    if np.isnan(bend).any():
        return Neglected(math.nan, math.inf, math.inf, 0.0)
    looks = np.linspace(0.0, HORIZON, _LOOKS)
    straight = np.array([abs(push.levers[push.joint] * push.turned(t, course.braked)[0]) for t in looks])
    off = _WAY_SHIFT * straight + _FACET_DEPTH
    answers, torque = _six_joints(push, course.braked, np.array([0.0 * bend, bend, bend - off, bend + off]))
    model = np.array([course.peak, course.impulse, course.deepest])
    joints, way, less, more = np.max(np.abs(model[:, None] / answers - 1.0), axis=0).tolist()
    return Neglected(joints, way, max(way, less, more), torque)


def _bend(push: Push, braked: float) -> NDArray[np.float64]:
    """Return by how much the sheet comes nearer to where the ball was than a straight way would take it [m]."""
    found = []
    for time in np.linspace(0.0, HORIZON, _LOOKS):
        way, _ = push.turned(float(time), braked)
        q = [at + (way if joint == push.joint else 0.0) for joint, at in enumerate(push.q)]
        back = LINK_CONE.link_frustum.inverse() @ link_pose(MODEL, q, LINK).inverse()
        u, _, distance = LINK_CONE.frustum.locate(*back.apply(push.ball))
        on_sheet = 0.0 <= u <= LINK_CONE.frustum.slant
        found.append(RADIUS - distance - abs(push.levers[push.joint] * way) if on_sheet else math.nan)
    return np.array(found)


def _six_joints(push: Push, braked: float, bends: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return peak [N], impulse [N s] and compression [m] with each of some bends of the way, and the torque's share."""
    levers, padding, body, count = push.levers, push.padding, push.body, len(bends)
    diagonal = np.diag(push.masses)
    stiffness, damping = diagonal * SERVO_RATE**2, 2.0 * diagonal * SERVO_RATE
    mobility = np.linalg.inv(push.masses)
    pull, drag, shove = mobility * stiffness, mobility * damping, mobility @ levers
    highest = np.array(arm_inertia(MODEL).torque)[:, None]
    times = np.arange(0.0, HORIZON, _STEP)
    looks = np.linspace(0.0, HORIZON, _LOOKS)
    nearer = np.array([np.interp(times, looks, bend) for bend in bends])
    faster = np.gradient(nearer, _STEP, axis=1)
    x, v = np.zeros((6, count)), np.zeros((6, count))
    v[push.joint] = push.rate
    target, rate = np.zeros((6, 1)), np.zeros((6, 1))
    ball, gone = np.zeros(count), np.zeros(count)
    answers, torque = np.zeros((3, count)), 0.0
    for step, time in enumerate(times.tolist()):
        target[push.joint], rate[push.joint] = push.turned(time, braked)
        depth = levers @ x - ball + nearer[:, step]
        speed = levers @ v - gone + faster[:, step]
        beyond = np.maximum(0.0, depth - padding.thickness)
        elastic = padding.stiffness * (np.maximum(0.0, depth) - beyond) + padding.hard_stiffness * beyond
        force = np.maximum(0.0, elastic * (1.0 + padding.loss * speed))
        answers[0] = np.maximum(answers[0], force)
        answers[1] += force * _STEP
        answers[2] = np.maximum(answers[2], depth)
        lag, slip = target - x, rate - v
        if step % 25 == 0:
            asked = np.abs(stiffness[:, None] * lag + damping[:, None] * slip) / highest
            torque = max(torque, float(np.max(asked[:, :2])))
        v += _STEP * (pull @ lag + drag @ slip - np.outer(shove, force))
        x += _STEP * v
        gone += _STEP * (force - body.support * ball - body.damping * gone) / body.mass
        ball += _STEP * gone
    return answers, torque
