"""Plant of a scene: its arm among its bodies, behind the protocol of the simulated controller, cycle by cycle."""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.core.errors import SceneError
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.models import arm_model
from coneskin.robot.arm.vectors import cross, dot, minus, scaled
from coneskin.robot.arm.workspace import arm_parts
from coneskin.robot.guard.signals.joint_current import TORQUE_PER_AMPERE
from coneskin.robot.sim.motion.arm import CYCLE
from coneskin.robot.sim.motion.plant import PlantLost, PlantState
from coneskin.scene.build import place_on_arm
from coneskin.scene.values.scene import Scene
from coneskin.skin.materials import Padding
from coneskin.skin.virtual.skin import Press

from .mujoco_plant import MujocoPlant
from .scene_description import SheetOnLink

__all__ = ["ScenePlant", "bare_parts_of", "currents_of", "presses_of", "sheets_of"]

_INSIDE = 0.008  # m by which a bare tube is thinner than the skin around it
_CONTACT_PERIOD = 5  # steps of the integration from one look at the contacts to the next, in real time


def sheets_of(scene: Scene) -> list[SheetOnLink]:
    """Return the skins of a scene on its arm."""
    return [SheetOnLink(item.name, item.link, item.frustum) for item in place_on_arm(scene)]


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


def currents_of(plant: MujocoPlant) -> list[float]:
    """Return the current that each motor takes against the contacts [A]."""
    return [-torque / each for torque, each in zip(plant.external, TORQUE_PER_AMPERE, strict=True)]


def presses_of(plant: MujocoPlant, skins: Sequence[SheetOnLink]) -> dict[tuple[int, int], Press]:
    """Return what the skins feel now, by skin and part of a body: contacts within their active area."""
    found = {}
    for contact in plant.contacts:
        if contact.sheet >= len(skins):
            continue  # a bare part
        skin = skins[contact.sheet]
        cone = skin.cone.frustum
        if 0.0 <= contact.u <= cone.slant and 0.0 <= contact.phi <= cone.wrap:
            found[contact.sheet, contact.part] = Press(skin.name, contact.u, contact.phi, contact.force)
    return found


class ScenePlant:
    """Plant of a scene; methods as of ``coneskin.robot.sim.motion.plant.Plant``.

    In lock-step it is deterministic: the same targets give the same measurements, bit by bit.

    Args:
        scene: with an arm, skins and bodies.
        q: joint positions at the start [rad].
        period: as of `MujocoPlant`; 1 is more exact, and takes three times as long.

    Attributes:
        physics: what MuJoCo simulates.

    Raises:
        MissingExtra: MuJoCo is not installed.
        SceneError: the scene has no arm.
    """

    def __init__(self, scene: Scene, q: Sequence[float], period: int = _CONTACT_PERIOD) -> None:
        if scene.arm is None:
            raise SceneError(["a scene whose bodies are to be met needs an [arm]"], scene.name)
        self._skins = sheets_of(scene)
        padding = scene.padding or Padding()
        model = arm_model(scene.arm.model)
        self.physics = MujocoPlant(model, self._skins, scene.bodies, padding, list(q), period=period)

    def update(self, q: Sequence[float], qd: Sequence[float]) -> PlantState:
        """Let one control cycle pass; see the protocol."""
        start = [at - CYCLE * speed for at, speed in zip(q, qd, strict=True)]
        self.physics.update(start, qd, CYCLE)
        if self.physics.diverged:
            raise PlantLost("the physics engine has diverged: the bodies are too light for their stiffness, perhaps")
        return PlantState(self.physics.q, self.physics.qd, currents_of(self.physics))

    def close(self) -> None:
        """Do nothing: it has no process and no connection."""

    def presses(self) -> dict[tuple[int, int], Press]:
        """Return what the skins feel now; see `presses_of`."""
        return presses_of(self.physics, self._skins)
