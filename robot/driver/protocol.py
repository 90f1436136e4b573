"""What a guard needs of an arm's controller, in tiers.

``ArmDriver`` is the first: states, a stop and a check of the model. It is enough for ``reaction = "stop"`` where
another program moves the arm. Each further protocol adds what a scene may ask for. A scene that asks for more than its
driver has is refused before anything starts. ``coneskin.robot.ur`` has all of them. Guard, reaction and stop know
nothing else of a controller.
"""

from __future__ import annotations

import socket
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, NamedTuple, Protocol, Self, TypeVar, cast, runtime_checkable

from coneskin.core.errors import RobotRefused
from coneskin.core.finding import Finding
from coneskin.robot.arm.model import ArmModel

from .messages import EndReaction, StopProgram
from .values import ArmReading, ControllerState, JointVelocitySetpoint, SetpointProgram, StopPath, UseStopPath


class ExaminationScope(NamedTuple):
    """What a scene needs of a controller."""

    control: bool  #: a program of ours moves the arm
    slider: bool  #: the guard takes the speed slider
    setpoints: bool  #: the guard moves the arm away although another program moves it
    heartbeat: bool  #: a program on the controller may depend on the guard's heartbeat
    deceleration: float = 10.0  #: of its stops [rad/s2]


class _Connection(Protocol):
    """Connection that is opened in a ``with``."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...

    def close(self) -> None:
        """Close it; may be called again."""


class PayloadReader(_Connection, Protocol):
    """Connection that brings payloads, of states or of the speed slider, and never waits."""

    def fileno(self) -> int:
        """Return the descriptor, for select and poll."""

    def read(self) -> list[bytes]:
        """Return every whole payload that has arrived, oldest first.

        Raises:
            RobotConnectionError: the controller is gone.
        """


class SetpointWriter(PayloadReader, Protocol):
    """Reader of states whose connection carries joint velocity setpoints as well."""

    def write(self, setpoint: JointVelocitySetpoint, /) -> bool:
        """Send a setpoint without waiting; return whether the system took the bytes."""


class SpeedSlider(PayloadReader, Protocol):
    """Reader and writer of the controller's speed slider."""

    def set(self, fraction: float, /) -> bool:
        """Send the slider to a fraction without waiting; return whether the system took the bytes."""


class HeartbeatWriter(PayloadReader, Protocol):
    """Writer of the guard's heartbeat to the controller, and reader of what its program has seen of it."""

    def write(self, count: int, /) -> bool:
        """Send a count without waiting; return whether the system took the bytes."""


class VariableReader(_Connection, Protocol):
    """Reader of what the controller says, for the guarded program. It waits. Any thread may ask."""

    def value(self, name: str, /) -> Any:
        """Return the newest value of a variable, by the controller's name of it."""

    def reading(self) -> ArmReading:
        """Return what the controller says at one moment."""


class OutputWriter(_Connection, Protocol):
    """Writer of the controller's outputs, for the guarded program. It waits. Any thread may write."""

    def set_digital(self, group: str, number: int, on: bool, /) -> None:
        """Switch a digital output of a group."""

    def set_analog(self, number: int, ratio: float, kind: str, /) -> None:
        """Set an analog output to a ratio of its range; the kind is "voltage" or "current"."""

    def set_register(self, number: int, value: int | float, /) -> None:
        """Write a register that programs on the controller read."""


class StopSink(Protocol):
    """What takes the commands of a stop."""

    def append(self, command: StopProgram | EndReaction | UseStopPath, /) -> None:
        """Take one command."""


class StopConnections(_Connection, Protocol):
    """Connections through which an arm can be stopped, whatever moves it. ``tcp`` has one to begin from.

    Entering it in a ``with`` opens all of them and proves that stops are taken, or raises RobotConnectionError or
    RobotRefused; ``reopen`` opens what it can.
    """

    host: str

    def sockets(self) -> dict[str, socket.socket]:
        """Return those that are open, by the name of the stop path that needs them."""

    def ask(self) -> None:
        """Ask the controller whether it still takes stops, without waiting."""

    def drain(self) -> list[tuple[str, socket.socket, str]]:
        """Take what the controller has said; return the connections that are of no use now, to be closed, and why."""

    def use(self, path: StopPath, deceleration: float, /) -> bool:
        """Send one stop without waiting; return whether the system took the bytes, False for a path it does not have.

        The deceleration [rad/s2] is that of the leading joint.
        """

    def reopen(self) -> bool:
        """Open again what is gone; return whether any was opened."""


@runtime_checkable
class ProgramStarter(Protocol):
    """Stop connections through which the program that follows setpoints is started as well."""

    def follow(self, program: SetpointProgram, /) -> bool:
        """Start that program; return whether the system took the bytes."""


class ArmDriver(Protocol):
    """One maker's controller, as a guard sees it that stops the arm and no more."""

    @property
    def lost_with(self) -> Mapping[str, frozenset[StopPath]]:
        """Stop paths that are lost with each connection, by the name of the connection; together all that there are."""

    def decode_state(self, time: float, payload: bytes, /) -> ControllerState:
        """Return the state in a payload that was read at a host time [s].

        Raises:
            RobotConnectionError: the payload cannot be one.
        """

    def check_model(self, arm: ArmModel, host: str) -> None:
        """Compare the scene's model with the controller's arm.

        Raises:
            RobotRefused: the arm at this host is another one.
            RobotConnectionError: the controller cannot be reached.
        """

    def state_reader(self, host: str, timeout: float = 2.0) -> PayloadReader:
        """Return a reader of states, to be opened in a ``with``."""

    def stop_connections(self, host: str, timeout: float = 2.0) -> StopConnections:
        """Return connections for stops, none of them open yet."""


@runtime_checkable
class SetpointDriver(Protocol):
    """Driver that moves the arm away beside another program; its stop connections are a ``ProgramStarter``."""

    def setpoint_writer(self, host: str) -> SetpointWriter:
        """Return a reader of states that also writes setpoints, to be opened in a ``with``."""


@runtime_checkable
class SliderDriver(Protocol):
    """Driver that slows the arm by its controller's speed slider."""

    def decode_speed_fraction(self, payload: bytes, /) -> float:
        """Return the position of the speed slider in a payload, 0..1.

        Raises:
            RobotConnectionError: the payload cannot be one.
        """

    def speed_slider(self, host: str, *, claim: bool = True) -> SpeedSlider:
        """Return the speed slider, to be opened in a ``with``; where not claimed, it is taken by the first ``set``."""


@runtime_checkable
class HeartbeatDriver(Protocol):
    """Driver whose controller ends a program by itself where the network is cut."""

    def heartbeat_writer(self, host: str) -> HeartbeatWriter:
        """Return the writer of the guard's heartbeat, to be opened in a ``with``."""

    def heartbeat_lines(self, frequency: float) -> str:
        """Return the lines of a program that let the controller end it without a heartbeat for 1 / frequency [Hz]."""

    def decode_heartbeat(self, payload: bytes, /) -> int:
        """Return the count that a program with these lines found at its start.

        Raises:
            RobotConnectionError: the payload cannot be one.
        """


@runtime_checkable
class ProgramDriver(Protocol):
    """Driver that moves the arm for a program."""

    @property
    def process(self) -> str:
        """Module of the driver process."""

    def variable_reader(self, host: str) -> VariableReader:
        """Return a reader of variables for the guarded program, to be opened in a ``with``."""

    def output_writer(self, host: str) -> OutputWriter:
        """Return a writer of outputs for the guarded program, to be opened in a ``with``."""


@runtime_checkable
class ExaminedDriver(Protocol):
    """Driver that tells what is wrong with a controller before anything starts."""

    def examine(self, arm: ArmModel, host: str, scope: ExaminationScope) -> list[Finding]:
        """Look at a controller, and move and change nothing; what is wrong comes with a remedy."""


_Tier = TypeVar("_Tier")
#: tier -> what a driver without it cannot do
_TIER_WORDS: Mapping[object, str] = {
    SetpointDriver: "move it away from a touch",
    SliderDriver: "slow it down",
    HeartbeatDriver: "end a program where the network is cut",
    ProgramDriver: "move it for a program",
}


def load_driver(path: str) -> ArmDriver:
    """Import the driver that an ``ArmModel`` names.

    Raises:
        RobotRefused: it names nothing that can be imported.
    """
    module, _, name = path.partition(":")
    try:
        driver: ArmDriver = getattr(import_module(module), name)
    except Exception as exc:  # whatever somebody else's package raises
        raise RobotRefused(
            f"the arm's driver {path!r} cannot be loaded: {type(exc).__name__}: {exc}; its package names it as "
            '"module:object" in ArmModel.driver'
        ) from exc
    return driver


def require(driver: ArmDriver, tier: Callable[..., _Tier]) -> _Tier:
    """Return a driver as one of a further tier.

    Raises:
        RobotRefused: it is none.
    """
    assert isinstance(tier, type)
    if not isinstance(driver, tier):
        raise RobotRefused(
            f'this arm\'s driver cannot {_TIER_WORDS[tier]}; reaction = "stop" with control = "external" works'
        )
    return cast(_Tier, driver)
