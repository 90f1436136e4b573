"""A mocked robot: six joints that obey the guard's commands after one cycle, or do not, on a clock of their own."""

from dataclasses import dataclass, field

from coneskin.robot.follower import FollowerProgram, Steer
from coneskin.robot.owner_messages import Clear, Halt, Speed, Stop
from coneskin.robot.slowing import Slider
from coneskin.robot.state_reader import RECIPE
from coneskin.robot.stop_watch import Use, Way

CYCLE = 0.002


@dataclass
class MockArm:
    """Joints at q [rad] that move at qd [rad/s]; ``obeys`` are the ways to stop that work, ``heeds`` the slider."""

    q: list[float]
    qd: list[float]
    obeys: frozenset[Way] = frozenset(Way)
    clock: float = 0.0
    safety_bits: int = 1
    robot_mode: int = 7
    runtime_state: int = 2
    target: list[float] | None = None
    acceleration: float = 0.0
    commands: list[object] = field(default_factory=list)
    heeds: bool = True
    slider: float = 1.0
    registers: Steer | None = None
    following: int = 0

    def take(self, command: object) -> None:
        """Obey a command of the guard, if this arm does."""
        if isinstance(command, Use):
            command = command.way
        self.commands.append(command)
        if isinstance(command, Slider):
            self.slider = command.fraction
        elif isinstance(command, Steer):
            self.registers = command
        elif isinstance(command, FollowerProgram):
            self.following, self.runtime_state = command.token, 2
        elif isinstance(command, Way):
            if command in self.obeys:
                self._go([0.0] * 6, 10.0)
                if command is Way.PROTECTIVE:
                    self.safety_bits = 0b10000000100
        elif isinstance(command, Clear) or Way.OWNER not in self.obeys:
            return
        elif isinstance(command, Stop | Halt):
            self._go([0.0] * 6, command.deceleration)
        elif isinstance(command, Speed):
            self._go(list(command.qd), command.acceleration)

    def go(self, target: list[float], acceleration: float) -> None:
        """Let the joints go to these speeds."""
        self._go(target, acceleration)

    def _go(self, target: list[float], acceleration: float) -> None:
        self.target, self.acceleration = target, acceleration
        self.following = 0

    def step(self) -> bytes:
        """One control cycle; the payload of its RTDE packet."""
        self.clock += CYCLE
        if self.following and self.registers is not None and self.registers.token == self.following:
            self.target, self.acceleration = list(self.registers.qd), self.registers.acceleration
        if self.target is not None:
            target = [self.slider * t if self.heeds else t for t in self.target]
            gap = max(abs(t - v) for t, v in zip(target, self.qd, strict=True))
            share = min(1.0, self.acceleration * CYCLE / gap) if gap else 1.0
            self.qd = [v + share * (t - v) for t, v in zip(target, self.qd, strict=True)]
        self.q = [x + v * CYCLE for x, v in zip(self.q, self.qd, strict=True)]
        return RECIPE.pack(
            (self.clock, tuple(self.q), tuple(self.qd), self.robot_mode, self.safety_bits, self.runtime_state)
        )
