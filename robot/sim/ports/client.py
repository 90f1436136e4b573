"""Client of the simulated controller: its connection, and what it has not read yet."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable

MAX_LINE = 10_000  #: bytes of a line to the dashboard
_MAX_UNSENT = 1_000_000  # bytes that a client may leave unread
MAX_MESSAGES = 100_000  #: bytes that a client may leave unread and still be sent messages
UNREAD_TIMEOUT = 10.0  #: s; a client of RTDE that reads nothing for so long is dropped, and its inputs are free again
#: option of a connection -> s of silence before the first question whether the other side lives, s between, questions
_KEEPALIVE_OPTIONS = {"TCP_KEEPIDLE": 10, "TCP_KEEPINTVL": 5, "TCP_KEEPCNT": 3}


class Client:
    """Connection of one client.

    Args:
        receive: bytes of the client in, bytes for it out.
        closed: called once the connection is gone.
        outputs: data of a cycle that it is sent without asking; None where it is sent none.
        left: whether the client has taken its leave, so that its connection ends with the answer.
        patience: for how long what was sent may stay unacknowledged [s]; as the operating system has it where it is
            None, which is a quarter of an hour on Linux. Other systems know no such option.

    Attributes:
        unsent: bytes that the client has not read yet.
        stuck_since: when it last took any, or some began to wait [s, monotonic].
    """

    def __init__(
        self,
        sock: socket.socket,
        receive: Callable[[bytes], bytes],
        closed: Callable[[], None] = lambda: None,
        *,
        outputs: Callable[[], bytes] | None = None,
        left: Callable[[], bool] = lambda: False,
        patience: float | None = None,
    ) -> None:
        self.socket, self.receive, self.closed, self.outputs, self.left = sock, receive, closed, outputs, left
        self.unsent = b""
        self.stuck_since = 0.0
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._notice_half_open(patience)

    def _notice_half_open(self, patience: float | None) -> None:
        """Let the operating system close the connection where the other side is gone without a word.

        It asks one that is sent nothing; one that is sent something has to acknowledge it.
        """
        if patience is not None and hasattr(socket, "TCP_USER_TIMEOUT"):
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, round(1000 * patience))
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in _KEEPALIVE_OPTIONS.items():
            if (option := getattr(socket, name, None)) is not None:  # not every system has them
                self.socket.setsockopt(socket.IPPROTO_TCP, option, value)

    def send(self, data: bytes) -> None:
        """Send as much as the client takes, after what it has not taken yet.

        Raises:
            OSError: it is gone, or has left too much unread.
        """
        fresh = not self.unsent
        self.unsent += data
        if not self.unsent:
            return
        if len(self.unsent) > _MAX_UNSENT:
            raise OSError("the client does not read the answers")
        try:
            sent = self.socket.send(self.unsent)
        except BlockingIOError:
            sent = 0
        self.unsent = self.unsent[sent:]
        if sent or fresh:
            self.stuck_since = time.monotonic()


class LineReader:
    """Reader of lines: bytes in, answers to whole lines out."""

    def __init__(self, answer_line: Callable[[str], str]) -> None:
        self._answer = answer_line
        self._rest = b""

    def __call__(self, data: bytes) -> bytes:
        """Take bytes, and return the answers to the lines that they complete.

        Raises:
            ValueError: a line is too long.
        """
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > MAX_LINE:
            raise ValueError(f"a line has at most {MAX_LINE} bytes")
        replies = (self._answer(line.decode("utf-8", "replace").rstrip("\r")) for line in lines)
        return b"".join([reply.encode() + b"\n" for reply in replies if reply])
