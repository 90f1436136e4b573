"""The controller's speed slider, over an RTDE connection of our own. Opened only where a scene has a slow reaction.

RTDE gives each input to one client. Whoever opens ur_rtde's RTDEIOInterface beside it gets "in use", and the other way
round; so a scene that does not slow leaves the slider alone.
"""

from __future__ import annotations

import socket
from collections.abc import Sequence

from coneskin.errors import RobotConnectionError, RobotRefused, RobotTimeout

from . import rtde_codec as rtde

__all__ = ["SpeedSlider", "decode_fraction"]

PORT = 30004
_OUTPUT = ("target_speed_fraction",)
_INPUT = ("speed_slider_mask", "speed_slider_fraction")
_HZ = 50.0  # enough to know where a person has put it
_OUT = rtde.Recipe(_OUTPUT)


def decode_fraction(payload: bytes) -> float:
    """Where the slider is, 0..1, from the payload of a data packet of ``SpeedSlider.read``.

    Raises:
        RobotConnectionError: the payload has another length.
    """
    (fraction,) = _OUT.unpack(payload)
    assert isinstance(fraction, float)
    return fraction


class SpeedSlider:
    """Reads and sets the slider without waiting; open it in a ``with``.

    Args:
        host: the controller.
        timeout: how long connecting and each reply may take [s].

    Raises:
        RobotConnectionError: on entering, where the controller cannot be reached.
        RobotRefused: on entering, where another client owns the slider.
        RobotTimeout: on entering, where the controller does not answer.
    """

    def __init__(self, host: str, timeout: float = 2.0) -> None:
        self.host = host
        self._timeout = timeout
        self._sock: socket.socket | None = None
        self._rest = b""
        self._in = rtde.Recipe(_INPUT)

    def __enter__(self) -> SpeedSlider:
        try:
            self._sock = socket.create_connection((self.host, PORT), self._timeout)
            self._sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if self._ask(rtde.pack_version_request(), rtde.PacketKind.PROTOCOL_VERSION) != b"\x01":
                raise RobotConnectionError(f"{self.host} does not speak RTDE version {rtde.PROTOCOL_VERSION}")
            self._set_up(rtde.pack_outputs_request(_OUTPUT, _HZ), rtde.PacketKind.OUTPUTS, _OUTPUT)
            self._in = self._set_up(rtde.pack_inputs_request(_INPUT), rtde.PacketKind.INPUTS, _INPUT)
            if self._ask(rtde.pack_start_request(), rtde.PacketKind.START) != b"\x01":
                raise RobotConnectionError(f"{self.host} does not start its RTDE output")
            self._sock.setblocking(False)
        except TimeoutError as exc:
            self.close()
            raise RobotTimeout(f"no answer from {self.host}:{PORT} about its speed slider") from exc
        except OSError as exc:
            self.close()
            if isinstance(exc, RobotConnectionError):
                raise
            raise RobotConnectionError(f"cannot reach {self.host}:{PORT}: {exc.strerror or exc}") from exc
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection; the slider stays where it is. May be called again."""
        if self._sock is not None:
            self._sock.close()
            self._sock = None

    def fileno(self) -> int:
        """The descriptor, for select; -1 when closed."""
        return -1 if self._sock is None else self._sock.fileno()

    def read(self) -> list[bytes]:
        """Payloads of the data packets that have arrived, for ``decode_fraction``. Never waits.

        Raises:
            RobotConnectionError: the controller has closed the connection.
        """
        gone = f"the controller {self.host} has closed the connection of its speed slider"
        if self._sock is None:
            raise RobotConnectionError(gone)
        try:
            data = self._sock.recv(1 << 14)
        except BlockingIOError:
            return []
        except OSError as exc:
            raise RobotConnectionError(gone) from exc
        if not data:
            raise RobotConnectionError(gone)
        packets, self._rest = rtde.split(self._rest + data)
        return [packet.payload for packet in packets if packet.kind is rtde.PacketKind.DATA]

    def set(self, fraction: float) -> bool:
        """Send the slider to a fraction, without waiting; whether the system took the bytes."""
        data = rtde.pack(rtde.PacketKind.DATA, self._in.pack((1, fraction)))
        try:
            return self._sock is not None and self._sock.send(data) == len(data)
        except OSError:
            return False

    def _set_up(self, request: bytes, kind: rtde.PacketKind, names: Sequence[str]) -> rtde.Recipe:
        try:
            return rtde.unpack_types(self._ask(request, kind), names)
        except RobotRefused as exc:
            raise RobotRefused(f"a slow reaction needs the speed slider of {self.host}: {exc}") from exc

    def _ask(self, request: bytes, kind: rtde.PacketKind) -> bytes:
        assert self._sock is not None
        self._sock.sendall(request)
        while True:  # each read has the socket's own timeout, and the controller is not talking yet
            data = self._sock.recv(1 << 14)
            if not data:
                raise RobotConnectionError(f"the controller {self.host} has closed the connection during set-up")
            packets, self._rest = rtde.split(self._rest + data)
            for packet in packets:
                if packet.kind is kind:
                    return packet.payload
