"""Line of a monitor: what has none is refused with what to name instead."""

from pathlib import Path

import pytest

from coneskin.commissioning.line.line import find_line
from coneskin.core.errors import SceneError, SkinConnectionError


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("scene.toml", r"a folder has no line; its scene has one: coneskin monitor .*scene\.toml"),
        ("design.json", r"the folder of a design, which has no line: .*coneskin init"),
        ("notes.txt", r"a folder without a recorded run \(run\.rec\) has no line"),
    ],
)
def test_a_folder_without_a_run_has_no_line(tmp_path: Path, file: str, words: str) -> None:
    (tmp_path / file).write_text("")
    with pytest.raises(SkinConnectionError, match=words):
        find_line(str(tmp_path), 921600)


def test_the_file_of_a_sensor_has_no_line(tmp_path: Path) -> None:
    file = tmp_path / "sensor.toml"
    file.write_text("radius1_mm = 50\nheight_mm = 100\n")
    with pytest.raises(SkinConnectionError, match="the file of a sensor, which has no line: name the port"):
        find_line(str(file), 921600)


def test_a_scene_has_the_line_of_its_source(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    link = '[[link]]\nname = "tube"\n[[link.sensor]]\nradius1_mm = 50\nradius2_mm = 50\nheight_mm = 100\n'
    file.write_text(link)
    with pytest.raises(SceneError, match=r"there is no \[source\], so there is no line to listen to"):
        find_line(str(file), 921600)
    file.write_text(link + '[source]\nkind = "serial"\nport = "/dev/ttyUSB7"\nbaud = 115200\n')
    line = find_line(str(file), 921600)
    assert line.source is not None
    assert (line.source.name, line.baud, len(line.sensors)) == ("/dev/ttyUSB7", 115200, 1)


def test_a_file_of_bytes_is_read_whole_and_has_no_times(tmp_path: Path) -> None:
    file, data = tmp_path / "line.bin", bytes(range(256)) * 20
    file.write_bytes(data)
    pieces = list(find_line(str(file), 921600).pieces())
    assert b"".join(piece for _, piece in pieces) == data
    assert {time for time, _ in pieces} == {0.0}
