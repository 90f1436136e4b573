"""Mock arm: six joints that obey the guard's commands after one cycle, or do not, on a clock of their own."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from coneskin.core.recording.block import Block
from coneskin.robot.driver.messages import EndReaction, Release, SetJointVelocity, StatusReport, StopProgram
from coneskin.robot.driver.values import JointVelocitySetpoint, SetpointProgram, SetSpeedSlider, StopPath, UseStopPath
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent
from coneskin.robot.ur.rtde_codec import STATE_RECIPE, Recipe

#: what a controller reports of its speed slider
SLIDER = Recipe(("target_speed_fraction",))

_CONTROL_CYCLE = 0.002  # s


@dataclass
class MockArm:
    """Joints at q [rad] that move at qd [rad/s]; ``obeys`` are the paths to stop that work, ``heeds`` the slider.

    ``current`` is what the motors take beyond the controller's model [A].
    """

    q: list[float]
    qd: list[float]
    obeys: frozenset[StopPath] = frozenset(StopPath)
    clock: float = 0.0
    safety_bits: int = 1
    robot_mode: int = 7
    runtime_state: int = 2
    target: list[float] | None = None
    acceleration: float = 0.0
    commands: list[object] = field(default_factory=list)
    heeds: bool = True
    slider: float = 1.0
    registers: JointVelocitySetpoint | None = None
    following: int = 0
    current: list[float] = field(default_factory=lambda: [0.0] * 6)

    def feed(self, command: object) -> None:
        """Obey a command of the guard, if this arm does."""
        if isinstance(command, UseStopPath):
            command = command.path
        self.commands.append(command)
        if isinstance(command, SetSpeedSlider):
            self.slider = command.fraction
        elif isinstance(command, JointVelocitySetpoint):
            self.registers = command
        elif isinstance(command, SetpointProgram):
            self.following, self.runtime_state = command.token, 2
        elif isinstance(command, StopPath):
            if command in self.obeys:
                self.go([0.0] * 6, 10.0)
                if command is StopPath.SLIDER:
                    self.slider = 0.0
                if command is StopPath.PROTECTIVE:
                    self.safety_bits = 0b10000000100
        elif StopPath.DRIVER not in self.obeys:
            return
        elif isinstance(command, StopProgram | EndReaction):
            self.go([0.0] * 6, command.deceleration)
        elif isinstance(command, SetJointVelocity):
            self.go(list(command.qd), command.acceleration)

    def go(self, target: list[float], acceleration: float) -> None:
        """Let the joints go to these speeds."""
        self.target, self.acceleration = target, acceleration
        self.following = 0

    @property
    def speed(self) -> float:
        """Speed of the leading joint [rad/s]."""
        return max(map(abs, self.qd))

    def poll(self) -> bytes:
        """Go on by one control cycle and return the payload of its RTDE packet."""
        self.update()
        return self.packet(self.q, self.qd, self.current)

    def update(self) -> None:
        """Go on by one control cycle."""
        self.clock += _CONTROL_CYCLE
        if self.following and self.registers is not None and self.registers.token == self.following:
            self.target, self.acceleration = list(self.registers.qd), self.registers.acceleration
        if self.target is not None:
            target = [self.slider * t if self.heeds else t for t in self.target]
            gap = max(abs(t - v) for t, v in zip(target, self.qd, strict=True))
            share = min(1.0, self.acceleration * _CONTROL_CYCLE / gap) if gap else 1.0
            self.qd = [v + share * (t - v) for t, v in zip(target, self.qd, strict=True)]
        self.q = [x + v * _CONTROL_CYCLE for x, v in zip(self.q, self.qd, strict=True)]

    def packet(self, q: Sequence[float], qd: Sequence[float], current: Sequence[float]) -> bytes:
        """Return the payload of an RTDE packet with these positions [rad], speeds [rad/s] and currents [A] measured."""
        modes = self.robot_mode, self.safety_bits, self.runtime_state
        return STATE_RECIPE.pack((self.clock, tuple(q), tuple(qd), *modes, tuple(current), (0.0,) * 6))


_REPORT_PERIOD = 0.02  # s between two heartbeats


class CompanionProcesses:
    """Program that guards, and driver process or guard watchdog, as far as a core hears them.

    Attributes:
        program_is_mute: True where the program is suspended.
        process_is_mute: True where driver process or guard watchdog sends nothing.
        second_is_mute: the same of the second guard watchdog.
    """

    def __init__(self) -> None:
        self.program_is_mute = self.process_is_mute = self.second_is_mute = False
        self._ready = False
        self._due = 0.0
        self._release: Release | None = None
        self._latched_stop = self._request = 0

    def feed(self, output: object) -> None:
        """Take an output of the core."""
        if isinstance(output, Release):
            self._release = output
        elif isinstance(output, GuardEvent) and output.name == EventName.LATCHED:
            self._latched_stop = output.details["stop"]

    def blocks(self, now: float) -> Iterator[Block]:
        """Return what they say by a host time [s]; to be asked continuously."""
        due = now >= self._due
        if due:
            self._due = now + _REPORT_PERIOD
        if due:
            yield Block(BlockKind.PROGRAM, now, b"suspended" if self.program_is_mute else b"")
        if due and not self.second_is_mute:
            yield _report(now, "alive", "second")
        if self.process_is_mute:
            return
        if not self._ready:
            self._ready = True
            yield _report(now, "ready")
        if due:
            yield _report(now, "alive")
        if self._release is not None:
            number, self._release = self._release.number, None
            yield _report(now, "released", str(number))

    def reset(self, now: float) -> Block:
        """Return a person's reset of the newest stop that has latched the arm, at a host time [s]."""
        self._request += 1
        return Block(BlockKind.RESET, now, b"%d %d" % (self._latched_stop, self._request))


def _report(now: float, kind: str, text: str = "") -> Block:
    return Block(BlockKind.DRIVER, now, StatusReport(kind, text).encode())
