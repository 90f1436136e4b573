"""Streams that are something else: text, nothing but one byte, and protocols of other devices."""

from __future__ import annotations

import base64
import binascii
import math
import re
from collections import Counter
from collections.abc import Iterator

from .capture import Capture, count_frames, printable_share, short_hex
from .cause import Cause, Diagnosis
from .checksum import crc16

__all__ = ["find_constant", "find_protocol", "find_text", "first_line"]

_MIN_TEXT = 0.95  # share of printable bytes
_LINE = 60  # characters of a line that are shown
_PAUSE = 0.0018  # s without a byte that ends a message of Modbus
_MIN_CHAIN = 4  # messages in a row
_MODBUS = 0x8005  # polynomial


def find_constant(data: bytes, rate: float, baud: int | None) -> Diagnosis | None:
    """Find a line on which one byte comes over and over.

    Args:
        data: the bytes.
        rate: at which they come [1/s]; infinite where that is not known.
        baud: of the port, or None.
    """
    byte, count = Counter(data).most_common(1)[0]
    if count < 0.99 * len(data) or len(data) < 16:
        return None
    if byte == 0 and baud and rate < 0.05 * baud:
        what = f"nothing but zeros comes, {rate:.0f} a second: the device sends much more slowly than {baud} baud"
        return Diagnosis(Cause.BAUD, what)
    how_often = f"{rate:.0f} a second" if math.isfinite(rate) else f"{count} times"
    what = f"nothing but the byte 0x{byte:02X} comes, {how_often}"
    return Diagnosis(Cause.BREAK if byte == 0 else Cause.IDLE_NOISE, what)


def first_line(data: bytes) -> str:
    """Return the first whole line of a text, or what there is of it."""
    lines = [line for line in re.split(rb"[\r\n]+", data) if line.strip()]
    whole = lines[1] if len(lines) > 2 else lines[0] if lines else b""
    text = whole[:_LINE].decode("ascii", "replace")
    return text + ("..." if len(whole) > _LINE else "")


def find_text(data: bytes) -> Diagnosis | None:
    """Find text, and frames that are written in it."""
    if printable_share(data) < _MIN_TEXT:
        return None
    for cause, words, plain in (
        (Cause.HEX_TEXT, "frames come as hexadecimal digits", _undo_hex(data)),
        (Cause.HEX_TEXT, "frames come as decimal numbers", _undo_decimal(data)),
        (Cause.BASE64, "frames come in base64", _undo_base64(data)),
    ):
        if count_frames(plain)[0] >= 3:
            return Diagnosis(cause, f"{words}: {first_line(data)!r}")
    if len(re.findall(rb"[$!][A-Z]{2,6},[^\r\n]*\*[0-9A-F]{2}", data)) >= 2:
        return Diagnosis(Cause.NMEA, f"NMEA sentences come, not frames: {first_line(data)!r}")
    return Diagnosis(Cause.TEXT, f"text comes, not frames: {first_line(data)!r}")


def _undo_hex(data: bytes) -> bytes:
    digits = re.sub(rb"0[xX]|[^0-9a-fA-F]", b"", data)
    start = digits.lower().find(b"c53a")
    digits = digits[max(start, 0) :]
    return binascii.unhexlify(digits[: len(digits) // 2 * 2])


def _undo_decimal(data: bytes) -> bytes:
    return bytes(number for word in re.findall(rb"\d+", data) if (number := int(word[:6])) < 256)


def _undo_base64(data: bytes) -> bytes:
    plain = b""
    for line in re.split(rb"[\r\n]+", data):
        try:
            plain += base64.b64decode(line, validate=True)
        except (binascii.Error, ValueError):
            continue
    return plain


def find_protocol(capture: Capture, data: bytes) -> Diagnosis | None:
    """Find the messages of another device's protocol, by several of them in a row."""
    if _longest_chain(data, b"\xfd", 1, 12) >= _MIN_CHAIN or _longest_chain(data, b"\xfe", 1, 8) >= _MIN_CHAIN:
        return Diagnosis(Cause.MAVLINK, "MAVLink messages come, not frames")
    if _longest_chain(data, b"\xb5\x62", 4, 8) >= _MIN_CHAIN:
        return Diagnosis(Cause.UBX, "UBX messages come, not frames")
    messages = [message for message in _bursts(capture) if 4 <= len(message) <= 256]
    right = sum(crc16(message, _MODBUS, 0xFFFF, reflected=True) == 0 for message in messages[-16:])
    if len(messages) >= _MIN_CHAIN and right >= max(_MIN_CHAIN, 0.7 * len(messages[-16:])):
        return Diagnosis(Cause.MODBUS, f"Modbus RTU messages come, not frames ({short_hex(messages[-1])})")
    return None


def _longest_chain(data: bytes, start: bytes, length_at: int, overhead: int) -> int:
    """Return how many messages follow each other, by their own lengths."""
    longest, at = 0, data.find(start)
    while at >= 0:
        count, place = 0, at
        while data.startswith(start, place) and place + length_at < len(data):
            count, place = count + 1, place + overhead + data[place + length_at]
        longest = max(longest, count)
        if longest >= 64:
            break
        at = data.find(start, at + 1)
    return longest


def _bursts(capture: Capture) -> Iterator[bytes]:
    """Yield what came without a pause."""
    burst, last = b"", None
    for time, piece in capture.pieces:
        if last is not None and time - last > _PAUSE:
            yield burst
            burst = b""
        burst += piece
        last = time
    if burst:
        yield burst
