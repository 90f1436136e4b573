"""Damage to a stream in which some frames are valid: what lies between them says what happens on the way."""

from __future__ import annotations

from binascii import crc_hqx
from collections import Counter
from collections.abc import Sequence

from coneskin.skin.wire import SYNC

from .capture import LENGTHS, FoundFrames, count_frames, printable_share, short_hex
from .cause import Cause, Diagnosis
from .checksum import find_checksum
from .foreign_stream import first_line
from .line_coding import undo_newlines, undo_slip

__all__ = ["find_damage"]

_FLOW = {0x11, 0x13}
_MAX_REPAIRS = 24  # damaged frames that are looked at
_TOLERATED = 0.005  # share of the bytes that may be lost without a word
_SAME = 0.8  # share of what lies between frames that must be the same


def find_damage(data: bytes, found: FoundFrames) -> Diagnosis | None:
    """Say what damages the frames of a capture, or stands between them; None where hardly anything does."""
    if found.covered >= 1.0 - _TOLERATED or not found.gaps:
        return None
    share = f"{100.0 * (1.0 - found.covered):.1f} % of the bytes are no frames"
    for cause, words, undo in (
        (Cause.NEWLINES, "each 0A in a frame has become 0D 0A", undo_newlines),
        (Cause.SLIP, "the frames are wrapped in SLIP", undo_slip),
    ):
        frames, covered = count_frames(undo(data))
        if frames > len(found.frames) and covered > found.covered + 0.5 * (1.0 - found.covered):
            return Diagnosis(cause, f"{share}: {words}")
    between = b"".join(found.gaps)
    if SYNC not in between:
        gap, count = Counter(found.gaps).most_common(1)[0]
        if count >= _SAME * len(found.gaps) and len(gap) <= 8:
            return Diagnosis(Cause.EXTRA_BYTES, f"{short_hex(gap)} stands between the frames")
        if printable_share(between) > 0.9:
            return Diagnosis(Cause.TEXT, f"text stands between the frames: {first_line(between)!r}")
    broken = _broken_frames(found.gaps)
    if (repaired := _repair(broken)) is not None:
        return Diagnosis(repaired[0], f"{share}: {repaired[1]}")
    whole = [piece for piece in broken if len(piece) == piece[3]]
    if sum(len(piece) < piece[3] for piece in broken) > 0.5 * len(broken):
        return Diagnosis(Cause.BYTES_LOST, f"{share}: frames are shorter than they say")
    if len(whole) >= 8 and len(whole) > 2 * len(found.frames):
        named = find_checksum(whole)
        if named.cause not in (Cause.CRC_UNKNOWN, Cause.CRC_CONSTANT):
            return named
    if whole and len(whole) >= 0.5 * len(found.gaps):
        return Diagnosis(Cause.DAMAGED, f"{share}: {len(whole)} frames of the right length have a wrong checksum")
    if printable_share(between) > 0.9:
        return Diagnosis(Cause.TEXT, f"text stands between the frames: {first_line(between)!r}")
    return Diagnosis(Cause.DAMAGED, f"{share}, such as {short_hex(max(found.gaps, key=len))}")


def _broken_frames(gaps: Sequence[bytes]) -> list[bytes]:
    """Return the pieces that begin as a frame does, each up to the next such beginning."""
    pieces = []
    for gap in gaps:
        at = gap.find(SYNC)
        while at >= 0:
            end = gap.find(SYNC, at + 2)
            piece = gap[at : end if end >= 0 else len(gap)]
            if len(piece) >= 8 and LENGTHS.get(piece[3]) == piece[2]:
                pieces.append(piece)
            at = end
    return pieces


def _repair(broken: Sequence[bytes]) -> tuple[Cause, str] | None:
    """Find which byte is missing in frames that are one byte too short."""
    short = [piece for piece in broken if len(piece) == piece[3] - 1][:_MAX_REPAIRS]
    if len(short) < 2 or len(short) < 0.5 * min(len(broken), _MAX_REPAIRS):
        return None
    votes: Counter[int] = Counter()
    for piece in short:
        votes.update(set(_missing_bytes(piece)))
    in_flow = sum(votes[byte] for byte in _FLOW)
    (byte, count), *_ = votes.most_common(1) or [(-1, 0)]
    if in_flow >= 0.7 * len(short) and count <= in_flow:
        return Cause.FLOW_CONTROL, "the bytes 11 and 13 are missing from the frames"
    if byte == 0 and count >= 0.7 * len(short):
        return Cause.ZEROS_LOST, "the byte 00 is missing from the frames"
    return Cause.BYTES_LOST, "frames are one byte too short"


def _missing_bytes(piece: bytes) -> list[int]:
    """Return each byte that makes the checksum right where it is put in somewhere."""
    found = []
    for place in range(2, len(piece) + 1):
        before, behind = piece[:place], piece[place:]
        start = crc_hqx(before, 0)
        for byte in (0x11, 0x13, 0x00, 0x0A, 0x0D):
            if crc_hqx(bytes((byte,)) + behind, start) == 0:
                found.append(byte)
    return found
