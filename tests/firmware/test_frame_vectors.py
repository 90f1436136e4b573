"""The 50 test vectors: Python, the C header on this machine, and the same header on the board agree byte for byte."""

import csv
import random
import subprocess

import pytest

from coneskin.skin.firmware.boards import firmware_folder
from coneskin.skin.wire import FRAME_LENGTHS, DrivenPotentials, Frame, FrameDecoder, encode
from tests.support.firmware.emulated_board import BoardPrograms, run_board
from tests.support.firmware.firmware_build import build_sketch, missing_tools

COLUMNS = [*(name for name in Frame._fields if name != "driven"), *DrivenPotentials._fields, "bytes"]
COUNTS = 18  # of the longest frame
SENDER = """
#include "vectors.h"
void setup() { Serial.begin(500000); }
void loop() {
  static uint8_t number;
  uint8_t bytes[CONESKIN_LONGEST_FRAME];
  ConeskinFrame frame;
  memcpy_P(&frame, &VECTORS[number], sizeof frame);
  Serial.write(bytes, coneskin_encode(&frame, bytes));
  if (++number == sizeof VECTORS / sizeof *VECTORS) for (;;) ;
}
"""
PROGRAM = """
#include <stdio.h>
#define PROGMEM
#include "vectors.h"
int main(void) {
  uint8_t bytes[CONESKIN_LONGEST_FRAME];
  for (size_t k = 0; k < sizeof VECTORS / sizeof *VECTORS; k++)
    fwrite(bytes, 1, coneskin_encode(&VECTORS[k], bytes), stdout);
  return 0;
}
"""


def drawn_frames():
    """50 frames: of all lengths, three of them with the extremes of each field."""
    draw = random.Random(36)
    for number in range(50):
        length = FRAME_LENGTHS[number % 3]
        extreme = {0: 0, 1: 1, 2: 1, 3: 1, 4: 0, 5: 0}.get(number)

        def pick(top, extreme=extreme):
            return draw.randint(0, top) if extreme is None else extreme * top

        head = [length, pick(0xFFFF), pick(0xFF), pick(0x7F), pick(0xFFFF), pick(0xFFFFFFFF)]
        counts = [pick(0xFFFF) for _ in range(12)]
        if length == 36:
            counts[10] = counts[11] = counts[9]
        yield Frame(*head, *counts, DrivenPotentials(*(pick(0xFFFF) for _ in range(6))) if length == 52 else None)


def row_of(frame):
    *values, driven = frame
    return [*map(str, values), *(map(str, driven) if driven else [""] * 6), encode(frame).hex()]


def frames_of_file():
    with (firmware_folder() / "frame_vectors.csv").open(encoding="ascii", newline="") as file:
        for row in csv.DictReader(file):
            numbers = [int(row[name]) for name in COLUMNS[:18]]
            driven = [row[name] for name in COLUMNS[18:24]]
            yield (
                Frame(*numbers, DrivenPotentials(*map(int, driven)) if driven[0] else None),
                bytes.fromhex(row["bytes"]),
            )


@pytest.fixture
def header(tmp_path):
    """The vectors as C, beside a copy of the frame header."""
    rows = []
    for frame, _ in frames_of_file():
        *values, driven = frame
        length, device, sensor, status, sequence, clock = values[:6]
        counts = [*values[6:], *(driven or ())]
        head = f"{length}, {device}, {sensor}, {status}, {sequence}, {clock}UL"
        rows.append(f"  {{{head}, {{{', '.join(map(str, counts))}}}}},")
    text = ['#include "coneskin_frame.h"', "static const ConeskinFrame VECTORS[] PROGMEM = {", *rows, "};", ""]
    (tmp_path / "vectors.h").write_text("\n".join(text), encoding="ascii")
    return tmp_path


def test_python_writes_and_reads_them():
    vectors = list(frames_of_file())
    assert len(vectors) == 50
    assert [frame for frame, _ in vectors] == list(drawn_frames())
    assert [encode(frame) for frame, _ in vectors] == [data for _, data in vectors]
    assert FrameDecoder().feed(b"".join(data for _, data in vectors)) == [frame for frame, _ in vectors]


@pytest.mark.skipif(bool(missing_tools()), reason=missing_tools())
def test_the_c_header_writes_them_on_this_machine(header):
    (header / "vectors.c").write_text(PROGRAM, encoding="ascii")
    words = ["gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-Wno-unused-function"]
    source = ["-I", str(firmware_folder() / "coneskin"), "-o", str(header / "vectors"), str(header / "vectors.c")]
    subprocess.run([*words, *source], check=True, timeout=60)
    sent = subprocess.run([str(header / "vectors")], check=True, capture_output=True, timeout=60).stdout
    assert sent == b"".join(data for _, data in frames_of_file())


@pytest.mark.long
def test_the_board_writes_them(programs, sensor, header):
    (header / "sender.ino").write_text(SENDER, encoding="ascii")
    sender = build_sketch(header, header / "sender.ino")
    sent = run_board(BoardPrograms(programs.emulator, sender), sensor, 0.2).data
    assert sent == b"".join(data for _, data in frames_of_file())
