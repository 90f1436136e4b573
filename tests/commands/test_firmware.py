"""Command ``coneskin firmware``: what it writes for each board."""

import re
import xml.etree.ElementTree as ET

import pytest

from coneskin.cli import main
from coneskin.scene.reader import parse_scene
from coneskin.skin.firmware.boards import BOARD_FACTS, boards, converters, firmware_folder

CONE = "radius1_mm = 37.5\nradius2_mm = 37.5\nheight_mm = 240\nwrap_deg = 350\n"
each_board = pytest.mark.parametrize("board", list(BOARD_FACTS))


@pytest.fixture
def sensor_file(tmp_path):
    path = tmp_path / "sensor.toml"
    path.write_text(CONE, encoding="utf-8")
    return path


def write(sensor_file, *options):
    folder = sensor_file.parent / "board"
    return main(["firmware", str(sensor_file), "--to", str(folder), *options]), folder


def test_the_table_of_pins_has_a_row_for_each_board_that_facts_are_known_of():
    assert list(boards()) == list(BOARD_FACTS)


@each_board
def test_no_pin_of_a_board_does_two_things(board):
    row = boards()[board]
    channels = [*row.sense, row.current, row.supply]
    pins = [*row.rail, *row.ground, *row.pull_down, *row.select, *([row.common] if row.common else channels)]
    assert len(set(pins)) == len(pins)
    assert len(set(channels)) == 6


@each_board
def test_the_folder_holds_sketch_wiring_page_and_vectors(sensor_file, board, capsys):
    code, folder = write(sensor_file, "--board", board)
    assert code == 0
    product = firmware_folder()
    for path in [*(product / "coneskin").iterdir(), product / "frame_vectors.csv"]:
        assert (folder / path.relative_to(product)).read_bytes() == path.read_bytes()
    row, page = boards()[board], (folder / "board.md").read_text(encoding="utf-8")
    drawn = [text.text for text in ET.parse(folder / "wiring.svg").iter("{http://www.w3.org/2000/svg}text")]
    for pin in [*row.rail, *row.ground, *row.pull_down]:
        assert drawn.count(pin) == 1
        assert f"| {pin} | " in page
    assert drawn.count("10 kohm") == 2
    assert "shunt 11.3 ohm" in drawn
    assert "| shunt, 1 % | 11.3 ohm |" in page
    counts = {where: int(count) for count, where in re.findall(r"^\| (\d) \|.*\| ([^|]+) \|$", page, re.MULTILINE)}
    four = ("rail to A, B, C, D", "each gate of a switch to ground: open while the board starts")
    assert {counts[where] for where in (*four, "A, B, C, D to ground, at the channels")} == {4}
    assert counts["C and D to their pull-down pins"] == 2
    assert str(folder / "board.md") in capsys.readouterr().out


@each_board
def test_what_the_page_says_for_the_scene_is_a_scene(sensor_file, board):
    _, folder = write(sensor_file, "--board", board)
    page = (folder / "board.md").read_text(encoding="utf-8")
    lines = re.findall(r"^    (.*)$", page.split("The scene:")[1], re.MULTILINE)
    text = "\n".join(lines).replace("[[link.sensor]]", f'[[link]]\nname = "arm"\n[[link.sensor]]\n{CONE}')
    scene = parse_scene(text)
    assert scene.sensors[0].sensor.electronics.adc_bits == boards()[board].bits + 1


@pytest.mark.parametrize("converter", list(converters()))
def test_another_converter_is_in_sketch_wiring_page_and_scene(sensor_file, converter):
    code, folder = write(sensor_file, "--converter", converter)
    assert code == 0
    header, own = ((place / "coneskin" / "coneskin_board.h").read_text() for place in (folder, firmware_folder()))
    changed = [line for line in header.splitlines() if line not in own.splitlines()]
    assert changed == [f"#define CONESKIN_ADS {converter.removeprefix('ads')}"]
    page = (folder / "board.md").read_text(encoding="utf-8")
    drawn = [text.text for text in ET.parse(folder / "wiring.svg").iter("{http://www.w3.org/2000/svg}text")]
    for channel in converters()[converter].channels:
        assert drawn.count(channel) == 1
        assert f"| {channel} | " in page
    assert f"| 2 | converter, address pin to ground (0x48) and to its supply (0x49) | {converter.upper()} |" in page
    assert "AREF" not in page
    lines = re.findall(r"^    (.*)$", page.split("The scene:")[1], re.MULTILINE)
    scene = parse_scene("\n".join(lines).replace("[[link.sensor]]", f'[[link]]\nname = "arm"\n[[link.sensor]]\n{CONE}'))
    electronics = scene.sensors[0].sensor.electronics
    assert (electronics.adc_bits, electronics.adc_volts) == (converters()[converter].bits, 4.096)
    assert scene.monitoring_limits.skin_silence == pytest.approx(4.0 / converters()[converter].rate_hz)


def test_settings_of_a_sensor_that_is_another_one_are_on_the_page(sensor_file):
    sensor_file.write_text(CONE + 'id = 3\ndevice = 17\nradial_positive = "A"\nsupply_v = 2.048\n', encoding="utf-8")
    _, folder = write(sensor_file)
    page = (folder / "board.md").read_text(encoding="utf-8")
    assert re.findall(r"^    (\w+=\d+)$", page, re.MULTILINE) == [
        *("device=17", "sensor=3", "supply_permille=621", "a_positive=1")
    ]


def test_a_current_that_the_pins_do_not_stand_is_refused(sensor_file, capsys):
    sensor_file.write_text(CONE.replace("240", "36"), encoding="utf-8")
    code, folder = write(sensor_file, "--board", "pico")
    assert code == 1
    assert "the pins of a Raspberry Pi Pico carry at most 4 mA, and sensor 0/0 draws" in capsys.readouterr().err
    assert not folder.exists()


def test_a_file_of_the_users_is_not_replaced_unasked(sensor_file, capsys):
    sketch = sensor_file.parent / "board" / "coneskin" / "coneskin.ino"
    sketch.parent.mkdir(parents=True)
    sketch.write_text("my own", encoding="utf-8")
    code, folder = write(sensor_file)
    assert code == 1
    assert f"{sketch} would be replaced" in capsys.readouterr().err
    assert sketch.read_text(encoding="utf-8") == "my own"
    assert list(folder.iterdir()) == [sketch.parent]
    assert write(sensor_file, "--force")[0] == 0
    assert sketch.read_bytes() == (firmware_folder() / "coneskin" / "coneskin.ino").read_bytes()
    assert write(sensor_file)[0] == 0  # nothing in it is another


def test_a_file_that_is_no_sensor_is_refused(sensor_file, capsys):
    sensor_file.write_text("radius1_mm = 0", encoding="utf-8")
    assert write(sensor_file)[0] == 1
    assert "sensor.toml" in capsys.readouterr().err


def test_of_a_design_with_two_sheets_both_are_named(tmp_path, capsys):
    for number in (1, 2):
        (tmp_path / f"sheet-{number}").mkdir()
        (tmp_path / f"sheet-{number}" / "sensor.toml").write_text(CONE, encoding="utf-8")
    for asked in (tmp_path, tmp_path / "sensor.toml"):
        assert main(["firmware", str(asked), "--to", str(tmp_path / "board")]) == 1
        said = capsys.readouterr().err
        assert str(tmp_path / "sheet-1" / "sensor.toml") in said
        assert str(tmp_path / "sheet-2" / "sensor.toml") in said
