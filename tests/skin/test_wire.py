"""Frames on the wire: the layout, the checksum, and finding frames in anything."""

import math
import random
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact
from coneskin.skin.wire import (
    FRAME_LENGTHS,
    MAX_LENGTH,
    SYNC,
    VERSION,
    DrivenPotentials,
    Frame,
    FrameDecoder,
    encode,
    frame_at,
)
from tests.support.paths import ROOT

from .bench_top import UR10, measured

counts = st.integers(0, 0xFFFF)
heads = st.tuples(counts, st.integers(0, 255), st.integers(0, 255), counts, st.integers(0, 0xFFFFFFFF))
drivens = st.builds(DrivenPotentials, *[counts] * 6)
frames_1 = st.builds(
    lambda head, nine, supply: Frame(36, *head, *nine, *[supply] * 3), heads, st.tuples(*[counts] * 9), counts
)
frames_2 = st.builds(
    lambda head, twelve, driven: Frame(40 if driven is None else 52, *head, *twelve, driven),
    heads,
    st.tuples(*[counts] * 12),
    st.none() | drivens,
)
frames = frames_1 | frames_2
PLAIN = Frame(36, 7, 1, 0, 5, 123456, *range(1000, 1010), 1009, 1009)
#: one frame in each layout
EVERY = (
    PLAIN,
    Frame(40, 7, 1, 0, 5, 123456, *range(1000, 1012)),
    Frame(52, 7, 1, 0, 5, 123456, *range(1000, 1012), DrivenPotentials(*range(1012, 1018))),
)
each_layout = pytest.mark.parametrize("frame", EVERY, ids=("36", "40", "52"))


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


_HEAD = (0x1234, 5, 0x40, 0x0A0B, 0x01020304)
DOCUMENTED = (
    Frame(36, *_HEAD, *range(0x0100, 0x010A), 0x0109, 0x0109),
    Frame(40, *_HEAD, *range(0x0100, 0x010C)),
    Frame(52, *_HEAD, *range(0x0100, 0x010C), DrivenPotentials(*range(0x010C, 0x0112))),
)


def test_layout_byte_by_byte():
    # docs/look-up/wire-format.md shows these bytes
    head, nine = "3412 05 40 0b0a 04030201", "0001 0101 0201 0301 0401 0501 0601 0701 0801"
    for frame, sync, rest in (
        (DOCUMENTED[0], "c53a 01 24", "0901"),
        (DOCUMENTED[1], "c53a 01 28", "0901 0a01 0b01"),
        (DOCUMENTED[2], "c53a 01 34", "0901 0a01 0b01 0c01 0d01 0e01 0f01 1001 1101"),
    ):
        by_hand = bytes.fromhex(f"{sync}{head}{nine}{rest}".replace(" ", ""))
        assert encode(frame) == sealed(by_hand)
        assert len(encode(frame)) == frame.length


def test_the_documented_bytes_are_the_encoded_ones():
    text = (ROOT / "docs" / "look-up" / "wire-format.md").read_text(encoding="utf-8")
    shown = bytes.fromhex("".join(re.findall(r"^    ((?:[0-9A-F]{2}[ ]*)+)$", text, re.MULTILINE)))
    assert shown == b"".join(encode(frame) for frame in DOCUMENTED)


def test_the_worked_example_is_what_the_circuit_gives():
    text = (ROOT / "docs" / "look-up" / "wire-format.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (?:untouched|touched at [^|]*) \| (.*) \|$", text, re.MULTILINE)
    shown = [[int(count) for count in re.findall(r"\d+", row)] for row in rows]
    sensor = Sensor(UR10)
    contacts = [[], [LayerContact(0.217, math.pi, 0.8e-3)]]
    assert shown == [list(measured(sensor, there)[6:16]) for there in contacts]
    assert f"{1e3 * sensor.electronics.current_full_scale:.3f} mA full scale" in text


@given(frames)
def test_what_is_encoded_is_decoded(frame):
    assert frame_at(encode(frame)) == frame
    assert FrameDecoder().feed(encode(frame)) == [frame]


pieces = st.lists(
    st.one_of(
        frames.map(encode),
        st.binary(max_size=50),
        st.just(SYNC),
        st.sampled_from([SYNC + bytes((VERSION, length)) for length in FRAME_LENGTHS]),
        st.just(SYNC + bytes((3, MAX_LENGTH))),
        frames.map(encode).flatmap(lambda data: st.integers(0, 52).map(lambda cut: data[:cut])),
    ),
    max_size=8,
)


@pytest.mark.long
@given(pieces, st.data())
def test_the_frames_do_not_depend_on_how_the_stream_is_cut(parts, data):
    stream = b"".join(parts)
    whole = FrameDecoder()
    expected = whole.feed(stream)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    pieced = FrameDecoder()
    found = [f for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True) for f in pieced.feed(stream[a:b])]
    assert found == expected
    for name in ("frames", "bytes_skipped", "crc_errors", "unknown_versions", "pending"):
        assert getattr(pieced, name) == getattr(whole, name), name
    assert sum(frame.length for frame in expected) + whole.bytes_skipped + whole.pending == len(stream)


@given(st.binary(max_size=200), frames, frames, frames)
def test_a_frame_in_noise_is_found_at_the_latest_with_the_next(noise, first, second, third):
    decoder = FrameDecoder()
    found = decoder.feed(noise + encode(first))
    found += decoder.feed(encode(second))
    assert first in found  # a false start is at most 64 bytes long and ends within the second frame
    found += decoder.feed(encode(third))
    assert found[-3:] == [first, second, third]


@pytest.mark.parametrize(
    ("version", "length", "at_once"),
    [(3, 36, True), (3, 64, False), (3, 65, True), (3, 255, True), (1, 40, True), (2, 36, True), (2, 52, False)],
)
def test_only_a_length_that_can_be_holds_a_frame_back(version, length, at_once):
    decoder = FrameDecoder()
    found = decoder.feed(SYNC + bytes((version, length)) + encode(PLAIN))
    assert found == ([PLAIN] if at_once else [])
    assert found + decoder.feed(encode(PLAIN)) == [PLAIN, PLAIN]


def test_noise_never_raises_and_gives_nothing():
    rng = random.Random(5)
    decoder = FrameDecoder()
    for _ in range(2000):
        assert decoder.feed(rng.randbytes(rng.randrange(200))) == []
    assert decoder.bytes_skipped + decoder.pending > 150_000
    assert decoder.pending < MAX_LENGTH


def test_every_error_of_one_two_or_three_bits_is_detected():
    # The CRC is linear: an error passes if and only if its bits' residues cancel. All 24 million triples by sets.
    residues = []
    length = FRAME_LENGTHS[-1]  # a shorter frame's errors are among them
    for bit in range(length * 8):
        error = bytearray(length)
        error[bit // 8] |= 0x80 >> bit % 8
        residues.append(crc_by_hand(bytes(error)))
    single = set(residues)
    assert 0 not in single
    assert len(single) == len(residues)
    assert not any(residues[i] ^ residues[k] in single for i in range(len(residues)) for k in range(i))


@each_layout
def test_every_burst_up_to_16_bits_is_detected(frame):
    good, length = encode(frame), frame.length
    number = int.from_bytes(good, "big")
    rng = random.Random(2)
    for start in range(length * 8 - 16):
        for burst in (0x8001, 0xFFFF, 0x8000 | rng.randrange(0x8000)):
            damaged = (number ^ burst << start).to_bytes(length, "big")
            assert frame_at(damaged) is None


@each_layout
def test_a_damaged_frame_is_counted_and_its_successor_is_not_lost(frame):
    damaged = bytearray(encode(frame))
    damaged[20] ^= 4
    decoder = FrameDecoder()
    assert decoder.feed(bytes(damaged) + encode(frame)) == [frame]
    assert (decoder.crc_errors, decoder.bytes_skipped, decoder.frames) == (1, frame.length, 1)


@pytest.mark.parametrize("length", [8, 40, MAX_LENGTH])
def test_a_version_of_the_future_is_skipped_whole_and_counted(length):
    frame = PLAIN
    future = sealed(SYNC + bytes((9, length)) + encode(frame)[: length - 6].ljust(length - 6, b"\x07"))
    decoder = FrameDecoder()
    assert decoder.feed(future + encode(frame)) == [frame]
    assert decoder.unknown_versions == 1
    assert decoder.last_unknown_version == 9
    assert decoder.bytes_skipped == 0 == decoder.crc_errors


def test_the_known_version_with_another_length_is_no_frame():
    decoder = FrameDecoder()
    assert decoder.feed(sealed(SYNC + bytes((VERSION, 38)) + bytes(32))) == []
    assert decoder.unknown_versions == 0


def test_frames_of_all_layouts_may_follow_each_other():
    stream = b"".join(encode(frame) for frame in EVERY * 3)
    assert FrameDecoder().feed(stream) == list(EVERY * 3)


def test_the_shortest_frame_gives_its_supply_in_every_phase():
    read = frame_at(encode(PLAIN))
    assert (read.touch_supply, read.radial_supply, read.angular_supply, read.driven) == (1009, 1009, 1009, None)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"length": 38}, "length must be one of 36, 40, 52 bytes, got 38"),
        ({"touch_c": 70000}, "does not fit its width"),
        ({"radial_supply": 1}, "36 bytes carries one supply"),
        ({"driven": EVERY[2].driven}, "52 bytes, and no other, carries the driven potentials"),
    ],
)
def test_what_cannot_be_encoded_is_refused(change, words):
    with pytest.raises(ValueError, match=words):
        encode(PLAIN._replace(**change))
