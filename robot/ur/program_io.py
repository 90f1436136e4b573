"""Reader of any RTDE output and writer of outputs and registers, for the program that is guarded and not for the guard.

A thread keeps the newest packet; nothing is decoded before somebody asks. Unlike the wheel's receive interface the
reader never returns an old value: it waits for a new one, and raises where none comes. The wheel's IO interface takes
the speed slider as well, which is a stop path of the guard; the writer does not.
"""

from __future__ import annotations

import threading
import time
from enum import IntEnum
from typing import Any, Self

from coneskin.core.channel import wait_readable
from coneskin.core.errors import ConeSkinError, RobotConnectionError, RobotRefused, RobotTimeout
from coneskin.robot.driver.values import DIGITAL_GROUPS, ArmReading

from . import rtde_codec as rtde
from .rtde_codec import PROGRAM_RUNNING, VARIABLES, RobotMode, SafetyMode
from .rtde_connection import RtdeConnection

_READING_NAMES = (
    *("timestamp", "actual_q", "actual_qd", "actual_TCP_pose", "actual_TCP_speed", "actual_TCP_force"),
    *("robot_mode", "safety_mode", "target_speed_fraction", "runtime_state"),
    *("actual_digital_input_bits", "actual_digital_output_bits"),
    *("standard_analog_input0", "standard_analog_input1", "tool_analog_input0", "tool_analog_input1"),
    *("standard_analog_output0", "standard_analog_output1"),
)
_USUAL_NAMES = (*_READING_NAMES, "safety_status_bits", "robot_status_bits", "target_q", "target_qd", "speed_scaling")
_FRESH_TIME = 0.1  # s; an older packet is waited out
_POLL_PERIOD = 0.1  # s in which the thread notices that it is to end


class RtdeVariableReader:
    """Reader of the newest value of any variable; open it in a ``with``. Any thread may ask.

    Args:
        timeout: how long connecting, each reply and a fresh value may take [s].

    Raises:
        RobotConnectionError: on entering, where the controller cannot be reached.
        RobotTimeout: on entering, where it does not answer.
    """

    def __init__(self, host: str, timeout: float = 2.0) -> None:
        self._host, self._timeout = host, timeout
        self._asking = threading.Lock()  # one thread opens the connection anew
        self._news = threading.Condition()
        self._connection: RtdeConnection | None = None
        self._recipe = rtde.Recipe(_USUAL_NAMES)
        self._thread: threading.Thread | None = None
        self._newest: tuple[float, rtde.Recipe, bytes] | None = None  # when it was read
        self._error: ConeSkinError | None = None
        self._closing = False

    def __enter__(self) -> Self:
        self._open(_USUAL_NAMES)
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection; may be called again."""
        with self._asking:
            self._end()

    def value(self, name: str) -> rtde.Value:
        """Return the newest value of a variable; a vector is a tuple.

        Args:
            name: as Universal Robots' RTDE guide has it. One that was not asked for before takes some 10 ms.

        Raises:
            RobotRefused: the controller has no such variable.
            RobotTimeout: it sends nothing.
            RobotConnectionError: it is gone.
        """
        if name not in VARIABLES:
            raise RobotRefused(f"RTDE has no variable named {name}")
        return self._values(name)[name]

    def reading(self) -> ArmReading:
        """Return what the controller says at one moment.

        Raises:
            RobotTimeout, RobotConnectionError: as ``value``.
        """
        newest = self._values()
        values: list[Any] = [newest[name] for name in _READING_NAMES]
        values[6:8] = _name(RobotMode, values[6]), _name(SafetyMode, values[7])
        values[9] = values[9] == PROGRAM_RUNNING
        return ArmReading._make((*values[:12], tuple(values[12:16]), tuple(values[16:])))

    def _values(self, *wanted: str) -> dict[str, rtde.Value]:
        """Return the newest values, over a new connection where the present one does not bring what is wanted."""
        with self._asking:
            names = self._recipe.names
            if self._thread is None or not set(wanted) <= set(names):
                self._end()
                self._open((*names, *(name for name in wanted if name not in names)))
        recipe, payload = self._fresh()
        return dict(zip(recipe.names, recipe.unpack(payload), strict=True))

    def _open(self, names: tuple[str, ...]) -> None:
        connection = RtdeConnection(self._host, self._timeout)
        connection.__enter__()
        try:
            self._recipe = connection.ask_outputs(names)
            connection.start()
        except BaseException:
            connection.close()
            raise
        self._connection, self._newest, self._error, self._closing = connection, None, None, False
        self._thread = threading.Thread(
            target=self._run, args=(connection, self._recipe), name="coneskin states", daemon=True
        )
        self._thread.start()

    def _end(self) -> None:
        self._closing = True
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _run(self, connection: RtdeConnection, recipe: rtde.Recipe) -> None:
        try:
            while not self._closing:
                wait_readable([connection], _POLL_PERIOD)
                if payloads := connection.read():
                    with self._news:
                        self._newest = (time.monotonic(), recipe, payloads[-1])
                        self._news.notify_all()
        except ConeSkinError as exc:
            with self._news:
                self._error = exc
                self._news.notify_all()

    def _fresh(self) -> tuple[rtde.Recipe, bytes]:
        """Return the newest payload, which is not old; wait for it where need be."""
        end = time.monotonic() + self._timeout
        with self._news:
            while self._newest is None or time.monotonic() - self._newest[0] > _FRESH_TIME:
                if self._error is not None:
                    self._thread = None  # the next question opens the connection anew
                    raise RobotConnectionError(f"the state of the arm cannot be read: {self._error}") from self._error
                left = end - time.monotonic()
                if left <= 0.0:
                    raise RobotTimeout(f"the controller {self._host} has sent no state for {self._timeout:g} s")
                self._news.wait(left)
            return self._newest[1:]


def _name(modes: type[IntEnum], number: int) -> str:
    return modes(number).name if number in modes._value2member_map_ else str(number)


_ANALOG_WORDS = ("mask", "type", "0", "1")
_ANALOG_TYPES = {"current": 0, "voltage": 1}
_USER_REGISTERS = (*range(18, 23), *range(42, 47))  # those that ur_rtde leaves to users


class RtdeOutputWriter:
    """Writer of outputs; open it in a ``with``, which raises as `RtdeVariableReader` says. Any thread may write."""

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
