"""Run of an arm that meets bodies, in lock-step and virtual time: force -> skin -> bytes -> guard -> stop -> force.

One step is 1 ms: a frame of each sensor, which the guard reads a frame late. The controller has its cycle of 2 ms and
obeys a command as late as was measured (bench/RESULTS.md: 5 ms from a stop sent to the first slower state); its targets
move the plant, and what the plant measures is what the guard sees. The same seed gives the same run, bit by bit.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

from coneskin.core.recording.block import Block
from coneskin.robot.arm.ur_models import arm_model
from coneskin.robot.driver.messages import Release
from coneskin.robot.driver.setpoint import JointVelocitySetpoint, SetSpeedSlider
from coneskin.robot.driver.stop_path import StopPath
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent
from coneskin.robot.sim.companion_processes import CompanionProcesses
from coneskin.robot.sim.mock_arm import SLIDER, MockArm
from coneskin.scene.build import build_core
from coneskin.scene.values.body import BodyScene
from coneskin.scene.values.scene import Scene
from coneskin.skin.padding import Padding
from coneskin.skin.virtual.pressed_skin import PressedSkin

from .force_limit import ForceLimit
from .impact_outcome import ImpactMeter, ImpactOutcome
from .joint_program import JointProgram
from .mujoco_plant import MujocoPlant
from .scene_plant import currents_of, presses_of, sheets_of
from .touch_recorder import TouchRecorder
from .truth_recorder import TruthRecorder

__all__ = ["PROTECTIONS", "CollisionRun"]

#: what protects the bodies: the scene's guard, the controller's own force limit, nothing
PROTECTIONS = ("guard", "force limit", "nothing")
_STEP = 0.001  # s
_CYCLE = 0.002  # s
_LATE = 5  # steps from a command to the control cycle that obeys it
_LIMIT_LATE = 4  # steps from the force limit's decision to that cycle; assumed
_ACTIVATION = 10.0  # s within which the guard must become active
_AFTER = 0.01  # s for which a run goes on after the clamping force was taken


class CollisionRun:
    """Run of one collision.

    Args:
        scene: with an arm and its skins.
        bodies: that it may meet.
        q: joint positions at the start [rad].
        protection: of `PROTECTIONS`.
        seed: of the skins' noise.
        sheets: model of the skins' sheets, "ladder" or "field".
        heeds: True where what moves the arm obeys the speed slider; a stream of servo setpoints does not.
        note: is told each block that the guard takes, each event that it makes, the force of the contacts, where
            the bodies are, and which skin they touch, for a recording.

    Attributes:
        plant: the arm among its bodies.
        meter: of the collision.
        events: of the guard.
        now: virtual host time [s].

    Raises:
        MissingExtra: MuJoCo is not installed.
    """

    def __init__(
        self,
        scene: Scene,
        bodies: Sequence[BodyScene],
        q: Sequence[float],
        *,
        protection: str = "guard",
        seed: int = 0,
        sheets: str = "ladder",
        heeds: bool = True,
        note: Callable[[Block], None] = lambda _: None,
    ) -> None:
        assert scene.arm is not None
        model = arm_model(scene.arm.model)
        self._skins = sheets_of(scene)
        self.plant = MujocoPlant(model, self._skins, bodies, scene.padding or Padding(), q)
        self.arm = MockArm(list(q), [0.0] * 6, heeds=heeds)
        self.meter = ImpactMeter()
        self.events: list[GuardEvent] = []
        self.now = 100.0
        self._protection = protection
        self._limit = ForceLimit(model)
        self._core = build_core(scene) if protection == "guard" else None
        sensors = [item.sensor for item in scene.sensors]
        self._device = PressedSkin(sensors, seed=seed, model=sheets)
        self._packets = self._device.packets()
        self._companions = CompanionProcesses()
        self._commands: deque[tuple[int, object]] = deque()
        self._unread = b""
        self._program: JointProgram | None = None
        self._began = math.nan
        self._steps = 0
        self._note = note
        self._truth, self._touches = TruthRecorder(_STEP), TouchRecorder()

    @property
    def outcome(self) -> ImpactOutcome:
        """Outcome so far."""
        return self.meter.outcome

    def run(self, program: JointProgram, longest: float = 3.0, after: float = _AFTER) -> ImpactOutcome:
        """Wait until the guard is active, let the program move the arm, and see what comes of it.

        Args:
            program: that moves the arm until the guard does.
            longest: for which to look on [s]; it is over 0.5 s after the first contact.
            after: for which to go on then, to see what comes later [s].

        Returns:
            the outcome; that of no contact has a peak of 0.
        """
        while self._core is not None and self._core.phase is not Phase.ACTIVE:
            self._step(moving=False)
            if self.now > 100.0 + _ACTIVATION:
                raise RuntimeError(f"the guard does not become active: {self._core.blockers(self.now)}")
        self._steps += self._steps % 2  # the program begins with a control cycle
        self._program, self._began = program, self.now
        left = math.inf
        while self.now - self._began < longest and left > 0.0:
            self._step()
            if self.meter.over:
                left = min(left, after) - _STEP
        return self.outcome

    def _step(self, moving: bool = True) -> None:
        self.now += _STEP
        self._steps += 1
        first = self._steps % 2 == 1  # half of a control cycle
        while self._commands and self._commands[0][0] <= self._steps:
            self._obey(self._commands.popleft()[1])
        if first:
            self._drive()
            self.arm.advance()
        if moving:
            since = _CYCLE if first else _STEP
            start = [q - since * v for q, v in zip(self.arm.q, self.arm.qd, strict=True)]
            self.plant.advance(start, self.arm.qd, _STEP)
            self._measure()
        if self._core is not None:
            self._guard(first)
        elif self._protection == "force limit" and self._limit.exceeded(self.plant.q, self.plant.external, _STEP):
            self._send(StopPath.PROTECTIVE, _LIMIT_LATE)

    def _drive(self) -> None:
        """Let the program say where to go, as long as it is the one that moves the arm."""
        if self._program is None:
            return
        wanted = self._program.target(self.now - self._began, self.arm.q)
        if wanted is None:
            self._program = None
        else:
            self.arm.go(*wanted)

    def _obey(self, command: object) -> None:
        if not isinstance(command, SetSpeedSlider | JointVelocitySetpoint):
            self._program = None
        self.arm.take(command)

    def _send(self, command: object, late: int) -> None:
        self.meter.notice(self.now)
        self._commands.append((self._steps + late, command))

    def _measure(self) -> None:
        plant = self.plant
        rate = max((contact.rate for contact in plant.contacts), default=0.0)
        speed = max(map(abs, plant.qd))
        touches = self._touches.take(self.now, presses_of(plant, self._skins).values())
        for block in (self._truth.take(self.now, plant.force, plant.places), touches):
            if block is not None:
                self._note(block)
        self.meter.take(self.now, plant.force, rate, plant.peak, plant.deepest, plant.impulse, speed)

    # guard

    def _guard(self, first: bool) -> None:
        """Show the guard what skin, controller and processes send in this step."""
        for block in list(self._companions.blocks(self.now)):
            self._take(block)
        self._device.press(presses_of(self.plant, self._skins), _STEP)
        if self._unread:
            self._feed(BlockKind.SKIN, self._unread)
        self._unread = b"".join([next(self._packets)[1] for _ in self._device.sensors])
        assert self._core is not None
        if not first:
            if self._steps % 20 == 0 and self._core.needs.slider:
                self._feed(BlockKind.SLIDER, SLIDER.pack((self.arm.slider,)))
            self._feed(BlockKind.ARM, self.arm.packet(self.plant.q, self.plant.qd, currents_of(self.plant)))
        self._feed(BlockKind.TICK)

    def _feed(self, kind: BlockKind, payload: bytes = b"") -> None:
        self._take(Block(kind, self.now, payload))

    def _take(self, block: Block) -> None:
        assert self._core is not None
        self._note(block)
        out: list[object] = []
        self._core.take(block, out)
        for output in out:
            self._companions.take(output)
            if isinstance(output, GuardEvent):
                self.events.append(output)
                self._note(output.block())
            elif not isinstance(output, Release):
                self._send(output, _LATE)

    def event(self, name: EventName) -> GuardEvent | None:
        """Return the first event of a name; None where there is none."""
        return next((event for event in self.events if event.name == name), None)
