"""Plant of a scene: its arm among its bodies, behind the protocol of the simulated controller, cycle by cycle.

For real time, `_LiveMujocoPlant` looks every millisecond where skins and bodies meet, not at each integration step.
Between two looks place and normal of a contact stay, and its indentation grows with the speeds. That takes a third of
the time of `MujocoPlant` and has its forces within a few per cent (tests/impact/simulation).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.errors import SceneError
from coneskin.robot.arm.ur_models import arm_model
from coneskin.robot.sim.motion.arm import CYCLE
from coneskin.robot.sim.motion.plant import PlantLost, PlantState
from coneskin.scene.build import place_on_arm
from coneskin.scene.values.scene import Scene
from coneskin.skin.materials import Padding
from coneskin.skin.virtual.skin import Press

from .mujoco_plant import MujocoPlant, Touch
from .scene_description import SheetOnLink

__all__ = ["ScenePlant", "currents_of", "presses_of", "sheets_of"]

_CONTACT_PERIOD = 5  # steps of the integration from one look to the next
_CONTACT_RANGE = 0.002  # m between two surfaces that may meet before the next look; as far as MuJoCo reports it


class _LiveMujocoPlant(MujocoPlant):
    """Plant of one arm and its surroundings in real time; arguments and attributes as of `MujocoPlant`.

    ``lost`` stays 0: energy is not accounted for.
    """

    def update(self, q: Sequence[float], qd: Sequence[float], duration: float) -> None:
        """Let time pass while the controller's targets move evenly; see `MujocoPlant.update`."""
        m, d, step, padding = self._m, self._d, self._step, self._padding
        step1, step2 = self._mj.mj_step1, self._mj.mj_step2
        no_contacts = int(self._mj.mjtDisableBit.mjDSBL_CONTACT)
        speed = np.asarray(qd, float)
        moved, target = step * speed, np.asarray(q, float) + self._lead * speed
        arm, control, applied, velocity = len(speed), d.ctrl, d.qfrc_applied, d.qvel
        near: list[tuple[Touch, Floats]] = []
        for number in range(round(duration / step)):
            look = number % _CONTACT_PERIOD == 0
            m.opt.disableflags = 0 if look else no_contacts
            step1(m, d)
            if look:
                near = [(touch, self._row(touch)) for touch in self._find(_CONTACT_RANGE)]
                depths = [touch.depth for touch, _ in near]
            control[:arm] = target
            applied[:] = 0.0
            felt: dict[int, Touch] = {}
            for at, (touch, row) in enumerate(near):
                rate = float(row @ velocity)
                depth = depths[at]
                depths[at] = depth + rate * step
                if depth <= 0.0:
                    continue
                force = padding.force(depth, rate)
                applied -= force * row
                self.impulse += force * step
                self.deepest, self.peak = max(self.deepest, depth), max(self.peak, force)
                self._touched.setdefault(self._body_numbers[touch.part], self.time)
                if touch.part not in felt or felt[touch.part].force < force:
                    felt[touch.part] = touch._replace(force=force)
            self._let_people_act(felt)
            step2(m, d)
            target += moved
            self.time += step
        m.opt.disableflags = 0
        self._look()

    def _row(self, touch: Touch) -> Floats:
        """Return what gives the rate of an indentation from all speeds, and the forces on all of them from its own."""
        row: Floats = np.zeros(self._m.nv)
        row[: touch.jacobian.shape[1]] = touch.normal @ touch.jacobian
        if (at := self._address[touch.part]) is not None:
            row[at : at + 3] = -touch.normal
        return row


_TORQUE_PER_AMPERE = (12.0, 12.0, 12.0, 9.0, 9.0, 9.0)  # N m/A of a joint, as the guard assumes


def sheets_of(scene: Scene) -> list[SheetOnLink]:
    """Return the skins of a scene on its arm."""
    return [SheetOnLink(item.name, item.link, item.frustum) for item in place_on_arm(scene)]


def currents_of(plant: MujocoPlant) -> list[float]:
    """Return the current that each motor takes against the contacts [A]."""
    return [-torque / each for torque, each in zip(plant.external, _TORQUE_PER_AMPERE, strict=True)]


def presses_of(plant: MujocoPlant, skins: Sequence[SheetOnLink]) -> dict[tuple[int, int], Press]:
    """Return what the skins feel now, by skin and part of a body: contacts within their active area."""
    found = {}
    for contact in plant.contacts:
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
        engine: what simulates it; `MujocoPlant` is more exact, and takes three times as long.

    Attributes:
        physics: what MuJoCo simulates.

    Raises:
        MissingExtra: MuJoCo is not installed.
        SceneError: the scene has no arm.
    """

    def __init__(self, scene: Scene, q: Sequence[float], engine: type[MujocoPlant] = _LiveMujocoPlant) -> None:
        if scene.arm is None:
            raise SceneError(["a scene whose bodies are to be met needs an [arm]"], scene.name)
        self._skins = sheets_of(scene)
        self.physics = engine(
            arm_model(scene.arm.model), self._skins, scene.bodies, scene.padding or Padding(), list(q)
        )

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
