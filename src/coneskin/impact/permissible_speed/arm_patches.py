"""Patches of the skins on an arm, and the mass that a blow feels at each in the positions that the arm takes."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.errors import SceneError
from coneskin.geometry.pose import Vector
from coneskin.robot.arm.inertia import ArmInertia, arm_inertia, joint_torques, loaded, mass_matrix
from coneskin.robot.arm.kinematics import link_poses, point_jacobian
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import ZERO_VELOCITY
from coneskin.scene.build import place_on_arm
from coneskin.scene.values.scene import ArmScene, Scene

ALONG = 3  #: patches along a sheet: its two ends, and the middle
AROUND = 16  #: around a whole turn
_SAMPLE_COUNT = 200  # joint positions of a motion that are looked at


@dataclass(frozen=True, slots=True)
class ArmPatch:
    """Patch of a skin."""

    sensor: str  #: its name
    link: int  #: index of the link's DH frame
    u: float  #: slant distance from end 1 [m]
    phi: float  #: azimuth [rad]
    point: Vector  #: in the link's frame [m]
    normal: Vector  #: outward unit normal in that frame


def patches_of(scene: Scene) -> list[ArmPatch]:
    """Return the patches of all skins of a scene.

    Raises:
        SceneError: it has no arm, or no skin on a link that moves.
    """
    if scene.arm is None or not scene.sensors:
        raise SceneError(["permissible speeds need an [arm] and a [[link]] with a [[link.sensor]]"], scene.name)
    found = []
    for item in place_on_arm(scene):
        if item.link == 0:
            continue
        cone = item.frustum.frustum
        whole = cone.wrap > 2.0 * math.pi - 1e-9
        count = AROUND if whole else max(2, math.ceil(AROUND * cone.wrap / (2.0 * math.pi)) + 1)
        step = cone.wrap / (count if whole else count - 1)
        for row in range(ALONG):
            for column in range(count):
                u, phi = cone.slant * row / (ALONG - 1), min(cone.wrap, step * column)
                at = item.frustum.point(u, phi), item.frustum.normal(phi)
                found.append(ArmPatch(item.name, item.link, u, phi, *at))
    if not found:
        why = "permissible speeds need a skin on a link that moves; there is one on the base only"
        raise SceneError([why], scene.name)
    return found


def motion_positions(scene: Scene) -> list[tuple[float, ...]]:
    """Return joint positions in the box around a scene's motion [rad]: on its way, and anywhere in the box.

    Raises:
        SceneError: it has no [motion].
    """
    if scene.motion is None:
        raise SceneError(["the speeds of a motion need a [motion]"], scene.name)
    points = scene.motion.waypoints
    lowest = [min(values) for values in zip(*points, strict=True)]
    highest = [max(values) for values in zip(*points, strict=True)]
    found = [
        tuple(p + (r - p) * step / 20 for p, r in zip(*leg, strict=True))
        for leg in pairwise(points)
        for step in range(21)
    ]
    chance = random.Random(0)
    while len(found) < _SAMPLE_COUNT:
        found.append(tuple(chance.uniform(low, high) for low, high in zip(lowest, highest, strict=True)))
    return found


def inertias_of(arm: ArmScene) -> tuple[ArmInertia, ...]:
    """Return the inertia of an arm, bare and with all that it carries."""
    bare = arm_inertia(arm.model)
    return (bare, loaded(bare, arm.payload, arm.payload_xyz)) if arm.payload else (bare,)


def braking_held(arm: ArmModel, positions: Sequence[Sequence[float]], inertias: Sequence[ArmInertia]) -> float:
    """Return the deceleration of the leading joint that the motors hold beside gravity [rad/s^2]; negative without one.

    It is the least of upright positions, with all joints braking as hard, in the worst directions.
    """
    found = math.inf
    for q, inertia in product(positions, inertias):
        weights = joint_torques(arm, inertia, q, ZERO_VELOCITY, ZERO_VELOCITY)
        for row, weight, most in zip(mass_matrix(arm, inertia, q), weights, inertia.torque, strict=True):
            found = min(found, (most - abs(weight)) / sum(map(abs, row)))
    return found


def weigh(
    arm: ArmModel,
    patches: Sequence[ArmPatch],
    positions: Sequence[Sequence[float]],
    inertias: Sequence[ArmInertia] = (),
) -> Floats:
    """Return the effective mass at each patch in each position [kg], with each inertia; shape (both, patches).

    It is infinite where no joint moves the patch along its normal. The joints are free in it. Held joints make an arm
    heavier, never lighter.

    Source: Khatib, "Inertial properties in robotic manipulation: an object-level framework", IJRR 14 (1995), eq. 9.
    """
    cases = list(product(positions, inertias or (arm_inertia(arm),)))
    found = np.empty((len(cases), len(patches)))
    for row, (q, inertia) in enumerate(cases):
        inverse = np.linalg.inv(np.array(mass_matrix(arm, inertia, q)))
        poses = link_poses(arm, q)
        lever = np.empty((len(patches), 6))
        for number, patch in enumerate(patches):
            normal = poses[patch.link].rotate(patch.normal)
            lever[number] = np.array(normal) @ np.array(point_jacobian(arm, q, patch.link, patch.point))
        mobility = np.einsum("pi,ij,pj->p", lever, inverse, lever)
        with np.errstate(divide="ignore"):
            found[row] = np.where(mobility > 1e-12, 1.0 / mobility, np.inf)
    return found
