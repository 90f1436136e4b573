"""RTDE connection to a controller: set-up with a time limit, then data without waiting; and the reader of its state.

Its users decide what is read and written: ``input_writers``, ``program_io``, ``model_check``. The wheel's receive
interface needs a thread, keeps the interpreter's lock while it connects and goes on returning old values for 2.5 s when
the controller freezes. The reader is one socket in the guard's own loop, and each state carries its time.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Sequence
from typing import Self

from coneskin.core.channel import wait_readable
from coneskin.core.errors import RobotConnectionError, RobotTimeout
from coneskin.robot.driver.tcp import TcpReader
from coneskin.robot.driver.values import ControllerState

from . import rtde_codec as rtde


class RtdeConnection(TcpReader):
    """One connection; open it in a ``with``, ask for variables, then ``start``.

    Raises:
        RobotConnectionError: the controller cannot be reached, or refuses.
        RobotTimeout: it does not answer.
    """

    port = 30004
    advice = (
        "check the address (arm.host), that the controller is on, that RTDE is enabled on it (Settings, Security, "
        "Services), and that it is in remote control"
    )

    def prepare(self) -> None:
        """Agree on the version of the protocol."""
        self._waiting: list[bytes] = []
        kind = rtde.PacketKind.PROTOCOL_VERSION
        if self._ask(rtde.pack(kind, struct.pack(">H", rtde.PROTOCOL_VERSION)), kind) != b"\x01":
            raise RobotConnectionError(f"{self.host}:{self.port} does not speak RTDE version {rtde.PROTOCOL_VERSION}")

    def split(self, data: bytes) -> tuple[list[bytes], bytes]:
        """Return the payloads of the data packets at the beginning of what was received, and what is left of it."""
        packets, rest = rtde.split(data)
        return [packet.payload for packet in packets if packet.kind is rtde.PacketKind.DATA], rest

    def ask_outputs(self, names: Sequence[str], frequency_hz: float = 500.0) -> rtde.Recipe:
        """Ask for variables that the controller sends at a frequency [Hz].

        Raises:
            RobotRefused: it does not know one of them.
        """
        return self._recipe(rtde.pack_outputs_request(names, frequency_hz), rtde.PacketKind.OUTPUTS, names)

    def ask_inputs(self, names: Sequence[str]) -> rtde.Recipe:
        """Ask for variables that the controller takes from here.

        Raises:
            RobotRefused: it does not know one of them, or another client has taken it.
        """
        return self._recipe(rtde.pack_inputs_request(names), rtde.PacketKind.INPUTS, names)

    def ask_version(self) -> tuple[int, int]:
        """Return major and minor version of the controller's software.

        Raises:
            RobotConnectionError, RobotTimeout: as of ``ask_outputs``.
        """
        kind = rtde.PacketKind.CONTROLLER_VERSION
        major, minor = struct.unpack_from(">2I", self._ask(rtde.pack(kind), kind).ljust(8, b"\0"))
        return major, minor

    def start(self) -> None:
        """Let the data flow; from now on nothing waits."""
        if self._ask(rtde.pack(rtde.PacketKind.START), rtde.PacketKind.START) != b"\x01":
            self.close()
            raise RobotConnectionError(f"{self.host}:{self.port} does not start its RTDE output")
        super().prepare()

    def read(self) -> list[bytes]:
        """Return the payloads that have arrived, those during the set-up included."""
        waiting, self._waiting = self._waiting, []
        return waiting + super().read()

    def wait_data(self, timeout: float) -> bytes:
        """Wait for a data packet, for a time at most [s], and return the payload of the newest one.

        Raises:
            RobotTimeout: none came.
            RobotConnectionError: the controller is gone.
        """
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0.0:
            if payloads := self.read():
                return payloads[-1]
            wait_readable([self], left)
        raise RobotTimeout(f"the controller {self.host} sent no state within {timeout:g} s")

    def send(self, recipe: rtde.Recipe, values: Sequence[rtde.Value]) -> bool:
        """Send inputs without waiting; return whether the system took the bytes."""
        return self.send_bytes(rtde.pack(rtde.PacketKind.DATA, recipe.pack(values)))

    def send_bytes(self, data: bytes) -> bool:
        """Send a packet without waiting; return whether the system took the bytes."""
        try:
            return self._sock is not None and self._sock.send(data) == len(data)
        except OSError:
            return False

    def _recipe(self, request: bytes, kind: rtde.PacketKind, names: Sequence[str]) -> rtde.Recipe:
        reply = self._ask(request, kind)
        try:
            return rtde.unpack_types(reply, names)
        except BaseException:
            self.close()
            raise

    def _ask(self, request: bytes, kind: rtde.PacketKind) -> bytes:
        """Send a request and wait for the reply of its kind; close the connection where that fails."""
        assert self._sock is not None
        end = time.monotonic() + self._timeout
        try:
            self._sock.sendall(request)
            reply: bytes | None = None
            while reply is None:
                if time.monotonic() >= end:
                    raise TimeoutError
                data = self._sock.recv(1 << 16)
                if not data:
                    raise RobotConnectionError(
                        f"the controller {self.host}:{self.port} has closed the connection during set-up, so perhaps "
                        f"something else answers there; {self.advice}"
                    )
                packets, self._rest = rtde.split(self._rest + data)
                for packet in packets:
                    if packet.kind is kind and reply is None:
                        reply = packet.payload
                    elif packet.kind is rtde.PacketKind.DATA:
                        self._waiting.append(packet.payload)
        except TimeoutError as exc:
            self.close()
            raise self._silent() from exc
        except OSError as exc:
            self.close()
            if isinstance(exc, RobotConnectionError):
                raise
            raise RobotConnectionError(
                f"the controller {self.host}:{self.port} is gone: {exc.strerror or exc}; {self.advice}"
            ) from exc
        return reply


class StateReader(RtdeConnection):
    """Reader of the controller's state; open it in a ``with``, which raises as `RtdeConnection` says."""

    def __enter__(self) -> Self:
        super().__enter__()
        self._ask_for()
        self.start()
        return self

    def wait(self, timeout: float) -> ControllerState:
        """Wait for the next state, for scripts and set-up; the guard's loop uses ``fileno`` and ``read``.

        Raises:
            RobotTimeout: none came within the timeout [s].
            RobotConnectionError: the controller is gone.
        """
        return rtde.decode_state(time.monotonic(), self.wait_data(timeout))

    def _ask_for(self) -> None:
        """Ask for the variables before the data flows."""
        self.ask_outputs(rtde.STATE_RECIPE.names)
