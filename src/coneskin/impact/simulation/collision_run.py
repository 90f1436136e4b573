"""Run of an arm that meets bodies, in lock-step and virtual time: force -> skin -> bytes -> guard -> stop -> force.

One step is 1 ms: a frame of each sensor, which the guard reads a frame late. The controller has its cycle of 2 ms and
obeys a command as late as was measured (bench/RESULTS.md: 5 ms from a stop sent to the first slower state); its targets
move the plant, and what the plant measures is what the guard sees. The same seed gives the same run, bit by bit.

In place of the guard, the force limit of a controller can be imitated: that of Universal Robots' safety system ("Tool
force", "Elbow force": 150 N is a common setting, 100 to 250 N can be set). How it estimates the force is not published.
Assumed: it knows the torques from outside without error, low-passed by 10 ms, and takes them for a force at the tool,
or at the elbow, by least squares.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.recording.block import Block
from coneskin.robot.arm.kinematics import point_jacobian
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.messages import Release
from coneskin.robot.driver.values import JointVelocitySetpoint, SetSpeedSlider, StopPath
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent
from coneskin.robot.sim.mock_arm import SLIDER, CompanionProcesses, MockArm
from coneskin.robot.sim.motion.arm import CYCLE
from coneskin.scene.build import build_core
from coneskin.scene.values.scene import BodyScene, Scene
from coneskin.skin.materials import Padding
from coneskin.skin.virtual.skin import PressedSkin

from .impact_outcome import ImpactMeter, ImpactOutcome, TouchRecorder, TruthRecorder
from .mujoco_plant import MujocoPlant, sheets_of
from .scene_description import SheetOnLink

_MAX_FORCE = 150.0  # N, at which the imitated limit stops the arm
_FILTER_TIME = 0.01  # s
_ELBOW_LINK = 2  # index of the link at whose far end it is
_MIN_LEVER = 0.1  # of the longest; shorter ones say nothing of a force


class _ForceLimit:
    """Force limit of one arm."""

    def __init__(self, model: ArmModel) -> None:
        self._model = model
        self._torque: Floats = np.zeros(model.joints)

    def exceeded(self, q: Sequence[float], torque: Sequence[float], step: float) -> bool:
        """Take the torques from outside [N m] that have acted for a time [s]; tell whether the arm must stop."""
        share = math.exp(-step / _FILTER_TIME)
        self._torque = share * self._torque + (1.0 - share) * np.asarray(torque, float)
        if not self._torque.any():
            return False
        return max(self._force(q, self._model.joints), self._force(q, _ELBOW_LINK)) > _MAX_FORCE

    def _force(self, q: Sequence[float], link: int) -> float:
        """Return the force at the end of a link that explains the torques best [N]."""
        levers = np.array(point_jacobian(self._model, q, link)).T
        force, *_ = np.linalg.lstsq(levers, self._torque, rcond=_MIN_LEVER)
        return float(np.linalg.norm(force))


_ARRIVAL_TOLERANCE = 1e-4  # rad from a waypoint


#: joint positions [rad] -> joint speeds to go to [rad/s], and the acceleration of the leading joint; None at its end
_JointProgram = Callable[[Sequence[float]], tuple[Sequence[float], float] | None]


def follow_waypoints(points: Sequence[Sequence[float]], speed: float, acceleration: float) -> _JointProgram:
    """Return a program that goes through waypoints along straight lines in joint space, with a stop at each.

    Args:
        points: joint positions [rad].
        speed: of the leading joint [rad/s].
        acceleration: of the leading joint [rad/s^2].
    """
    ahead = [list(point) for point in points]

    def target(q: Sequence[float]) -> tuple[list[float], float] | None:
        while ahead:
            way = [goal - at for goal, at in zip(ahead[0], q, strict=True)]
            left = max(map(abs, way))
            if left > _ARRIVAL_TOLERANCE:
                braking = math.sqrt(2.0 * 0.8 * acceleration * left)  # it sees a cycle late that it must brake
                return [min(speed, braking, left / CYCLE) * value / left for value in way], acceleration
            ahead.pop(0)
        return None

    return target


_STEP_TIME = 0.001  # s
_COMMAND_DELAY = 5  # steps from a command to the control cycle that obeys it
_FORCE_LIMIT_DELAY = 4  # steps from the force limit's decision to that cycle; assumed
_ACTIVATION_TIMEOUT = 10.0  # s within which the guard must become active
_SETTLE_TIME = 0.01  # s for which a run goes on after the clamping force was taken


class CollisionRun:
    """Run of one collision.

    Args:
        scene: with an arm and its skins.
        bodies: that it may meet.
        q: joint positions at the start [rad].
        protection: of the bodies: "guard", the scene's; "force limit", the controller's own; or "nothing".
        seed: of the skins' noise.
        bare: parts of the arm without a skin that bodies meet too.
        period: as of `MujocoPlant`.
        note: is told each block that the guard takes, each event that it makes, the force of the contacts, where
            the bodies are, and which skin they touch, for a recording.

    Attributes:
        plant: the arm among its bodies.
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
        bare: Sequence[SheetOnLink] = (),
        period: int = 1,
        note: Callable[[Block], None] = lambda _: None,
    ) -> None:
        assert scene.arm is not None
        model = arm_model(scene.arm.model)
        padding = scene.padding or Padding()
        self.plant = MujocoPlant(model, sheets_of(scene), bodies, padding, q, period=period, bare=bare)
        self.arm = MockArm(list(q), [0.0] * model.joints)
        self.meter = ImpactMeter()
        self.events: list[GuardEvent] = []
        self.now = 100.0
        self._protection = protection
        self._limit = _ForceLimit(model)
        self._core = build_core(scene) if protection == "guard" else None
        sensors = [item.sensor for item in scene.sensors]
        self._device = PressedSkin(sensors, seed=seed, model="ladder")
        self._packets = self._device.packets()
        self._companions = CompanionProcesses()
        self._commands: deque[tuple[int, object]] = deque()
        self._unread = b""
        self._program: _JointProgram | None = None
        self._began = math.nan
        self._steps = 0
        self._note = note
        self._truth, self._touches = TruthRecorder(_STEP_TIME), TouchRecorder()

    @property
    def latched(self) -> bool:
        """True while the guard holds the arm latched."""
        return self._core is not None and self._core.phase is Phase.LATCHED

    def run(
        self,
        program: _JointProgram,
        longest: float = 3.0,
        after: float = _SETTLE_TIME,
        look: Callable[[], bool] = lambda: False,
    ) -> ImpactOutcome:
        """Wait until the guard is active, let the program move the arm, and see what comes of it.

        Args:
            program: that moves the arm until the guard does.
            longest: for which to look on [s]; it is over 0.5 s after the first contact.
            after: for which to go on then, to see what comes later [s].
            look: is called after each step, and ends the run where it returns True.

        Returns:
            the outcome; that of no contact has a peak of 0.
        """
        while self._core is not None and self._core.phase is not Phase.ACTIVE:
            self._step(moving=False)
            if self.now > 100.0 + _ACTIVATION_TIMEOUT:
                raise RuntimeError(f"the guard does not become active: {self._core.blockers(self.now)}")
        self._steps += self._steps % 2  # the program begins with a control cycle
        self._program, self._began = program, self.now
        left = math.inf
        while self.now - self._began < longest and left > 0.0:
            self._step()
            if look():
                break
            if self.meter.over:
                left = min(left, after) - _STEP_TIME
        return self.meter.outcome

    def _step(self, moving: bool = True) -> None:
        self.now += _STEP_TIME
        self._steps += 1
        first = self._steps % 2 == 1  # half of a control cycle
        while self._commands and self._commands[0][0] <= self._steps:
            command = self._commands.popleft()[1]
            if not isinstance(command, SetSpeedSlider | JointVelocitySetpoint):
                self._program = None
            self.arm.feed(command)
        if first:
            self._drive()
            self.arm.update()
        if moving:
            since = CYCLE if first else _STEP_TIME
            start = [q - since * v for q, v in zip(self.arm.q, self.arm.qd, strict=True)]
            self.plant.update(start, self.arm.qd, _STEP_TIME)
            self._measure()
        if self._core is not None:
            self._guard(first)
        elif self._protection == "force limit" and self._limit.exceeded(self.plant.q, self.plant.external, _STEP_TIME):
            self._send(StopPath.PROTECTIVE, _FORCE_LIMIT_DELAY)

    def _drive(self) -> None:
        """Let the program say where to go, as long as it is the one that moves the arm."""
        if self._program is None:
            return
        wanted = self._program(self.arm.q)
        if wanted is None:
            self._program = None
        else:
            self.arm.go(list(wanted[0]), wanted[1])

    def _send(self, command: object, late: int) -> None:
        self.meter.notice(self.now)
        self._commands.append((self._steps + late, command))

    def _measure(self) -> None:
        plant = self.plant
        touches = self._touches.feed(self.now, plant.presses.values())
        for block in (self._truth.feed(self.now, plant.force, plant.places), touches):
            if block is not None:
                self._note(block)
        self.meter.feed(self.now, plant)

    # guard

    def _guard(self, first: bool) -> None:
        """Show the guard what skin, controller and processes send in this step."""
        for block in list(self._companions.blocks(self.now)):
            self._feed(block)
        self._device.press(self.plant.presses, _STEP_TIME)
        if self._unread:
            self._feed_new(BlockKind.SKIN, self._unread)
        self._unread = b"".join([next(self._packets)[1] for _ in self._device.sensors])
        assert self._core is not None
        if not first:
            if self._steps % 20 == 0 and self._core.needs.slider:
                self._feed_new(BlockKind.SLIDER, SLIDER.pack((self.arm.slider,)))
            self._feed_new(BlockKind.ARM, self.arm.packet(self.plant.q, self.plant.qd, self.plant.currents))
        self._feed_new(BlockKind.TICK)

    def _feed_new(self, kind: BlockKind, payload: bytes = b"") -> None:
        self._feed(Block(kind, self.now, payload))

    def _feed(self, block: Block) -> None:
        assert self._core is not None
        self._note(block)
        out: list[object] = []
        self._core.feed(block, out)
        for output in out:
            self._companions.feed(output)
            if isinstance(output, GuardEvent):
                self.events.append(output)
                self._note(output.block())
            elif not isinstance(output, Release):
                self._send(output, _COMMAND_DELAY)

    def event(self, name: EventName) -> GuardEvent | None:
        """Return the first event of a name; None where there is none."""
        return next((event for event in self.events if event.name == name), None)
