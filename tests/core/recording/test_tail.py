"""Tail of a recording: it reads what has been written, chunk by chunk, also over files and damage."""

from contextlib import closing
from pathlib import Path

import pytest

from coneskin.core.errors import RecordingError
from coneskin.core.recording.block import Block
from coneskin.core.recording.reader import RecordingTail
from coneskin.core.recording.recorder import Recorder

HEADER, SKIN, EVENT = 20, 1, 10
ALWAYS = frozenset({HEADER, EVENT})


def blocks(count: int, since: float, kind: int = SKIN) -> list[Block]:
    return [Block(kind, since + 0.01 * k, bytes([k % 256]) * 40) for k in range(count)]


def test_it_reads_each_block_once_as_it_comes(tmp_path: Path) -> None:
    path = tmp_path / "run.rec"
    with Recorder(path) as recorder, closing(RecordingTail(path, 60.0, ALWAYS)) as tail:
        assert tail.read() == []
        recorder.write(Block(HEADER, 0.0, b"{}"), flush=True)
        first = blocks(30, 1.0)
        recorder.write(*first, flush=True)
        assert tail.read() == [Block(HEADER, 0.0, b"{}"), *first]
        assert tail.read() == []
        second = blocks(30, 2.0)
        recorder.write(*second, flush=True)
        assert tail.read() == second
        assert not tail.ended
        recorder.close()
        assert [block.kind for block in tail.read()] == [0]
        assert tail.ended


def test_a_chunk_that_is_not_whole_yet_is_waited_for(tmp_path: Path) -> None:
    whole, path = tmp_path / "whole.rec", tmp_path / "run.rec"
    with Recorder(whole) as recorder:
        recorder.write(*blocks(30, 1.0), flush=True)
        written = whole.read_bytes()
    for cut in (24, 40, 24 + 68, len(written) - 1):
        path.write_bytes(written[:cut])
        with closing(RecordingTail(path, 60.0, ALWAYS)) as tail:
            assert tail.read() == []
            with path.open("ab") as file:
                file.write(written[cut:])
            assert tail.read() == blocks(30, 1.0)


def test_it_goes_on_in_the_next_file(tmp_path: Path) -> None:
    path = tmp_path / "run.rec"
    with Recorder(path, part_size=2000) as recorder, closing(RecordingTail(path, 1e9, ALWAYS)) as tail:
        found: list[Block] = []
        for turn in range(40):
            recorder.write(*(Block(SKIN, turn + 0.001 * k, bytes(200 + k)) for k in range(20)), flush=True)
            found += tail.read()
        assert len(recorder.parts) > 3
    assert [block.time for block in found] == [turn + 0.001 * k for turn in range(40) for k in range(20)]


def test_of_a_long_recording_it_reads_the_end_and_the_events(tmp_path: Path) -> None:
    path = tmp_path / "run.rec"
    with Recorder(path) as recorder:
        recorder.write(Block(HEADER, 0.0, b"{}"), flush=True)
        for second in range(1, 300):
            recorder.write(*blocks(10, float(second)), flush=True)
            if second % 100 == 0:
                recorder.write(Block(EVENT, second + 0.5, b"[]"), flush=True)
    with closing(RecordingTail(path, 10.0, ALWAYS)) as tail:
        found = tail.read()
    assert [block.time for block in found if block.kind != SKIN][:3] == [0.0, 100.5, 200.5]
    assert min(block.time for block in found if block.kind == SKIN) >= 289.0


def test_damage_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "run.rec"
    with Recorder(path) as recorder:
        for second in range(5):
            recorder.write(*blocks(10, float(second)), flush=True)
    data = bytearray(path.read_bytes())
    second = data.index(b"\xa7CSK", 30)
    data[second : second + 20] = bytes(20)
    path.write_bytes(data)
    with closing(RecordingTail(path, 1e9, ALWAYS)) as tail:
        found = tail.read()
    assert {int(block.time) for block in found if block.kind == SKIN} == {0, 2, 3, 4}


@pytest.mark.parametrize("content", [b"", b"CONESKIN", b"x" * 200])
def test_what_is_no_recording_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "run.rec"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="no recording that can be followed"):
        RecordingTail(path, 1.0, ALWAYS)
