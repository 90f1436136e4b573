"""Files of recorded runs: which ones a path stands for, and what is in each of them."""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from coneskin.core.errors import RecordingError
from coneskin.core.progress import Progress, silent
from coneskin.core.recording.block import is_time
from coneskin.robot.guard.signals.journal import BlockKind, EventName

from .replay.run import Run, run_path

_IN_FOLDER = "run.rec"
_FILE_SUFFIX = ".rec"
_PART_PATTERN = re.compile(r"(.+)\.\d{4}\.rec")


def is_run(path: Path) -> bool:
    """Tell whether a path is one run: a file, or a folder with a recording of that name in it."""
    path = run_path(path)
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
    for path in map(run_path, paths):
        if not path.exists():
            raise RecordingError(f"there is no run {path}: name a recording, or a folder with recordings in it")
        if not (below := dict.fromkeys(_recordings(path, beside))):
            raise RecordingError(f"there is no recording (*{_FILE_SUFFIX}) in {path} or below it")
        found.update(below)
    return list(found)


def _recordings(path: Path, beside: bool) -> Iterator[Path]:
    if path.is_file():
        yield path
    elif (path / _IN_FOLDER).is_file() and not beside:
        yield path / _IN_FOLDER
    elif path.is_dir():
        yield from sorted(
            item for item in path.rglob(f"*{_FILE_SUFFIX}") if item.is_file() and not is_further_part(item)
        )


def is_further_part(path: Path) -> bool:
    """Tell whether a file is a further part of a recording: ``run.0001.rec`` of ``run.rec``."""
    match = _PART_PATTERN.fullmatch(path.name)
    return match is not None and path.with_name(match[1] + _FILE_SUFFIX).is_file()


def summarise_run(path: Path, run: Run, progress: Progress = silent) -> dict[str, Any]:
    """Return what is in a run, as values for JSON with units in the names; None where there is nothing to tell.

    Times count from the start of the run, but ``began``, which is local time. ``size_bytes`` is that of the first file,
    ``commissioned`` says why the arm may move away or only stops, ``blocks`` how many there are of each kind, and
    ``cut`` what the run was cut from.

    Raises:
        SceneError: this version of coneskin cannot read its scene.
        RecordingError: an event cannot be read.
    """
    scene, header, kinds = run.scene(), run.header, Counter[int]()
    for block in run.select(progress=progress):
        kinds[block.kind] += 1
    since, until = run.span
    names = Counter(event.name for event in run.events)
    unix, cut = header["clocks"].get("unix"), header.get("cut")
    dated = is_time(unix) and 0.0 <= unix < 1e11
    file = path / "run.rec" if path.is_dir() else path
    known = {kind.value: kind.name.lower() for kind in BlockKind}
    return {
        "run": run_name(file),
        "path": str(file),
        "size_bytes": file.stat().st_size,
        "began": time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(unix)) if dated else None,
        "first_s": since - run.start,
        "duration_s": until - since,
        "contacts": names[EventName.CONTACT],
        "stops": names[EventName.STOPPING],
        "faults": names[EventName.FAULT],
        "missing": run.missing or None,
        "arm": scene.arm.model if scene.arm else None,
        "sensors": [f"{item.sensor.name} ({link.name})" for link in scene.links for item in link.sensors],
        "reaction": scene.default_reaction.kind if scene.arm else None,
        "coneskin": run.recorded_by or None,
        "commissioned": (run.commissioning.note or None) if run.commissioning and scene.arm else None,
        "blocks": {known.get(kind, f"kind {kind}"): count for kind, count in sorted(kinds.items())},
        "cut": cut if isinstance(cut, dict) else None,
    }
