"""Stop sockets: the stop paths that work on any program, opened before they are needed and independent of ur_rtde.

| stop path | how |
|---|---|
| program | a program of one ``stopj`` on the script port; it replaces the one that runs, whatever started it |
| command | the dashboard's ``stop`` |
| slider | the speed slider at 0, over an RTDE connection that is opened for it; the guard has one of its own |
| protective | ``protective_stop()`` twice: in a program that replaces the one that runs, and in a secondary program |

A secondary program runs beside the main one and no upload replaces it, so that a sender which starts its program again
at once cannot keep the protective stop away. Whether a controller takes the call there is measured by
scripts/measure_controller.py; where it does not, the program before it does the same as long as nobody replaces it.

Source: UR script manual, dashboard server manual; which of these stops which motion was measured in a simulation
(docs/safety.md, "Stop paths").
"""

from __future__ import annotations

import socket
from contextlib import suppress

from coneskin.core.errors import RobotConnectionError
from coneskin.robot.driver.values import SetpointProgram, StopPath

__all__ = ["StopSockets"]

_REOPEN_TIMEOUT = 0.2  # s for each port; a stop over the other one waits meanwhile
_SLIDER_TIMEOUT = 0.2  # s for connecting, and for each reply, where the slider is used
_PROTECTIVE_PROGRAM = """def coneskin_stop():
  protective_stop()
end
sec coneskin_protective():
  protective_stop()
end
"""
_STOP_PORTS = {"program": 30003, "command": 29999}  # stop path -> TCP port: script interface, dashboard


class StopSockets:
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

    def __enter__(self) -> StopSockets:
        try:
            for name, port in _STOP_PORTS.items():
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
        """Return the open sockets, by stop path. The controller sends on both: ``drain`` them."""
        return dict(self._open_ones)

    def drain(self) -> list[tuple[str, socket.socket]]:
        """Discard what the controller has sent, at most 64 kB a call and socket, without waiting.

        Returns:
            the sockets that are no longer of use, for the caller to close: the controller has closed them, or the
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

    def use(self, path: StopPath, deceleration: float) -> bool:
        """Send one stop without waiting.

        Args:
            path: PROGRAM, COMMAND, PROTECTIVE, or SLIDER, which alone may wait, for 0.6 s at most.
            deceleration: of the leading joint [rad/s2], for PROGRAM.

        Returns:
            whether the system took the bytes; what the arm does is measured, not assumed.
        """
        if path is StopPath.COMMAND:
            return self._send("command", b"stop\n")
        if path is StopPath.SLIDER:
            from .input_writers import set_slider

            return set_slider(self.host, 0.0, _SLIDER_TIMEOUT)
        if path is StopPath.PROTECTIVE:
            return self.run(_PROTECTIVE_PROGRAM)
        return self.run(f"def coneskin_stop():\n  stopj({deceleration:.3f})\nend\n")

    def follow(self, program: SetpointProgram) -> bool:
        """Start the program that follows setpoints, without waiting; return whether the system took the bytes."""
        from .input_writers import program_text

        return self.run(program_text(program))

    def run(self, program: str) -> bool:
        """Send a program without waiting; it replaces the one that runs. Return whether the system took the bytes."""
        return self._send("program", program.encode())

    def reopen(self) -> bool:
        """Open again what has been closed, at most 0.2 s for each; return whether any was opened."""
        opened = False
        for name, port in _STOP_PORTS.items():
            if name not in self._open_ones:
                with suppress(RobotConnectionError):
                    self._open_ones[name] = self._open(port, min(self._timeout, _REOPEN_TIMEOUT))
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
