"""Script of an External Control node: asked for at ``play``, from the program that has it, without holding a cycle up.

The program listens on a TCP port and answers the line ``request_program`` with URScript; nothing marks its end, so that
it ends with the connection or with a pause. Source: Universal Robots, External Control URCap and client library.
"""

from __future__ import annotations

import socket
import threading
import time
from queue import Empty, SimpleQueue

from coneskin.robot.sim.urscript.translator import MAX_LENGTH

__all__ = ["ScriptRequest"]

REQUEST = b"request_program\n"
CONNECT_TIMEOUT = 2.0  #: s
FIRST_TIMEOUT = 2.0  #: s; until the script begins to come
PAUSE = 0.1  #: s; the script has come to its end when nothing more comes for so long


class ScriptRequest:
    """Request for a script, made in a thread of its own.

    Args:
        address: host and port of the program that has it.
    """

    def __init__(self, address: tuple[str, int]) -> None:
        self.address = address
        self._answer: SimpleQueue[str | OSError] = SimpleQueue()
        threading.Thread(target=self._ask, daemon=True).start()

    def result(self) -> str | OSError | None:
        """Return the script, or why there is none; None while it is still to come."""
        try:
            return self._answer.get_nowait()
        except Empty:
            return None

    def _ask(self) -> None:
        try:
            with socket.create_connection(self.address, CONNECT_TIMEOUT) as sock:
                sock.sendall(REQUEST)
                self._answer.put(_read(sock).decode("utf-8", "replace"))
        except OSError as exc:
            self._answer.put(exc)


def _read(sock: socket.socket) -> bytes:
    """Read until the other side closes, or pauses after its first bytes.

    Raises:
        OSError: nothing comes, or too much.
    """
    text = b""
    end = time.monotonic() + FIRST_TIMEOUT
    while time.monotonic() < end or text:
        sock.settimeout(PAUSE if text else FIRST_TIMEOUT)
        try:
            more = sock.recv(65536)
        except TimeoutError:
            break
        if not more:
            break
        text += more
        if len(text) > MAX_LENGTH:
            raise OSError(f"the script has more than {MAX_LENGTH} characters")
    if not text:
        raise OSError("no script came")
    return text
