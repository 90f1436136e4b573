"""Heartbeat of the guard in a register of the controller, and the lines with which a program depends on it.

The guard writes a count; a program that has the lines is ended by the controller's own watchdog where the count stays
away, so it needs no packet to be stopped: the network may be cut. The program writes the count that it found at its
start to an output register, which is how the guard knows that this program, and not one before it, has the lines.
Source: UR script manual, rtde_set_watchdog, read_input_integer_register, write_output_integer_register.
"""

from __future__ import annotations

from . import rtde_codec as rtde
from .rtde_connection import RtdeConnection

__all__ = ["HEARTBEAT_INPUTS", "HeartbeatRegisters", "decode_echo", "heartbeat_lines"]

_HEARTBEAT_REGISTER = 46  # of both registers; 47 and the doubles from 40 on belong to the setpoints
#: the controller's name of the register that is written
HEARTBEAT_INPUTS = (f"input_int_register_{_HEARTBEAT_REGISTER}",)
_HEARTBEAT_OUTPUTS = (f"output_int_register_{_HEARTBEAT_REGISTER}",)
_HEARTBEAT_FREQUENCY = 50.0  # Hz of the echo
_HEARTBEAT_RECIPE = rtde.Recipe(_HEARTBEAT_OUTPUTS)


def heartbeat_lines(frequency: float) -> str:
    """Return the lines of URScript that go to the beginning of a program.

    Args:
        frequency: the program is ended where no count comes for 1 / frequency [Hz].
    """
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


class HeartbeatRegisters(RtdeConnection):
    """Connection that writes the count and reads the echo without waiting; open it in a ``with``.

    Raises:
        RobotConnectionError: on entering, where the controller cannot be reached.
        RobotRefused: on entering, where another client has taken the register.
        RobotTimeout: on entering, where the controller does not answer.
    """

    _in = rtde.Recipe(HEARTBEAT_INPUTS)

    def __enter__(self) -> HeartbeatRegisters:
        super().__enter__()
        self._in = self.claim("the heartbeat's register", _HEARTBEAT_OUTPUTS, HEARTBEAT_INPUTS, _HEARTBEAT_FREQUENCY)
        return self

    def write(self, count: int) -> bool:
        """Send a count without waiting; return whether the system took the bytes."""
        return self.send(self._in, (count,))
