"""Line of a monitor: what has none is refused with what to name instead."""

from pathlib import Path

import pytest

from coneskin.commissioning.line.line import find_line
from coneskin.core.errors import SkinConnectionError


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
