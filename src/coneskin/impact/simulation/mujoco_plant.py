"""Plant: an arm with skins among bodies, simulated by MuJoCo, driven by the targets of a controller.

MuJoCo has the dynamics (inertias, servos, springs, Coriolis forces) and finds the contacts; the force of a contact is
the padding's. It acts on the skin and on the body, equal and opposite, along the normal at the deepest point. Springs
hold the bodies; a person moves their rest, to push back or to grip.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.errors import SceneError, needed_package
from coneskin.geometry.pose import Vector
from coneskin.robot.arm.inertia import arm_inertia
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import UR_CURRENTS, arm_model
from coneskin.robot.sim.motion.arm import CYCLE
from coneskin.robot.sim.motion.plant import PlantLost, PlantState
from coneskin.scene.build import place_on_arm
from coneskin.scene.values.scene import BodyScene, Scene
from coneskin.skin.materials import Padding
from coneskin.skin.virtual.skin import Press

from .scene_description import SheetOnLink, body_link, describe_scene

_FORCE_BAND = 100.0  # N from the force wanted, at which a person moves at full speed; faster, hands would hammer


@dataclass
class _HeldPart:
    """Part of a body on a spring, and where that spring rests."""

    body: BodyScene  #: of the scene
    part: int = 0  #: 1 for the second hand of a grip
    rest: Vector = (0.0, 0.0, 0.0)  #: how far the spring's rest has been moved [m]
    _towards: Vector = field(default=(0.0, 0.0, 0.0))

    @property
    def acts(self) -> bool:
        """True where a person moves the rest."""
        return self.body.kind in ("person", "grip")

    def update(self, since: float, felt: Sequence[tuple[float, Floats]], step: float) -> bool:
        """Let a person move the rest; return whether it has moved.

        What a hand feels at its back while it gives way, caught between two links, it does not press with: its force
        counts as one that helps.

        Args:
            since: the body was first touched [s]; negative before.
            felt: what touches this part now: force [N], and unit normal from the arm to the part.
            step: time [s].
        """
        body = self.body
        if felt and body.kind == "person":
            x, y, z = max(felt, key=lambda touch: touch[0])[1].tolist()
            self._towards = (-x, -y, -z)
        elif body.kind == "grip" and self._towards == (0.0, 0.0, 0.0):
            x, y, z = body.axis
            self._towards = (-x, -y, -z) if self.part else (x, y, z)
        if not self.acts or since < body.delay:
            return False
        force = sum(math.copysign(each, -(normal @ self._towards)) for each, normal in felt)
        share = max(-1.0, min(1.0, (body.force - force) / _FORCE_BAND))
        way = share * body.speed * step
        x, y, z = (r + way * t for r, t in zip(self.rest, self._towards, strict=True))
        self.rest = (x, y, z)
        return True


_BARE_LINK = Padding(1e-3, 2e5, 1e6)  # lacquer on metal, and the skin of what touches it; assumed
STEP = 2e-4  #: s of the integration; the stiffest contact, 1e6 N/m against 0.3 kg, swings with 1800 rad/s
_CONTACT_RANGE = 0.002  # m between surfaces that may meet before the next look; as far as MuJoCo reports it
_ARM_DOF = 6  # degrees of freedom of the arm, the first ones


class _BodyContact(NamedTuple):
    """Contact of a skin with a part of a body, at one instant."""

    sheet: int  #: number of the skin
    part: int  #: number of the part, over all bodies
    depth: float  #: indentation of the padding [m]
    rate: float  #: its growth [m/s]
    force: float  #: [N]
    normal: Floats  #: outward unit normal of the skin, in the base frame
    point: Floats  #: in the base frame [m]
    jacobian: Floats  #: of the point, for the arm's joints, 3 x 6
    bare: bool  #: no skin is there


class MujocoPlant:
    """Plant of one arm and its surroundings.

    Args:
        sheets: its skins.
        bodies: around it.
        bare: parts of the arm without a skin, which are as hard as a strip that a sheet leaves bare.
        q: joint positions at the beginning [rad].
        qd: joint speeds then [rad/s].
        step: of the integration [s].
        period: steps from one look where skins and bodies meet to the next. Between two looks place and normal of a
            contact stay, and its indentation grows with the speeds. 5 takes a third of the time, and has the forces of
            1 within a few per cent (tests/impact/simulation).

    Attributes:
        time: since the beginning [s].
        contacts: at the end of the last step.
        impulse: that all contacts together have given, over time [N s].
        deepest: greatest indentation so far [m].
        peak: greatest force of one skin on one body so far [N].

    Raises:
        MissingExtra: MuJoCo is not installed.
    """

    def __init__(
        self,
        model: ArmModel,
        sheets: Sequence[SheetOnLink],
        bodies: Sequence[BodyScene],
        padding: Padding,
        q: Sequence[float],
        qd: Sequence[float] = (0.0,) * _ARM_DOF,
        step: float = STEP,
        period: int = 1,
        bare: Sequence[SheetOnLink] = (),
    ) -> None:
        with needed_package("mujoco", "physics in the loop", "physics"):
            import mujoco
        self._mj: Any = mujoco
        mujoco.set_mju_user_warning(lambda _: None)  # it would write a file into the current folder: see `diverged`
        inertia = arm_inertia(model)
        self._skins, sheets = len(sheets), (*sheets, *bare)
        self._m: Any = mujoco.MjModel.from_xml_string(describe_scene(model, inertia, q, sheets, bodies, step))
        self._d: Any = mujoco.MjData(self._m)
        self._padding = padding
        self._sheets = sheets
        self._back = [body_link(model, sheet.link).inverse() for sheet in sheets]
        self._links = [self._m.body(f"link{sheet.link}").id for sheet in sheets]
        self._sheet_of = {self._m.geom(f"sheet{n}").id: n for n in range(len(sheets))}
        self.parts: list[_HeldPart] = []
        self._part_of: dict[int, int] = {}
        self._address: list[int | None] = []  # of a part's first coordinate; None where it does not move
        for number, body in enumerate(bodies):
            for part, _ in enumerate(body.parts):
                name = f"body{number}.{part}"
                self._part_of[self._m.geom(name).id] = len(self.parts)
                self._address.append(int(self._m.joint(f"{name}.x").dofadr[0]) if body.gives_way else None)
                self.parts.append(_HeldPart(body, part))
        self._lead = self._m.actuator_biasprm[:, 2] / self._m.actuator_biasprm[:, 1]  # kv / kp [s]
        self._step, self._period = step, period
        self._d.qpos[:_ARM_DOF], self._d.qvel[:_ARM_DOF] = q, qd
        self._starts = [place for body in bodies for place in body.parts]
        self._moving = [(number, at) for number, at in enumerate(self._address) if at is not None]
        self._touched: dict[int, float] = {}  # body -> when it was first touched
        self._body_numbers = [n for n, body in enumerate(bodies) for _ in body.parts]
        self.time = 0.0
        self.contacts: tuple[_BodyContact, ...] = ()
        self.impulse = self.deepest = self.peak = 0.0
        mujoco.mj_forward(self._m, self._d)

    # state

    @property
    def q(self) -> tuple[float, ...]:
        """Joint positions [rad]."""
        return tuple(self._d.qpos[:_ARM_DOF].tolist())

    @property
    def qd(self) -> tuple[float, ...]:
        """Joint speeds [rad/s]."""
        return tuple(self._d.qvel[:_ARM_DOF].tolist())

    @property
    def external(self) -> tuple[float, ...]:
        """Torque that the contacts put on the joints [N m]."""
        return tuple(self._d.qfrc_applied[:_ARM_DOF].tolist())

    @property
    def currents(self) -> list[float]:
        """Current that each motor takes against the contacts [A]."""
        return [-torque / each for torque, each in zip(self.external, UR_CURRENTS.torque_per_ampere, strict=True)]

    @property
    def force(self) -> float:
        """Sum of the forces of all contacts now [N]."""
        return sum(contact.force for contact in self.contacts)

    @property
    def presses(self) -> dict[tuple[int, int], Press]:
        """What the skins feel now, by skin and part of a body: contacts within their active area."""
        found = {}
        for contact in self.contacts:
            skin = self._sheets[contact.sheet]
            cone = skin.cone.frustum
            u, phi = self._locate(contact.sheet, contact.point)
            if not contact.bare and 0.0 <= u <= cone.slant and 0.0 <= phi <= cone.wrap:
                found[contact.sheet, contact.part] = Press(skin.name, u, phi, contact.force)
        return found

    @property
    def diverged(self) -> bool:
        """True once the integration has met what is not a number; MuJoCo then starts anew without a word."""
        kinds = self._mj.mjtWarning
        bad = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
        return any(self._d.warning[int(kind)].number for kind in bad)

    @property
    def places(self) -> list[Vector]:
        """Places of the bodies' parts now, in the base frame [m]."""
        found: list[Vector] = []
        for start, at in zip(self._starts, self._address, strict=True):
            moved = (0.0, 0.0, 0.0) if at is None else self._d.qpos[at : at + 3].tolist()
            found.append((start[0] + moved[0], start[1] + moved[1], start[2] + moved[2]))
        return found

    # time

    def update(self, q: Sequence[float], qd: Sequence[float], duration: float) -> None:
        """Let time pass while the controller's targets move evenly.

        Args:
            q: targets of the joints at the beginning [rad].
            qd: their speeds [rad/s].
            duration: a multiple of the step [s].
        """
        m, d, step = self._m, self._d, self._step
        step1, step2 = self._mj.mj_step1, self._mj.mj_step2
        no_contacts = int(self._mj.mjtDisableBit.mjDSBL_CONTACT)
        speed = np.asarray(qd, float)
        moved = step * speed
        target = np.asarray(q, float) + self._lead * speed  # a servo that damps its speed would follow behind by this
        near: list[tuple[_BodyContact, Floats]] = []
        for number in range(round(duration / step)):
            look = number % self._period == 0
            m.opt.disableflags = 0 if look else no_contacts
            step1(m, d)
            if look:
                near = [(touch, self._row(touch)) for touch in self._find(0.0 if self._period == 1 else _CONTACT_RANGE)]
                depths = [touch.depth for touch, _ in near]
            d.ctrl[:_ARM_DOF] = target
            self._press(near, depths)
            step2(m, d)
            target += moved
            self.time += step
        m.opt.disableflags = 0
        self._mj.mj_fwdPosition(m, d)
        self.contacts = tuple(self._find())

    def _row(self, touch: _BodyContact) -> Floats:
        """Return what gives the rate of an indentation from all speeds, and the forces on all of them from its own."""
        row: Floats = np.zeros(self._m.nv)
        row[:_ARM_DOF] = touch.normal @ touch.jacobian
        if (at := self._address[touch.part]) is not None:
            row[at : at + 3] = -touch.normal
        return row

    def _press(self, near: Sequence[tuple[_BodyContact, Floats]], depths: list[float]) -> None:
        """Put the forces of contacts on skins and bodies, and let people act; the depths grow with the speeds."""
        d, step = self._d, self._step
        applied, velocity = d.qfrc_applied, d.qvel
        applied[:] = 0.0
        felt: dict[int, list[tuple[float, Floats]]] = {}
        for number, (touch, row) in enumerate(near):
            rate, depth = float(row @ velocity), depths[number]
            depths[number] += rate * step
            if depth <= 0.0:
                continue
            force = self._law(touch).force(depth, rate)
            applied -= force * row
            self.impulse += force * step
            self.deepest, self.peak = max(self.deepest, depth), max(self.peak, force)
            self._touched.setdefault(self._body_numbers[touch.part], self.time)
            felt.setdefault(touch.part, []).append((force, touch.normal))
        for number, at in self._moving:
            part, since = self.parts[number], self.time - self._touched.get(self._body_numbers[number], math.inf)
            if part.update(since, felt.get(number, ()), self._step):
                self._m.qpos_spring[at : at + 3] = part.rest

    def _find(self, near: float = 0.0) -> list[_BodyContact]:
        """Return what touches, or is nearer than that [m]: one contact for each skin and part, amid MuJoCo's points.

        A second one is that of a part beside the end of a sheet with the strip beyond it (``_edge``).
        """
        d = self._d
        if not d.ncon:
            return []
        contact = d.contact
        distances = contact.dist.tolist()
        if min(distances) >= near:
            return []
        points: dict[tuple[int, int], list[tuple[float, int, float]]] = {}
        for index, ((first, second), distance) in enumerate(zip(contact.geom.tolist(), distances, strict=True)):
            if distance < near:
                swapped = first not in self._sheet_of
                pair = (second, first) if swapped else (first, second)
                key = self._sheet_of[pair[0]], self._part_of[pair[1]]
                points.setdefault(key, []).append((-distance, index, -1.0 if swapped else 1.0))
        frames, places = contact.frame, contact.pos
        touches = [self._touch(*key, found, frames, places) for key, found in points.items()]
        edges = [edge for touch in touches if (edge := self._edge(touch)) is not None and edge.depth > -near]
        return touches + edges

    def _touch(
        self,
        sheet: int,
        part: int,
        found: list[tuple[float, int, float]],
        frames: Floats,
        places: Floats,
    ) -> _BodyContact:
        depth, index, sign = max(found)
        normal, point = sign * frames[index, :3], np.array(places[index])
        found = [item for item in found if item[0] > 0.0]
        if len(found) > 1:
            whole = math.fsum(item[0] for item in found)
            point = sum((item[0] / whole * places[item[1]] for item in found), np.zeros(3))
        return self._made(sheet, part, depth, normal, point, self._is_bare(sheet, point))

    def _edge(self, touch: _BodyContact) -> _BodyContact | None:
        """Return the contact of what presses a skin with the end of the lacquer beside it. None where there is none.

        Skin and strip have one height. What is deep in the pad reaches beyond the end of the sheet, as deep as the
        curvature of the body leaves. Else its force would jump as the deepest point slides over the end, by hundreds of
        newtons at a millimetre, with energy from nowhere.
        """
        cone, body = self._sheets[touch.sheet].cone, self.parts[touch.part].body
        if touch.bare or cone.frustum.wrap == math.tau:
            return None
        u, phi = self._locate(touch.sheet, touch.point)
        end = 0.0 if 2.0 * phi < cone.frustum.wrap else cone.frustum.wrap
        surface, point = self._place(touch.sheet, u, phi), self._place(touch.sheet, u, end)
        normal, depth = touch.normal, touch.depth - float(touch.normal @ (surface - point))
        if body.kind != "wall":
            way = surface - point + (body.radius - touch.depth) * normal  # from the end to the middle of the body
            if body.kind == "post":
                axis = np.asarray(body.axis)
                way = way - float(way @ axis) * axis
            size = float(np.linalg.norm(way))
            normal, depth = way / size, body.radius - size
        return self._made(touch.sheet, touch.part, depth, normal, point, True)

    def _made(self, sheet: int, part: int, depth: float, normal: Floats, point: Floats, bare: bool) -> _BodyContact:
        jacobian = np.empty((3, self._m.nv))
        self._mj.mj_jac(self._m, self._d, jacobian, None, point, self._links[sheet])
        jacobian = jacobian[:, :_ARM_DOF]
        speed = jacobian @ self._d.qvel[:_ARM_DOF]
        if (at := self._address[part]) is not None:
            speed -= self._d.qvel[at : at + 3]
        rate = float(speed @ normal)
        touch = _BodyContact(sheet, part, depth, rate, 0.0, normal, point, jacobian, bare)
        return touch._replace(force=self._law(touch).force(depth, rate))

    def _is_bare(self, sheet: int, point: Floats) -> bool:
        """Tell whether a point of the base frame [m] lies where there is no skin."""
        frustum = self._sheets[sheet].cone.frustum
        if sheet >= self._skins or frustum.wrap == math.tau:
            return sheet >= self._skins
        return self._locate(sheet, point)[1] > frustum.wrap

    def _law(self, touch: _BodyContact) -> Padding:
        return _BARE_LINK if touch.bare else self._padding

    def _locate(self, sheet: int, point: Floats) -> tuple[float, float]:
        """Return u [m] and phi [rad] of a point of the base frame."""
        link = self._links[sheet]
        axes = self._d.xmat[link].reshape(3, 3)
        x, y, z = (axes.T @ (point - self._d.xpos[link])).tolist()
        u, phi, _ = self._sheets[sheet].cone.locate(self._back[sheet].apply((x, y, z)))
        return u, phi % math.tau

    def _place(self, sheet: int, u: float, phi: float) -> Floats:
        """Return a point of a sheet's side in the base frame [m]; the inverse of ``_locate``."""
        link = self._links[sheet]
        inside = self._back[sheet].inverse().apply(self._sheets[sheet].cone.point(u, phi))
        place: Floats = self._d.xmat[link].reshape(3, 3) @ np.asarray(inside) + self._d.xpos[link]
        return place


_LIVE_PERIOD = 5  # steps of the integration from one look at the contacts to the next, in real time


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

    def __init__(self, scene: Scene, q: Sequence[float], period: int = _LIVE_PERIOD) -> None:
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
