"""Frames on the wire: the layout, the checksum, and finding frames in anything."""

import random
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.skin.wire import FRAME_LENGTH, MAX_LENGTH, SYNC, VERSION, Decoder, Frame, encode, frame_at

WIDTHS = dict(zip(Frame._fields, (8, 16, 8, 8, 16, 32, *[16] * 10), strict=True))
frames = st.builds(
    Frame,
    version=st.just(VERSION),
    **{name: st.integers(0, (1 << bits) - 1) for name, bits in WIDTHS.items() if name != "version"},
)


def crc_by_hand(data: bytes) -> int:
    """CRC-16/XMODEM bit by bit, from its definition: polynomial x^16 + x^12 + x^5 + 1, start 0."""
    register = 0
    for byte in data:
        for bit in range(7, -1, -1):
            carry = (register >> 15) ^ (byte >> bit & 1)
            register = (register << 1 & 0xFFFF) ^ (0x1021 if carry else 0)
    return register


def sealed(content: bytes) -> bytes:
    return content + crc_by_hand(content).to_bytes(2, "big")


def test_the_checksum_by_hand_is_the_published_one():
    assert crc_by_hand(b"123456789") == 0x31C3  # the check value of CRC-16/XMODEM in the catalogue of CRCs


def test_layout_byte_by_byte():
    # docs/wire-format.md shows these bytes
    frame = Frame(1, 0x1234, 5, 0x40, 0x0A0B, 0x01020304, *(0x0100 + k for k in range(10)))
    by_hand = bytes.fromhex(
        "c53a 01 24 3412 05 40 0b0a 04030201 0001 0101 0201 0301 0401 0501 0601 0701 0801 0901".replace(" ", "")
    )
    assert encode(frame) == sealed(by_hand)
    assert len(encode(frame)) == FRAME_LENGTH == 36


def test_the_documented_bytes_are_the_encoded_ones():
    text = (Path(__file__).parents[2] / "docs" / "wire-format.md").read_text(encoding="utf-8")
    shown = bytes.fromhex("".join(re.findall(r"^    ((?:[0-9A-F]{2}[ ]*)+)$", text, re.MULTILINE)))
    frame = Frame(1, 0x1234, 5, 0x40, 0x0A0B, 0x01020304, *(0x0100 + k for k in range(10)))
    assert shown == encode(frame)


@given(frames)
def test_what_is_encoded_is_decoded(frame):
    assert frame_at(encode(frame)) == frame
    assert Decoder().feed(encode(frame)) == [frame]


pieces = st.lists(
    st.one_of(
        frames.map(encode),
        st.binary(max_size=50),
        st.just(SYNC),
        st.just(SYNC + bytes((VERSION, FRAME_LENGTH))),
        st.just(SYNC + bytes((2, MAX_LENGTH))),
        frames.map(encode).flatmap(lambda data: st.integers(0, 36).map(lambda cut: data[:cut])),
    ),
    max_size=8,
)


@given(pieces, st.data())
@settings(deadline=None)
def test_the_frames_do_not_depend_on_how_the_stream_is_cut(parts, data):
    stream = b"".join(parts)
    whole = Decoder()
    expected = whole.feed(stream)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    pieced = Decoder()
    found = [f for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True) for f in pieced.feed(stream[a:b])]
    assert found == expected
    for name in ("frames", "bytes_skipped", "crc_errors", "unknown_versions", "pending"):
        assert getattr(pieced, name) == getattr(whole, name), name
    assert whole.frames * FRAME_LENGTH + whole.bytes_skipped + whole.pending == len(stream)


@given(st.binary(max_size=200), frames, frames, frames)
@settings(deadline=None)
def test_a_frame_in_noise_is_found_at_the_latest_with_the_next(noise, first, second, third):
    decoder = Decoder()
    found = decoder.feed(noise + encode(first))
    found += decoder.feed(encode(second))
    assert first in found  # a false start is at most 64 bytes long and ends within the second frame
    found += decoder.feed(encode(third))
    assert found[-3:] == [first, second, third]


@pytest.mark.parametrize(("length", "at_once"), [(36, True), (64, False), (65, True), (255, True)])
def test_only_a_length_that_can_be_holds_a_frame_back(length, at_once):
    frame = Frame(1, 7, 1, 0, 5, 123456, *range(1000, 1010))
    decoder = Decoder()
    found = decoder.feed(SYNC + bytes((2, length)) + encode(frame))
    assert found == ([frame] if at_once else [])
    assert found + decoder.feed(encode(frame)) == [frame, frame]


def test_noise_never_raises_and_gives_nothing():
    rng = random.Random(5)
    decoder = Decoder()
    for _ in range(2000):
        assert decoder.feed(rng.randbytes(rng.randrange(200))) == []
    assert decoder.bytes_skipped + decoder.pending > 150_000
    assert decoder.pending < MAX_LENGTH


def test_every_error_of_one_two_or_three_bits_is_detected():
    # The CRC is linear: an error passes if and only if its bits' residues cancel. All 8 million triples by sets.
    residues = []
    for bit in range(FRAME_LENGTH * 8):
        error = bytearray(FRAME_LENGTH)
        error[bit // 8] |= 0x80 >> bit % 8
        residues.append(crc_by_hand(bytes(error)))
    single = set(residues)
    assert 0 not in single
    assert len(single) == len(residues)
    assert not any(residues[i] ^ residues[k] in single for i in range(len(residues)) for k in range(i))


def test_every_burst_up_to_16_bits_is_detected():
    frame = encode(Frame(1, 7, 1, 0, 5, 123456, *range(1000, 1010)))
    number = int.from_bytes(frame, "big")
    rng = random.Random(2)
    for start in range(FRAME_LENGTH * 8 - 16):
        for burst in (0x8001, 0xFFFF, 0x8000 | rng.randrange(0x8000)):
            damaged = (number ^ burst << start).to_bytes(FRAME_LENGTH, "big")
            assert frame_at(damaged) is None


def test_a_damaged_frame_is_counted_and_its_successor_is_not_lost():
    frame = Frame(1, 7, 1, 0, 5, 123456, *range(1000, 1010))
    damaged = bytearray(encode(frame))
    damaged[20] ^= 4
    decoder = Decoder()
    assert decoder.feed(bytes(damaged) + encode(frame)) == [frame]
    assert (decoder.crc_errors, decoder.bytes_skipped, decoder.frames) == (1, FRAME_LENGTH, 1)


@pytest.mark.parametrize("length", [8, 40, MAX_LENGTH])
def test_a_version_of_the_future_is_skipped_whole_and_counted(length):
    frame = Frame(1, 7, 1, 0, 5, 123456, *range(1000, 1010))
    future = sealed(SYNC + bytes((9, length)) + encode(frame)[: length - 6].ljust(length - 6, b"\x07"))
    decoder = Decoder()
    assert decoder.feed(future + encode(frame)) == [frame]
    assert decoder.unknown_versions == 1
    assert decoder.last_unknown_version == 9
    assert decoder.bytes_skipped == 0 == decoder.crc_errors


def test_version_1_of_another_length_is_no_frame():
    decoder = Decoder()
    assert decoder.feed(sealed(SYNC + bytes((VERSION, 38)) + bytes(32))) == []
    assert decoder.unknown_versions == 0


@pytest.mark.parametrize(
    ("change", "words"), [({"version": 2}, "version must be 1, got 2"), ({"supply": 70000}, "does not fit its width")]
)
def test_what_cannot_be_encoded_is_refused(change, words):
    with pytest.raises(ValueError, match=words):
        encode(Frame(1, 7, 1, 0, 5, 123456, *range(10))._replace(**change))
