"""Patches of the skins on an arm, and the mass that a blow feels at each in the positions that the arm takes."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from coneskin.core.errors import SceneError
from coneskin.robot.arm.inertia import arm_inertia, mass_matrix
from coneskin.robot.arm.kinematics import link_poses, point_jacobian
from coneskin.scene.build import place_on_arm

if TYPE_CHECKING:
    from coneskin.core.arrays import Floats
    from coneskin.geometry.pose import Vector
    from coneskin.robot.arm.model import ArmModel
    from coneskin.scene.values.scene import Scene

ALONG = 3  #: patches along a sheet: its two ends, and the middle
AROUND = 16  #: around a whole turn
_SAMPLE_COUNT = 200  # joint positions of a motion that are looked at


@dataclass(frozen=True, slots=True)
class ArmPatch:
    """Patch of a skin.

    Attributes:
        sensor: its name.
        link: index of the link's DH frame.
        u: slant distance from end 1 [m].
        phi: azimuth [rad].
        point: in the link's frame [m].
        normal: outward unit normal in that frame.
    """

    sensor: str
    link: int
    u: float
    phi: float
    point: Vector
    normal: Vector


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
    found: list[tuple[float, ...]] = []
    legs = list(pairwise(points))
    for a, b in legs:
        for step in range(21):
            found.append(tuple(p + (r - p) * step / 20 for p, r in zip(a, b, strict=True)))
    chance = random.Random(0)
    while len(found) < _SAMPLE_COUNT:
        found.append(tuple(chance.uniform(low, high) for low, high in zip(lowest, highest, strict=True)))
    return found


def weigh(arm: ArmModel, patches: Sequence[ArmPatch], positions: Sequence[Sequence[float]]) -> Floats:
    """Return the effective mass at each patch in each position [kg], shape (positions, patches).

    It is infinite where no joint moves the patch along its normal. The joints are free in it. Held joints make an arm
    heavier, never lighter.

    Source: Khatib, "Inertial properties in robotic manipulation: an object-level framework", IJRR 14 (1995), eq. 9.
    """
    import numpy as np

    inertia = arm_inertia(arm)
    found = np.empty((len(positions), len(patches)))
    for row, q in enumerate(positions):
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
