"""Draft of a file: what is written beside it, and takes its place once all of it is on the disk."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["draft_of"]


@contextmanager
def draft_of(path: Path, overwrite: bool = False) -> Iterator[Path]:
    """Yield where to write a file, so that whoever reads it, or pulls the plug, finds the whole file or none.

    Args:
        path: the file; at the end of the ``with`` the draft gets its name. After an error there is neither.
        overwrite: in place of an older file.

    Raises:
        FileExistsError: there is one, and it must stay.
        OSError: the draft cannot be written or renamed.
    """
    draft = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        yield draft
        _bring_to_disk(draft)
        if not overwrite and path.exists():
            raise FileExistsError(17, "File exists", str(path))
        draft.replace(path)
        with suppress(OSError):  # a folder cannot be opened everywhere
            _bring_to_disk(path.parent)
    finally:
        with suppress(OSError):
            draft.unlink()


def _bring_to_disk(path: Path) -> None:
    number = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(number)
    finally:
        os.close(number)
