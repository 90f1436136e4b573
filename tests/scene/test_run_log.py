"""The log of a run: blocks to the file, events to whoever waits, and neither a full disk nor a bad callback ends it."""

import logging
import os
import threading

import pytest

from coneskin.replay import read_run
from coneskin.robot.channel import Channel, pair
from coneskin.robot.journal import GuardEvent, Kind
from coneskin.run_log import RunLog, new_recording
from coneskin.skin.recording import Block, encode_block


@pytest.fixture
def channel():
    ours, theirs = (Channel(end) for end in pair())
    yield ours, theirs
    ours.close()
    theirs.close()


def tell(theirs, name, time=1.0, **details):
    theirs.send(encode_block(GuardEvent(name, time, details).block()))


def test_what_is_told_is_recorded_and_waited_for(tmp_path, channel):
    ours, theirs = channel
    seen = []
    log = RunLog(tmp_path / "run.rec", seen.append)
    log.open({"scene": "", "name": "x", "folder": "."})
    log.listen(ours)
    theirs.send(encode_block(Block(Kind.TICK, 0.5, b"")))
    tell(theirs, "armed")
    assert log.wait_for(("contact", "armed"), 5.0).name == "armed"
    assert log.wait_for(("contact",), 0.0) is None
    threading.Timer(0.01, tell, (theirs, "contact")).start()
    assert log.wait_for(("contact",), 5.0, after=1).name == "contact"
    theirs.close()
    log.close()
    log.close()
    assert log.ended
    assert log.wait_for(("never",), 60.0) is None  # nobody is left to tell
    run = read_run(tmp_path / "run.rec")
    assert run.missing == ""
    assert [block.kind for block in run.blocks] == [Kind.TICK, Kind.EVENT, Kind.EVENT]
    assert [event.name for event in seen] == ["armed", "contact"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system to stand for a full disk")
def test_a_full_disk_ends_the_recording_and_says_so(tmp_path, channel):
    ours, theirs = channel
    log = RunLog(tmp_path / "run.rec", None)
    log.open({})
    log._recorder._file.close()
    log._recorder._file = open("/dev/full", "wb", buffering=0)  # noqa: SIM115 - the log closes it
    log.listen(ours)
    tell(theirs, "armed")
    message = log.wait_for(("message",), 5.0)
    assert "recording ended" in message.details["what"]
    assert "No space left" in message.details["what"]
    tell(theirs, "contact")
    assert log.wait_for(("contact",), 5.0) is not None
    theirs.close()
    log.close()


def test_a_callback_that_fails_is_called_no_more(channel, caplog):
    ours, theirs = channel

    def fail(event):
        raise KeyError(event.name)

    log = RunLog(None, fail)
    log.open({})
    log.listen(ours)
    with caplog.at_level(logging.ERROR, "coneskin"):
        tell(theirs, "armed")
        tell(theirs, "contact")
        assert log.wait_for(("contact",), 5.0) is not None
        theirs.close()
        log.close()
    assert caplog.text.count("on_event has failed") == 1


def test_two_runs_in_one_second_have_folders_of_their_own(tmp_path):
    assert len({new_recording(tmp_path / "runs") for _ in range(4)}) == 4


@pytest.mark.parametrize(
    ("told", "times"), [(["armed"], 1), (["armed", "latched"], 1), (["armed", "ending"], 0), (["waiting", "died"], 0)]
)
def test_an_armed_guard_that_ends_without_a_word_is_missed_once(channel, told, times):
    ours, theirs = channel
    missed = []
    log = RunLog(None, None)
    log.listen(ours, lambda: missed.append(True))
    for name in told:
        tell(theirs, name)
    theirs.close()
    log.close()
    assert len(missed) == times


def test_an_armed_guard_that_falls_silent_is_missed_once(channel, monkeypatch):
    monkeypatch.setattr("coneskin.run_log._SILENCE", 0.01)
    ours, theirs = channel
    missed, lost = [], threading.Event()
    log = RunLog(None, None)
    log.listen(ours, lambda: (missed.append(True), lost.set()))
    tell(theirs, "armed")
    assert lost.wait(5.0)
    theirs.close()
    log.close()
    assert len(missed) == 1
