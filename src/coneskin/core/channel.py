"""Messages between the processes of one guard, over a connected pair of stream sockets.

A message is its length (u32, little endian) and its bytes. Sending never waits: what the other side does not take is
kept, up to a bound. Beyond it ``send`` returns False, and the message is dropped, or shortened by ``overflow``. A pair
is given to a child process by its descriptor, so no port is opened and no other process can join.

The end of a channel is how a process learns that another has died. So a forked copy of a process, which would keep its
channels open, closes them: it has no part in them.
"""

from __future__ import annotations

import json
import os
import select
import socket
import struct
import sys
import threading
import time
import weakref
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

if TYPE_CHECKING:
    from _typeshed import HasFileno

_LENGTH_FIELD: Final = struct.Struct("<I")
_MAX_LENGTH: Final = 1 << 24  # bytes of one message
_MAX_WAITING: Final = 1 << 22  # bytes that the other side has not taken
_BOUND_FACTOR: Final = 2  # bounds; the second is for what is left of a shortened message


_Waited = TypeVar("_Waited", bound="HasFileno")


def wait_readable(inputs: Sequence[_Waited], timeout: float) -> list[_Waited]:
    """Wait until one of these can be read or has ended, or for the timeout [s], and return those that can.

    Unlike ``select.select`` it also takes descriptors above 1023 on Linux, of which a program may have many.
    """
    return _wait(inputs, timeout, write=False)


def wait_writable(output: HasFileno, timeout: float) -> bool:
    """Wait until this can be written, or for the timeout [s], and tell whether it can."""
    return bool(_wait([output], timeout, write=True))


def _wait(items: Sequence[_Waited], timeout: float, write: bool) -> list[_Waited]:
    if sys.platform in ("win32", "darwin"):  # no poll, or none of terminals; written from the documentation
        if not items:
            time.sleep(timeout)
        readable, writable, _ = select.select([] if write else items, items if write else [], [], timeout)
        return list(writable if write else readable)
    poll, by_number = select.poll(), {}
    for item in items:
        number = item.fileno()
        if number < 0:
            raise ValueError("a closed channel or connection cannot be waited for")
        by_number[number] = item
        poll.register(number, select.POLLOUT if write else select.POLLIN)
    return [by_number[number] for number, _ in poll.poll(1e3 * max(timeout, 0.0))]


class _OverflowFilter(Protocol):
    """Filter that shortens what the other side of a full channel does not take."""

    def shorten(self, message: bytes) -> bytes:
        """Return what is left of a message that does not fit; it may be empty."""

    def notice(self) -> bytes:
        """Return a message that reports what was left out since the last one; empty where nothing was."""


class Channel:
    """One end of a pair; any thread may send.

    Attributes:
        closed: True once the other side is gone, and all that it has said was received.
        dropped: messages that were not sent, or not whole, because the other side does not read.
        overflow: shortens what does not fit, and reports it as soon as there is room again; None drops it.
    """

    def __init__(self, sock: socket.socket) -> None:
        sock.setblocking(False)
        self._sock = sock
        self._limit = _MAX_WAITING
        self._out = bytearray()
        self._in = b""
        self.closed = False
        self._unheard = False  # the other side takes nothing more; what it has said may still be there to read
        self.dropped = 0
        self.overflow: _OverflowFilter | None = None
        self._full = False
        self._sending = threading.Lock()
        _open_sockets.add(sock)

    def fileno(self) -> int:
        """Return the descriptor, for select and poll; -1 when closed."""
        return self._sock.fileno()

    def send(self, message: bytes) -> bool:
        """Send without waiting.

        Returns:
            whether the message was sent or queued; False where the other side is gone or does not read.
        """
        with self._sending:
            return self._send(message)

    def _send(self, message: bytes) -> bool:
        if self.closed or self._unheard:
            return False
        if self._full or len(self._out) + len(message) > self._limit:
            self._flush()
            # once full it stays so until half of it has gone: a few long gaps are better than many short ones
            self._full = len(self._out) + len(message) > self._limit // (2 if self._full else 1)
            if self._full:
                self.dropped += 1
                message = b"" if self.overflow is None else self.overflow.shorten(message)
                if not message or len(self._out) + len(message) > _BOUND_FACTOR * self._limit:
                    return False
            elif self.overflow is not None and (notice := self.overflow.notice()):
                self._out += _LENGTH_FIELD.pack(len(notice)) + notice
        data = _LENGTH_FIELD.pack(len(message)) + message
        if not self._out:  # mostly nothing waits, and nothing needs to be copied
            try:
                if (taken := self._sock.send(data)) == len(data):
                    return True
                data = data[taken:]
            except OSError:
                pass  # it goes the way of what waits, which says what is wrong
        self._out += data
        return self._flush()

    def flush(self) -> bool:
        """Hand over what waits, as far as the other side takes it; return False where it is gone."""
        with self._sending:
            return self._flush()

    def _flush(self) -> bool:
        try:
            while self._out:
                del self._out[: self._sock.send(self._out)]
        except BlockingIOError:
            pass
        except OSError:
            self._unheard = True
            self._out.clear()
        return not (self.closed or self._unheard)

    def finish(self, seconds: float) -> bool:
        """Hand over all that waits, report what was left out, and return whether it was taken within this time [s]."""
        if self.overflow is not None and (notice := self.overflow.notice()):
            self._out += _LENGTH_FIELD.pack(len(notice)) + notice
        end = time.monotonic() + seconds
        while self.flush() and self._out and (left := end - time.monotonic()) > 0.0:
            wait_writable(self, left)
        return not (self.closed or self._unheard or self._out)

    def receive(self) -> list[bytes]:
        """Return the whole messages that have arrived; set ``closed`` where the other side is gone. Never waits."""
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
        while at + _LENGTH_FIELD.size <= len(self._in):
            (length,) = _LENGTH_FIELD.unpack_from(self._in, at)
            if length > _MAX_LENGTH:
                self.closed = True  # the other side does not speak this protocol
                break
            if at + _LENGTH_FIELD.size + length > len(self._in):
                break
            messages.append(self._in[at + _LENGTH_FIELD.size : at + _LENGTH_FIELD.size + length])
            at += _LENGTH_FIELD.size + length
        self._in = self._in[at:]
        return messages

    def hung_up(self) -> bool:
        """Tell whether the other side is gone, or this one closed, without reading what has come; any thread may."""
        number = self._sock.fileno()
        if number < 0:
            return True
        if sys.platform == "win32":  # written from the documentation
            try:
                return not self._sock.recv(1, socket.MSG_PEEK)
            except BlockingIOError:
                return False
            except OSError:
                return True
        poll = select.poll()
        poll.register(number, 0)  # its end is reported without being asked for
        return bool(poll.poll(0))

    def hang_up(self) -> None:
        """End the conversation for both sides, whoever has copies of the other end; any thread may.

        What has come already can still be received.
        """
        with suppress(OSError):
            self._sock.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close this end; may be called again."""
        self.closed = True
        self._sock.close()


_open_sockets: weakref.WeakSet[socket.socket] = weakref.WeakSet()


def _close_in_forked_child() -> None:
    """Close the copies of all channels in a forked child: with them it would hide the death of its parent."""
    for sock in list(_open_sockets):
        sock.close()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_close_in_forked_child)


def pair() -> tuple[socket.socket, socket.socket]:
    """Return two connected stream sockets, for the two sides of a channel."""
    return socket.socketpair()


def encode_json(value: dict[str, Any]) -> bytes:
    """Return a message that is a JSON object."""
    return json.dumps(value).encode()


def decode_json(message: bytes) -> dict[str, Any]:
    """Return the JSON object in a message.

    Raises:
        ValueError: the message holds none.
    """
    try:
        value = json.loads(message)
    except RecursionError as exc:
        raise ValueError("a message must be a JSON object, got brackets without end") from exc
    if not isinstance(value, dict):
        raise ValueError(f"a message must be a JSON object, got {type(value).__name__}")
    return value
