"""Files of recorded runs: those that a path stands for."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from coneskin.core.errors import RecordingError

__all__ = ["find_recordings", "is_further_part", "is_run", "run_name"]

_IN_FOLDER = "run.rec"
_SUFFIX = ".rec"
_PART = re.compile(r"(.+)\.\d{4}\.rec")


def is_run(path: Path) -> bool:
    """Tell whether a path is one run: a file, or a folder with a recording of that name in it."""
    return path.is_file() or (path / _IN_FOLDER).is_file()


def run_name(path: Path) -> str:
    """Return the name of a run for people: that of its folder, or of a file with a name of its own."""
    return path.parent.name or path.stem if path.name == _IN_FOLDER else path.stem


def find_recordings(paths: Iterable[Path], beside: bool = False) -> list[Path]:
    """Return the recordings that these paths stand for: files, folders of runs, and folders of such folders.

    Args:
        paths: in the order in which they are wanted; what is in a folder is sorted by its path.
        beside: a run's folder stands for all that is in it and below, and not for that run alone.

    Raises:
        RecordingError: a path does not exist, or there is no recording below it.
    """
    found: dict[Path, None] = {}
    for path in paths:
        if not path.exists():
            raise RecordingError(f"there is no run {path}: name a recording, or a folder with recordings in it")
        if not (below := dict.fromkeys(_recordings(path, beside))):
            raise RecordingError(f"there is no recording (*{_SUFFIX}) in {path} or below it")
        found.update(below)
    return list(found)


def _recordings(path: Path, beside: bool) -> Iterator[Path]:
    if path.is_file():
        yield path
    elif (path / _IN_FOLDER).is_file() and not beside:
        yield path / _IN_FOLDER
    elif path.is_dir():
        yield from sorted(item for item in path.rglob(f"*{_SUFFIX}") if item.is_file() and not is_further_part(item))


def is_further_part(path: Path) -> bool:
    """Tell whether a file is a further part of a recording: ``run.0001.rec`` of ``run.rec``."""
    match = _PART.fullmatch(path.name)
    return match is not None and path.with_name(match[1] + _SUFFIX).is_file()
