"""What of an arm carries no skin, for physics in which bodies meet it too."""

from __future__ import annotations

import math

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.impact.simulation.mujoco_plant import sheets_of
from coneskin.impact.simulation.scene_description import SheetOnLink
from coneskin.robot.arm.models import arm_model
from coneskin.robot.arm.vectors import cross, dot, minus, scaled
from coneskin.robot.arm.workspace import arm_parts
from coneskin.scene.values.scene import Scene

_INSIDE = 0.008  # m by which a bare tube is thinner than the skin around it


def bare_parts_of(scene: Scene) -> list[SheetOnLink]:
    """Return what of a scene's arm carries no skin, as round bars; along a tube with a skin one that is thinner."""
    assert scene.arm is not None
    model = arm_model(scene.arm.model)
    thick = {sheet.link: min(sheet.cone.frustum.radius1, sheet.cone.frustum.radius2) for sheet in sheets_of(scene)}
    found = []
    for name, link, begin, end in arm_parts(model):
        step = minus(end, begin)
        length = math.sqrt(dot(step, step))
        radius = min(0.5 * model.d[4], thick.get(link, math.inf) - _INSIDE)
        axis = scaled(step, 1.0 / length)
        side = cross(axis, min(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), key=lambda e: abs(dot(e, axis))))
        side = scaled(side, 1.0 / math.sqrt(dot(side, side)))
        columns = (side, cross(axis, side), axis)
        turned = tuple(tuple(column[i] for column in columns) for i in range(3))
        pose = Pose(turned, begin)  # type: ignore[arg-type]
        found.append(SheetOnLink(name, link, PlacedFrustum(Frustum(radius, radius, length), pose)))
    return found
