"""Search for the checksum that frames carry instead of the right one: other CRC parameters, ranges, sums.

A CRC is linear: the CRCs of two messages of one length differ by the CRC of their difference with start 0, whatever the
start value and what is added at the end. So polynomial, reflection, byte order and range are found from differences of
frames first, and the start value from any one of them.
"""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Callable, Sequence
from functools import reduce
from itertools import product
from operator import xor
from typing import Literal

from coneskin.core.finding import Finding

from .capture import swap_bytes
from .cause import Cause

_RIGHT_POLYNOMIAL = 0x1021  # polynomial of CRC-16/XMODEM
_KNOWN_POLYNOMIALS = (_RIGHT_POLYNOMIAL, 0x8005, 0x3D65, 0x8BB7, 0xA097, 0xC867, 0x0589, 0x5935, 0x8D95)
_POLYNOMIAL_NAMES = {0x8005: "0x8005 (MODBUS, ARC, USB)", 0x3D65: "0x3D65 (DNP)", 0x8BB7: "0x8BB7 (T10-DIF)"}
_RANGE_WORDS = {
    0: "",
    2: "it leaves out the sync bytes",
    3: "it leaves out sync and version",
    4: "it leaves out sync, version and length",
}
_START_VALUES = (0xFFFF, 0x1D0F, 0xB2AA, 0x800D, 0x89EC, 0x554D)
_COMPARED_FRAMES = 8  # that are compared
_AGREEING_SHARE = 0.9  # share of the frames that must agree


def crc16(data: bytes, polynomial: int, start: int = 0, reflected: bool = False) -> int:
    """Return a CRC of 16 bits, without anything added at the end.

    Args:
        data: the message.
        polynomial: without its highest bit, not reflected.
        start: value of the register before the first byte, not reflected.
        reflected: the least significant bit of each byte goes first, and the result is reflected.
    """
    register = start
    for byte in data:
        value = int(f"{byte:08b}"[::-1], 2) if reflected else byte
        register ^= value << 8
        for _ in range(8):
            register = (register << 1 ^ polynomial if register & 0x8000 else register << 1) & 0xFFFF
    return int(f"{register:016b}"[::-1], 2) if reflected else register


def find_checksum(frames: Sequence[bytes]) -> Finding:
    """Name the checksum of frames that are right but for it.

    Args:
        frames: whole frames of one length whose last two bytes are no CRC-16/XMODEM of the others.
    """
    bodies, tails = [frame[:-2] for frame in frames], [frame[-2:] for frame in frames]
    different = len(set(bodies)) > 1
    if different and len(set(tails)) == 1:
        return Cause.CRC_CONSTANT.found(f"the checksum is {tails[0].hex(' ').upper()} in every frame")
    for search in (_find_stale, _find_sum):
        if found := search(bodies, tails):
            return found
    distinct = list(dict.fromkeys(zip(bodies, tails, strict=True)))
    if found := _find_crc(distinct[: _COMPARED_FRAMES + 1]):
        return found
    body, tail = distinct[0]
    right = crc_hqx(body, 0).to_bytes(2, "big").hex(" ").upper()
    what = f"frames come with a wrong checksum that follows no rule known here ({tail.hex(' ').upper()} for {right})"
    return Cause.CRC_UNKNOWN.found(what)


def _find_stale(bodies: Sequence[bytes], tails: Sequence[bytes]) -> Finding | None:
    """Find a CRC that was taken of the frame before, or before sequence or clock were written."""
    pairs = list(zip(bodies, bodies[1:], tails[1:], strict=False))
    if len(pairs) < 3:
        return None
    parts: dict[str, Callable[[bytes, bytes], bytes]] = {
        "is that of the frame before": lambda old, _: old,
        "was taken before the sequence was written": lambda old, new: new[:8] + old[8:10] + new[10:],
        "was taken before the clock was written": lambda old, new: new[:10] + old[10:14] + new[14:],
        "was taken before sequence and clock were written": lambda old, new: new[:8] + old[8:14] + new[14:],
        "was taken before the measurements were written": lambda old, new: new[:14] + old[14:],
        "was taken before the status was written": lambda _, new: new[:7] + b"\0" + new[8:],
    }
    for words, mix in parts.items():
        hits = sum(crc_hqx(mix(old, new) + tail, 0) == 0 for old, new, tail in pairs)
        if hits >= _AGREEING_SHARE * len(pairs):
            return Cause.CRC_STALE.found(f"the checksum {words}")
    return None


def _find_sum(bodies: Sequence[bytes], tails: Sequence[bytes]) -> Finding | None:
    kinds: dict[str, Callable[[bytes], int]] = {
        "the sum of the bytes": sum,
        "the sum of the bytes, negated": lambda data: -sum(data),
        "the sum of the bytes, inverted": lambda data: ~sum(data),
        "the exclusive or of the bytes": lambda data: reduce(xor, data),
        "the sum of the 16-bit words": lambda data: sum(data[::2]) + (sum(data[1::2]) << 8),
        "a Fletcher checksum": _fletcher,
        "a CRC of 8 bits": lambda data: crc16(data, 0x0700) >> 8,
    }
    for (words, kind), start in product(kinds.items(), _RANGE_WORDS):
        wide = [(kind(body[start:]) & 0xFFFF).to_bytes(2, "big") for body in bodies]
        hits = (
            sum(tail in (value, value[::-1]) for value, tail in zip(wide, tails, strict=True)),
            sum(value[1] == tail[0] and tail[1] == tails[0][1] for value, tail in zip(wide, tails, strict=True)),
            sum(value[1] == tail[1] and tail[0] == tails[0][0] for value, tail in zip(wide, tails, strict=True)),
        )
        if max(hits) >= _AGREEING_SHARE * len(tails) and len(tails) >= 3:
            return Cause.CHECKSUM_KIND.found(f"the checksum is {words}, not a CRC of 16 bits")
    return None


def _fletcher(data: bytes) -> int:
    low = high = 0
    for byte in data:
        low = (low + byte) % 255
        high = (high + low) % 255
    return high << 8 | low


def _find_crc(frames: Sequence[tuple[bytes, bytes]]) -> Finding | None:
    """Find the parameters of a CRC of 16 bits from differences of frames."""
    if len(frames) < 4:
        return None
    (body0, tail0), *others = frames
    for polynomial, padded, reflected in product(_KNOWN_POLYNOMIALS, (b"", b"\0\0"), (False, True)):
        orders = {"big", "little"}
        for body, tail in others:
            change = bytes(a ^ b for a, b in zip(body0, body, strict=True)).lstrip(b"\0") + padded
            crc = crc16(change, polynomial, 0, reflected)
            got = int.from_bytes(tail0, "big") ^ int.from_bytes(tail, "big")
            orders &= {order for order, value in (("big", got), ("little", swap_bytes(got))) if value == crc}
            if not orders:
                break
        if orders:
            order: Literal["big", "little"] = "big" if "big" in orders else "little"
            return _describe(body0, tail0, polynomial, len(padded), reflected, order)
    return None


def _describe(
    body: bytes, tail: bytes, polynomial: int, zeros: int, reflected: bool, order: Literal["big", "little"]
) -> Finding:
    """Name every parameter that differs from CRC-16/XMODEM, the gravest first; zeros are taken behind the message."""
    seen: list[tuple[Cause, str]] = []
    if polynomial != _RIGHT_POLYNOMIAL:
        seen.append(
            (Cause.CRC_POLYNOMIAL, f"its polynomial is {_POLYNOMIAL_NAMES.get(polynomial, f'0x{polynomial:04X}')}")
        )
    if reflected:
        seen.append((Cause.CRC_REFLECTED, "its bits are reflected (as KERMIT, X-25 and MODBUS have them)"))
    if zeros:
        seen.append((Cause.CRC_RANGE, "it was taken over its own two bytes as well, while they were 0"))
    start, value, inverted = _find_start(body + bytes(zeros), int.from_bytes(tail, order), polynomial, reflected)
    if start:
        seen.append((Cause.CRC_RANGE, _RANGE_WORDS[start]))
    if value is None:
        seen.append((Cause.CRC_START, "its start value is another one"))
    elif value or inverted:
        seen.append((Cause.CRC_START, f"it starts with 0x{value:04X}{' and is inverted at the end' * inverted}"))
    if order == "little":
        seen.append((Cause.CRC_BYTE_ORDER, "its low byte goes first"))
    cause = seen[0][0] if seen else Cause.CRC_UNKNOWN
    return cause.found(f"the checksum is another CRC: {', and '.join(words for _, words in seen)}")


def _find_start(message: bytes, wanted: int, polynomial: int, reflected: bool) -> tuple[int, int | None, bool]:
    """Return where a CRC's message begins, its start value (None where no known one fits), whether it is inverted."""
    for values, inverted, start in (
        *(((0,), False, start) for start in _RANGE_WORDS),
        *((_START_VALUES, inverted, start) for start in _RANGE_WORDS for inverted in (False, True)),
        *(((0,), True, start) for start in _RANGE_WORDS),
    ):
        for value in values:
            if crc16(message[start:], polynomial, value, reflected) ^ 0xFFFF * inverted == wanted:
                return start, value, inverted
    return 0, None, False
