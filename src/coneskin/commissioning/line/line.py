"""Line that a monitor listens to: a port, the source of a scene, a recording, or a file of bytes."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from coneskin.core.errors import SceneError, SkinConnectionError
from coneskin.core.files import explain_os_error, read_file
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.kinds import open_source
from coneskin.skin.sources.source import Source

_MAX_SIZE = 1 << 28  # bytes of a file of bytes
_PIECE_SIZE = 4096  # bytes of a file that are taken at once


@dataclass(frozen=True, slots=True)
class Line:
    """A line to listen to; either a source or a file."""

    name: str  #: for messages
    source: Source | None = None  #: not open yet; None for a file
    path: Path | None = None  #: of a file
    recorded: bool = False  #: the file is a recording, which has the times of its bytes
    sensors: tuple[Sensor, ...] = ()  #: that a scene expects
    baud: int | None = None  #: rate of the port [1/s]; None where there is none

    def pieces(self) -> Iterator[tuple[float, bytes]]:
        """Yield the bytes of a file with their times [s]; all of them are 0 where the file has none.

        Raises:
            RecordingError: the recording cannot be read.
            SkinConnectionError: the file cannot be read.
        """
        assert self.path is not None
        if self.recorded:
            from coneskin.core.recording.reader import read_recording
            from coneskin.robot.guard.signals.journal import BlockKind

            recording = read_recording(self.path)
            for block in recording.select(kinds=frozenset({BlockKind.SKIN})):
                yield block.time, block.payload
            return
        with explain_os_error(SkinConnectionError, f"{self.path} cannot be read"):
            data = read_file(self.path, _MAX_SIZE)
        for at in range(0, len(data), _PIECE_SIZE):
            yield 0.0, data[at : at + _PIECE_SIZE]


def find_line(target: str, baud: int) -> Line:
    """Return the line that a word of the user means.

    Args:
        target: a port or URL, a scene file, a run's folder, a recording, or a file of bytes.
        baud: for a port [1/s].

    Raises:
        SceneError: the scene has mistakes, or no source.
        SkinConnectionError: the word means a folder without a run, or the file of a sensor.
    """
    path = Path(target)
    if (path / "run.rec").is_file():
        path /= "run.rec"
    if path.is_dir():
        raise SkinConnectionError(f"{target}: {_folder_advice(path)}")
    if not path.is_file():
        return Line(target, open_source("serial", {"port": target, "baud": baud}), baud=baud)
    if path.suffix == ".toml":
        return _line_of_scene(path)
    from coneskin.core.recording.chunk import MAGIC

    with path.open("rb") as file:
        head = file.read(len(MAGIC))
    return Line(target, path=path, recorded=head == MAGIC or path.suffix == ".rec")


def _folder_advice(path: Path) -> str:
    """Return what to name instead of a folder in which there is no run."""
    if (path / "scene.toml").is_file():
        return f"a folder has no line; its scene has one: coneskin monitor {path / 'scene.toml'}"
    if (path / "design.json").is_file():
        return "this is the folder of a design, which has no line: name the port, or write its scene (coneskin init)"
    return "a folder without a recorded run (run.rec) has no line: name a port, a scene, a run or a file of bytes"


def _refuse_sensor(path: Path) -> None:
    """Refuse the file of a sensor, which says nothing of a port."""
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return  # the reader of scenes says it better
    if "radius1_mm" in table and not {"source", "link", "arm"} & table.keys():
        raise SkinConnectionError(
            f"{path}: this is the file of a sensor, which has no line: name the port to which its board is connected, "
            "or the scene that refers to it"
        )


def _line_of_scene(path: Path) -> Line:
    from coneskin.scene.reader import load_scene

    _refuse_sensor(path)
    scene = load_scene(path)
    if scene.source is None:
        raise SceneError(["there is no [source], so there is no line to listen to"], scene.name)
    sensors = tuple(item.sensor for item in scene.sensors)
    settings = scene.source.settings
    baud = settings.get("baud")
    if scene.source.kind == "virtual":
        from coneskin.session.skin_process import virtual_skin
        from coneskin.skin.virtual.memory_source import MemorySource

        source: Source = MemorySource(virtual_skin(scene), real_time=True)
    else:
        source = open_source(scene.source.kind, settings)
    return Line(scene.name, source, sensors=sensors, baud=baud)
