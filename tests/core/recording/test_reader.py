"""The reader finds every intact chunk, and says of everything else what it was; whatever is done to the bytes."""

from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.core.errors import RecordingError
from coneskin.core.recording.block import Block, is_time
from coneskin.core.recording.chunk import CHUNK_HEAD_SIZE, FILE_HEAD_SIZE, MAX_BODY, encode_chunk
from coneskin.core.recording.defects import DefectKind
from coneskin.core.recording.reader import Recording, read_recording
from coneskin.core.recording.recorder import Recorder
from coneskin.core.recording.scan import Chunk, walk

COUNT = 40  # chunks of the recording below, without the last


def block(number: int) -> Block:
    return Block(1 + number % 3, 1000.0 + 0.01 * number, Random(number).randbytes(20) + bytes(30))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A recording of 40 chunks with three blocks each, and the last chunk."""
    path = tmp_path_factory.mktemp("whole") / "run.rec"
    with Recorder(path, copied=frozenset({1})) as recorder:
        for number in range(COUNT):
            recorder.write(*(block(3 * number + k) for k in range(3)), flush=True)
    return path.read_bytes()


def pieces(data: bytes, path: Path) -> list[bytes]:
    """The head of the file, and its chunks."""
    path.write_bytes(data)
    with open(path, "rb") as file:
        found = [piece for piece in walk(file, FILE_HEAD_SIZE, len(data)) if isinstance(piece, Chunk)]
    return [data[:FILE_HEAD_SIZE], *(data[chunk.offset : chunk.end] for chunk in found)]


def read(data: bytes, path: Path) -> Recording:
    path.write_bytes(data)
    return read_recording(path)


def missing(recording: Recording) -> str:
    return "; ".join(defect.describe(recording.since) for defect in recording.defects)


def kinds(recording: Recording) -> list[DefectKind]:
    return [defect.kind for defect in recording.defects]


def of_chunks(numbers: Iterator[int] | range | list[int]) -> list[Block]:
    return [block(3 * number + k) for number in numbers for k in range(3)]


def test_a_whole_recording_has_no_defect(whole: bytes, tmp_path: Path) -> None:
    recording = read(whole, tmp_path / "run.rec")
    assert list(recording) == of_chunks(range(COUNT)) == list(recording)  # as often as one likes
    assert recording.defects == ()
    assert missing(recording) == ""
    assert recording.size == len(whole)


def test_one_flipped_bit_costs_one_chunk_and_the_reader_says_which(whole: bytes, tmp_path: Path) -> None:
    parts = pieces(whole, tmp_path / "run.rec")
    hurt = bytearray(parts[14])
    hurt[CHUNK_HEAD_SIZE + 5] ^= 1
    recording = read(b"".join([*parts[:14], hurt, *parts[15:]]), tmp_path / "run.rec")
    assert list(recording) == of_chunks([n for n in range(COUNT) if n != 13])
    (lost,) = recording.defects
    assert (lost.kind, lost.chunks, lost.blocks, lost.kinds) == (DefectKind.LOST, 1, 3, frozenset({1, 2, 3}))
    assert (lost.size, lost.offset) == (len(parts[14]), sum(map(len, parts[:14])))
    assert (lost.since, lost.until) == (block(38).time, block(42).time)
    assert "1 chunk is missing, from 0.380 s to 0.420 s: 3 blocks (1, 2, 3)" in missing(recording)


def test_a_damaged_head_hides_no_chunk_behind_it(whole: bytes, tmp_path: Path) -> None:
    parts = pieces(whole, tmp_path / "run.rec")
    hurt = bytearray(parts[14])
    hurt[5] ^= 0x40
    recording = read(b"".join([*parts[:14], hurt, *parts[15:]]), tmp_path / "run.rec")
    assert list(recording) == of_chunks([n for n in range(COUNT) if n != 13])
    (lost,) = recording.defects
    assert (lost.kind, lost.chunks, lost.kinds, lost.size) == (DefectKind.LOST, 1, None, len(parts[14]))


def test_a_chunk_that_was_cut_out_is_missed(whole: bytes, tmp_path: Path) -> None:
    parts = pieces(whole, tmp_path / "run.rec")
    recording = read(b"".join([*parts[:7], *parts[9:]]), tmp_path / "run.rec")
    assert list(recording) == of_chunks([n for n in range(COUNT) if n not in (6, 7)])
    (lost,) = recording.defects
    assert (lost.kind, lost.chunks, lost.size) == (DefectKind.LOST, 2, 0)
    assert "nothing stands in their place" in missing(recording)


def test_bytes_that_were_cut_out_of_a_body_hide_no_chunk(whole: bytes, tmp_path: Path) -> None:
    """The head of the torn chunk names more bytes than there are, so that the next begins inside of them."""
    parts = pieces(whole, tmp_path / "run.rec")
    recording = read(b"".join([*parts[:7], parts[7][:-30], *parts[8:]]), tmp_path / "run.rec")
    assert list(recording) == of_chunks([n for n in range(COUNT) if n != 6])
    assert kinds(recording) == [DefectKind.LOST]


def test_a_chunk_that_stands_twice_is_read_once(whole: bytes, tmp_path: Path) -> None:
    parts = pieces(whole, tmp_path / "run.rec")
    recording = read(b"".join([*parts[:30], parts[4], *parts[30:]]), tmp_path / "run.rec")
    assert list(recording) == of_chunks(range(COUNT))
    (twice,) = recording.defects
    assert (twice.kind, twice.chunks, twice.offset) == (DefectKind.TWICE, 1, sum(map(len, parts[:30])))


def test_chunks_that_were_swapped_are_read_in_their_order(whole: bytes, tmp_path: Path) -> None:
    parts = pieces(whole, tmp_path / "run.rec")
    parts[5], parts[20] = parts[20], parts[5]
    recording = read(b"".join(parts), tmp_path / "run.rec")
    assert list(recording) == of_chunks(range(COUNT))
    assert set(kinds(recording)) == {DefectKind.DISORDER}


def test_a_chunk_of_another_recording_is_not_read(whole: bytes, tmp_path: Path) -> None:
    parts = pieces(whole, tmp_path / "run.rec")
    alien = encode_chunk(12345, 9, [block(27)])
    recording = read(b"".join([*parts[:10], alien, *parts[10:]]), tmp_path / "run.rec")
    assert list(recording) == of_chunks(range(COUNT))
    assert kinds(recording) == [DefectKind.FOREIGN]


def test_bytes_behind_the_end_and_between_chunks_are_said(whole: bytes, tmp_path: Path) -> None:
    parts = pieces(whole, tmp_path / "run.rec")
    recording = read(b"".join([*parts[:10], b"x" * 33, *parts[10:], b"y" * 44]), tmp_path / "run.rec")
    assert list(recording) == of_chunks(range(COUNT))
    assert [(defect.kind, defect.size) for defect in recording.defects] == [
        (DefectKind.STRAY, 33),
        (DefectKind.STRAY, 44),
    ]


def test_a_damaged_head_of_the_file_is_said_and_the_rest_is_read(whole: bytes, tmp_path: Path) -> None:
    for at in range(FILE_HEAD_SIZE):
        hurt = bytearray(whole)
        hurt[at] ^= 1
        recording = read(bytes(hurt), tmp_path / "run.rec")
        assert list(recording) == of_chunks(range(COUNT)), at
        assert kinds(recording) == [DefectKind.STRAY], at


def test_what_a_replay_cannot_do_without_stands_at_the_end_again(whole: bytes, tmp_path: Path) -> None:
    parts = pieces(whole, tmp_path / "run.rec")
    recording = read(b"".join([parts[0], *parts[2:]]), tmp_path / "run.rec")
    assert next(iter(recording)) == block(3)
    assert block(0) in recording.copies


@pytest.mark.parametrize("cut", [1, 40, 200, 3000])
def test_a_torn_end_is_said(whole: bytes, tmp_path: Path, cut: int) -> None:
    recording = read(whole[:-cut], tmp_path / "run.rec")
    assert kinds(recording) == [DefectKind.NOT_CLOSED]
    got = list(recording)
    assert got == of_chunks(range(COUNT))[: len(got)]
    assert "the recording was not closed: nothing is known after" in missing(recording)


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_no_damage_yields_a_false_block_or_hides_an_intact_one(
    whole: bytes, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.getbasetemp() / "hurt.rec"
    parts = pieces(whole, path)
    hurt = bytearray(whole)
    at = data.draw(st.integers(FILE_HEAD_SIZE, len(hurt) - 1))
    hurt[at] ^= data.draw(st.integers(1, 255))
    offset, number = FILE_HEAD_SIZE, 0
    while offset + len(parts[number + 1]) <= at:
        offset, number = offset + len(parts[number + 1]), number + 1
    recording = read(bytes(hurt), path)
    assert list(recording) == of_chunks([n for n in range(COUNT) if n != number])
    assert kinds(recording) == [DefectKind.LOST if number < COUNT else DefectKind.NOT_CLOSED]
    assert missing(recording)


def test_a_seek_reads_what_it_needs(whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks, unpacked = read(whole, tmp_path / "run.rec"), []
    unpack = Chunk.blocks
    monkeypatch.setattr(Chunk, "blocks", lambda chunk: unpacked.append(chunk) or unpack(chunk))
    assert list(blocks.select(1000.25, 1000.30)) == [block(n) for n in range(25, 31)]
    assert len(unpacked) == 3
    assert list(blocks.select(kinds=frozenset({2}))) == [block(n) for n in range(1, 3 * COUNT, 3)]
    (tmp_path / "run.rec").write_bytes(whole[:3000])
    with pytest.raises(RecordingError, match="has changed while it was read"):
        list(blocks)


def test_a_million_heads_that_name_long_bodies_do_not_hold_the_reader_up(whole: bytes, tmp_path: Path) -> None:
    """Each is searched for chunks in vain; without a limit this is quadratic, and takes minutes."""
    big = encode_chunk(1, 0, [Block(1, 1.0, Random(0).randbytes(1 << 20))])
    heads = b"".join(
        encode_chunk(1, 0, [Block(1, 1.0, Random(0).randbytes(1 << 20))])[:CHUNK_HEAD_SIZE] for _ in range(3)
    )
    recording = read(whole[:FILE_HEAD_SIZE] + heads * 4000 + big[:-1], tmp_path / "run.rec")
    assert not list(recording)
    assert recording.defects


def test_a_reversed_recording_is_put_in_order(whole: bytes, tmp_path: Path) -> None:
    parts = pieces(whole, tmp_path / "run.rec")
    assert list(read(b"".join([parts[0], *parts[:0:-1]]), tmp_path / "run.rec")) == of_chunks(range(COUNT))


def test_a_body_that_unpacks_to_more_than_can_be_is_refused(tmp_path: Path) -> None:
    """Made, not damaged: its checksum is right."""
    bomb = encode_chunk(7, 0, [Block(1, 1.0, bytes(MAX_BODY + 1))])
    with Recorder(tmp_path / "run.rec"):
        pass
    recording = read((tmp_path / "run.rec").read_bytes()[:FILE_HEAD_SIZE] + bomb, tmp_path / "run.rec")
    assert not list(recording)  # its number is of another recording
    recording = read(bytes(FILE_HEAD_SIZE) + bomb, tmp_path / "run.rec")
    with pytest.raises(RecordingError, match=r"chunk 0 of 1\.000000 s is not what its head says: it has more than"):
        list(recording)


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.rec"
    with pytest.raises(RecordingError, match="cannot read the recording"):
        read_recording(path)
    for data, words in (
        (b"hello", "is no recording of coneskin"),
        (b"CONESKIN", "has no header: not one chunk"),
    ):
        path.write_bytes(data)
        with pytest.raises(RecordingError, match=words):
            read_recording(path)


def test_a_time_is_a_number_that_a_clock_can_show() -> None:
    assert is_time(0)
    assert is_time(-1.5)
    assert not any(map(is_time, (True, None, "1", 1e13, float("nan"), float("inf"))))
