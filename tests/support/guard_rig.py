"""Rig of a guard core on a virtual skin and a mock arm, in virtual time: a frame every 1 ms, a state every 2 ms."""

import math
from collections.abc import Iterator

from coneskin.core.errors import SkinConnectionError
from coneskin.core.recording.block import Block
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.kinematics import LINK_INDEX, dh_mesh, link_pose
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import UR_CURRENTS, arm_model
from coneskin.robot.driver.messages import Release
from coneskin.robot.driver.protocol import ArmDriver
from coneskin.robot.driver.values import EXTERNAL_PATHS, INTERNAL_PATHS, StopPath
from coneskin.robot.guard.arm_supervisor import ArmSupervisor
from coneskin.robot.guard.core import GuardCore
from coneskin.robot.guard.motion.setpoint_stream import ReactionPlanner
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.contact import Contact, GuardedSensor
from coneskin.robot.guard.signals.joint_current import _push_torque
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent
from coneskin.robot.guard.speed.speed_limit import SpeedLimit
from coneskin.robot.reaction.rules import Rule, RuleSet
from coneskin.robot.reaction.types import ContactOnLink, Reaction
from coneskin.robot.sim.mock_arm import SLIDER, CompanionProcesses, MockArm
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.ur.driver import UR_DRIVER
from coneskin.skin.detection.frame.reading import TouchReading
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.electronics import Electronics
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.imperfections import Foam, Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin

_PUSH = 300.0  # N
_LEAVES = 0.05  # rad/s at which the arm leaves what has touched it

MODEL = arm_model("UR5e")
START_Q = [math.radians(q) for q in (-20.0, -90.0, 90.0, -90.0, -90.0, 0.0)]
LINK = LINK_INDEX["forearm"]
CONE = PlacedFrustum(Frustum(0.0376, 0.0372, 0.26), dh_mesh(MODEL, "forearm") @ Pose(translation=(0.0, 0.0, 0.08)))


def touch(
    start: float, end: float = math.inf, u: float = 0.13, phi: float = 1.57, sensor: str = "one"
) -> ScriptedTouch:
    """Return a firm touch whose force rises within one frame."""
    return ScriptedTouch(start, end, u, phi, rise=0.0005, sensor=sensor)


class GuardRig:
    """Rig that runs a core; ``events``, ``outputs`` and ``blocks`` hold what came of it.

    What touches rests: it is off the skin once the arm moves away from it, unless it ``follows``. The joints feel what
    follows a complying arm, as a push that is firm enough for any speed.
    """

    def __init__(
        self,
        *touches: ScriptedTouch,
        reaction: Reaction | None = None,
        faults: FaultInjection | None = None,
        obeys: frozenset[StopPath] = frozenset(StopPath),
        sensors: int = 1,
        speed: float = 0.0,
        rules: tuple[Rule, ...] = (),
        external: bool = False,
        table: float | None = None,
        follows: bool = False,
        bits: int = 16,
        speed_limit: SpeedLimit | None = None,
        limits: MonitoringLimits | None = None,
    ) -> None:
        names = ("one", "two")[:sensors]
        fine = Electronics(adc_bits=bits)  # with 16 a place is certain in the second frame of its touch
        skins = [Sensor(CONE.frustum, number, fine, name=name) for number, name in enumerate(names)]
        # Foam without delay and ideal resistors: a touch begins and ends in the frames that the tests name.
        at_once = Imperfections(foam=Foam(delayed=0.0))
        self.skin = VirtualSkin(skins, touches, faults=faults, imperfections=at_once, model="ladder")
        self.core = make_core(
            skins,
            reaction or Reaction(kind="retreat"),
            rules,
            external,
            table,
            speed_limit=speed_limit,
            limits=limits,
        )
        self.arm = MockArm(list(START_Q), [0.0] * 6, obeys)
        self.speed = speed
        self.now = 100.0
        self.events: list[GuardEvent] = []
        self.outputs: list[object] = []
        self.blocks: list[Block] = []
        self.mute_skin = self.mute_arm = False
        self.companions = CompanionProcesses()
        self._follows = follows or (reaction is not None and reaction.kind == "comply")
        self._pushes = touches if reaction is not None and reaction.kind == "comply" else ()
        self._packets: Iterator[tuple[float, bytes]] = self.skin.packets()

    def feed(self, kind: BlockKind, payload: bytes = b"") -> list[object]:
        """Give the core one input now; its commands go to the arm."""
        return self._take(Block(kind, self.now, payload))

    def reset(self) -> list[object]:
        """Reset the newest stop that has latched the arm."""
        return self._take(self.companions.reset(self.now))

    def replug(self, skin: VirtualSkin) -> None:
        """Plug in a skin whose port is then open again; its own time begins now."""
        start = self.now - 100.0
        self.skin, self.mute_skin = skin, False
        self._packets = ((start + time, data) for time, data in skin.packets())
        self.feed(BlockKind.REOPENED, b"skin")

    def _take(self, block: Block) -> list[object]:
        self.blocks.append(block)
        out: list[object] = []
        self.core.feed(block, out)
        for output in out:
            self.companions.feed(output)
            if isinstance(output, GuardEvent):
                self.events.append(output)
            elif not isinstance(output, Release):
                self.arm.feed(output)
        self.outputs += out
        return out

    def _hear_companions(self) -> None:
        for block in list(self.companions.blocks(self.now)):
            self._take(block)

    def run(self, seconds: float) -> "GuardRig":
        """Let time pass."""
        for step in range(round(1000 * seconds)):
            self.now += 0.001
            self._hear_companions()
            if self.core.phase is Phase.RETREATING and not self._follows and self.arm.speed > _LEAVES:
                self.skin.release(self.now - 100.0)
            try:
                data = b"".join([next(self._packets)[1] for _ in self.skin.sensors])
            except SkinConnectionError as exc:
                data, self.mute_skin = b"", True
                self.feed(BlockKind.LOST, f"skin\n{exc}".encode())
                self._packets = iter(())
            except StopIteration:
                data = b""
            heard = not self.mute_skin and bool(data)
            if heard:
                self.feed(BlockKind.SKIN, data)
            if step % 2 == 0:
                if step % 20 == 0 and self.core.needs.slider:
                    self.feed(BlockKind.SLIDER, SLIDER.pack((self.arm.slider,)))
                if self.core.phase is Phase.ACTIVE and self.arm.target is None:
                    self.arm.go([self.speed, 0, 0, 0, 0, 0], 4.0)
                if self._pushes:
                    self.arm.current = self._held()
                payload = self.arm.poll()
                if not self.mute_arm:
                    self.feed(BlockKind.ARM, payload)
                    heard = True
            if not heard:  # as the live loop: any input is a look at the clocks as well
                self.feed(BlockKind.TICK)
        return self

    def _held(self) -> list[float]:
        """Return the currents that hold the arm against what pushes it [A]."""
        q, torque = tuple(self.arm.q), [0.0] * 6
        for item in self._pushes:
            if item.start <= self.now - 100.0 < item.end:
                place = ContactOnLink(LINK, CONE.point(item.u, item.phi), CONE.normal(item.phi))
                pushed = _push_torque(MODEL, q, place)  # type: ignore[arg-type]
                torque = [a + _PUSH * b for a, b in zip(torque, pushed, strict=True)]
        return [-a / b for a, b in zip(torque, UR_CURRENTS.torque_per_ampere, strict=True)]

    @property
    def names(self) -> list[str]:
        """Names of the events, in order."""
        return [event.name for event in self.events]

    def event(self, name: str) -> GuardEvent:
        """Return the first event of a name."""
        return next(event for event in self.events if event.name == name)

    def point(self, u: float = 0.13, phi: float = 1.57) -> tuple[float, float, float]:
        """Return a place of the skin in the base frame [m]."""
        return link_pose(MODEL, self.arm.q, LINK).apply(CONE.point(u, phi))

    def normal(self, phi: float = 1.57) -> tuple[float, float, float]:
        """Return the normal there, in the base frame."""
        return link_pose(MODEL, self.arm.q, LINK).rotate(CONE.normal(phi))


def felt(level: float, number: int = 1) -> Contact:
    """Return a touch of the forearm as the arm supervisor takes it."""
    where = GuardedSensor("one", "forearm", LINK, lambda u, phi: (CONE.point(u, phi), CONE.normal(phi)), 0.1, 0.2)
    return Contact(TouchReading(0.0, level, 0.13, 1.57, True, "", 0, 0), where, number)


def make_core(
    sensors: list[Sensor],
    reaction: Reaction,
    rules: tuple[Rule, ...] = (),
    external: bool = False,
    table: float | None = None,
    driver: ArmDriver = UR_DRIVER,
    speed_limit: SpeedLimit | None = None,
    limits: MonitoringLimits | None = None,
    model: ArmModel = MODEL,
) -> GuardCore:
    """Return a core for sensors that all lie on the same place of the forearm."""
    limits = limits or MonitoringLimits()
    placed = [
        GuardedSensor(s.name, "forearm", LINK, lambda u, phi: (CONE.point(u, phi), CONE.normal(phi)), 0.1, 0.2)
        for s in sensors
    ]
    paths = EXTERNAL_PATHS if external else INTERNAL_PATHS
    planner = ReactionPlanner(model, 4.0 if external else None, table) if model is MODEL else None
    arm = ArmSupervisor(model, driver, RuleSet(reaction, rules), limits, paths, planner, speed_limit=speed_limit)
    return GuardCore(TouchStream(sensors, DetectorSettings(stuck_frames=200)), placed, limits, arm)
