"""Protocol of a source of bytes: what a real port and a virtual one have in common."""

from __future__ import annotations

from types import TracebackType
from typing import Protocol, Self, runtime_checkable

__all__ = ["Openable", "Source"]


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
        """Wait for bytes.

        Args:
            timeout: longest time to wait [s].

        Returns:
            what has arrived, at least one byte, never more than a few kilobytes.

        Raises:
            SkinTimeout: nothing arrived in time; the source stays open.
            SkinConnectionError: it is gone, or not open.
        """
        ...
