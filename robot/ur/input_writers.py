"""Inputs of the controller that the guard writes: joint velocity setpoints, the speed slider, and its heartbeat.

RTDE gives each input to one client. The guard refuses to start where another client has taken one that the scene needs;
a scene can leave the slider to the program (``arm.slider_stop``).

Setpoints go to a program on the controller, which moves an arm that another program moves otherwise. They come in every
second control cycle. Each motion has a token of its own: the program ends where the register holds another one, so that
setpoints left from before move nothing. Where the guard falls silent, the controller's own watchdog ends the program,
and the arm brakes.

The heartbeat is a count. A program that has the lines of `heartbeat_lines` is ended by the controller's own watchdog
where the count stays away, so it needs no packet to be stopped: the network may be cut. The program writes the count
that it found at its start to an output register, which is how the guard knows that this program, and not one before it,
has the lines.

Source: UR script manual, rtde_set_watchdog, read_input_float_register, read_input_integer_register,
write_output_integer_register, speedj.
"""

from __future__ import annotations

from typing import ClassVar, Self

from coneskin.core.errors import ConeSkinError, RobotConnectionError, RobotRefused
from coneskin.robot.arm.models import ZERO_VELOCITY
from coneskin.robot.driver.values import JointVelocitySetpoint, SetpointProgram

from . import rtde_codec as rtde
from .rtde_connection import RtdeConnection, StateReader

_OUTPUT_FREQUENCY = 50.0  # Hz; enough to know where a person has put the slider

# All registers are of the half that is for clients of RTDE; ur_rtde uses the other half by default.
_SPEED_REGISTERS = range(40, 46)  # double registers of the six joint speeds
_ACCELERATION_REGISTER = 46  # double register
_TOKEN_REGISTER = 47  # integer register
#: the controller's names of the registers, in the order of ``_register_values``
SETPOINT_INPUTS = (
    f"input_int_register_{_TOKEN_REGISTER}",
    *(f"input_double_register_{number}" for number in (*_SPEED_REGISTERS, _ACCELERATION_REGISTER)),
)


def _register_values(setpoint: JointVelocitySetpoint) -> tuple[int | float, ...]:
    """Return what to write to ``SETPOINT_INPUTS`` for a setpoint."""
    return (setpoint.token, *setpoint.qd, setpoint.acceleration)


def program_text(program: SetpointProgram) -> str:
    """Return the URScript of the program that follows setpoints."""
    speeds = ", ".join(f"read_input_float_register({number})" for number in _SPEED_REGISTERS)
    return (
        "def coneskin_follow():\n"
        f'  rtde_set_watchdog("{SETPOINT_INPUTS[0]}", {program.watchdog_hz:g}, "stop")\n'
        f"  while read_input_integer_register({_TOKEN_REGISTER}) == {program.token}:\n"
        f"    speedj([{speeds}], read_input_float_register({_ACCELERATION_REGISTER}), 0.002)\n"
        "  end\n"
        f"  stopj({program.deceleration:.3f})\n"
        "end\n"
    )


class RegisterWriter(StateReader):
    """Reader of states and writer of setpoints; open it in a ``with``.

    Raises:
        RobotRefused: on entering, where another client has taken one of the registers.
    """

    _in = rtde.Recipe(SETPOINT_INPUTS)

    def __enter__(self) -> Self:
        super().__enter__()
        self.write(JointVelocitySetpoint(0, ZERO_VELOCITY, 0.0))  # voids what an earlier guard has left
        return self

    def write(self, setpoint: JointVelocitySetpoint) -> bool:
        """Send a setpoint without waiting; return whether the system took the bytes."""
        return self.send(self._in, _register_values(setpoint))

    def _ask_for(self) -> None:
        super()._ask_for()
        try:
            self._in = self.ask_inputs(SETPOINT_INPUTS)
        except RobotRefused as exc:
            raise RobotRefused(
                f"to move an arm that another program moves, the guard needs registers of {self.host}: {exc}; "
                "let that client use others, or let the arm only stop (reaction.kind)"
            ) from exc


class _InputOwner(RtdeConnection):
    """Connection that owns inputs of the controller and reads outputs that go with them; open it in a ``with``.

    Raises:
        RobotRefused: on entering, where another client has taken one of the inputs; all else as `RtdeConnection`.
    """

    _what: ClassVar[str]  # for people
    _outputs: ClassVar[tuple[str, ...]]
    _inputs: ClassVar[tuple[str, ...]]
    _recipe_in: rtde.Recipe

    def __enter__(self) -> Self:
        super().__enter__()
        try:
            self.ask_outputs(self._outputs, _OUTPUT_FREQUENCY)
            self._recipe_in = self._ask_inputs()
        except RobotRefused as exc:
            raise RobotRefused(f"the guard cannot have {self._what} of {self.host}: {exc}") from exc
        self.start()
        return self

    def _ask_inputs(self) -> rtde.Recipe:
        return self.ask_inputs(self._inputs)


_SLIDER_OUTPUTS = ("target_speed_fraction",)
#: the controller's names of what is written
SLIDER_INPUTS = ("speed_slider_mask", "speed_slider_fraction")
_SLIDER_RECIPE = rtde.Recipe(_SLIDER_OUTPUTS)


def decode_fraction(payload: bytes) -> float:
    """Return the position of the slider, 0..1, in the payload of a data packet of ``RtdeSpeedSlider.read``.

    Raises:
        RobotConnectionError: the payload has another length, or the position is not from 0 to 1.
    """
    (fraction,) = _SLIDER_RECIPE.unpack(payload)
    assert isinstance(fraction, float)
    if not 0.0 <= fraction <= 1.0:
        raise RobotConnectionError(f"target_speed_fraction must be from 0 to 1, got {fraction!r}")
    return fraction


class RtdeSpeedSlider(_InputOwner):
    """Connection that reads and sets the slider without waiting; its ``with`` raises as `_InputOwner` says.

    Args:
        host: the controller.
        timeout: as of `_InputOwner`.
        claim: take the slider at once. Otherwise it is only looked whether it is free, and taken by the first ``set``;
            a program may have it until then. It is free again once the connection is closed.
    """

    _what, _outputs, _inputs = "the speed slider", _SLIDER_OUTPUTS, SLIDER_INPUTS

    def __init__(self, host: str, timeout: float = 2.0, *, claim: bool = True) -> None:
        super().__init__(host, timeout)
        self._claimed = claim

    def __enter__(self) -> Self:
        if not self._claimed:
            with RtdeSpeedSlider(self.host, self._timeout):
                pass
        return super().__enter__()

    def _ask_inputs(self) -> rtde.Recipe:
        return super()._ask_inputs() if self._claimed else rtde.Recipe(SLIDER_INPUTS, 1)  # the first of a connection

    def set(self, fraction: float) -> bool:
        """Set the slider to a fraction without waiting; return whether the system took the bytes."""
        if not self._claimed:  # the answer comes among the data, where nobody looks at it: the slider itself is read
            self._claimed = self.send_bytes(rtde.pack_inputs_request(SLIDER_INPUTS))
        return self._claimed and self.send(self._recipe_in, (1, fraction))


def set_slider(host: str, fraction: float, timeout: float) -> bool:
    """Set the slider to a fraction over a new connection that is closed again; the controller keeps the value.

    Args:
        fraction: from 0 to 1.
        timeout: how long connecting and each reply may take [s].

    Returns:
        whether the system took the bytes; False where another client has taken the slider.
    """
    try:
        with RtdeConnection(host, timeout) as connection:
            return connection.send(connection.ask_inputs(SLIDER_INPUTS), (1, fraction))
    except ConeSkinError:
        return False


_HEARTBEAT_REGISTER = 46  # of both registers; 47 and the doubles from 40 on belong to the setpoints
#: the controller's name of the register that is written
HEARTBEAT_INPUTS = (f"input_int_register_{_HEARTBEAT_REGISTER}",)
_HEARTBEAT_OUTPUTS = (f"output_int_register_{_HEARTBEAT_REGISTER}",)
_HEARTBEAT_RECIPE = rtde.Recipe(_HEARTBEAT_OUTPUTS)


def heartbeat_lines(frequency: float) -> str:
    """Return the lines with which a program begins, which is ended where no count comes for 1 / frequency [Hz]."""
    return (
        f'rtde_set_watchdog("{HEARTBEAT_INPUTS[0]}", {frequency:g}, "stop")\n'
        f"write_output_integer_register({_HEARTBEAT_REGISTER}, read_input_integer_register({_HEARTBEAT_REGISTER}))\n"
    )


def decode_echo(payload: bytes) -> int:
    """Return the count that the newest program with the lines found at its start.

    Raises:
        RobotConnectionError: the payload has another length.
    """
    (count,) = _HEARTBEAT_RECIPE.unpack(payload)
    assert isinstance(count, int)
    return count


class HeartbeatRegisters(_InputOwner):
    """Connection that writes the count and reads the echo without waiting; ``with`` raises as `_InputOwner` says."""

    _what, _outputs, _inputs = "the heartbeat's register", _HEARTBEAT_OUTPUTS, HEARTBEAT_INPUTS

    def write(self, count: int) -> bool:
        """Send a count without waiting; return whether the system took the bytes."""
        return self.send(self._recipe_in, (count,))
