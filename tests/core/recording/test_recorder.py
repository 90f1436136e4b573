"""The recorder hands chunks to the operating system, and loses no more than the one that it collects."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.core.errors import RecordingError
from coneskin.core.recording.block import Block
from coneskin.core.recording.reader import read_recording
from coneskin.core.recording.recorder import FLUSH_PERIOD, Recorder

blocks = st.lists(st.builds(Block, st.integers(1, 239), st.floats(0, 1e9), st.binary(max_size=60)), max_size=12)


@given(blocks)
@settings(max_examples=60)
def test_what_is_written_is_read(tmp_path_factory: pytest.TempPathFactory, written: list[Block]) -> None:
    path = tmp_path_factory.mktemp("whole") / "run.rec"
    with Recorder(path) as recorder:
        recorder.write(*written)
    got = read_recording(path)
    assert list(got) == written
    assert got.defects == ()


def test_kill_9_loses_no_more_than_the_chunk_that_is_collected(tmp_path: Path) -> None:
    """The writer kills itself with SIGKILL right behind its hundredth block, 10 ms each."""
    path = tmp_path / "run.rec"
    code = (
        "import os, sys, pathlib\n"
        "from coneskin.core.recording.block import Block\nfrom coneskin.core.recording.recorder import Recorder\n"
        "with Recorder(pathlib.Path(sys.argv[1])) as recorder:\n"
        "    for i in range(1000):\n"
        "        recorder.write(Block(1, 0.01 * i, bytes([i % 256])), flush=i == 97)\n"
        "        if i == 99: os.kill(os.getpid(), 9)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], timeout=60)
    assert done.returncode == -signal.SIGKILL
    got = read_recording(path)
    assert [b.time for b in got] == [0.01 * i for i in range(98)]
    assert FLUSH_PERIOD >= 0.99 - 0.97
    (cut,) = got.defects
    assert "was not closed: nothing is known after 0.970 s" in cut.describe()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system to stand for a full disk")
def test_a_full_disk_is_said(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "run.rec")
    with open("/dev/full", "wb", buffering=0) as full:
        recorder._file = full
        with pytest.raises(RecordingError, match="No space left on device"):
            recorder.write(Block(1, 0.0, b"x"), flush=True)
        recorder._file = None


def test_nothing_is_overwritten_and_nothing_is_written_to_a_closed_recording(tmp_path: Path) -> None:
    (tmp_path / "run.rec").write_bytes(b"x")
    with (
        pytest.raises(
            RecordingError,
            match=r"run\.rec is there already, and a recording is never overwritten: name another file, or none",
        ),
        Recorder(tmp_path / "run.rec"),
    ):
        pass
    recorder = Recorder(tmp_path / "closed.rec")
    with recorder:
        pass
    recorder.close()
    with pytest.raises(RecordingError, match="is not open"):
        recorder.write(Block(1, 0.0, b""))


def test_a_long_recording_goes_on_in_further_files(tmp_path: Path) -> None:
    written = [Block(1 + (number > 0), float(number), os.urandom(1000)) for number in range(60)]
    with Recorder(tmp_path / "run.rec", part_size=10_000, copied=frozenset({1})) as recorder:
        for item in written:
            recorder.write(item)
    assert len(recorder.parts) > 4
    assert max(part.stat().st_size for part in recorder.parts) < 13_000
    got = read_recording(tmp_path / "run.rec")
    assert list(got) == written
    assert got.defects == ()
    assert set(got.copies) == {written[0]}
    recorder.parts[2].unlink()
    torn = read_recording(tmp_path / "run.rec")
    assert [defect.kind for defect in torn.defects] == ["lost"]
    kept = list(torn)
    assert kept == [item for item in written if not torn.defects[0].since < item.time <= torn.defects[0].until]
    assert len(kept) < 60
    assert written[0] in read_recording(recorder.parts[3]).copies  # each file has what it takes to be looked at alone
