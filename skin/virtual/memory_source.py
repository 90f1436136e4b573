"""Virtual skin without any port: bytes in memory, in real time or as fast as can be."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from coneskin.core.errors import SkinConnectionError, SkinTimeout
from coneskin.skin.sources.source import Source

from .skin import VirtualSkin


class MemorySource(Source):
    """Source of a virtual skin's bytes.

    By default time is simulated and a day passes as fast as it can be computed.

    Args:
        real_time: the bytes come when they are due.

    Attributes:
        clock: returns the time [s], simulated from 0 on or monotonic.
        sleep: lets time pass [s].
    """

    name = "virtual skin"

    def __init__(self, skin: VirtualSkin, real_time: bool = False) -> None:
        self._now = 0.0
        self.clock: Callable[[], float] = time.monotonic if real_time else lambda: self._now
        self.sleep: Callable[[float], None] = time.sleep if real_time else self._advance
        self._skin = skin
        self._packets: Iterator[tuple[float, bytes]] | None = None
        self._next: tuple[float, bytes] | None = None
        self._gone: SkinConnectionError | None = None
        self._start = 0.0

    def _advance(self, duration: float) -> None:
        self._now += duration

    def open(self) -> None:
        """Start the device, anew each time."""
        if self._packets is None:
            self._start = self.clock()
            self._packets = self._skin.packets()
            self._next = self._gone = None

    def close(self) -> None:
        """Stop the device."""
        self._packets = None

    def fileno(self) -> None:
        """Return None: there is no descriptor."""
        return

    def read(self, timeout: float) -> bytes:
        """Wait for bytes, as every Source does."""
        deadline = self.clock() + timeout
        parts: list[bytes] = []
        while not (parts and self._gone is not None):
            due, data = self._peek()
            now = self.clock()
            if due > now and (parts or due > deadline):
                break
            if due > now:
                self.sleep(due - now)
                if self.clock() < due:  # woken early
                    continue
            self._next = None
            if data:
                parts.append(data)
            if len(parts) >= 64:
                break
        if parts:
            return b"".join(parts)
        self.sleep(max(0.0, deadline - self.clock()))
        raise SkinTimeout(f"{self.name}: no bytes for {timeout * 1e3:.0f} ms")

    def _peek(self) -> tuple[float, bytes]:
        """Return the next packet and when it is due; bytes that came before the end of the line are still delivered."""
        if self._packets is None:
            raise SkinConnectionError(f"{self.name} is not open: call open, or read it inside a with")
        if self._next is None:
            if self._gone is not None:
                raise self._gone
            try:
                due, data = next(self._packets)
                self._next = (self._start + due, data)
            except (StopIteration, SkinConnectionError) as error:
                why = f"its time of {self._skin.duration:g} s is over" if isinstance(error, StopIteration) else error
                self._gone = SkinConnectionError(f"{self.name} is gone: {why}")
                self._next = (self.clock(), b"")
        return self._next
