"""Virtual skin without any port: bytes in memory, on a clock that the caller may own."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from coneskin.core.errors import SkinConnectionError, SkinTimeout
from coneskin.skin.sources.source import Source

from .skin import VirtualSkin

__all__ = ["ManualClock", "MemorySource"]


class ManualClock:
    """A clock that moves only when ``sleep`` is called.

    Args:
        now: where it starts [s].
    """

    def __init__(self, now: float = 0.0) -> None:
        self._now = now

    def __call__(self) -> float:
        """Return the time [s]."""
        return self._now

    def sleep(self, duration: float) -> None:
        """Let time pass [s]."""
        self._now += max(0.0, duration)


class MemorySource(Source):
    """Source of a virtual skin's bytes.

    By default time is simulated and a day passes as fast as it can be computed. With ``clock=time.monotonic`` and
    ``sleep=time.sleep`` the bytes come when they are due.

    Args:
        skin: the virtual skin.
        clock: the time [s].
        sleep: lets time pass [s]; must be given with a clock.
        name: what to call it.
    """

    def __init__(
        self,
        skin: VirtualSkin,
        clock: Callable[[], float] | None = None,
        sleep: Callable[[float], None] | None = None,
        name: str = "virtual skin",
    ) -> None:
        if (clock is None) != (sleep is None):
            raise TypeError("MemorySource needs clock and sleep together, or neither")
        manual = ManualClock()
        self.clock: Callable[[], float] = clock or manual
        self._sleep = sleep or manual.sleep
        self._skin = skin
        self.name = name
        self._packets: Iterator[tuple[float, bytes]] | None = None
        self._next: tuple[float, bytes] | None = None
        self._gone: SkinConnectionError | None = None
        self._start = 0.0

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
                self._sleep(due - now)
                if self.clock() < due:  # woken early
                    continue
            self._next = None
            if data:
                parts.append(data)
            if len(parts) >= 64:
                break
        if parts:
            return b"".join(parts)
        self._sleep(deadline - self.clock())
        raise SkinTimeout(f"{self.name}: no bytes for {timeout * 1e3:.0f} ms")

    def _peek(self) -> tuple[float, bytes]:
        """Return the next packet and when it is due; bytes that came before the end of the line are still delivered."""
        if self._packets is None:
            raise SkinConnectionError(f"{self.name} is not open: call open, or read it inside a with")
        if self._next is None:
            if self._gone is not None:
                raise self._gone
            try:
                time, data = next(self._packets)
                self._next = (self._start + time, data)
            except StopIteration:
                self._gone = SkinConnectionError(f"{self.name} is gone: its time of {self._skin.duration:g} s is over")
                self._next = (self.clock(), b"")
            except SkinConnectionError as error:
                self._gone = SkinConnectionError(f"{self.name} is gone: {error}")
                self._next = (self.clock(), b"")
        return self._next
