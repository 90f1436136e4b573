"""Output writer: digital and analog outputs and the registers for users, over an RTDE connection of its own.

The wheel's IO interface takes the speed slider as well, which is a stop path of the guard; this one does not.
"""

from __future__ import annotations

import threading
from typing import Self

from coneskin.core.channel import wait_readable
from coneskin.core.errors import RobotConnectionError, RobotRefused
from coneskin.robot.driver.arm_reading import DIGITAL_GROUPS

from . import rtde_codec as rtde
from .rtde_connection import RtdeConnection

__all__ = ["RtdeOutputWriter"]

_ANALOG_WORDS = ("mask", "type", "0", "1")
_ANALOG_TYPES = {"current": 0, "voltage": 1}
_USER_REGISTERS = (*range(18, 23), *range(42, 47))  # those that ur_rtde leaves to users


class RtdeOutputWriter:
    """Writer of outputs; open it in a ``with``. Any thread may write.

    Args:
        host: the controller.
        timeout: how long connecting and each reply may take [s].

    Raises:
        RobotConnectionError: on entering, where the controller cannot be reached.
        RobotTimeout: on entering, where it does not answer.
    """

    def __init__(self, host: str, timeout: float = 2.0) -> None:
        self._host, self._timeout = host, timeout
        self._lock = threading.Lock()
        self._connection: RtdeConnection | None = None
        self._recipes: dict[tuple[str, ...], rtde.Recipe] = {}

    def __enter__(self) -> Self:
        self._open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection; may be called again."""
        with self._lock:
            if self._connection is not None:
                self._connection.close()
                self._connection = None

    def set_digital(self, group: str, number: int, on: bool) -> None:
        """Switch a digital output.

        Args:
            group: "standard", "configurable" or "tool".
            number: from 0.
            on: True for high.

        Raises:
            ValueError: there is no such output.
            RobotRefused: another client has taken the outputs.
            RobotConnectionError, RobotTimeout: the controller is gone.
        """
        if not 0 <= number < (count := DIGITAL_GROUPS.get(group, (0, 0))[1]):
            raise ValueError(f"{group} digital outputs have numbers from 0 to {count - 1}, got {number}")
        bit = 1 << number
        self._write((f"{group}_digital_output_mask", f"{group}_digital_output"), (bit, bit if on else 0))

    def set_analog(self, number: int, ratio: float, kind: str = "voltage") -> None:
        """Set an analog output.

        Args:
            number: 0 or 1.
            ratio: of its range, 0 to 1.
            kind: "voltage" (0 to 10 V) or "current" (4 to 20 mA).

        Raises:
            ValueError: there is no such output, or the ratio or the kind cannot be.
            RobotRefused, RobotConnectionError, RobotTimeout: as ``set_digital``.
        """
        if number not in (0, 1) or not 0.0 <= ratio <= 1.0 or kind not in _ANALOG_TYPES:
            raise ValueError(
                "an analog output has the number 0 or 1, a ratio from 0 to 1 and the kind voltage or current, got "
                f"{number}, {ratio}, {kind!r}"
            )
        bit = 1 << number
        values = (bit, _ANALOG_TYPES[kind] * bit, ratio if number == 0 else 0.0, ratio if number == 1 else 0.0)
        names = tuple(f"standard_analog_output_{word}" for word in _ANALOG_WORDS)
        self._write(names, values)

    def set_register(self, number: int, value: int | float) -> None:
        """Write an input register that programs on the controller read: an integer one, or one for a float.

        Args:
            number: 18 to 22 or 42 to 46; the others belong to ur_rtde and to this guard.
            value: an int of 32 bits, or a float.

        Raises:
            ValueError: it is not one of these registers, or does not hold the value.
            RobotRefused, RobotConnectionError, RobotTimeout: as ``set_digital``.
        """
        if number not in _USER_REGISTERS:
            raise ValueError(f"a register for users has the number 18 to 22 or 42 to 46, got {number}")
        kind = "int" if isinstance(value, int) else "double"
        self._write((f"input_{kind}_register_{number}",), (value,))

    def _open(self) -> RtdeConnection:
        connection = RtdeConnection(self._host, self._timeout)
        connection.__enter__()
        self._connection, self._recipes = connection, {}
        return connection

    def _write(self, names: tuple[str, ...], values: tuple[float, ...]) -> None:
        """Send one packet, over a new connection where the old one has ended."""
        with self._lock:
            connection = self._connection
            if connection is None or wait_readable([connection], 0.0):  # its end: nothing else comes unasked
                if connection is not None:
                    connection.close()
                connection = self._open()
            if names not in self._recipes:
                try:
                    self._recipes[names] = connection.ask_inputs(names)
                except RobotRefused as exc:
                    self._connection = None
                    raise RobotRefused(
                        f"outputs of {self._host} cannot be set: {exc}; end that client, such as an RTDEIOInterface"
                    ) from exc
            if not connection.send(self._recipes[names], values):
                raise RobotConnectionError(f"the controller {self._host} does not take outputs any more")
