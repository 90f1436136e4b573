"""Bound to the memory of a process: what a program hoards ends the program, not the computer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["SIMULATOR", "TRANSLATOR", "bounded_memory"]

SIMULATOR = 512 * 2**20  #: bytes that the simulated controller may take beyond what it has at its start
TRANSLATOR = 1024 * 2**20  #: bytes for the translation of a program, likewise
_STATUS = Path("/proc/self/statm")


@contextmanager
def bounded_memory(beyond: int) -> Iterator[bool]:
    """Let this process take so many bytes more than it has now; a request for more raises MemoryError.

    Yields:
        whether that is possible: on Linux alone.
    """
    try:
        import resource

        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        now = int(_STATUS.read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (now + beyond, hard))
    except (ImportError, OSError, ValueError):
        yield False
        return
    try:
        yield True
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
