"""The contract of a source (`coneskin.testing.source_contract`), held by a serial port with the board behind it.

The contract names the bytes that the device sends; so for it the board runs a sketch that sends them, out of the same
port. The rest is about the product's own sketch.
"""

import os
from contextlib import contextmanager

import pytest

from coneskin.core.errors import SkinTimeout
from coneskin.skin.sources.serial_port import SerialPort
from coneskin.skin.sources.source import Source
from coneskin.skin.wire import FRAME_LENGTH, FrameDecoder, encode
from coneskin.testing.source_contract import SOURCE_CHECKS, OpenLine
from tests.support.firmware.emulated_board import BoardPrograms, EmulatedBoard
from tests.support.firmware.firmware_build import build_sketch

pytestmark = [pytest.mark.long, pytest.mark.processes]  # the board has to be punctual
SENDER = """
#include "coneskin_board.h"
const uint8_t SENT[4096] PROGMEM = "the test writes length and bytes over this";
void setup() { Serial.begin(BOARD.baud); }
void loop() {
  static bool done;
  if (done || !Serial.available()) return;
  const uint16_t length = pgm_read_byte(SENT) | pgm_read_byte(SENT + 1) << 8;
  for (uint16_t k = 0; k < length; k++) Serial.write(pgm_read_byte(SENT + 2 + k));
  done = true;
}
"""
ROOM, MARK = 4096, b"the test writes length and bytes over this"
PATIENCE = 5.0  # s; far beyond what the board needs; reached only where the contract is broken


@pytest.fixture
def board(programs, sensor):
    with EmulatedBoard(programs, sensor) as emulated:
        yield emulated


@pytest.fixture
def port(board):
    with SerialPort(board.path, baud=500000) as opened:
        yield opened


@pytest.fixture(scope="module")
def sender(programs, tmp_path_factory):
    sketch = tmp_path_factory.mktemp("sender") / "sender.ino"
    sketch.write_text(SENDER, encoding="ascii")
    return build_sketch(programs.firmware.parent, sketch)


@pytest.fixture
def open_line(programs, sensor, sender, tmp_path):
    """What the contract asks for: a line over which the board sends given bytes once it is open."""

    @contextmanager
    def open_board(sent):
        image, data = sender.read_bytes(), len(sent).to_bytes(2, "little") + sent
        at = image.index(MARK)
        firmware = tmp_path / "sender.elf"
        firmware.write_bytes(image[:at] + data.ljust(ROOM, b"\0") + image[at + ROOM :])
        with (
            EmulatedBoard(BoardPrograms(programs.emulator, firmware), sensor) as emulated,
            SerialPort(emulated.path, baud=500000) as port,
        ):
            emulated.tell("0 port go")
            yield OpenLine(port, emulated.unplug)

    return open_board


@pytest.mark.parametrize("check", SOURCE_CHECKS, ids=lambda check: check.__name__)
def test_it_keeps_the_contract_of_every_source(check, open_line):
    check(open_line)


def read(port, count):
    data = b""
    while len(data) < count:
        data += port.read(PATIENCE)
    return data


def read_until_silent(port):
    data = b""
    try:
        while True:
            data += port.read(0.5)
    except SkinTimeout:
        return data


def test_it_is_a_source_and_its_bytes_are_frames_and_nothing_else(port):
    assert isinstance(port, Source)
    data = read(port, 20 * 52)
    decoder = FrameDecoder()
    frames = decoder.feed(data)
    begun = decoder.bytes_skipped  # the port was opened while a frame was on its way
    assert begun < 52
    assert b"".join(map(encode, frames)) == data[begun : begun + 52 * len(frames)]
    assert [frame.sequence for frame in frames] == list(range(frames[0].sequence, frames[0].sequence + len(frames)))


@pytest.mark.parametrize(("line", "length"), [(b"frame_length=36\n", FRAME_LENGTH), (b"frame_length=40\n", 40)])
def test_it_sends_the_length_that_it_is_told_over_the_same_port(board, port, line, length):
    read(port, 52)
    writer = os.open(board.path, os.O_WRONLY | os.O_NOCTTY)
    try:
        os.write(writer, line)
    finally:
        os.close(writer)
    decoder = FrameDecoder()
    frames = []
    for _ in range(400):
        frames += decoder.feed(port.read(PATIENCE))
        if len(frames) > 5 and all(len(encode(frame)) == length for frame in frames[-5:]):
            return
    pytest.fail(f"no frames of {length} bytes came, the last ones were {frames[-2:]}")


def test_silence_is_a_timeout_that_leaves_it_open(board, port):
    read(port, 5 * 52)
    board.tell("0 power off")
    read_until_silent(port)
    for _ in range(2):
        with pytest.raises(SkinTimeout, match="no bytes for 10 ms"):
            port.read(0.01)
    board.tell("0 power on")
    assert FrameDecoder().feed(read(port, 52))[0].sequence == 0


def test_cut_frames_cost_those_frames_only(board, port):
    board.tell("0.2 port off", "0.2125 port on", "0.5 power off")
    decoder = FrameDecoder()
    numbers = [frame.sequence for frame in decoder.feed(read_until_silent(port))]
    lost = set(range(numbers[0], numbers[-1])) - set(numbers)
    assert 2 <= len(lost) <= 4  # in 12.5 ms, at a frame each 5 ms
    assert decoder.bytes_skipped < 2 * 52
    assert max(lost) - min(lost) == len(lost) - 1
