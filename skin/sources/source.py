"""Protocol of a source of bytes, and reopening of one that is gone.

Opening a port may take seconds, a guard's loop may not: so it is done in a thread of its own.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Protocol, Self, runtime_checkable

from coneskin.core.errors import ConeSkinError


class Openable(Protocol):
    """An object that ``with`` opens and closes. It does nothing before ``open``."""

    def open(self) -> None:
        """Open it; what is open stays so.

        Raises:
            SkinConnectionError: it cannot be opened; the message says which one and why.
        """

    def close(self) -> None:
        """Release everything. May be called twice, and before ``open``."""

    def __enter__(self) -> Self:
        """Open it."""
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        self.close()


@runtime_checkable
class Source(Openable, Protocol):
    """A stream of bytes from a sensor.

    Attributes:
        name: what to call it in a message, for instance the port.
    """

    name: str

    def fileno(self) -> int | None:
        """Return the descriptor that becomes readable when bytes arrive, or None where there is none."""

    def read(self, timeout: float) -> bytes:
        """Wait for bytes, for a time at most [s].

        Returns:
            what has arrived, at least one byte, never more than a few kilobytes.

        Raises:
            SkinTimeout: nothing arrived in time; the source stays open.
            SkinConnectionError: it is gone, or not open.
        """
        ...


_ATTEMPT_PERIOD = 0.5  # s between two attempts
_MAX_ATTEMPTS = 1200  # ten minutes; after them somebody has to look at it anyway


class SourceReopening:
    """Thread that closes a source and opens it again, every half second for ten minutes. It begins at once.

    Args:
        source: it is gone; nobody else may use it before ``done``.
        wait: lets so many seconds pass, True if the waiting shall stop; real time by default.

    Attributes:
        opened: the source is open; it means something once ``done``.
    """

    def __init__(self, source: Source, wait: Callable[[float], bool] | None = None) -> None:
        self._source = source
        self._stopped = threading.Event()
        self._wait = wait or self._stopped.wait
        self.opened = False
        self._thread = threading.Thread(target=self._run, name=f"opens {source.name} again", daemon=True)
        self._thread.start()

    @property
    def done(self) -> bool:
        """True once it is open, or given up."""
        return not self._thread.is_alive()

    def stop(self, timeout: float = 1.0) -> None:
        """Give up, and wait for an attempt that is under way, so long at most [s]."""
        self._stopped.set()
        self._thread.join(timeout)

    def _run(self) -> None:
        self._source.close()
        for _ in range(_MAX_ATTEMPTS):
            if self._stopped.is_set() or self._wait(_ATTEMPT_PERIOD):
                return
            with suppress(ConeSkinError):  # not there yet; that it is gone has been reported
                self._source.open()
                self.opened = True
                return
