"""Lock on an arm: of one computer, only one guard at a time may have it.

Two guards would stop each other's motions, and neither knows when the other one is reset. The lock is a socket with a
name that the system forgets when the process ends, however that ends. Guards on two computers do not see each other.
"""

from __future__ import annotations

import errno
import socket
import sys
import time
from collections.abc import Callable

from coneskin.core.errors import RobotRefused

__all__ = ["ArmLock"]

_TIMEOUT = 3.0  # s for the guard of a program that was killed to stop its arm and end
_LOOK_PERIOD = 0.05  # s


class ArmLock:
    """Lock on the arm of one controller, held in a ``with``; on Linux alone.

    Args:
        host: the controller.
        timeout: how long another guard may take to end [s].
        wait: waits for this time [s].
        clock: monotonic seconds.

    Raises:
        RobotRefused: on entering, where another guard of this computer has the arm.
    """

    def __init__(
        self,
        host: str,
        timeout: float = _TIMEOUT,
        wait: Callable[[float], None] = time.sleep,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._host = host
        self._timeout = timeout
        self._wait = wait
        self._clock = clock
        self._sock: socket.socket | None = None

    def __enter__(self) -> ArmLock:
        if sys.platform != "linux":
            return self
        name = f"\0coneskin guard of {_address(self._host)}"
        self._sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        end = self._clock() + self._timeout
        while True:
            try:
                self._sock.bind(name)
                return self
            except OSError as exc:
                if exc.errno != errno.EADDRINUSE:  # a system without such names has no lock
                    return self
            if self._clock() >= end:
                self._sock.close()
                raise RobotRefused(
                    f"another guard on this computer has the arm at {self._host}: end that program, or that "
                    "coneskin guard, first"
                )
            self._wait(_LOOK_PERIOD)

    def __exit__(self, *_: object) -> None:
        if self._sock is not None:
            self._sock.close()


def _address(host: str) -> str:
    """Return the address of a host, so that two names of one controller are one arm."""
    try:
        return socket.gethostbyname(host)
    except OSError:
        return host  # the driver says what is wrong with it
