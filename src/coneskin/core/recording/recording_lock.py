"""Lock on a recording that goes on: its recorder holds it, and nobody replaces the file under the recorder.

A file that is replaced while it is written loses what comes after: the recorder goes on in one that has no name any
more. The system forgets the lock when the recorder's process ends, however that ends. Reading needs no lock.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from coneskin.core.errors import RecordingError
from coneskin.core.files import open_file

if sys.platform != "win32":
    import fcntl

__all__ = ["hold_against_recorder", "mark_recorded"]


def mark_recorded(file: BinaryIO) -> None:
    """Hold the lock of a file until it is closed; a file system without locks has none."""
    if sys.platform != "win32":
        with suppress(OSError):
            fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def hold_against_recorder(path: Path, limit: int) -> Iterator[None]:
    """Hold the lock of a file that no recorder writes.

    Args:
        path: the file.
        limit: its largest length [bytes].

    Raises:
        RecordingError: it is being recorded now, or cannot be read.
    """
    try:
        file = open_file(path, limit)
    except OSError as exc:
        raise RecordingError(f"cannot read the recording {path}: {exc.strerror or exc}") from exc
    with file:
        if sys.platform != "win32":
            try:
                fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise RecordingError(
                    f"{path} is being recorded now, or pruned by somebody else: wait until that has ended"
                ) from None
            except OSError:
                pass  # a file system without locks
        yield
