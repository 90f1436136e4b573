"""Connections of a driver over TCP, to begin from: a reader of payloads, and sockets that stops go through.

A maker's driver says where the payloads end, which ports take stops, and what the controller says where it takes none.
"""

from __future__ import annotations

import socket
from collections.abc import Mapping
from contextlib import suppress
from typing import ClassVar, Self

from coneskin.core.errors import RobotConnectionError, RobotTimeout
from coneskin.core.files import explain_os_error

from .values import StopPath

_REOPEN_TIMEOUT = 0.2  # s for each port; a stop over another one waits meanwhile
_MAX_READ = 1 << 16  # bytes that are taken at once


class TcpReader:
    """Reader of payloads from one TCP port; open it in a ``with``.

    Args:
        timeout: how long connecting and each reply may take [s].

    Raises:
        RobotConnectionError: on entering, where the controller cannot be reached.
        RobotTimeout: on entering, where it does not answer.
    """

    port: ClassVar[int]  #: TCP port of the controller
    advice: ClassVar[str] = "check the address (arm.host), and that the controller is on"  #: where it is not reached

    def __init__(self, host: str, timeout: float = 2.0) -> None:
        self.host, self._timeout = host, timeout
        self._sock: socket.socket | None = None
        self._rest = b""

    def split(self, data: bytes) -> tuple[list[bytes], bytes]:
        """Return the whole payloads at the beginning of what was received, oldest first, and what is left of it."""
        raise NotImplementedError

    def prepare(self) -> None:
        """Ask for the payloads on the new connection, then call this one: from then on nothing waits."""
        if self._sock is not None:
            self._sock.setblocking(False)

    def __enter__(self) -> Self:
        try:
            self._sock = socket.create_connection((self.host, self.port), self._timeout)
        except TimeoutError as exc:
            raise self._silent() from exc
        except OSError as exc:
            raise RobotConnectionError(
                f"cannot reach the controller {self.host}:{self.port}: {exc.strerror or exc}; {self.advice}"
            ) from exc
        self._sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            self.prepare()
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
        """Return the descriptor, for select and poll; -1 when closed."""
        return -1 if self._sock is None else self._sock.fileno()

    def read(self) -> list[bytes]:
        """Return the payloads that have arrived, oldest first. Never waits.

        Raises:
            RobotConnectionError: the controller has closed the connection.
        """
        if self._sock is None:
            raise RobotConnectionError(f"the connection to the controller {self.host} is not open")
        try:
            data = self._sock.recv(_MAX_READ)
        except BlockingIOError:
            return []
        except OSError as exc:
            raise RobotConnectionError(f"the controller {self.host} is gone: {exc.strerror or exc}") from exc
        if not data:
            raise RobotConnectionError(f"the controller {self.host} has closed the connection")
        payloads, self._rest = self.split(self._rest + data)
        return payloads

    def _silent(self) -> RobotTimeout:
        return RobotTimeout(
            f"no answer from the controller {self.host}:{self.port} within {self._timeout:g} s; {self.advice}"
        )


class TcpStops:
    """Sockets that stops go through; open it in a ``with``.

    Args:
        timeout: how long connecting may take [s].

    Raises:
        RobotConnectionError: on entering, where a port does not answer.
        RobotRefused: on entering, where the controller takes no stop.
    """

    ports: ClassVar[Mapping[str, int]]  #: name of each connection -> its TCP port
    advice: ClassVar[str] = "see its network settings"  #: where a port does not answer

    def __init__(self, host: str, timeout: float = 2.0) -> None:
        self.host = host
        self._timeout = timeout
        self._open_ones: dict[str, socket.socket] = {}

    def prove(self) -> None:
        """Prove over the open sockets that the controller takes stops, by what moves nothing.

        Raises:
            RobotConnectionError, RobotRefused: it does not answer, or takes none.
        """
        raise NotImplementedError

    def refusal(self, name: str, data: bytes) -> str:
        """Take what the controller has said over a connection; return why it takes no stop now. Empty where it does."""
        raise NotImplementedError

    def use(self, path: StopPath, deceleration: float) -> bool:
        """Send one stop without waiting; as ``StopConnections.use``."""
        raise NotImplementedError

    def ask(self) -> None:
        """Ask whether the controller still takes stops, without waiting; its answer goes to ``refusal``."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        try:
            for name, port in self.ports.items():
                self._open_ones[name] = self._open(port)
            self.prove()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close all; may be called again."""
        for sock in self._open_ones.values():
            sock.close()
        self._open_ones = {}

    def sockets(self) -> dict[str, socket.socket]:
        """Return the open sockets, by the name of the connection. The controller sends on each: ``drain`` them."""
        return dict(self._open_ones)

    def drain(self) -> list[tuple[str, socket.socket, str]]:
        """Take what the controller has sent, at most 64 kB a call and socket, without waiting.

        Returns:
            the sockets that are no longer of use, for the caller to close, and why: the controller has closed them, or
            takes no stop, or the system could not take a whole message, so that the next one would not be understood.
        """
        gone: dict[str, str] = {}
        for name, sock in self._open_ones.items():
            try:
                data = sock.recv(_MAX_READ)
            except BlockingIOError:
                continue
            except OSError:
                data = b""
            if not data:
                gone[name] = f"the controller has closed the {name} connection, which a stop may need"
            elif why := self.refusal(name, data):
                gone = dict.fromkeys(self._open_ones, why)
                break
        return [(name, self._open_ones.pop(name), why) for name, why in gone.items()]

    def reopen(self) -> bool:
        """Open again what has been closed, at most 0.2 s for each; return whether any was opened."""
        opened = False
        for name, port in self.ports.items():
            if name not in self._open_ones:
                with suppress(RobotConnectionError):
                    self._open_ones[name] = self._open(port, min(self._timeout, _REOPEN_TIMEOUT))
                    opened = True
        return opened

    def send(self, name: str, data: bytes) -> bool:
        """Send a message over a connection without waiting; return whether the system took all of it."""
        sock = self._open_ones.get(name)
        try:
            if sock is None or sock.send(data) == len(data):
                return sock is not None
            sock.shutdown(socket.SHUT_RDWR)  # half a message: the next one would not be understood
        except OSError:
            pass
        return False

    def _open(self, port: int, timeout: float | None = None) -> socket.socket:
        what = f"cannot reach port {port} of the controller {self.host}, which a stop may need"
        with explain_os_error(RobotConnectionError, what, f"; {self.advice}"):
            sock = socket.create_connection((self.host, port), self._timeout if timeout is None else timeout)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setblocking(False)
        return sock
