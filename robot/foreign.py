"""Ways to stop whatever moves the arm, without ur_rtde: sockets of our own, opened before they are needed.

A program sent to the controller's script port replaces the one that runs, whoever started it. Source: UR script
manual; which of these stops which motion was measured in a simulation (docs/safety.md).
"""

from __future__ import annotations

import socket

from coneskin.errors import RobotConnectionError

from .stop_watch import Way

__all__ = ["ForeignStops"]

SCRIPT_PORT = 30003
DASHBOARD_PORT = 29999


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
        self._script: socket.socket | None = None
        self._dashboard: socket.socket | None = None

    def __enter__(self) -> ForeignStops:
        try:
            self._script = self._open(SCRIPT_PORT)
            self._dashboard = self._open(DASHBOARD_PORT)
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close both; may be called again."""
        for sock in (self._script, self._dashboard):
            if sock is not None:
                sock.close()
        self._script = self._dashboard = None

    def sockets(self) -> list[socket.socket]:
        """Those that are open. The controller talks on both; ``drain`` what it says, or it closes them."""
        return [sock for sock in (self._script, self._dashboard) if sock is not None]

    def drain(self) -> None:
        """Throw away what the controller has said; drops a socket that it has closed."""
        for name in ("_script", "_dashboard"):
            sock: socket.socket | None = getattr(self, name)
            try:
                while sock is not None and (data := sock.recv(1 << 16)) is not None:
                    if not data:
                        sock.close()
                        setattr(self, name, None)
                        break
            except BlockingIOError:
                pass
            except OSError:
                assert sock is not None
                sock.close()
                setattr(self, name, None)

    def use(self, way: Way, deceleration: float) -> bool:
        """Send one stop, without waiting.

        Args:
            way: SCRIPT, DASHBOARD or PROTECTIVE.
            deceleration: of the leading joint [rad/s2], for SCRIPT.

        Returns:
            whether the system took the bytes; what the arm does is measured, not assumed.
        """
        if way is Way.DASHBOARD:
            return self._send(self._dashboard, b"stop\n")
        call = f"stopj({deceleration:.3f})" if way is Way.SCRIPT else "protective_stop()"
        return self._send(self._script, f"def coneskin_stop():\n  {call}\nend\n".encode())

    @staticmethod
    def _send(sock: socket.socket | None, data: bytes) -> bool:
        try:
            return sock is not None and sock.send(data) == len(data)
        except OSError:
            return False

    def _open(self, port: int) -> socket.socket:
        try:
            sock = socket.create_connection((self.host, port), self._timeout)
        except OSError as exc:
            raise RobotConnectionError(
                f"cannot reach port {port} of the controller {self.host}, which a stop may need: {exc.strerror or exc}"
            ) from exc
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setblocking(False)
        return sock
