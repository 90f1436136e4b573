"""Plant of a scene: its arm among its bodies, behind the protocol of the simulated controller, cycle by cycle."""

from __future__ import annotations

from collections.abc import Sequence

from coneskin.core.errors import SceneError
from coneskin.robot.arm.models import arm_model
from coneskin.robot.sim.motion.arm import CYCLE
from coneskin.robot.sim.motion.plant import PlantLost, PlantState
from coneskin.scene.build import place_on_arm
from coneskin.scene.values.scene import Scene
from coneskin.skin.materials import Padding

from .mujoco_plant import MujocoPlant
from .scene_description import SheetOnLink

_CONTACT_PERIOD = 5  # steps of the integration from one look at the contacts to the next, in real time


def sheets_of(scene: Scene) -> list[SheetOnLink]:
    """Return the skins of a scene on its arm."""
    return [SheetOnLink(item.name, item.link, item.frustum) for item in place_on_arm(scene)]


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
        model, padding = arm_model(scene.arm.model), scene.padding or Padding()
        self.physics = MujocoPlant(model, sheets_of(scene), scene.bodies, padding, q, period=period)

    def update(self, q: Sequence[float], qd: Sequence[float]) -> PlantState:
        """Let one control cycle pass; see the protocol."""
        start = [at - CYCLE * speed for at, speed in zip(q, qd, strict=True)]
        self.physics.update(start, qd, CYCLE)
        if self.physics.diverged:
            raise PlantLost("the physics engine has diverged: the bodies are too light for their stiffness, perhaps")
        return PlantState(self.physics.q, self.physics.qd, self.physics.currents)

    def close(self) -> None:
        """Do nothing: it has no process and no connection."""
