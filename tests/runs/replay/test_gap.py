"""A recording in the middle of which blocks are missing: it says so, and is compared up to there."""

import pytest

from coneskin.cli import main
from coneskin.core.recording.block import Block, decode_blocks, encode_block
from coneskin.core.recording.reader import read_recording
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent, RecordingOverflowFilter
from coneskin.runs.replay.run import Run, Verdict, _left_out, read_run
from tests.support.sweep import sweep

from ...scene.scenes import record


def with_a_gap(whole, cut, since, until):
    """The recording as a guard makes it whose program takes nothing for a while."""
    spill, blocks = RecordingOverflowFilter(), []
    for block in read_recording(whole):
        if block.kind == BlockKind.HEADER or not since <= block.time < until:
            blocks += decode_blocks(spill.notice())
            blocks.append(block)
        else:
            blocks += decode_blocks(spill.shorten(encode_block(block)))
    with Recorder(cut) as recorder:
        recorder.write(*blocks)


@pytest.mark.promise("P56")
@pytest.mark.parametrize("since", sweep([1000.3, 1000.7]))  # before and within the touch at 0.6 s
def test_it_is_compared_up_to_the_gap_and_says_where_that_is(tmp_path, capsys, since):
    happened = record(tmp_path / "whole.rec")
    with_a_gap(tmp_path / "whole.rec", tmp_path / "cut.rec", since, 1001.0)
    run = read_run(tmp_path / "cut.rec")
    assert [event.name for event in run.events if event.name != "recording_gap"] == [event.name for event in happened]
    assert f"are not recorded: the program did not read them, from {since - 1000.0:.2f}" in run.missing
    assert "to 0.99" in run.missing or "to 1.00" in run.missing
    result = run.replay()
    assert result.verdict == Verdict.INCOMPLETE, result.differences
    assert result.compared == sum(event.time < since for event in happened)
    assert main(["replay", str(tmp_path / "cut.rec")]) == 4
    assert f"missing: {run.missing}" in capsys.readouterr().out


@pytest.mark.long
def test_a_difference_before_the_gap_is_found(tmp_path):
    record(tmp_path / "whole.rec")
    with_a_gap(tmp_path / "whole.rec", tmp_path / "cut.rec", 1001.2, 1001.4)
    blocks = list(read_recording(tmp_path / "cut.rec"))
    with Recorder(tmp_path / "other.rec") as recorder:
        recorder.write(*(block for block in blocks if not (block.kind == BlockKind.ARM and block.time < 1000.4)))
    assert read_run(tmp_path / "other.rec").replay().differences
    assert not read_run(tmp_path / "cut.rec").replay().differences


@pytest.mark.parametrize(("told", "known"), [({"blocks": 7}, 7), ({}, 0), ({"blocks": "many"}, 0)])
def test_no_block_counts_as_missing_that_the_guard_has_not_counted(told, known):
    details = {"since": 1.0, "until": 2.0, "what": "frames", **told}
    run = Run({}, [GuardEvent(EventName.RECORDING_GAP, 2.0, details).block()])
    assert [defect.blocks for defect in _left_out(run.events)] == [known]


def test_a_whole_recording_lacks_nothing(tmp_path):
    record(tmp_path / "whole.rec")
    with_a_gap(tmp_path / "whole.rec", tmp_path / "same.rec", 0.0, 0.0)
    assert read_run(tmp_path / "same.rec").missing == ""
    assert RecordingOverflowFilter().notice() == b""
    assert RecordingOverflowFilter().shorten(encode_block(Block(BlockKind.SKIN, 1.0, b"x"))) == b""
