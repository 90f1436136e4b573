"""Line coding: what another baud rate, an inverted line or wrong ends of a line make of frames."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from itertools import groupby, product

from coneskin.skin.wire import SYNC

from .capture import LENGTHS, count_frames
from .cause import Cause, Diagnosis

__all__ = ["BAUD_RATES", "find_baud", "find_coding", "receive_at", "undo_newlines", "undo_slip"]

#: Rates that are tried [1/s].
BAUD_RATES = (
    *(9600, 19200, 38400, 57600, 74880, 115200, 230400, 250000, 460800, 500000),
    *(921600, 1000000, 1500000, 2000000, 3000000),
)
#: Beginnings of a frame; where a fast sender leaves little of them, with the commonest numbers of device and sensor.
_HEADERS = tuple(SYNC + bytes((version, length)) for length, version in LENGTHS.items())
_LONG_HEADERS = tuple(header + numbers for header in _HEADERS for numbers in (bytes(4), b"\1\0\0\0", b"\0\0\1\0"))
_MIN_FRAMES = 3
_MIN_COVERED = 0.5  # share of the bytes that must be frames once a coding is undone
_PATTERN = 8  # bytes of the beginning of a frame that are looked for
_MIN_HITS = 5  # beginnings of a frame, as another baud rate shows them
_MIN_RUN = 2.5  # bits; shortest run on a line that is slower by so much
_SLOW_SHARE = 0.97  # share of the runs that must be as long
_REVERSED = bytes(int(f"{n:08b}"[::-1], 2) for n in range(256))
_INVERTED = bytes(n ^ 0xFF for n in range(256))
_NIBBLES = bytes(n >> 4 | n << 4 & 0xFF for n in range(256))


def receive_at(sent: bytes, ratio: float, inverted: bool = False, waits: bool = True) -> bytes:
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
        if samples[-1] >= len(line) or len(received) >= _PATTERN:
            return bytes(received)
        received.append(sum(line[place] << bit for bit, place in enumerate(samples[1:9])))
        started = not (line[samples[9]] or waits)
        at = at + 9.0 * ratio if started else float(samples[9])
        while not started and at < len(line) and not line[int(at)]:
            at += 1.0


def find_baud(data: bytes, baud: int | None) -> Diagnosis | None:
    """Name the baud rate of the sender where the bytes show it."""
    if len(data) < 64:
        return None
    frequency = Counter(data)
    best, rate, inverted = (
        max(
            (_gain(data, frequency, candidate / baud, inverted), candidate, inverted)
            for candidate in BAUD_RATES
            for inverted in (False, True)
            if candidate != baud or inverted
        )
        if baud
        else (0.0, 0, False)
    )
    if best > 0.0 and inverted:
        return Diagnosis(Cause.INVERTED, f"the bytes are what {rate} baud on an inverted line look like")
    if best > 0.0:
        return Diagnosis(Cause.BAUD, f"the device sends at {rate} baud, the port listens at {baud}", rate)
    run = _shortest_run(data)
    if run >= _MIN_RUN:
        nearest = min(BAUD_RATES, key=lambda item: abs(math.log(item * run / baud))) if baud else 0
        words = f"the device sends about {run:.0f} times more slowly than the port listens"
        return Diagnosis(Cause.BAUD, f"{words}{f', at about {nearest} baud' if nearest else ''}", nearest)
    return None


def _gain(data: bytes, frequency: Counter[int], ratio: float, inverted: bool) -> float:
    """Return how much more often than by chance frames begin in these bytes; 0 where it may be chance."""
    best = 0.0
    for header, waits in product(_HEADERS if ratio < 1.0 else _LONG_HEADERS, (True, False)):
        pattern = receive_at(header, ratio, inverted, waits)
        if len(pattern) < 2:
            continue
        hits = data.count(pattern)
        chance = len(data) * math.prod(frequency[byte] / len(data) for byte in pattern)
        if hits >= _MIN_HITS and hits > 4.0 * chance + _MIN_HITS:
            best = max(best, hits * math.log(hits / max(chance, 1e-3)))
    return best


def _shortest_run(data: bytes) -> float:
    """Return the length [bits] that nearly all runs of equal bits have at least, each byte taken with its start bit."""
    lengths: Counter[int] = Counter()
    for byte in data:
        runs = [len(list(same)) for _, same in groupby((0, *(byte >> bit & 1 for bit in range(8)), 1))]
        for run in runs[:-1]:  # the last one goes on
            lengths[run] += 1
    if len({*data}) < 2:
        return 0.0
    short = 0
    for run in sorted(lengths):
        short += lengths[run]
        if short > (1.0 - _SLOW_SHARE) * lengths.total():
            return float(run)
    return 0.0


def find_coding(data: bytes) -> Diagnosis | None:
    """Name a coding of the bytes below which there are valid frames."""
    codings: tuple[tuple[Cause, str, Callable[[bytes], bytes]], ...] = (
        (Cause.INVERTED, "the bytes are frames with every bit inverted", lambda d: d.translate(_INVERTED)),
        (Cause.BIT_ORDER, "the bytes are frames with the bits of each byte reversed", lambda d: d.translate(_REVERSED)),
        (
            Cause.INVERTED,
            "the bytes are frames with every bit inverted, and reversed",
            lambda d: d.translate(_REVERSED).translate(_INVERTED),
        ),
        (Cause.NIBBLES_SWAPPED, "the bytes are frames with the halves of each byte exchanged", _swap_nibbles),
        (Cause.WORDS_SWAPPED, "the bytes are frames with the two bytes of each word exchanged", _swap_words),
        (Cause.SLIP, "the frames are wrapped in SLIP", undo_slip),
        (Cause.COBS, "the frames are coded in COBS", _undo_cobs),
    )
    for cause, words, undo in codings:
        frames, covered = count_frames(undo(data))
        if frames >= _MIN_FRAMES and covered >= _MIN_COVERED:
            return Diagnosis(cause, words)
    return None


def _swap_nibbles(data: bytes) -> bytes:
    return data.translate(_NIBBLES)


def _swap_words(data: bytes) -> bytes:
    start = data.find(SYNC[::-1])
    even = data[max(start, 0) :]
    even = even[: len(even) // 2 * 2]
    swapped = bytearray(even)
    swapped[::2], swapped[1::2] = even[1::2], even[::2]
    return bytes(swapped)


def undo_newlines(data: bytes) -> bytes:
    """Return the bytes as they were before each line feed became CR LF."""
    return data.replace(b"\r\n", b"\n")


def undo_slip(data: bytes) -> bytes:
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
