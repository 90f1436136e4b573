"""Recordings: what is written is read, and what is torn is said."""

import os
import signal
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.errors import RecordingError
from coneskin.skin.recording import Block, Recorder, encode_block, read_recording

blocks = st.lists(st.builds(Block, st.integers(1, 255), st.floats(0, 1e9), st.binary(max_size=60)), max_size=12)


@given(blocks, st.data())
@settings(deadline=None, max_examples=60)
def test_every_cut_yields_the_whole_blocks_before_it(tmp_path_factory, written, data):
    path = tmp_path_factory.mktemp("cut") / "run.rec"
    with Recorder(path) as recorder:
        recorder.write(*written)
    whole = path.read_bytes()
    assert read_recording(path).blocks == tuple(written)
    assert read_recording(path).missing == ""
    cut = data.draw(st.integers(10, len(whole) - 1))
    path.write_bytes(whole[:cut])
    ends, at = [], 10
    for block in written:
        at += len(encode_block(block))
        ends.append(at)
    torn = read_recording(path)
    assert torn.blocks == tuple(b for b, end in zip(written, ends, strict=True) if end <= cut)
    assert "was not closed" in torn.missing


@given(
    st.lists(st.builds(Block, st.integers(1, 255), st.floats(0, 1e9), st.binary(max_size=60)), min_size=1), st.data()
)
@settings(deadline=None, max_examples=60)
def test_a_damaged_byte_never_yields_a_false_block(tmp_path_factory, written, data):
    path = tmp_path_factory.mktemp("flip") / "run.rec"
    with Recorder(path) as recorder:
        recorder.write(*written)
    raw = bytearray(path.read_bytes())
    at = data.draw(st.integers(10, len(raw) - 1))
    raw[at] ^= data.draw(st.integers(1, 255))
    path.write_bytes(raw)
    got = read_recording(path)
    assert got.blocks == tuple(written[: len(got.blocks)])
    assert got.missing
    assert "ignored" in got.missing or "not closed" in got.missing


def test_kill_9_loses_nothing_that_was_written(tmp_path):
    """The writer kills itself with SIGKILL right behind its hundredth block."""
    path = tmp_path / "run.rec"
    code = (
        "import os, sys, pathlib\n"
        "from coneskin.skin.recording import Block, Recorder\n"
        "with Recorder(pathlib.Path(sys.argv[1])) as recorder:\n"
        "    for i in range(1000):\n"
        "        recorder.write(Block(1, float(i), bytes([i % 256])))\n"
        "        if i == 99: os.kill(os.getpid(), 9)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], timeout=60)
    assert done.returncode == -signal.SIGKILL
    got = read_recording(path)
    assert [b.time for b in got.blocks] == [float(i) for i in range(100)]
    assert "nothing is known after 99.000000 s" in got.missing


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system to stand for a full disk")
def test_a_full_disk_is_said(tmp_path):
    recorder = Recorder(tmp_path / "run.rec")
    with open("/dev/full", "wb", buffering=0) as full:
        recorder._file = full
        with pytest.raises(RecordingError, match="No space left on device"):
            recorder.write(Block(1, 0.0, b"x"))
        recorder._file = None


def test_what_is_no_recording_is_refused(tmp_path):
    path = tmp_path / "run.rec"
    with pytest.raises(RecordingError, match="cannot read the recording"):
        read_recording(path)
    path.write_bytes(b"hello")
    with pytest.raises(RecordingError, match="is no recording of coneskin"):
        read_recording(path)
    path.write_bytes(b"CONESKIN\x09\x00")
    with pytest.raises(RecordingError, match="version 9; this coneskin reads version 1"):
        read_recording(path)
    with pytest.raises(RecordingError, match=r"cannot make the recording .*File exists"), Recorder(path):
        pass
    recorder = Recorder(tmp_path / "closed.rec")
    with recorder:
        pass
    recorder.close()
    with pytest.raises(RecordingError, match="is not open"):
        recorder.write(Block(1, 0.0, b""))
