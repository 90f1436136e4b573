"""Boards that the sketch runs on, and converters: their pins, read from the sketch itself, and facts beside them.

The firmware of the Uno and of the Pico was run as compiled, in emulators. What is said of the others is an estimate.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple


class BoardFacts(NamedTuple):
    """What is to be known about a board, as parts.toml has it."""

    title: str
    target: str  #: name of the board for ``arduino-cli``
    logic_volts: float  #: of its pins [V]
    five_volts: str  #: its pin that gives 5 V
    clock_ppm: int  #: how far its clock may be off [ppm]
    rate: str  #: frames per second with the usual settings
    remark: str
    pin_prefix: str = ""  #: of a pin's number, as it stands on the board
    port: str = "/dev/ttyACM0"  #: that Linux gives it
    i2c: tuple[str, ...] = ("A4", "A5")  #: its pins SDA and SCL


_BOARD_PATTERN = re.compile(r"^const Board BOARD = \{(.*)\};$", re.MULTILINE)
_CONVERTER_PATTERN = re.compile(r'^const Converter CONVERTER = \{"([a-z]+\d+)", (.*)\};$', re.MULTILINE)
_CONVERTER_CHOICE = "#define CONESKIN_CONVERTER "
_HEADER_PATH = Path("coneskin") / "coneskin_board.h"
_WORD_PATTERN = re.compile(r'"?([\w.-]+)"?')


class Board(NamedTuple):
    """A row of the sketch's table; pins are named as on the board."""

    name: str
    bits: int  #: of the converter
    baud: int  #: of the serial port [bit/s]; one with USB of its own ignores it
    sense: tuple[str, ...]  #: channels of the electrodes A, B, C, D
    current: str  #: channel of the amplifier over the shunt
    supply: str  #: channel of the rail
    rail: tuple[str, ...]  #: gates of the switches from the rail to A, B, C, D
    ground: tuple[str, ...]  #: pins that drive A, B, C, D to ground
    pull_down: tuple[str, ...]  #: pins of the resistors of C and D
    select: tuple[str, ...]  #: address pins of an analog multiplexer; empty where there is none
    common: str  #: pin of its output; empty where there is none


class Converter(NamedTuple):
    """A row of the sketch's table of converters that stand in for a board's own."""

    name: str  #: such as "ads1115"
    bits: int
    volts: float  #: of its highest count [V]
    extra_bits: int  #: that the sketch's usual setting adds
    rate_hz: int  #: frames per second of the usual setting
    permille: int  #: of the range that the sketch takes for the rail
    pull_down: tuple[str, ...]  #: in place of the board's, by a converter on SPI, which answers with 5 V; else none

    @property
    def channels(self) -> tuple[str, ...]:
        """Inputs of its chips for the electrodes A, B, C, D, the current and the rail."""
        return tuple(f"CH{n}" if self.pull_down else f"0x{0x48 + n // 4:x} AIN{n % 4}" for n in range(6))


BUILT_IN = "built-in"  #: name of a board's own converter


def firmware_folder() -> Path:
    """Return the folder of the firmware: the sketch's folder ``coneskin``, and the test vectors beside it."""
    return Path(__file__).parent


def boards() -> dict[str, Board]:
    """Return the rows of the table by name, in its order."""
    text = (firmware_folder() / _HEADER_PATH).read_text(encoding="utf-8")
    return {board.name: board for board in map(_board, _BOARD_PATTERN.findall(text))}


def converters() -> dict[str, Converter]:
    """Return the rows of the table of converters by name, in its order."""
    text = (firmware_folder() / _HEADER_PATH).read_text(encoding="utf-8")
    found = {}
    for name, row in _CONVERTER_PATTERN.findall(text):
        bits, millivolts, _, _, _, extra, _, rate, permille, _, pull_down = _words(row)
        numbers = int(bits), 1e-3 * int(millivolts), int(extra), int(rate), int(permille)
        found[name] = Converter(name, *numbers, _pins(pull_down))
    return found


@cache
def part_catalog() -> dict[str, Any]:
    """Return the tables of parts.toml by name; pins as the numbers of their pads."""
    catalog = tomllib.loads((firmware_folder() / "parts.toml").read_text(encoding="utf-8"))
    for row in catalog.values():
        pads: dict[str, list[str]] = {}
        for number, names in enumerate(row.get("pins", "").split(), 1):
            for name in names.split("="):
                pads.setdefault(name, []).append(str(number))
        row["pins"] = pads
    return catalog


def board_header(converter: str = BUILT_IN) -> bytes:
    """Return the sketch's header with the tables, set to a converter."""
    data = (firmware_folder() / _HEADER_PATH).read_bytes()
    number = re.sub(r"\D", "", converter) or "0"
    return data.replace(f"{_CONVERTER_CHOICE}0\n".encode(), f"{_CONVERTER_CHOICE}{number}\n".encode())


def _board(row: str) -> Board:
    name, bits, baud, sense, current, supply, rail, ground, pull_down, select, common = _words(row)
    gates = _pins(rail), _pins(ground), _pins(pull_down)
    return Board(
        name, int(bits), int(baud), _pins(sense), current, supply, *gates, _pins(select), "".join(_pins([common]))
    )


def _words(row: str) -> Any:
    """Return what stands in a row of a table, what is in braces as a list."""
    return json.loads("[" + _WORD_PATTERN.sub(r'"\1"', row).replace("{", "[").replace("}", "]") + "]")


def _pins(listed: Sequence[str]) -> tuple[str, ...]:
    return tuple(pin for pin in listed if pin != "NONE")
