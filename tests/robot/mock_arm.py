"""A mocked robot: six joints that obey the guard's commands after one cycle, or do not, on a clock of their own."""

from dataclasses import dataclass, field

from coneskin.robot.owner_messages import Clear, Halt, Speed, Stop
from coneskin.robot.state_reader import RECIPE
from coneskin.robot.stop_watch import Way

CYCLE = 0.002


@dataclass
class MockArm:
    """Joints at q [rad] that move at qd [rad/s]; ``obeys`` are the ways to stop that work."""

    q: list[float]
    qd: list[float]
    obeys: frozenset[Way] = frozenset(Way)
    clock: float = 0.0
    safety_bits: int = 1
    robot_mode: int = 7
    target: list[float] | None = None
    acceleration: float = 0.0
    commands: list[object] = field(default_factory=list)

    def take(self, command: object) -> None:
        """Obey a command of the guard, if this arm does."""
        self.commands.append(command)
        if isinstance(command, Way):
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

    def _go(self, target: list[float], acceleration: float) -> None:
        self.target, self.acceleration = target, acceleration

    def step(self) -> bytes:
        """One control cycle; the payload of its RTDE packet."""
        self.clock += CYCLE
        if self.target is not None:
            gap = max(abs(t - v) for t, v in zip(self.target, self.qd, strict=True))
            share = min(1.0, self.acceleration * CYCLE / gap) if gap else 1.0
            self.qd = [v + share * (t - v) for t, v in zip(self.target, self.qd, strict=True)]
        self.q = [x + v * CYCLE for x, v in zip(self.q, self.qd, strict=True)]
        return RECIPE.pack((self.clock, tuple(self.q), tuple(self.qd), self.robot_mode, self.safety_bits, 2))
