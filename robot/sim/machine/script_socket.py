"""Connections that a program opens to other computers: never waited for, and with a bound to what they hold."""

from __future__ import annotations

import contextlib
import errno
import socket

_PENDING_ERRORS = (errno.EINPROGRESS, errno.EALREADY, errno.EWOULDBLOCK)
_MAX_UNREAD = 65_536  # bytes that have come and that the program has not read; more wait in the network
_MAX_READS = 10  # of one connection in a control cycle; an assumption, so that a program that is sent more gives way


class ScriptSocket:
    """Connection to a server.

    Args:
        address: numeric address.
        port: of the server.

    Attributes:
        unread: bytes that have come.
        ended: the other side has closed it, or it is broken.
    """

    def __init__(self, address: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._peer = (address, port)
        self.unread = bytearray()
        self.ended = False
        self._cycle = self._reads = 0

    def connect(self) -> bool | None:
        """Return whether it is connected; None while that is not known yet."""
        error = self._socket.connect_ex(self._peer)
        if error in _PENDING_ERRORS:
            return None
        return error in (0, errno.EISCONN)

    def fill(self) -> None:
        """Take what has come, as far as there is room."""
        while not self.ended and (room := _MAX_UNREAD - len(self.unread)) > 0:
            try:
                data = self._socket.recv(room)
            except BlockingIOError:
                return
            except OSError:
                data = b""
            if not data:
                self.ended = True
            self.unread += data

    def gives_way(self, cycle: int) -> bool:
        """Count a read of what has come; return whether it has to wait for the next control cycle."""
        if cycle != self._cycle:
            self._cycle, self._reads = cycle, 0
        self._reads += 1
        return bool(self.unread) and self._reads > _MAX_READS

    def pop(self, count: int) -> bytes:
        """Return the first bytes of what has come, and forget them."""
        data = bytes(self.unread[:count])
        del self.unread[:count]
        return data

    def forget_if_full(self) -> None:
        """Forget what has come where it leaves no room for what a program looks for."""
        if len(self.unread) >= _MAX_UNREAD:
            self.unread.clear()

    def send(self, data: bytes) -> bool:
        """Send bytes; return False where the connection is broken, or the other side does not read."""
        if self.ended:
            return False
        try:
            sent = self._socket.send(data)
        except OSError:
            return False
        if sent < len(data):  # what follows would not be understood
            self.ended = True
        return not self.ended

    def close(self) -> None:
        """Close it."""
        self.ended = True
        with contextlib.suppress(OSError):
            self._socket.close()
