"""Rig of an arm that runs into bodies, in virtual time: the guard's core, the virtual skin's bytes, a simulated arm.

The arm obeys late, as measured on the simulated controller (bench/RESULTS.md: 5 ms from a stop sent to the first
slower state), and its joints accelerate as they are told. Frames are read one frame late.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.core.recording.block import Block
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import UR_CURRENTS
from coneskin.robot.driver.messages import Release
from coneskin.robot.driver.values import INTERNAL_PATHS
from coneskin.robot.guard.arm_supervisor import ArmSupervisor
from coneskin.robot.guard.core import GuardCore
from coneskin.robot.guard.motion.setpoint_stream import ReactionPlanner
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.contact import GuardedSensor
from coneskin.robot.guard.signals.joint_current import _push_torque
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent
from coneskin.robot.reaction.rules import Rule, RuleSet
from coneskin.robot.reaction.types import ContactOnLink, Reaction
from coneskin.robot.sim.mock_arm import SLIDER, CompanionProcesses, MockArm
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.ur.driver import UR_DRIVER
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.frame.timing import TimingLimits
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.skin import Press, PressedSkin

from .pressing_body import Body, Pressing

STEP = 0.001  # s; a frame of each sensor, and a look of the guard
_LATE = 5  # steps from a command to the control cycle that obeys it
RUN_UP = 0.3  # s for which the arm moves before it collides
RUN_UP_ACCELERATION = 20.0  # rad/s2


@dataclass(frozen=True, slots=True)
class SkinOnLink:
    """Sensor on a link of the arm.

    Attributes:
        sensor: the sensor.
        link: index of the link's DH frame.
        cone: the sensor's side in that frame.
    """

    sensor: Sensor
    link: int
    cone: PlacedFrustum

    def guarded(self) -> GuardedSensor:
        """Return it as the guard knows it."""
        cone = self.cone
        return GuardedSensor(
            self.sensor.name,
            f"link {self.link}",
            self.link,
            lambda u, phi: (cone.point(u, phi), cone.normal(phi)),
            self.sensor.thresholds.touch_level,
            self.sensor.thresholds.location_level,
        )


class CollisionRig:
    """Arm under guard that runs into bodies.

    Args:
        model: the arm.
        q: joint positions at which it will collide [rad].
        qd: joint speeds then [rad/s].
        skins: on its links.
        reaction: to a touch that no rule fits.
        rules: reactions with conditions.
        seed: of the skins' noise.
        heeds: True where what moves the arm obeys the speed slider; a stream of servo setpoints does not.
        sheets: model of the skins' sheets, "ladder" or "field".
        limits: of the monitoring.

    Attributes:
        lag: time for which frames lie unread from the next one on [s]; it may change at any time.
        events: of the guard, at host times [s].
        began: host time at which the collision began [s].
        pressing: the bodies.
    """

    def __init__(
        self,
        model: ArmModel,
        q: Sequence[float],
        qd: Sequence[float],
        skins: Sequence[SkinOnLink],
        reaction: Reaction,
        rules: tuple[Rule, ...] = (),
        seed: int = 0,
        heeds: bool = True,
        sheets: str = "ladder",
        limits: MonitoringLimits | None = None,
    ) -> None:
        self._model = model
        self._qd = list(qd)
        self._skins = {item.sensor.name: item for item in skins}
        self._device = PressedSkin([item.sensor for item in skins], seed=seed, model=sheets)
        self._packets = self._device.packets()
        limits = limits or MonitoringLimits()
        supervisor = ArmSupervisor(
            model, UR_DRIVER, RuleSet(reaction, rules), limits, INTERNAL_PATHS, ReactionPlanner(model)
        )
        stream = TouchStream(
            [item.sensor for item in skins], DetectorSettings(timing=TimingLimits(late=limits.skin_silence))
        )
        self.core = GuardCore(stream, [item.guarded() for item in skins], limits, supervisor)
        leading = max(map(abs, qd))
        way = RUN_UP - 0.5 * leading / RUN_UP_ACCELERATION
        self.arm = MockArm([a - way * v for a, v in zip(q, qd, strict=True)], [0.0] * 6, heeds=heeds)
        self.now, self.lag = 100.0, STEP
        self.began = math.nan
        self.events: list[GuardEvent] = []
        self.pressing: list[Pressing] = []
        self._steps = 0
        self._unread: deque[bytes] = deque()
        self._commands: deque[tuple[int, object]] = deque()
        self._companions = CompanionProcesses()

    def is_in(self, phase: Phase) -> bool:
        """Tell whether the guard is in this phase."""
        return self.core.phase is phase

    def collide(self, bodies: Sequence[Body], longest: float = 3.5) -> list[Pressing]:
        """Wait until the guard is active, run up, meet the bodies and see what comes of it.

        Args:
            bodies: that press, each with its own time of arrival.
            longest: for which to look on [s]; it is over once the arm has been latched for 0.3 s and all have arrived.

        Returns:
            the bodies with what they saw.
        """
        while not self.is_in(Phase.ACTIVE):
            self._step()
            if self.now > 110.0:
                raise RuntimeError(f"the guard does not become active: {self.core.blockers(self.now)}")
        self.arm.go(self._qd, RUN_UP_ACCELERATION)
        for _ in range(round(RUN_UP / STEP)):
            self._step()
        for body in bodies:
            skin = self._skins[body.sensor]
            cone = skin.cone
            self.pressing.append(Pressing(body, skin.link, cone.point(body.u, body.phi), cone.normal(body.phi)))
        self.began = self.now
        last = max(body.arrives for body in bodies)
        latched = 0
        while self.now - self.began < longest and latched < 300:
            self._step()
            rests = self.is_in(Phase.LATCHED) and self.now - self.began > last
            latched = latched + 1 if rests else 0
        return self.pressing

    def _step(self) -> None:
        self.now += STEP
        self._steps += 1
        for block in list(self._companions.blocks(self.now)):
            self._take(block)
        while self._commands and self._commands[0][0] <= self._steps:
            self.arm.feed(self._commands.popleft()[1])
        presses: dict[Body, Press] = {}
        since = 0.0 if self._steps % 2 else STEP  # after the arm's last control cycle
        q = [x + since * v for x, v in zip(self.arm.q, self.arm.qd, strict=True)]
        for item in self.pressing:
            item.update(link_pose(self._model, q, item.link), self.now - self.began, STEP)
            body = item.body
            presses[body] = Press(body.sensor, body.u, body.phi, item.force, body.radius)
        self.arm.current = self._held(q)
        self._device.press(presses, STEP)
        self._unread.append(b"".join([next(self._packets)[1] for _ in self._skins]))
        while len(self._unread) * STEP > self.lag + 1e-9:
            if data := self._unread.popleft():
                self._feed(BlockKind.SKIN, data)
        if self._steps % 2 == 0:
            if self._steps % 20 == 0 and self.core.needs.slider:
                self._feed(BlockKind.SLIDER, SLIDER.pack((self.arm.slider,)))
            self._feed(BlockKind.ARM, self.arm.poll())
        self._feed(BlockKind.TICK)

    def _held(self, q: Sequence[float]) -> list[float]:
        """Return the currents that hold the arm against the bodies [A]."""
        torque = [0.0] * 6
        for item in self.pressing:
            if item.force > 0.0:
                place = ContactOnLink(item.link, item.point, item.normal)
                pushed = _push_torque(self._model, tuple(q), place)  # type: ignore[arg-type]
                torque = [a + item.force * b for a, b in zip(torque, pushed, strict=True)]
        return [-a / b for a, b in zip(torque, UR_CURRENTS.torque_per_ampere, strict=True)]

    def _feed(self, kind: BlockKind, payload: bytes = b"") -> None:
        self._take(Block(kind, self.now, payload))

    def _take(self, block: Block) -> None:
        out: list[object] = []
        self.core.feed(block, out)
        for output in out:
            self._companions.feed(output)
            if isinstance(output, GuardEvent):
                self.events.append(output)
            elif not isinstance(output, Release):
                self._commands.append((self._steps + _LATE, output))
