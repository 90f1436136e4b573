"""The log of a run: blocks to the file, events to whoever waits, and neither a full disk nor a bad callback ends it."""

import logging
import os
import threading
import time

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
    assert [block.kind for block in run.blocks] == [Kind.TICK, Kind.EVENT, Kind.EVENT, Kind.EVENT]
    assert [event.name for event in seen] == ["armed", "contact", "died"]  # without a word


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


class Standing:
    """Stands in for the last resort: counts the stops; ``stands`` from the first on."""

    def __init__(self):
        self.stops, self.ends, self.stands = 0, 0, False
        self.moves = threading.Event()
        self.moves.set()

    def look(self, over):
        moved = self.moves.is_set()
        self.moves.clear()
        self.stops += moved
        self.stands = True
        return moved

    def end(self):
        self.ends += 1
        self.moves.set()  # the next first look is a stop again


@pytest.mark.parametrize(
    ("told", "times"), [(["armed"], 1), (["armed", "latched"], 1), (["armed", "ending"], 0), (["waiting", "died"], 0)]
)
def test_an_armed_guard_that_ends_without_a_word_is_missed(channel, told, times):
    ours, theirs = channel
    resort, log = Standing(), RunLog(None, None)
    log.listen(ours, resort)
    for name in told:
        tell(theirs, name)
    theirs.close()
    log.close()
    assert resort.stops == times
    assert ("died" in [event.name for event in log.events[len(told) :]]) is bool(times)
    assert ("without a word" in log.lost) is bool(times)


def test_a_guard_that_is_gone_is_stood_in_for_until_the_program_leaves(channel):
    ours, theirs = channel
    resort, log = Standing(), RunLog(None, None)
    log.listen(ours, resort)
    tell(theirs, "armed")
    theirs.close()
    kept = log.wait_for(("kept",), 5.0) or next(event for event in wait_kept(log, 1))
    assert kept.details["stands"] is True
    resort.moves.set()  # a program moves the arm
    assert wait_kept(log, 2)
    log.close()
    assert resort.stops == 2


def wait_kept(log, count):
    """The stops made without the guard, once there are so many; events are waited for by no one after the end."""
    end = time.monotonic() + 5.0
    while len(kept := [event for event in log.events if event.name == "kept"]) < count:
        assert time.monotonic() < end
        time.sleep(0.001)
    return kept


def test_each_time_that_a_guard_hangs_it_is_missed_anew(channel, monkeypatch):
    monkeypatch.setattr("coneskin.run_log._SILENCE", 0.01)
    ours, theirs = channel
    resort, log = Standing(), RunLog(None, None)
    log.listen(ours, resort)
    tell(theirs, "armed")
    for _ in range(2):
        seen = len(log.events)
        assert "has said nothing" in log.wait_for(("hung",), 5.0, after=seen).details["what"]
        assert log.wait_for(("kept",), 5.0, after=seen) is not None
        tell(theirs, "latched")
        assert log.wait_for(("latched",), 5.0, after=seen) is not None
    tell(theirs, "ending")
    theirs.close()
    log.close()
    assert resort.stops == 2
    assert log.lost == ""


def test_the_end_is_set_whatever_happens_in_the_thread(channel, monkeypatch, caplog):
    ours, theirs = channel

    class Broken(Standing):
        def look(self, over):
            raise OSError("no descriptor is left")

    log = RunLog(None, None)
    log.listen(ours, Broken())
    tell(theirs, "armed")
    theirs.close()
    with caplog.at_level(logging.ERROR, "coneskin"):
        log.close()
    assert log.ended
    assert "no descriptor is left" in caplog.text
    assert log.wait_for(("never",), 60.0) is None


def test_what_cannot_be_taken_is_said_and_the_rest_is_heard(channel, monkeypatch, caplog):
    ours, theirs = channel
    log = RunLog(None, None)
    hear, fails = log._hear, [True]

    def once(blocks):
        if fails and any(b"contact" in block.payload for block in blocks):
            fails.clear()
            raise MemoryError
        hear(blocks)

    monkeypatch.setattr(log, "_hear", once)
    log.listen(ours)
    with caplog.at_level(logging.CRITICAL, "coneskin"):
        tell(theirs, "contact")
        assert "is lost: MemoryError" in log.wait_for(("message",), 5.0).details["what"]
        theirs.send(encode_block(Block(Kind.EVENT, 2.0, b"no event")))
        assert "holds no event" in log.wait_for(("message",), 5.0, after=1).details["what"]
        tell(theirs, "latched")
        assert log.wait_for(("latched",), 5.0) is not None
        theirs.close()
        log.close()
