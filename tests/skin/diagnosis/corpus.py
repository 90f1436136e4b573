"""The corpus of firmware mistakes: what each must be called, and how it is built, sent and heard."""

import shutil
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from coneskin.skin.diagnosis.cause import Cause

SOURCE = Path(__file__).with_name("mistakes.c")
COMPILER = shutil.which("cc") or shutil.which("gcc")
BAUD = 921600

#: mistake, as mistakes.c knows it -> what the first line must name
MISTAKES = {
    "none": Cause.NONE,
    "sync exchanged": Cause.SYNC_SWAPPED,
    "another sync": Cause.SYNC_OTHER,
    "big endian": Cause.BIG_ENDIAN,
    "version 0": Cause.VERSION,
    "version 3": Cause.VERSION,
    "version and length exchanged": Cause.HEADER_SWAPPED,
    "length without the crc": Cause.LENGTH_BYTE,
    "length of the content": Cause.LENGTH_BYTE,
    "padded struct": Cause.PADDING,
    "padded struct, 36 bytes sent": Cause.PADDING,
    "a field is missing": Cause.FRAME_SIZE,
    "no crc": Cause.CRC_MISSING,
    "buffer of 32 bytes": Cause.CUT_AT_BUFFER,
    "written as a string": Cause.ZEROS_LOST,
    "crc low byte first": Cause.CRC_BYTE_ORDER,
    "crc start ffff": Cause.CRC_START,
    "crc start 1d0f": Cause.CRC_START,
    "crc kermit": Cause.CRC_REFLECTED,
    "crc x-25": Cause.CRC_REFLECTED,
    "crc modbus": Cause.CRC_POLYNOMIAL,
    "crc arc, high first": Cause.CRC_POLYNOMIAL,
    "crc without sync": Cause.CRC_RANGE,
    "crc without header": Cause.CRC_RANGE,
    "crc over its own zeros": Cause.CRC_RANGE,
    "crc never written": Cause.CRC_CONSTANT,
    "crc of the frame before": Cause.CRC_STALE,
    "crc before the sequence": Cause.CRC_STALE,
    "byte sum": Cause.CHECKSUM_KIND,
    "exclusive or": Cause.CHECKSUM_KIND,
    "crc of 8 bits": Cause.CHECKSUM_KIND,
    "hexadecimal digits": Cause.HEX_TEXT,
    "decimal numbers": Cause.HEX_TEXT,
    "base64": Cause.BASE64,
    "readings as text": Cause.TEXT,
    "a print in every frame": Cause.TEXT,
    "a line end behind the frame": Cause.EXTRA_BYTES,
    "slip": Cause.SLIP,
    "cobs": Cause.COBS,
    "text mode": Cause.NEWLINES,
    "xon/xoff": Cause.FLOW_CONTROL,
    "zeros left out": Cause.ZEROS_LOST,
    "seven bits": Cause.SEVEN_BITS,
    "inverted bytes": Cause.INVERTED,
    "inverted line": Cause.INVERTED,
    "bits reversed": Cause.BIT_ORDER,
    "buffer changes while it is sent": Cause.DAMAGED,
    "noise on the line": Cause.DAMAGED,
    "receive buffer overflows": Cause.BYTES_LOST,
    "2 times slower": Cause.BAUD,
    "8 times slower": Cause.BAUD,
    "96 times slower": Cause.BAUD,
    "2 times faster": Cause.BAUD,
    "supply 0": Cause.SUPPLY_ZERO,
    "currents 0": Cause.CURRENTS_ZERO,
    "radial current 0": Cause.RADIAL_CURRENT_ZERO,
    "angular current 0": Cause.ANGULAR_CURRENT_ZERO,
    "shifted to 16 bits": Cause.LEFT_JUSTIFIED,
    "scaled to 16 bits": Cause.SCALED,
    "10 bits": Cause.CONVERTER_BITS,
    "millivolts": Cause.MILLIVOLTS,
    "negative counts": Cause.NEGATIVE,
    "supply first": Cause.FIELD_ORDER,
    "phases exchanged": Cause.PHASES_EXCHANGED,
    "readings never change": Cause.COUNTS_STUCK,
    "supply written as a constant": Cause.NO_NOISE,
    "reference missing": Cause.SATURATED,
    "inputs float": Cause.GUIDES_FLOAT,
    "clock in ms": Cause.CLOCK_MILLISECONDS,
    "clock in ns": Cause.CLOCK_NANOSECONDS,
    "clock twice too fast": Cause.CLOCK_RATIO,
    "clock in ticks of 4 us": Cause.CLOCK_RATIO,
    "clock 3 % fast": Cause.CLOCK_RATIO,
    "clock never written": Cause.CLOCK_STANDS,
    "clock of 16 bits": Cause.CLOCK_16_BIT,
    "clock since the frame began": Cause.CLOCK_JUMPS,
    "sequence never written": Cause.SEQUENCE_STANDS,
    "sequence of 8 bits": Cause.SEQUENCE_8_BIT,
    "sequence shared": Cause.SEQUENCE_SHARED,
    "sequence is the clock": Cause.SEQUENCE_STEPS,
    "every frame twice": Cause.REPEATED,
    "every fiftieth frame twice": Cause.REPEATED,
    "every twentieth frame is dropped uncounted": Cause.UNCOUNTED,
    "every fourth frame is lost": Cause.FRAMES_LOST,
    "restarted in every frame": Cause.RESTARTED_ALWAYS,
    "watchdog bites": Cause.RESTARTS,
    "reserved bit": Cause.STATUS_RESERVED,
    "self-test failed": Cause.STATUS,
    "another device": Cause.UNKNOWN_SENSOR,
    "9600 baud": Cause.RATE_LOW,
    "held back for 16 ms": Cause.HELD_BACK,
    "hangs after a while": Cause.STOPPED,
    "only a banner": Cause.STOPPED,
    "nothing": Cause.SILENT,
    "zeros": Cause.BREAK,
    "the byte 55": Cause.IDLE_NOISE,
    "a satellite receiver": Cause.NMEA,
    "modbus": Cause.MODBUS,
    "mavlink": Cause.MAVLINK,
}
#: what no bytes can show: nothing may be named then
NOT_TO_BE_NAMED = {"random bytes": Cause.UNKNOWN, "8 times faster": Cause.UNKNOWN}
#: what only a scene can show
WITH_A_SCENE = {"10 bits", "millivolts", "supply first", "phases exchanged", "another device"}
#: factor of the device's clock over the computer's
CLOCK_RATIOS = {"none": 1.0, "clock twice too fast": 2.0, "clock in ticks of 4 us": 0.25, "clock 3 % fast": 1.03}


def build(folder: Path) -> Path:
    """The compiled program of mistakes."""
    if COMPILER is None:
        pytest.skip("no C compiler here")
    program = folder / "mistakes"
    options = ["-std=c11", "-O1", "-Wall", "-Wextra", "-Werror"]
    subprocess.run([COMPILER, *options, "-o", str(program), str(SOURCE)], check=True, timeout=60)
    return program


def bytes_of(program: Path, mistake: str, seconds: float = 2.0) -> list[tuple[float, bytes]]:
    """What a mistake sends, with the times at which it would come."""
    done = subprocess.run([program, mistake, str(seconds)], capture_output=True, check=True, timeout=60)
    return list(_records(done.stdout))


def _records(data: bytes) -> Iterator[tuple[float, bytes]]:
    at = 0
    while at < len(data):
        time, length = struct.unpack_from("<dH", data, at)
        yield time, data[at + 10 : at + 10 + length]
        at += 10 + length
