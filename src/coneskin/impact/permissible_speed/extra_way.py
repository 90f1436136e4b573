"""Extra way of a surface: what it goes beyond the straight way of one driven mass, before the arm stands.

    symbol    meaning
    l         speed of a patch along its normal over that of each joint, its levers [m/rad]
    M         mass matrix [kg m^2]; w: frequency of the servos [rad/s]
    d         speeds of the joints over that of the leading one, each in -1 to 1
    h         how near the patch has come to a ball that it touches, by the joint positions [m]

*Lag.* A joint that brakes pulls at the others through the mass matrix, and their servos give way. Servos that are
critically damped at w, each for the inertia of its own joint, let the surface overshoot by (sum l_i M_ij d_j / M_ii) a
/ w^2 where the leading joint brakes with a. One mass on its servo overshoots by (l d) a / w^2; the rest is the lag.

*Bend.* The lever changes on the way: h = l d t + (d h'' d) t^2 / 2, with the angle t of the leading joint. The sheet
is taken as its tangent plane, from which a round one only recedes.

Where the joints move to is not known beforehand. So both are the worst of all directions d.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.robot.arm.inertia import ArmInertia, arm_inertia, mass_matrix
from coneskin.robot.arm.kinematics import link_poses
from coneskin.robot.arm.model import ArmModel

from .arm_patches import ArmPatch

#: m; radius of what is struck. The flatter it is, the sooner a link that tilts has pressed it
BODY_RADIUS = 0.1
_MAX_EXTRA_WAY = 2.0  # rad of the leading joint; the mean lever of any way is at most that of this one
#: ways are rounded up to these, so that patches share their curves; larger ones are left
_LAG_GRID = (0.0, 0.2, 0.8, 1.6, 3.2, 6.4, 12.8)
_BEND_GRID = (0.0, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8, 25.6)
_NO_EXTRA_WAY = 1e-9


@dataclass(frozen=True, slots=True)
class ExtraWay:
    """Extra way of a patch.

    Attributes:
        lag: overshoot by the other joints over the deceleration of the leading one, in units of 1 / w^2 [m/rad].
        bend: growth of the lever over the angle of the leading joint [m/rad^2].
    """

    lag: float = 0.0
    bend: float = 0.0

    def rounded_up(self) -> ExtraWay:
        """Return the way with both rounded up to one of few values."""
        return ExtraWay(_rounded_up(self.lag, _LAG_GRID), _rounded_up(self.bend, _BEND_GRID))

    def up_to(self, most: ExtraWay) -> ExtraWay:
        """Return the way, with neither lag nor bend above those of another."""
        return ExtraWay(min(self.lag, most.lag), min(self.bend, most.bend))

    def delay(self, speed: float, lever: float, deceleration: float, turn: float) -> float:
        """Return how much later an arm without lag would have to brake to go as far [s].

        A short braking ends before the servos have given way: a blow to a critically damped one moves it by 1 / (e w)
        of the speed that it changes.

        Args:
            speed: of the patch [m/s].
            lever: of the patch [m/rad].
            deceleration: of the leading joint [rad/s^2].
            turn: frequency w of the servos [rad/s].
        """
        if speed <= 0.0:
            return 0.0
        return self.lag * min(deceleration / (turn * turn * speed), 1.0 / (math.e * turn * lever))

    def stretch(self, angle: float, lever: float) -> float:
        """Return the mean lever while the leading joint turns by an angle [rad], over the lever at the beginning.

        A straight way with the mean lever ends where the bent one ends, and is ahead of it until then.
        """
        return 1.0 + 0.5 * self.bend * min(angle, _MAX_EXTRA_WAY) / lever


def extra_ways(
    arm: ArmModel,
    patches: Sequence[ArmPatch],
    positions: Sequence[Sequence[float]],
    inertias: Sequence[ArmInertia] = (),
) -> list[ExtraWay]:
    """Return the largest lag and bend of each patch in some joint positions [rad], with any of some inertias."""
    lags, bends = np.zeros(len(patches)), np.zeros(len(patches))
    links = sorted({patch.link for patch in patches})
    for q in positions:
        weights = [np.array(mass_matrix(arm, inertia, q)) for inertia in inertias or (arm_inertia(arm),)]
        for link in links:
            own = [number for number, patch in enumerate(patches) if patch.link == link]
            levers, changes = _levers_and_changes(arm, q, link, [patches[number] for number in own])
            lags[own] = np.max([lags[own], *(_worst_lag(levers, masses) for masses in weights)], axis=0)
            bends[own] = np.maximum(bends[own], _worst_bend(changes))
    return [ExtraWay(float(lag), float(bend)) for lag, bend in zip(lags, bends, strict=True)]


def _worst_lag(levers: Floats, masses: Floats) -> Floats:
    """Return the lag of patches in the worst direction [m/rad], shape (patches,)."""
    beyond: Floats = levers @ (masses / np.diag(masses)[:, None]) - levers
    worst: Floats = np.abs(beyond).sum(axis=1)
    return worst


def _worst_bend(changes: Floats) -> Floats:
    """Return a bound of the bend of patches in any direction [m/rad^2], shape (patches,).

    Without what is below 0 on its diagonal, a form is convex in each joint, so that a corner has the most. The changes
    are symmetric, shape (patches, joints, joints) [m/rad^2].
    """
    count = changes.shape[-1]
    diagonal = np.eye(count, dtype=bool)
    form = np.where(diagonal, np.maximum(changes, 0.0), changes)
    corners = np.array([(1.0, *signs) for signs in product((-1.0, 1.0), repeat=count - 1)])
    worst: Floats = np.einsum("ci,pij,cj->pc", corners, form, corners).max(axis=1)
    return worst


def _levers_and_changes(
    arm: ArmModel, q: Sequence[float], link: int, patches: Sequence[ArmPatch]
) -> tuple[Floats, Floats]:
    """Return the levers of patches of one link, and how they change with the joints on a ball that the patch touches.

    Returns:
        Levers [m/rad], shape (patches, joints), and changes [m/rad^2], shape (patches, joints, joints), symmetric.
    """
    poses = link_poses(arm, q)[: link + 1]
    points = np.array([poses[link].apply(patch.point) for patch in patches])
    normals = np.array([poses[link].rotate(patch.normal) for patch in patches])
    axes = np.array([pose.rotate((0.0, 0.0, 1.0)) for pose in poses[:link]])  # of the joints that move it
    crosses = np.cross(np.eye(3), axes[:, None]).swapaxes(1, 2)  # crosses[j] @ v = axes[j] x v
    arms = points[:, None] - np.array([pose.translation for pose in poses[:link]])
    moved = np.einsum("jab,pjb->pja", crosses, arms)
    tilted = np.einsum("jab,pb->pja", crosses, normals)
    # d^2 / dq_i dq_j of n (p - centre of the ball), with joint i not farther out than j
    second = np.einsum("pa,iab,pjb->pij", normals, crosses, moved - BODY_RADIUS * tilted)
    mixed = tilted @ moved.swapaxes(1, 2)
    second += mixed + mixed.swapaxes(1, 2)
    levers, changes = np.zeros((len(patches), arm.joints)), np.zeros((len(patches), arm.joints, arm.joints))
    levers[:, :link] = np.einsum("pa,pja->pj", normals, moved)
    changes[:, :link, :link] = np.triu(second) + np.triu(second, 1).swapaxes(1, 2)
    return levers, changes


def _rounded_up(value: float, steps: Sequence[float]) -> float:
    return min((step for step in steps if value <= step + _NO_EXTRA_WAY), default=value)
