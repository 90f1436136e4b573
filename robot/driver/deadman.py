"""Deadman of a process whose library may block or freeze it: a heartbeat of its work, and its certain end.

The process's own thread says that it gets on, and before a call that may take long how long that may be. A second
thread sends the heartbeat only as long as that holds: a process that hangs in a library is missed like one that is
frozen. The same thread sees that a channel has ended, without reading it, and then gives the process a last
while. Where even Python's lock is not given back, a timer of the interpreter that needs no lock ends the process.
"""

from __future__ import annotations

import faulthandler
import os
import threading
import time
from collections.abc import Callable
from typing import Self

from coneskin.core.channel import Channel

from .liveness import BEAT_PERIOD
from .messages import StatusReport

_WORK_TIMEOUT = 0.1  # s that one round of work may take, where nothing else was announced
_LAST_WHILE = 1.5  # s for the last stop and for disconnecting, once a channel has ended
_LOCK_TIMEOUT = 1.8  # s that a library may keep Python's lock
_START_LOCK_TIMEOUT = 10.0  # s for the same while it connects, before anything can move
_LOCK_PERIOD = 0.3  # s between two settings of that timer
_HEARTBEAT_MESSAGE = StatusReport("alive").encode()


class Deadman:
    """Deadman of this process; its thread runs in a ``with``.

    Args:
        guard: takes the heartbeat.
        others: further channels whose end ends this process.
        end: ends the process at once.
    """

    def __init__(
        self,
        guard: Channel,
        *others: Channel,
        clock: Callable[[], float] = time.monotonic,
        end: Callable[[], None] = lambda: os._exit(1),
    ) -> None:
        self._guard = guard
        self._channels = (guard, *others)
        self._clock = clock
        self._end = end
        self._works_until = clock() + _WORK_TIMEOUT
        self._ends_at: float | None = None
        self._lock_timer_at = -_LOCK_PERIOD
        self._lock_timeout = _START_LOCK_TIMEOUT  # until the process works
        self._nowhere = -1
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="coneskin deadman", daemon=True)

    def __enter__(self) -> Self:
        self._nowhere = os.open(os.devnull, os.O_WRONLY)  # for the interpreter's timer, until the very end
        self._limit_lock(self._lock_timeout)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closed.set()
        self._thread.join()
        self._limit_lock(_LAST_WHILE)  # the interpreter's own end may block in a library as well

    def work(self, seconds: float = 0.0) -> None:
        """Note that the process gets on; what it does next may take this long [s], and a little more."""
        self._works_until = self._clock() + seconds + _WORK_TIMEOUT
        self._lock_timeout = _LOCK_TIMEOUT

    def end_soon(self) -> None:
        """Note that the process is about to end; it does so within 1.5 s, whatever its last calls do."""
        if self._ends_at is None:
            self._ends_at = self._clock() + _LAST_WHILE

    def poll(self) -> None:
        """Send the heartbeat, or end the process, as is due."""
        now = self._clock()
        if now <= self._works_until:
            self._guard.send(_HEARTBEAT_MESSAGE)
        if any(channel.hung_up() for channel in self._channels):
            self.end_soon()
        if self._ends_at is not None and now >= self._ends_at:
            self._end()

    def _run(self) -> None:
        while not self._closed.wait(BEAT_PERIOD):
            if (now := self._clock()) - self._lock_timer_at >= _LOCK_PERIOD:
                self._lock_timer_at = now
                self._limit_lock(self._lock_timeout)
            self.poll()

    def _limit_lock(self, seconds: float) -> None:
        """End the process without Python's lock, unless this is called again within this time [s]."""
        faulthandler.dump_traceback_later(seconds, exit=True, file=self._nowhere)
