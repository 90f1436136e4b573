"""A small RTDE reader of our own: what the arm really does, 500 times a second, without the wheel.

The wheel's receive interface needs a thread, keeps the interpreter's lock while it connects and goes on returning old
values for 2.5 s when the controller freezes. This reader is one socket in the guard's own loop; whoever holds its
newest state also knows how old it is.
"""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable
from typing import NamedTuple

from coneskin.errors import RobotConnectionError, RobotTimeout

from . import rtde_codec as rtde
from .ur_models import Joints

__all__ = ["RECIPE", "ControllerState", "StateReader", "decode_state"]

PORT = 30004
_NAMES = ("timestamp", "actual_q", "actual_qd", "robot_mode", "safety_status_bits", "runtime_state")
#: what the reader asks for
RECIPE = rtde.Recipe(_NAMES)
_SAFETY_STOPS = 0b11111110100  # protective, safeguard, emergency, violation, fault, stopped: bits 2 and 4 to 10
_PLAYING = 2
_ROBOT_RUNNING = 7


class ControllerState(NamedTuple):
    """One sample of the controller.

    Attributes:
        time: host time at which it was read [s].
        controller_time: the controller's own clock [s].
        q: measured joint positions [rad].
        qd: measured joint speeds [rad/s].
        robot_mode: 7 where the arm is powered and its brakes are released.
        safety_bits: RTDE safety_status_bits; bit 0 normal, bit 2 protective stop, bit 7 emergency stop.
        runtime_state: 2 while a program plays.
    """

    time: float
    controller_time: float
    q: Joints
    qd: Joints
    robot_mode: int
    safety_bits: int
    runtime_state: int

    @property
    def speed(self) -> float:
        """Largest joint speed [rad/s], without sign."""
        return max(map(abs, self.qd))

    @property
    def stopped_by_safety(self) -> bool:
        """Whether the controller's own safety system holds the arm: a protective stop or worse."""
        return bool(self.safety_bits & _SAFETY_STOPS)

    @property
    def running(self) -> bool:
        """Whether the arm is powered with its brakes released."""
        return self.robot_mode == _ROBOT_RUNNING

    @property
    def playing(self) -> bool:
        """Whether a program plays on the controller."""
        return self.runtime_state == _PLAYING


def decode_state(time: float, payload: bytes) -> ControllerState:
    """The state in the payload of an RTDE data packet of this reader's recipe.

    Args:
        time: host time [s].
        payload: recipe id and values.

    Raises:
        RobotConnectionError: the payload has another length.
    """
    return ControllerState(time, *RECIPE.unpack(payload))  # type: ignore[arg-type]


class StateReader:
    """Reads the controller's state; open it in a ``with``.

    Args:
        host: the controller.
        timeout: how long connecting and each reply may take [s].
        clock: monotonic seconds.

    Raises:
        RobotConnectionError: on entering, where the controller cannot be reached or refuses.
        RobotTimeout: on entering, where it does not answer.
    """

    def __init__(self, host: str, timeout: float = 2.0, clock: Callable[[], float] = time.monotonic) -> None:
        self.host = host
        self._timeout = timeout
        self._clock = clock
        self._sock: socket.socket | None = None
        self._rest = b""

    def __enter__(self) -> StateReader:
        try:
            self._sock = socket.create_connection((self.host, PORT), self._timeout)
            self._sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            accepted = self._ask(rtde.pack_version_request(), rtde.PacketKind.PROTOCOL_VERSION)
            if accepted != b"\x01":
                raise RobotConnectionError(f"{self.host} does not speak RTDE version {rtde.PROTOCOL_VERSION}")
            rtde.unpack_types(self._ask(rtde.pack_outputs_request(_NAMES), rtde.PacketKind.OUTPUTS), _NAMES)
            if self._ask(rtde.pack_start_request(), rtde.PacketKind.START) != b"\x01":
                raise RobotConnectionError(f"{self.host} does not start its RTDE output")
            self._sock.setblocking(False)
        except TimeoutError as exc:
            self.close()
            raise RobotTimeout(
                f"no answer from the controller {self.host}:{PORT} within {self._timeout:g} s: "
                "is it on, and RTDE enabled?"
            ) from exc
        except OSError as exc:
            self.close()
            if isinstance(exc, RobotConnectionError):
                raise
            raise RobotConnectionError(
                f"cannot reach the controller {self.host}:{PORT}: {exc.strerror or exc}"
            ) from exc
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection; may be called again."""
        if self._sock is not None:
            self._sock.close()
            self._sock = None

    def fileno(self) -> int:
        """The descriptor, for select and poll; -1 when closed."""
        return -1 if self._sock is None else self._sock.fileno()

    def read(self) -> list[bytes]:
        """Payloads of the data packets that have arrived, oldest first, for ``decode_state``. Never waits.

        Raises:
            RobotConnectionError: the controller has closed the connection.
        """
        if self._sock is None:
            raise RobotConnectionError(f"the connection to the controller {self.host} is not open")
        try:
            data = self._sock.recv(1 << 16)
        except BlockingIOError:
            return []
        except OSError as exc:
            raise RobotConnectionError(f"the controller {self.host} is gone: {exc.strerror or exc}") from exc
        if not data:
            raise RobotConnectionError(f"the controller {self.host} has closed the connection")
        packets, self._rest = rtde.split(self._rest + data)
        return [packet.payload for packet in packets if packet.kind is rtde.PacketKind.DATA]

    def wait(self, timeout: float) -> ControllerState:
        """Wait for the next state, for scripts and set-up; the guard's loop uses ``fileno`` and ``read``.

        Raises:
            RobotTimeout: none came within the timeout [s].
            RobotConnectionError: the controller is gone.
        """
        end = self._clock() + timeout
        while (left := end - self._clock()) > 0.0:
            if select.select([self], [], [], left)[0] and (payloads := self.read()):
                return decode_state(self._clock(), payloads[-1])
        raise RobotTimeout(f"the controller {self.host} sent no state within {timeout:g} s")

    def _ask(self, request: bytes, kind: rtde.PacketKind) -> bytes:
        assert self._sock is not None
        self._sock.sendall(request)
        end = self._clock() + self._timeout
        while self._clock() < end:
            data = self._sock.recv(1 << 16)
            if not data:
                raise RobotConnectionError(f"the controller {self.host} has closed the connection during set-up")
            packets, self._rest = rtde.split(self._rest + data)
            for packet in packets:
                if packet.kind is kind:
                    return packet.payload
        raise TimeoutError
