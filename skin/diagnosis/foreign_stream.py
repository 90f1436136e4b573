"""Streams that are no frames as they stand: another baud rate or coding, text, one byte, protocols of other devices."""

from __future__ import annotations

import base64
import binascii
import math
import re
from array import array
from collections import Counter
from collections.abc import Callable
from itertools import groupby, product

from coneskin.core.finding import Finding
from coneskin.skin.wire import FRAME_LENGTHS, SYNC, VERSION

from .capture import Capture, count_frames, printable_share, short_hex
from .cause import Cause
from .foreign_checksum import crc16

#: Rates that are tried [1/s].
_BAUD_RATES = (
    *(9600, 19200, 38400, 57600, 74880, 115200, 230400, 250000, 460800, 500000),
    *(921600, 1000000, 1500000, 2000000, 3000000),
)
#: Beginnings of a frame; where a fast sender leaves little of them, with the commonest numbers of device and sensor.
_FRAME_HEADERS = tuple(SYNC + bytes((VERSION, length)) for length in FRAME_LENGTHS)
_NUMBERED_HEADERS = tuple(
    header + numbers for header in _FRAME_HEADERS for numbers in (bytes(4), b"\1\0\0\0", b"\0\0\1\0")
)
_MIN_FRAMES = 3
_MIN_COVERED = 0.5  # share of the bytes that must be frames once a coding is undone
_PATTERN_LENGTH = 8  # bytes of the beginning of a frame that are looked for
_MIN_HITS = 5  # beginnings of a frame, as another baud rate shows them
_MIN_RUN = 2.5  # bits; shortest run on a line that is slower by so much
_SLOW_SHARE = 0.97  # share of the runs that must be as long
_REVERSED_BITS = bytes(int(f"{n:08b}"[::-1], 2) for n in range(256))
_INVERTED_BITS = bytes(n ^ 0xFF for n in range(256))
_SWAPPED_NIBBLES = bytes(n >> 4 | n << 4 & 0xFF for n in range(256))


def _receive_at(sent: bytes, ratio: float, inverted: bool = False, waits: bool = True) -> bytes:
    """Return what a receiver makes of bytes, the first of it.

    Args:
        sent: sent without a pause, after an idle line.
        ratio: baud rate of the sender over that of the receiver.
        inverted: the line is inverted.
        waits: after a framing error the receiver waits for an idle line; otherwise it takes the missing stop bit for
            the next start bit. Both kinds are built.
    """
    line = [1]
    for byte in sent:
        line += [0, *(byte >> bit & 1 for bit in range(8)), 1]
    if inverted:
        line = [1 - bit for bit in line]
    received = bytearray()
    at, started = 1.0, False
    while True:
        while not started and at < len(line) and (line[int(at)] or not line[int(at) - 1]):
            at = int(at) + 1.0
        samples = [int(at + (k + 0.5) * ratio) for k in range(10)]
        if samples[-1] >= len(line) or len(received) >= _PATTERN_LENGTH:
            return bytes(received)
        received.append(sum(line[place] << bit for bit, place in enumerate(samples[1:9])))
        started = not (line[samples[9]] or waits)
        at = at + 9.0 * ratio if started else float(samples[9])
        while not started and at < len(line) and not line[int(at)]:
            at += 1.0


def find_baud(data: bytes, baud: int | None) -> Finding | None:
    """Name the baud rate of the sender where the bytes show it."""
    if len(data) < 64:
        return None
    frequency = Counter(data)
    tried = (
        (_gain(data, frequency, candidate / baud, inverted), candidate, inverted)
        for candidate, inverted in product(_BAUD_RATES, (False, True))
        if baud and (candidate != baud or inverted)
    )
    best, rate, inverted = max(tried, default=(0.0, 0, False))
    if best > 0.0 and inverted:
        return Cause.INVERTED.found(f"the bytes are what {rate} baud on an inverted line look like")
    if best > 0.0:
        return Cause.BAUD.found(f"the device sends at {rate} baud, the port listens at {baud}")
    run = _shortest_run(data)
    if run >= _MIN_RUN:
        nearest = min(_BAUD_RATES, key=lambda item: abs(math.log(item * run / baud))) if baud else 0
        words = f"the device sends about {run:.0f} times more slowly than the port listens"
        return Cause.BAUD.found(f"{words}{f', at about {nearest} baud' if nearest else ''}")
    return None


def _gain(data: bytes, frequency: Counter[int], ratio: float, inverted: bool) -> float:
    """Return how much more often than by chance frames begin in these bytes; 0 where it may be chance."""
    best = 0.0
    for header, waits in product(_FRAME_HEADERS if ratio < 1.0 else _NUMBERED_HEADERS, (True, False)):
        pattern = _receive_at(header, ratio, inverted, waits)
        if len(pattern) < 2:
            continue
        hits = data.count(pattern)
        chance = len(data) * math.prod(frequency[byte] / len(data) for byte in pattern)
        if hits >= _MIN_HITS and hits > 4.0 * chance + _MIN_HITS:
            best = max(best, hits * math.log(hits / max(chance, 1e-3)))
    return best


def _shortest_run(data: bytes) -> float:
    """Return the length [bits] that nearly all runs of equal bits have at least, each byte taken with its start bit."""
    if len({*data}) < 2:
        return 0.0
    bits = ((0, *(byte >> bit & 1 for bit in range(8)), 1) for byte in data)
    runs = ([len(list(same)) for _, same in groupby(row)] for row in bits)
    lengths = sorted(run for row in runs for run in row[:-1])  # the last one goes on
    return float(lengths[int((1.0 - _SLOW_SHARE) * len(lengths))])


def find_coding(data: bytes) -> Finding | None:
    """Name a coding of the bytes below which there are valid frames."""
    for cause, words, undo in _BYTE_CODINGS:
        frames, covered = count_frames(undo(data))
        if frames >= _MIN_FRAMES and covered >= _MIN_COVERED:
            return cause.found(f"the bytes are frames with {words}")
    return None


def _swap_words(data: bytes) -> bytes:
    even = data[max(data.find(SYNC[::-1]), 0) :]
    words = array("H", even[: len(even) // 2 * 2])
    words.byteswap()
    return words.tobytes()


def _undo_slip(data: bytes) -> bytes:
    """Return the bytes as they were before they were wrapped in SLIP (RFC 1055)."""
    return data.replace(b"\xc0", b"").replace(b"\xdb\xdc", b"\xc0").replace(b"\xdb\xdd", b"\xdb")


def _undo_cobs(data: bytes) -> bytes:
    plain = bytearray()
    for packet in data.split(b"\0"):
        at = 0
        while at < len(packet):
            code = packet[at]
            plain += packet[at + 1 : at + code]
            at += code
            if code < 0xFF and at < len(packet):
                plain.append(0)
    return bytes(plain)


_MIN_TEXT = 0.95  # share of printable bytes
_SHOWN_LENGTH = 60  # characters of a line that are shown
_BURST_PAUSE = 0.0018  # s without a byte that ends a message of Modbus
_MIN_CHAIN = 4  # messages in a row
_MODBUS_POLYNOMIAL = 0x8005  # polynomial


def find_constant(data: bytes, rate: float, baud: int | None) -> Finding | None:
    """Find a line on which one byte comes over and over, at a rate [1/s]; infinite where that is not known."""
    byte, count = Counter(data).most_common(1)[0]
    if count < 0.99 * len(data) or len(data) < 16:
        return None
    if byte == 0 and baud and rate < 0.05 * baud:
        what = f"nothing but zeros comes, {rate:.0f} a second: the device sends much more slowly than {baud} baud"
        return Cause.BAUD.found(what)
    how_often = f"{rate:.0f} a second" if math.isfinite(rate) else f"{count} times"
    what = f"nothing but the byte 0x{byte:02X} comes, {how_often}"
    return (Cause.BREAK if byte == 0 else Cause.IDLE_NOISE).found(what)


def first_line(data: bytes) -> str:
    """Return the first whole line of a text, or what there is of it."""
    lines = [line for line in re.split(rb"[\r\n]+", data) if line.strip()]
    whole = lines[1] if len(lines) > 2 else lines[0] if lines else b""
    text = whole[:_SHOWN_LENGTH].decode("ascii", "replace")
    return text + ("..." if len(whole) > _SHOWN_LENGTH else "")


def find_text(data: bytes) -> Finding | None:
    """Find text, and frames that are written in it."""
    if printable_share(data) < _MIN_TEXT:
        return None
    for cause, words, undo in _TEXT_CODINGS:
        if count_frames(undo(data))[0] >= _MIN_FRAMES:
            return cause.found(f"{words}: {first_line(data)!r}")
    if len(re.findall(rb"[$!][A-Z]{2,6},[^\r\n]*\*[0-9A-F]{2}", data)) >= 2:
        return Cause.NMEA.found(f"NMEA sentences come, not frames: {first_line(data)!r}")
    return Cause.TEXT.found(f"text comes, not frames: {first_line(data)!r}")


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


def find_protocol(capture: Capture, data: bytes) -> Finding | None:
    """Find the messages of another device's protocol, by several of them in a row."""
    for cause, name, chains in _MESSAGE_CHAINS:
        if any(_longest_chain(data, *chain) >= _MIN_CHAIN for chain in chains):
            return cause.found(f"{name} messages come, not frames")
    messages = [message for message in _bursts(capture) if 4 <= len(message) <= 256]
    right = sum(crc16(message, _MODBUS_POLYNOMIAL, 0xFFFF, reflected=True) == 0 for message in messages[-16:])
    if len(messages) >= _MIN_CHAIN and right >= max(_MIN_CHAIN, 0.7 * len(messages[-16:])):
        return Cause.MODBUS.found(f"Modbus RTU messages come, not frames ({short_hex(messages[-1])})")
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


def _bursts(capture: Capture) -> list[bytes]:
    """Return what came without a pause, each."""
    bursts, last = [b""], -math.inf
    for time, piece in capture.pieces:
        if time - last > _BURST_PAUSE:
            bursts.append(b"")
        bursts[-1] += piece
        last = time
    return bursts


#: cause, what was done to the frames, what undoes it
_BYTE_CODINGS: tuple[tuple[Cause, str, Callable[[bytes], bytes]], ...] = (
    (Cause.INVERTED, "every bit inverted", lambda data: data.translate(_INVERTED_BITS)),
    (Cause.BIT_ORDER, "the bits of each byte reversed", lambda data: data.translate(_REVERSED_BITS)),
    (Cause.INVERTED, "every bit inverted, and reversed", lambda data: data.translate(_REVERSED_BITS[::-1])),
    (Cause.NIBBLES_SWAPPED, "the halves of each byte exchanged", lambda data: data.translate(_SWAPPED_NIBBLES)),
    (Cause.WORDS_SWAPPED, "the two bytes of each word exchanged", _swap_words),
    (Cause.SLIP, "SLIP around them", _undo_slip),
    (Cause.COBS, "COBS as their coding", _undo_cobs),
)
_TEXT_CODINGS: tuple[tuple[Cause, str, Callable[[bytes], bytes]], ...] = (
    (Cause.HEX_TEXT, "frames come as hexadecimal digits", _undo_hex),
    (Cause.HEX_TEXT, "frames come as decimal numbers", _undo_decimal),
    (Cause.BASE64, "frames come in base64", _undo_base64),
)
#: cause, name, and of each kind of message: its first bytes, offset of its length, bytes beside what that counts
_MESSAGE_CHAINS = (
    (Cause.MAVLINK, "MAVLink", ((b"\xfd", 1, 12), (b"\xfe", 1, 8))),
    (Cause.UBX, "UBX", ((b"\xb5\x62", 4, 8),)),
)
