"""A guard core on a virtual skin and a mocked arm, in virtual time: a frame every 1 ms, a state every 2 ms."""

import math
from collections.abc import Iterator

from coneskin.errors import SkinConnectionError
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.robot.arm_reaction import ArmReaction
from coneskin.robot.commands import Reaction
from coneskin.robot.contact import GuardedSensor
from coneskin.robot.guard_core import GuardCore
from coneskin.robot.journal import GuardEvent, Kind
from coneskin.robot.kinematics import link_pose
from coneskin.robot.link_frames import LINK_INDEX, dh_mesh
from coneskin.robot.mover import Mover
from coneskin.robot.owner_messages import Note
from coneskin.robot.phase import Phase
from coneskin.robot.rtde_codec import Recipe
from coneskin.robot.rules import Rule
from coneskin.robot.stop_watch import FOREIGN, OWNED, Way
from coneskin.robot.table import Table
from coneskin.robot.ur_models import model
from coneskin.robot.watch import Watch
from coneskin.skin.detection import Detection
from coneskin.skin.faults import Faults
from coneskin.skin.imperfections import Imperfections
from coneskin.skin.recording import Block
from coneskin.skin.scripted_touch import ScriptedTouch
from coneskin.skin.sensor import Sensor
from coneskin.skin.stream import Stream
from coneskin.skin.substrate import Foam
from coneskin.skin.virtual import VirtualSkin

from .mock_arm import MockArm

MODEL = model("UR5e")
START_Q = [math.radians(q) for q in (-20.0, -90.0, 90.0, -90.0, -90.0, 0.0)]
LINK = LINK_INDEX["forearm"]
SLIDER = Recipe(("target_speed_fraction",))
CONE = PlacedFrustum(Frustum(0.0376, 0.0372, 0.26), dh_mesh(MODEL, "forearm") @ Pose(translation=(0.0, 0.0, 0.08)))


def touch(
    start: float, end: float = math.inf, u: float = 0.13, phi: float = 1.57, sensor: str = "one"
) -> ScriptedTouch:
    """A firm touch whose force rises within one frame."""
    return ScriptedTouch(start, end, u, phi, rise=0.0005, sensor=sensor)


class Rig:
    """Runs the core; ``events``, ``outputs`` and ``blocks`` are what came of it."""

    def __init__(
        self,
        *touches: ScriptedTouch,
        reaction: Reaction | None = None,
        faults: Faults | None = None,
        obeys: frozenset[Way] = frozenset(Way),
        sensors: int = 1,
        speed: float = 0.0,
        rules: tuple[Rule, ...] = (),
        foreign: bool = False,
        table: Table | None = None,
    ) -> None:
        names = ("one", "two")[:sensors]
        skins = [Sensor(CONE.frustum, number, name=name) for number, name in enumerate(names)]
        # Foam without delay and ideal resistors: a touch begins and ends in the frames that the tests name.
        at_once = Imperfections(foam=Foam(delayed=0.0))
        self.skin = VirtualSkin(skins, touches, faults=faults, imperfections=at_once, model="ladder")
        self.core = make_core(skins, reaction or Reaction(), rules, foreign, table)
        self.arm = MockArm(list(START_Q), [0.0] * 6, obeys)
        self.speed = speed
        self.now = 100.0
        self.events: list[GuardEvent] = []
        self.outputs: list[object] = []
        self.blocks: list[Block] = []
        self.mute_skin = self.mute_arm = False
        self._packets: Iterator[tuple[float, bytes]] = self.skin.packets()
        self.feed(Kind.OWNER, Note("ready").encode())

    def feed(self, kind: Kind, payload: bytes = b"") -> list[object]:
        """Give the core one input now; its commands go to the arm."""
        block = Block(kind, self.now, payload)
        self.blocks.append(block)
        out: list[object] = []
        self.core.take(block, out)
        for output in out:
            if isinstance(output, GuardEvent):
                self.events.append(output)
            else:
                self.arm.take(output)
        self.outputs += out
        return out

    def run(self, seconds: float) -> "Rig":
        """Let time pass."""
        for step in range(round(1000 * seconds)):
            self.now += 0.001
            try:
                data = b"".join([next(self._packets)[1] for _ in self.skin.sensors])
            except SkinConnectionError as exc:
                data, self.mute_skin = b"", True
                self.feed(Kind.LOST, f"skin\n{exc}".encode())
                self._packets = iter(())
            except StopIteration:
                data = b""
            if not self.mute_skin and data:
                self.feed(Kind.SKIN, data)
            if step % 2 == 0:
                if step % 20 == 0 and self.core.needs_slider:
                    self.feed(Kind.SLIDER, SLIDER.pack((self.arm.slider,)))
                if self.core.phase is Phase.ARMED and self.arm.target is None:
                    self.arm._go([self.speed, 0, 0, 0, 0, 0], 4.0)
                payload = self.arm.step()
                if not self.mute_arm:
                    self.feed(Kind.ARM, payload)
            self.feed(Kind.TICK)
        return self

    @property
    def names(self) -> list[str]:
        """Names of the events, in order."""
        return [event.name for event in self.events]

    def event(self, name: str) -> GuardEvent:
        """The first event of a name."""
        return next(event for event in self.events if event.name == name)

    def point(self, u: float = 0.13, phi: float = 1.57) -> tuple[float, float, float]:
        """A place of the skin, in the base frame [m]."""
        return link_pose(MODEL, self.arm.q, LINK).apply(CONE.point(u, phi))

    def normal(self, phi: float = 1.57) -> tuple[float, float, float]:
        """Its normal, in the base frame."""
        return link_pose(MODEL, self.arm.q, LINK).rotate(CONE.normal(phi))


def make_core(
    sensors: list[Sensor],
    reaction: Reaction,
    rules: tuple[Rule, ...] = (),
    foreign: bool = False,
    table: Table | None = None,
) -> GuardCore:
    """A core for sensors that all lie on the same place of the forearm."""
    watch = Watch()
    placed = [
        GuardedSensor(s.name, "forearm", LINK, lambda u, phi: (CONE.point(u, phi), CONE.normal(phi)), 0.1)
        for s in sensors
    ]
    ways = FOREIGN if foreign else OWNED
    arm = ArmReaction(MODEL, reaction, watch, ways, rules, Mover(MODEL, 4.0 if foreign else None, table))
    return GuardCore(Stream(sensors, Detection(stuck_frames=200)), placed, watch, arm)
