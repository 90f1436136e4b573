"""Spaces that links sweep while the joints beside them turn, of which sheets, tabs and cables keep clear."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.geometry.fit.surface_samples import sample_surface
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster
from coneskin.geometry.urdf import UrdfJoint, joint_frame, joints_inwards, link_poses

from .link_design import LinkDesign
from .sheets.cable_way import SphereBody
from .sheets.sheet_design import SheetDesign

_SWEEP_SAMPLES = 20_000  # of a link that moves beside another
_SAMPLE_RADIUS = 1.5e-3  # m; of the space about each of them
_SWEEP_CELL = 1.5e-3  # m; along, away from and around the axis
_SWEEP_REACH = 0.02  # m; beyond a link, where tie and connector look for what comes near


def _swept(axis: Pose, points: Floats, lower: float, upper: float, beside: Floats) -> SphereBody:
    """Return the space that a link takes while a joint turns over its range, as far as it comes near another link.

    Args:
        axis: pose of the joint, whose axis is z.
        points: of the link in that frame [m], shape (n, 3).
        lower: least angle by which they are turned [rad].
        upper: largest angle [rad].
        beside: places of the other link in that frame [m], shape (n, 3).
    """
    low, high = beside.min(axis=0) - _SWEEP_REACH, beside.max(axis=0) + _SWEEP_REACH
    away, azimuth = np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], points[:, 0])
    ring = np.round(away / _SWEEP_CELL).astype(int)
    far = np.hypot(*np.maximum(-low, high)[:2])
    ring[(points[:, 2] < low[2]) | (points[:, 2] > high[2]) | (away > far)] = -1
    found = [np.empty((0, 3))]
    for number in np.unique(ring[ring >= 0]):
        height, row = np.unique(np.round(points[ring == number, 2] / _SWEEP_CELL), return_inverse=True)
        count = max(1, math.ceil(math.tau * number))
        step = math.tau / count
        begins = np.zeros((len(height), count), bool)
        begins[row, np.round((azimuth[ring == number] + lower) / step).astype(int) % count] = True
        ahead = min(count - 1, math.ceil((upper - lower) / step))  # turns that are taken after each that begins
        sums = np.cumsum(np.pad(np.hstack([begins[:, count - ahead :], begins]), ((0, 0), (1, 0))), axis=1)
        at, turn = np.nonzero(sums[:, ahead + 1 :] > sums[:, :count])
        swept = _SWEEP_CELL * np.stack([number * np.cos(step * turn), number * np.sin(step * turn), height[at]], axis=1)
        found.append(swept[((swept > low) & (swept < high)).all(axis=1)])
    return SphereBody(axis.apply_all(np.concatenate(found)), _SAMPLE_RADIUS)


def _swept_beside(
    link: str, joints: Sequence[UrdfJoint], meshes: Mapping[str, Mesh], skins: Mapping[str, LinkDesign]
) -> dict[str, SphereBody]:
    """Return the spaces of the links next to one, and of the sheets that they have already, by their names.

    Links are next to each other where one joint moves between them, whatever frames without a mesh there are besides.
    """
    spaces = {}
    poses = link_poses(joints, [0.0] * len(joints))
    for outer in meshes:
        inner, between = joints_inwards(outer, joints, meshes)
        moving = [joint for joint in between if joint.upper > joint.lower]
        if not inner or link not in (inner, outer) or len(moving) > 1:
            continue
        joint = (moving or between)[0]
        other, turns = (outer, (joint.lower, joint.upper)) if link == inner else (inner, (-joint.upper, -joint.lower))
        points = sample_surface(meshes[other], RayCaster(meshes[other]), _SWEEP_SAMPLES).points
        if other in skins:
            points = np.concatenate([points, *(_outside(sheet) for sheet in skins[other].sheets)])
        frame = joint_frame(joint, poses)
        axis, moved = poses[link].inverse() @ frame, (frame.inverse() @ poses[other]).apply_all(points)
        spaces[other] = _swept(axis, moved, *turns, axis.inverse().apply_all(meshes[link].vertices))
    return spaces


def _outside(sheet: SheetDesign) -> Floats:
    """Return places of the outer face of a sheet, as near to each other as those of a link [m], shape (n, 3)."""
    side = sheet.place.frustum
    around = side.wrap * max(side.radius1, side.radius2)
    u = np.linspace(0.0, side.slant, math.ceil(side.slant / (2.0 * _SAMPLE_RADIUS)) + 1)
    phi = np.linspace(0.0, side.wrap, math.ceil(around / (2.0 * _SAMPLE_RADIUS)) + 1)
    return sheet.outer_face(*np.meshgrid(u, phi, indexing="ij"))[0].reshape(-1, 3)
