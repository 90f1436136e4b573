"""Protocol of a source of bytes, reopening of one that is gone, and several that are read as one.

Opening a port may take seconds, a guard's loop may not: so it is done in a thread of its own. A guard has one stream of
bytes, which is what it records and replays. Where sensors are on several ports, frames that are cut must not be mixed:
what one port sends is handed on up to its last whole frame.
"""

from __future__ import annotations

import select
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from types import TracebackType
from typing import Any, Protocol, Self, runtime_checkable

from coneskin.core.errors import ConeSkinError, SensorError, SkinConnectionError, SkinTimeout


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


_TURN_TIME = 0.001  # s for each source in turn, where there is nothing to wait on for all of them


class _FrameBoundary:
    """A stream of bytes that is handed on in whole frames; what is no frame goes with the next one."""

    __slots__ = ("_decoder", "_rest")

    def __init__(self) -> None:
        from coneskin.skin.wire import FrameDecoder  # not where a scene is only read

        self._decoder = FrameDecoder()
        self._rest = b""

    def cut(self, data: bytes) -> bytes:
        """Take the next bytes; return all that belong to whole frames, or to none, with what was kept before."""
        self._decoder.feed(data)
        whole = self._rest + data
        end = len(whole) - self._decoder.pending
        self._rest = whole[end:]
        return whole[:end]


class SourceGroup(Source):
    """Several sources as one.

    It is gone as soon as one of them is: a guard that lost a part of its skin must not go on with the rest.

    Args:
        sources: at least two, none open; they must not be used otherwise.

    Attributes:
        name: all their names.

    Raises:
        SensorError: there are fewer than two, or two have the same name: one port cannot be read twice.
    """

    def __init__(self, sources: Sequence[Source]) -> None:
        names = [source.name for source in sources]
        if len(sources) < 2 or len(set(names)) < len(names):
            raise SensorError(
                f"a group needs two or more sources with different ports, got {', '.join(names) or 'none'}"
            )
        self.name = " + ".join(names)
        self._sources = tuple(sources)
        self._cuts = {source.name: _FrameBoundary() for source in sources}
        self._opened = False
        self._poll: Any = None
        self._by_descriptor: dict[int, Source] = {}

    def open(self) -> None:
        """Open all of them, or none."""
        if self._opened:
            return
        try:
            for source in self._sources:
                source.open()
        except BaseException:
            self.close()
            raise
        self._opened = True
        self._cuts = {source.name: _FrameBoundary() for source in self._sources}
        descriptors = [source.fileno() for source in self._sources]
        if hasattr(select, "epoll") and None not in descriptors:
            self._poll = select.epoll()
            for source, descriptor in zip(self._sources, descriptors, strict=True):
                assert descriptor is not None
                self._by_descriptor[descriptor] = source
                self._poll.register(descriptor, select.EPOLLIN)

    def close(self) -> None:
        """Close all of them."""
        poll, self._poll, self._opened = self._poll, None, False
        self._by_descriptor.clear()
        if poll is not None:
            poll.close()
        for source in self._sources:
            source.close()

    def fileno(self) -> int | None:
        """Return a descriptor that becomes readable with any of them, or None where the system has no such thing."""
        return None if self._poll is None else int(self._poll.fileno())

    def read(self, timeout: float) -> bytes:
        """Wait for whole frames of any of them, as every Source does."""
        if not self._opened:
            raise SkinConnectionError(f"{self.name} is not open: call open, or read it inside a with")
        deadline = time.monotonic() + timeout
        left = timeout
        while True:
            ready, wait = list(self._sources), _TURN_TIME
            if self._poll is not None:
                ready, wait = [self._by_descriptor[number] for number, _ in self._poll.poll(max(left, 0.0))], 0.0
            if data := b"".join(self._read_one(source, wait) for source in ready):
                return data
            left = deadline - time.monotonic()
            if left <= 0.0:
                raise SkinTimeout(f"{self.name}: no bytes for {timeout * 1e3:.0f} ms")

    def _read_one(self, source: Source, timeout: float) -> bytes:
        try:
            return self._cuts[source.name].cut(source.read(timeout))
        except SkinTimeout:
            return b""
