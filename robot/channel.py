"""Messages between the processes of one guard, over a connected pair of stream sockets.

A message is its length (u32, little endian) and its bytes. Sending never waits: what the other side does not take is
kept, up to a bound; beyond it ``send`` says False and the message is not sent, or what ``spill`` leaves of it. A pair
is given to a child process by its descriptor, so no port is opened and nobody else can join.
"""

from __future__ import annotations

import select
import socket
import struct
import subprocess
import sys
import time
from typing import TYPE_CHECKING

from coneskin.errors import RobotConnectionError

if TYPE_CHECKING:
    from .spill import Spill

__all__ = ["Channel", "inherit", "pair", "spawn"]

_LENGTH = struct.Struct("<I")
_LONGEST = 1 << 24
_RESERVE = 2  # bounds; what lies behind the first is for what is left of a message


class Channel:
    """One end of a pair.

    Attributes:
        closed: True once the other side is gone.
        dropped: messages that were not sent, or not whole, because the other side does not read.
        spill: shortens what does not fit, and says so as soon as there is room again; None drops it.
    """

    def __init__(self, sock: socket.socket, limit: int = 1 << 22) -> None:
        sock.setblocking(False)
        self._sock = sock
        self._limit = limit
        self._out = bytearray()
        self._in = b""
        self.closed = False
        self.dropped = 0
        self.spill: Spill | None = None
        self._full = False

    def fileno(self) -> int:
        """The descriptor, for select and poll; -1 when closed."""
        return self._sock.fileno()

    def send(self, message: bytes) -> bool:
        """Send without waiting.

        Returns:
            whether the message was sent or queued; False where the other side is gone or does not read.
        """
        if self.closed:
            return False
        if self._full or len(self._out) + len(message) > self._limit:
            self.flush()
            # once full it stays so until half of it has gone, so that few gaps come of it, not many
            self._full = len(self._out) + len(message) > self._limit // (2 if self._full else 1)
            if self._full:
                self.dropped += 1
                message = b"" if self.spill is None else self.spill.shorten(message)
                if not message or len(self._out) + len(message) > _RESERVE * self._limit:
                    return False
            elif self.spill is not None and (notice := self.spill.notice()):
                self._out += _LENGTH.pack(len(notice)) + notice
        self._out += _LENGTH.pack(len(message)) + message
        return self.flush()

    def flush(self) -> bool:
        """Hand over what waits, as far as the other side takes it; False where it is gone."""
        try:
            while self._out:
                del self._out[: self._sock.send(self._out)]
        except BlockingIOError:
            pass
        except OSError:
            self.closed = True
            self._out.clear()
        return not self.closed

    def finish(self, seconds: float) -> bool:
        """Hand over all that waits, and say what was left out; whether it was taken within this time [s]."""
        if self.spill is not None and (notice := self.spill.notice()):
            self._out += _LENGTH.pack(len(notice)) + notice
        end = time.monotonic() + seconds
        while self.flush() and self._out and (left := end - time.monotonic()) > 0.0:
            select.select([], [self], [], left)
        return not (self.closed or self._out)

    def receive(self) -> list[bytes]:
        """Every whole message that has arrived; sets ``closed`` where the other side is gone. Never waits."""
        try:
            while data := self._sock.recv(1 << 16):
                self._in += data
                if len(data) < 1 << 16:
                    break
            else:
                self.closed = True
        except BlockingIOError:
            pass
        except OSError:
            self.closed = True
        messages, at = [], 0
        while at + _LENGTH.size <= len(self._in):
            (length,) = _LENGTH.unpack_from(self._in, at)
            if length > _LONGEST:
                self.closed = True  # the other side is not one of ours
                break
            if at + _LENGTH.size + length > len(self._in):
                break
            messages.append(self._in[at + _LENGTH.size : at + _LENGTH.size + length])
            at += _LENGTH.size + length
        self._in = self._in[at:]
        return messages

    def close(self) -> None:
        """Close this end; may be called again."""
        self.closed = True
        self._sock.close()


def pair() -> tuple[socket.socket, socket.socket]:
    """Two connected stream sockets, for the two sides of a channel."""
    return socket.socketpair()


def spawn(module: str, *ends: socket.socket) -> subprocess.Popen[bytes]:
    """Start ``python -m module`` with these ends of pairs; the child takes them with ``inherit``.

    Args:
        module: the module to run.
        ends: sockets for the child, closed here afterwards.

    Raises:
        RobotConnectionError: the process cannot be started.
    """
    command = [sys.executable, "-m", module]
    try:
        if sys.platform == "win32":  # written from the documentation of socket.share; not run by our tests
            child = subprocess.Popen([*command, "shared"], stdin=subprocess.PIPE)
            assert child.stdin is not None
            for end in ends:
                share = end.share(child.pid)
                child.stdin.write(_LENGTH.pack(len(share)) + share)
            child.stdin.close()
        else:
            numbers = [end.fileno() for end in ends]
            child = subprocess.Popen(
                [*command, *map(str, numbers)], pass_fds=numbers, stdin=subprocess.DEVNULL, start_new_session=True
            )
    except OSError as exc:
        raise RobotConnectionError(f"cannot start the process {module}: {exc.strerror or exc}") from exc
    for end in ends:
        end.close()
    return child


def inherit(arguments: list[str]) -> list[Channel]:
    """The channels that ``spawn`` gave to this process.

    Args:
        arguments: the command-line arguments of this process, without its name.
    """
    if arguments == ["shared"]:
        stream = sys.stdin.buffer
        shares = []
        while head := stream.read(_LENGTH.size):
            shares.append(stream.read(_LENGTH.unpack(head)[0]))
        return [Channel(socket.fromshare(share)) for share in shares]  # type: ignore[attr-defined,unused-ignore]
    return [Channel(socket.socket(fileno=int(number))) for number in arguments]
