"""Ways to stop whatever moves the arm, without ur_rtde: sockets of our own, opened before they are needed.

A program sent to the controller's script port replaces the one that runs, whoever started it. Source: UR script
manual; which of these stops which motion was measured in a simulation (docs/safety.md).
"""

from __future__ import annotations

import socket
from contextlib import suppress

from coneskin.errors import RobotConnectionError

from .stop_watch import Way

__all__ = ["ForeignStops"]

_REOPENING = 0.2  # s for each port: a stop by another one waits meanwhile
_PORTS = {"script": 30003, "dashboard": 29999}


class ForeignStops:
    """Two sockets and the three stops that go through them; open it in a ``with``.

    Args:
        host: the controller.
        timeout: how long connecting may take [s].

    Raises:
        RobotConnectionError: on entering, where a port does not answer.
    """

    def __init__(self, host: str, timeout: float = 2.0) -> None:
        self.host = host
        self._timeout = timeout
        self._open_ones: dict[str, socket.socket] = {}

    def __enter__(self) -> ForeignStops:
        try:
            for name, port in _PORTS.items():
                self._open_ones[name] = self._open(port)
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close both; may be called again."""
        for sock in self._open_ones.values():
            sock.close()
        self._open_ones = {}

    def sockets(self) -> dict[str, socket.socket]:
        """Those that are open, by name: "script" and "dashboard". The controller talks on both: ``drain`` them."""
        return dict(self._open_ones)

    def drain(self) -> list[tuple[str, socket.socket]]:
        """Throw away what the controller has said, at most 64 kB a call and socket. Never waits.

        Returns:
            the sockets that are of no use any more, for the caller to close: the controller has closed them, or the
            system could not take a whole program, so that the next one would not be understood.
        """
        gone = []
        for name, sock in self._open_ones.items():
            try:
                if sock.recv(1 << 16):
                    continue
            except BlockingIOError:
                continue
            except OSError:
                pass
            gone.append((name, sock))
        for name, _ in gone:
            del self._open_ones[name]
        return gone

    def use(self, way: Way, deceleration: float) -> bool:
        """Send one stop, without waiting.

        Args:
            way: SCRIPT, DASHBOARD or PROTECTIVE.
            deceleration: of the leading joint [rad/s2], for SCRIPT.

        Returns:
            whether the system took the bytes; what the arm does is measured, not assumed.
        """
        if way is Way.DASHBOARD:
            return self._send("dashboard", b"stop\n")
        call = "protective_stop()" if way is Way.PROTECTIVE else f"stopj({deceleration:.3f})"
        return self.run(f"def coneskin_stop():\n  {call}\nend\n")

    def run(self, program: str) -> bool:
        """Send a program, without waiting; it replaces the one that runs. Whether the system took it."""
        return self._send("script", program.encode())

    def reopen(self) -> bool:
        """Open again what is gone, waiting for each no longer than 0.2 s; whether any was opened."""
        opened = False
        for name, port in _PORTS.items():
            if name not in self._open_ones:
                with suppress(RobotConnectionError):
                    self._open_ones[name] = self._open(port, min(self._timeout, _REOPENING))
                    opened = True
        return opened

    def _send(self, name: str, data: bytes) -> bool:
        sock = self._open_ones.get(name)
        try:
            if sock is None or sock.send(data) == len(data):
                return sock is not None
            sock.shutdown(socket.SHUT_RDWR)  # half a program: the next one would not be understood
        except OSError:
            pass
        return False

    def _open(self, port: int, timeout: float | None = None) -> socket.socket:
        try:
            sock = socket.create_connection((self.host, port), self._timeout if timeout is None else timeout)
        except OSError as exc:
            raise RobotConnectionError(
                f"cannot reach port {port} of the controller {self.host}, which a stop may need: {exc.strerror or exc}"
            ) from exc
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setblocking(False)
        return sock
