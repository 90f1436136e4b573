"""Controller and program as the URScript functions see them.

The functions are below both: the controller runs the programs, and the programs call the functions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from coneskin.robot.sim.motion.arm import TRIGGERED, SimulatedArm, StopCause
from coneskin.robot.sim.urscript.translator import Interpreter
from coneskin.robot.sim.urscript.values import ScriptError

from .inputs_outputs import ClientInputs, Terminals
from .script_socket import ScriptSocket
from .states import Notice


class CallingProgram(Protocol):
    """Program that calls a URScript function."""

    name: str
    sockets: dict[str, ScriptSocket]
    told: set[str]
    signals: dict[str, Any]
    damping: float
    gain_scaling: float
    interpreter: Interpreter

    def drive(self) -> None:
        """Claim the arm for the thread that runs now; see `Program.drive`."""


class ScriptHost(Protocol):
    """Controller as a URScript function reads and commands it; see `Controller`."""

    cycle: int
    arm: SimulatedArm
    inputs: ClientInputs
    output_ints: list[int]
    output_doubles: list[float]
    digital_outputs: int
    terminals: Terminals
    outside_time: Callable[[], float]
    rtde_value: Callable[[str], Any]
    beyond: bool
    gravity: tuple[float, ...]
    payload: float
    payload_cog: tuple[float, ...]
    payload_inertia: tuple[float, ...]

    @property
    def steptime(self) -> float:
        """Control cycle [s]."""

    @property
    def speed_scaling(self) -> float:
        """Share of the commanded speeds at which the arm moves, 0..1."""

    @property
    def history(self) -> Sequence[list[float]]:
        """Joint positions of the last cycles, oldest first [rad]."""

    def pause_program(self) -> bool:
        """Hold the program and the arm."""

    def set_digital(self, bit: int, on: bool) -> None:
        """Switch digital outputs."""

    def protective_stop(self, reason: str, cause: StopCause = TRIGGERED) -> None:
        """Stop the arm as its safety system does."""

    def tell(self, notice: Notice) -> None:
        """Tell every client of the primary interface."""

    def fail(self, program: str, problem: ScriptError) -> None:
        """Report a program that has failed."""

    def log(self, event: str, **facts: Any) -> None:
        """Write one event to the log."""
