"""Command ``coneskin firmware``: what it writes for each board."""

import argparse
import csv
import os
import re
import shutil
import xml.etree.ElementTree as ET
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.commands.firmware import add_arguments
from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.scene.reader import parse_scene
from coneskin.skin.electronics import Electronics
from coneskin.skin.firmware.board_circuit import board_circuit
from coneskin.skin.firmware.board_page import board_page, wiring_diagram
from coneskin.skin.firmware.boards import BUILT_IN, boards, converters, firmware_folder, part_catalog
from coneskin.skin.sensor import Sensor
from tests.support.firmware.spice_deck import SENSORS

CONE = "radius1_mm = 37.5\nradius2_mm = 37.5\nheight_mm = 240\nwrap_deg = 350\n"
OWN = [name for name, row in boards().items() if row.sense]
each_board = pytest.mark.parametrize("board", OWN)


@pytest.fixture
def sensor_file(tmp_path):
    path = tmp_path / "sensor.toml"
    path.write_text(CONE, encoding="utf-8")
    return path


def write(sensor_file, *options):
    folder = sensor_file.parent / "board"
    return main(["firmware", str(sensor_file), "-o", str(folder), *options]), folder


def part_rows(folder):
    return list(csv.DictReader((folder / "parts.csv").read_text(encoding="utf-8").splitlines()))


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
    prefix = "GP" if board == "pico" else ""
    for pin in [prefix + pin for pin in (*row.rail, *row.ground, *row.pull_down)]:
        assert pin in drawn
        assert f"| {pin} | " in page
    parts = {row["names"].split()[0]: row for row in part_rows(folder)}
    first = parts["R1"]
    assert first["value"] == "11.3 ohm"
    assert (first["number"], first["second source"]) == ("Yageo RC0805FR-0711R3L", "Vishay CRCW080511R3FKEA")
    assert parts["A1"]["value"] == part_catalog()[board]["facts"]["title"]
    assert parts["XU2"]["names"] == "XU2 XU5 XU6"  # adapters of the amplifier and the clamps
    for row in parts.values():
        assert float(row["EUR"]) == pytest.approx(int(row["count"]) * float(row["EUR each"]))
    assert all(row["number"] and row["second source"] and row["data sheet"] for row in parts.values())
    assert [row["count"] for row in parts.values() if row["value"] == "100 kohm"] == ["8"]
    assert parts["U2"]["limits not sourced"] == "offset_uv gain_percent bandwidth_hz"
    assert all(row["limits not sourced"] == "" for row in parts.values() if "TNPW" in row["number"])
    assert str(folder / "board.md") in capsys.readouterr().out


def test_every_limit_says_where_it_stands():
    catalog = part_catalog()
    assert {name for name, row in catalog.items() if {*row["limits"]} != {*row.get("sources", {})}} == set()
    assert {*boards()} <= {*catalog}


@each_board
def test_what_the_page_says_for_the_scene_is_a_scene(sensor_file, board):
    _, folder = write(sensor_file, "--board", board)
    page = (folder / "board.md").read_text(encoding="utf-8")
    lines = re.findall(r"^    (.*)$", page.split("The scene:")[1], re.MULTILINE)
    text = "\n".join(lines).replace("[[link.sensor]]", f'[[link]]\nname = "arm"\n[[link.sensor]]\n{CONE}')
    scene = parse_scene(text)
    assert scene.sensors[0].sensor.electronics.adc_bits == boards()[board].bits + 1


@pytest.mark.parametrize("supply", [2.5, 2.048])
def test_what_a_scene_is_told_is_what_the_parts_make(supply):
    """From the values on the list alone: a pin of 30 ohm and a wire of 1 ohm are the only ones that are not on it."""
    sensor = Sensor(Frustum(0.0375, 0.0375, 0.24, 6.1), electronics=replace(Electronics(), supply_volts=supply))
    circuit, units = board_circuit("pico", sensor), {"ohm": 1.0, "kohm": 1e3, "Mohm": 1e6}

    def between(one, other):
        (value,) = (c.value for c in circuit.components if [*c.pins.values()] == [one, other] and c.name[0] == "R")
        figure, unit = value.split()
        return float(figure) * units[unit]

    shunt, down, beside = between("REG", "RAIL"), between("DRIVE_C", "DOWN_C"), between("S_C", "GND")
    low, high = between("BIAS", "GND"), between("3V3", "BIAS")
    on = part_catalog()["switch"]["limits"]["on_ohm"][0]
    assert circuit.keys == {
        "adc_v": 3.3,
        "adc_bits": boards()["pico"].bits + 1,
        "lead_ohm": [pytest.approx(1.0 + on)] * 4,
        "supply_v": 2.5 if supply == 2.5 else pytest.approx(1e-4 * between("SET", "GND")),
        "pulldown_ohm": pytest.approx(1.0 / (1.0 / (down + 31.0) + 1.0 / beside) + 1.0 + on, abs=0.06),
        "input_ohm": pytest.approx(beside),
        "current_full_scale_ma": pytest.approx(1e3 * 3.3 / (50.0 * shunt), rel=2e-3),  # the list has three digits
        "current_zero_ma": pytest.approx(1e3 * 3.3 * low / (low + high) / (50.0 * shunt), rel=2e-3),
    }
    assert beside == max(470e3, 10.0 * down)


@pytest.mark.parametrize("converter", list(converters()))
def test_another_converter_is_in_sketch_wiring_page_and_scene(sensor_file, converter):
    code, folder = write(sensor_file, "--converter", converter)
    assert code == 0
    header, own = ((place / "coneskin" / "coneskin_board.h").read_text() for place in (folder, firmware_folder()))
    changed = [line for line in header.splitlines() if line not in own.splitlines()]
    assert changed == [f"#define CONESKIN_CONVERTER {re.sub(r'[a-z]', '', converter)}"]
    page = (folder / "board.md").read_text(encoding="utf-8")
    drawn = [text.text for text in ET.parse(folder / "wiring.svg").iter("{http://www.w3.org/2000/svg}text")]
    chips = 1 if converter == "ltc1867" else 2
    assert sum(converter.upper() in words for words in drawn) == chips
    assert [row["count"] for row in part_rows(folder) if converter.upper() in row["number"]] == [str(chips)]
    assert "AREF" not in page
    lines = re.findall(r"^    (.*)$", page.split("The scene:")[1], re.MULTILINE)
    scene = parse_scene("\n".join(lines).replace("[[link.sensor]]", f'[[link]]\nname = "arm"\n[[link.sensor]]\n{CONE}'))
    electronics = scene.sensors[0].sensor.electronics
    assert (electronics.adc_bits, electronics.adc_volts) == (converters()[converter].bits, 4.096)
    silence = max(0.05, 4.0 / converters()[converter].rate_hz)  # at least what a scene has by default
    assert scene.monitoring_limits.skin_silence == pytest.approx(silence)


def test_settings_of_a_sensor_that_is_another_one_are_on_the_page(sensor_file):
    sensor_file.write_text(CONE + 'id = 3\ndevice = 17\nradial_positive = "A"\nsupply_v = 2.048\n', encoding="utf-8")
    _, folder = write(sensor_file)
    page = (folder / "board.md").read_text(encoding="utf-8")
    assert re.findall(r"^    (\w+=\d+)$", page, re.MULTILINE) == [
        *("device=17", "sensor=3", "supply_permille=621", "a_positive=1")
    ]


def test_a_current_that_the_switches_do_not_stand_is_refused(sensor_file, capsys):
    sensor_file.write_text(CONE + "upper_sheet_ohm = 1\nlower_sheet_ohm = 1\nsupply_v = 1.25\n", encoding="utf-8")
    code, folder = write(sensor_file, "--board", "pico")
    assert code == 1
    assert "the switches of a board carry at most 250 mA, and sensor 0/0 draws" in capsys.readouterr().err
    assert not folder.exists()


def test_the_converter_of_an_esp32_is_not_offered(sensor_file, capsys):
    code, folder = write(sensor_file, "--board", "esp32")
    assert code == 1
    assert "give it a converter, as with --converter ads1115" in capsys.readouterr().err
    assert not folder.exists()
    assert write(sensor_file, "--board", "esp32", "--converter", "ads1115")[0] == 0


def test_switches_of_half_an_ohm_are_for_pins_of_3_3_volts(sensor_file, capsys):
    sensor_file.write_text(CONE + "upper_sheet_ohm = 20\n", encoding="utf-8")
    assert write(sensor_file)[0] == 1
    assert "whose inputs stand 3.3 V" in capsys.readouterr().err
    assert write(sensor_file, "--board", "pico")[0] == 0
    assert "ADG812" in (sensor_file.parent / "board" / "parts.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize(("board", "converter"), [*((name, BUILT_IN) for name in OWN), ("esp32", "ads1115")])
def test_the_netlist_joins_what_belongs_together(board, converter):
    circuit = board_circuit(board, Sensor(Frustum(0.0375, 0.0375, 0.24, 6.1)), converter)
    nets = defaultdict(list)
    for name, part, _, _, pins in circuit.components:
        assert part in part_catalog()
        for pin, net in pins.items():
            nets[net].append((name, part, pin))
    assert {net for net, at in nets.items() if len(at) < 2} == set()  # every net joins something
    names = [component.name for component in circuit.components]
    assert len(set(names)) == len(names)
    for wire in (f"{kind}_{electrode}" for kind in "ES" for electrode in "ABCD"):  # each foil wire is protected
        parts = [part for _, part, _ in nets[wire]]
        assert parts.count("clamp") == parts.count("connector") == 1
        assert {"bead", "resistor"} & set(parts)
        assert "filter" in [part for _, part, _ in nets[wire if wire[0] == "E" else f"ADC_{wire[-1]}"]]
    for net in [f"{gate}_{electrode}" for gate in ("HIGH", "LOW") for electrode in "ABCD"]:
        assert sorted(part for _, part, _ in nets[net]) == sorted([board, "resistor", "switch"])
    assert [(part, pin) for _, part, pin in nets["BIAS"] if part == "amplifier"] == [("amplifier", "REF")]


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
        assert main(["firmware", str(asked), "-o", str(tmp_path / "board")]) == 1
        said = capsys.readouterr().err
        assert str(tmp_path / "sheet-1" / "sensor.toml") in said
        assert str(tmp_path / "sheet-2" / "sensor.toml") in said


AVR = shutil.which("avr-gcc") is not None and Path("/usr/share/arduino/hardware/arduino/avr").is_dir()
AVRDUDE = """#!/bin/sh
echo "$@" >> {log}
case "$*" in *"-b {baud}"*) for last; do :; done;; *) echo "avrdude: not in sync" >&2; exit 1;; esac
for word; do case "$word" in flash:w:*) cp "$(echo "$word" | cut -d: -f3)" {log}.elf;; esac; done
"""


@pytest.mark.long
@pytest.mark.processes
@pytest.mark.skipif(not AVR, reason="no compiler: apt-get install gcc-avr avr-libc arduino-core-avr")
@pytest.mark.parametrize("baud", ["115200", "57600", "none"])
def test_the_sketch_is_compiled_and_handed_to_the_programmer(sensor_file, tmp_path, monkeypatch, capsys, baud):
    tool = tmp_path / "bin" / "avrdude"
    tool.parent.mkdir()
    tool.write_text(AVRDUDE.format(log=tmp_path / "log", baud=baud), encoding="ascii")
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tool.parent}:{os.environ['PATH']}")
    code, _ = write(sensor_file, "--flash", "/dev/ttyNONE")
    said = capsys.readouterr()
    asked = (tmp_path / "log").read_text(encoding="ascii").splitlines()
    assert all("-p atmega328p -c arduino -P /dev/ttyNONE -D" in line for line in asked)
    if baud == "none":
        assert code == 1
        assert "avrdude cannot write to the board at /dev/ttyNONE: avrdude: not in sync" in said.err
        return
    assert code == 0
    assert "flashed the board at /dev/ttyNONE" in said.out
    assert len(asked) == ("115200", "57600").index(baud) + 1
    assert b"coneskin firmware=" in (tmp_path / "log.elf").read_bytes()


def test_without_a_compiler_it_says_what_to_install(sensor_file, monkeypatch, capsys):
    monkeypatch.setenv("PATH", "")
    assert write(sensor_file, "--board", "pico", "--flash", "/dev/ttyNONE")[0] == 1
    assert "install arduino-cli with the core of rp2040:rp2040:rpipico" in capsys.readouterr().err


@pytest.mark.parametrize(("board", "converter"), [("pico", BUILT_IN), ("uno", "ads1115"), ("uno", "ltc1867")])
def test_pins_have_the_numbers_of_their_footprints(board, converter):  # and U1 is set to what a resistor of E96 gives
    sensor = Sensor(Frustum(0.0375, 0.0375, 0.24, 6.1), electronics=replace(Electronics(), supply_volts=2.048))
    circuit, catalog = board_circuit(board, sensor, converter), part_catalog()
    netlist = circuit.kicad_netlist()
    for name, part, _, _, pins in circuit.components:
        numbers = re.findall(rf'\(ref "{re.escape(name)}"\) \(pin "([^"]+)"\)', netlist)
        assert len(numbers) == len({*numbers}) >= len(pins)
        assert all(number.isdecimal() for number in numbers)
        if len(pins) > 2 and part != "connector":
            assert {*pins} <= {*catalog[part]["pins"]}
            assert catalog[part]["pins_source"]
    assert '(ref "U1") (value "Analog Devices LT3045EMSE#PBF") (footprint "Package_SO:MSOP-12' in netlist
    assert circuit.sensor.electronics.supply_volts == pytest.approx(2.05)
    assert next(c for c in circuit.components if c.pins.get("1") == "SET").value == "20.5 kohm"


BUILDS = [
    *((name, BUILT_IN) for name in OWN),
    *((name, converter) for name in boards() for converter in ("ads1115", "ads1015")),
    *((name, "ltc1867") for name in ("uno", "nano-every")),
]


@pytest.mark.parametrize(("board", "converter"), BUILDS)
def test_no_pad_of_a_board_is_in_two_nets(board, converter):
    circuit = board_circuit(board, Sensor(Frustum(0.0375, 0.0375, 0.24, 6.1)), converter)
    pads = part_catalog()[board]["pins"]
    used = [(pad, net) for pin, net in circuit.pins.items() for pad in pads[pin]]
    assert len({pad for pad, _ in used}) == len({*used})
    netlist = circuit.kicad_netlist()
    for pad, net in used:
        assert re.search(rf'\(name "{net}"\).*\(ref "A1"\) \(pin "{pad}"\)', netlist)


@pytest.mark.parametrize(
    ("ohms", "number", "second"),
    [
        (0.62, "Yageo RL1206FR-070R62L", "Vishay RCWE1206R620FKEA"),
        (1.27, "Yageo RC1206FR-071R27L", "Vishay CRCW12061R27FKEA"),
    ],
)
def test_a_shunt_of_any_size_has_two_order_numbers(ohms, number, second):
    parts = replace(Electronics(), current_full_scale=3.3 / (50.0 * ohms))
    listed = board_circuit("pico", Sensor(Frustum(0.0375, 0.0375, 0.24, 6.1), electronics=parts)).part_list()
    row = next(row for row in csv.DictReader(listed.splitlines()) if row["names"] == "R1")
    assert (row["number"], row["second source"]) == (number, second)


@pytest.mark.parametrize("sensor", SENSORS)
def test_the_amplifier_still_reads_twice_the_current(sensor):
    circuit = board_circuit("pico", SENSORS[sensor])
    ends = (3.3 * 0.985 - 0.04) / (50.0 * circuit.shunt_ohms) - circuit.sensor.electronics.current_zero
    assert ends > 2.0 * max(circuit.sensor.radial_amperes, circuit.sensor.angular_amperes)


PINOUTS = {  # of what may stand on the pads of another part, from the documents of the second one
    "XC6206P252MR-G": "GND OUT IN",
    "INA186A2IDCKR": "REF GND VS IN+ IN- OUT",
    "ADG1612BRUZ": "SEL1 D1 S1 NC GND S4 D4 SEL4 SEL3 D3 S3 NC VDD S2 D2 SEL2",
    "ADG708BRUZ": "A0 EN VSS S1 S2 S3 S4 D S8 S7 S6 S5 VDD GND A2 A1",
    "LTC1863CGN#PBF": "CH0 CH1 CH2 CH3 CH4 CH5 CH6 CH7/COM REFCOMP VREF CS/CONV SCK SDO SDI GND VDD",
}
SAME_BOARD = {"ESP32-DevKitC-VE", "SC0917", "DEV-15583"}  # all pads at their places


def test_a_second_source_has_the_pads_of_the_first_or_says_so():
    for name, row in part_catalog().items():
        second = row.get("second", "")
        if len(row["pins"]) < 3 or second.startswith("none") or re.search(r"other (pads|pins)", second):
            continue
        maker_number = next(word for word in second.split() if word in {*PINOUTS, *SAME_BOARD})  # else nobody looked
        if maker_number in PINOUTS:
            pads = PINOUTS[maker_number].split()
            assert row["pins"] == {pin: [str(k) for k, at in enumerate(pads, 1) if at == pin] for pin in pads}, name


NOT_TO_DRIVE = {  # GPIO that are a module's own, that set how it starts, its serial port, and inputs alone
    "ESP32-DevKitC-32E": {*range(6, 12), 0, 2, 5, 12, 15, 1, 3, *range(34, 40)},
    "ESP32-DevKitC-VE": {*range(6, 12), 16, 17, 0, 2, 5, 12, 15, 1, 3, *range(34, 40)},  # 16, 17: its PSRAM
}


def test_pins_of_an_esp32_can_be_driven_on_each_board_that_is_named():
    row, board = part_catalog()["esp32"], boards()["esp32"]
    for number in (row["number"], row["second"]):
        taken = NOT_TO_DRIVE[number.split()[-1]]
        assert taken.isdisjoint(map(int, (*board.rail, *board.ground, *board.pull_down))), number


@pytest.mark.parametrize(("board", "converter"), BUILDS)
def test_what_is_to_be_typed_means_this_board_and_what_is_printed_on_it(board, converter):
    circuit = board_circuit(board, Sensor(Frustum(0.0375, 0.0375, 0.24, 6.1)), converter)
    page, drawing = board_page(circuit), wiring_diagram(circuit)
    (line,) = re.findall(r"^    coneskin firmware (.*)$", page, re.MULTILINE)
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    asked = parser.parse_args(line.split())
    assert (asked.board, asked.converter) == (board, converter)
    port = "/dev/ttyUSB0" if board == "esp32" else "/dev/ttyACM0"  # a bridge, or USB of the board's own
    assert asked.flash == port
    assert {*re.findall(r"/dev/tty\w+(?=[ \"])", page.split("Build it")[0] + page.split("First steps")[1])} == {port}
    assert "numbers are pads, of A1 names on it" in drawing
    if converter.startswith("ads"):
        wire = {"esp32": ("21", "22"), "pico": ("GP4", "GP5"), "teensy": ("18", "19")}.get(board, ("A4", "A5"))
        assert [circuit.pins[pin] for pin in wire] == ["SDA", "SCL"]
    strip = next(row for row in csv.DictReader(circuit.part_list().splitlines()) if row["names"] == "X1 X2")
    assert strip["number"].split()[-1].startswith("TSW" if board == "uno" else "SSW")


def test_a_shunt_that_measured_sheets_make_too_large_is_warned_of(sensor_file, capsys):
    for ohms, warned in ((1000, False), (600, True)):
        sensor_file.write_text(f"{CONE}current_full_scale_ma = 5.84\nupper_sheet_ohm = {ohms}\n", encoding="utf-8")
        _, folder = write(sensor_file, "--force")
        assert ("R1 is too large for these sheets" in capsys.readouterr().out) == warned
        (share,) = re.findall(r"([\d.]+) times the larger one", (folder / "board.md").read_text(encoding="utf-8"))
        assert (float(share) < 2.0) == warned


@pytest.mark.parametrize(("board", "converter", "highest"), [("pico", BUILT_IN, 3.1), ("esp32", "ads1115", 3.1)])
def test_a_rail_that_would_destroy_what_reads_it_is_refused(board, converter, highest):
    for volts in (3.0, 3.4, 5.0, 15.0):
        parts = replace(Electronics(), supply_volts=volts, adc_volts=2.0 * volts)
        sensor = Sensor(Frustum(0.0375, 0.0375, 0.24, 6.1), electronics=parts)
        if volts < highest:
            assert board_circuit(board, sensor, converter).keys["adc_v"] == (3.3 if converter == BUILT_IN else 4.096)
            continue
        with pytest.raises(SensorError, match=f"takes {highest} V at most"):
            board_circuit(board, sensor, converter)


def test_what_is_no_file_is_neither_read_nor_replaced(sensor_file, capsys):
    (sensor_file.parent / "board").mkdir()
    os.mkfifo(sensor_file.parent / "board" / "board.md")
    for words in ((), ("--force",)):
        assert write(sensor_file, *words)[0] == 1
        assert "board.md would be replaced" in capsys.readouterr().err
