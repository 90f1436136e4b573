"""Guard monitor: a guard that hangs, or has ended unannounced, is missed, and what the watchdogs say is noted."""

import logging
import time

import pytest

from coneskin.core.channel import Channel, encode_json, pair
from coneskin.core.recording.block import encode_block
from coneskin.robot.guard.signals.journal import GuardEvent
from coneskin.session.event_log import EventLog
from coneskin.session.guard_monitor import GuardMonitor


@pytest.fixture
def channel():
    ours, theirs = (Channel(end) for end in pair())
    yield ours, theirs
    ours.close()
    theirs.close()


def emit(theirs, name, time=1.0, **details):
    theirs.send(encode_block(GuardEvent(name, time, details).block()))


def monitored(channel, *watchdogs):
    """Return a log and a running monitor."""
    log = EventLog()
    return log, GuardMonitor(log, channel, watchdogs)


@pytest.fixture
def watchdog():
    ours, theirs = (Channel(end) for end in pair())
    yield ours, theirs
    ours.close()
    theirs.close()


def until(what):
    end = time.monotonic() + 60.0
    while not what():
        assert time.monotonic() < end
        time.sleep(0.001)


def fallback_stops(log):
    return [event.details["stands"] for event in log.events if event.name == "fallback_stop"]


@pytest.mark.parametrize(
    ("reported", "missed"),
    [
        (["activated"], True),
        (["activated", "latched"], True),
        (["activated", "ending"], False),
        (["waiting", "guard_exited"], False),
    ],
)
def test_an_active_guard_that_ends_unannounced_is_missed(channel, reported, missed):
    ours, theirs = channel
    log, monitor = monitored(ours)
    for name in reported:
        emit(theirs, name)
    theirs.close()
    until(lambda: log.ended)
    monitor.close()
    assert ("guard_exited" in [event.name for event in log.events[len(reported) :]]) is missed
    assert ("unannounced" in monitor.lost) is missed


@pytest.mark.promise("P45")
def test_what_the_watchdogs_report_of_a_guard_that_is_gone_is_noted_until_the_program_has_ended(channel, watchdog):
    ours, theirs = channel
    log, monitor = monitored(ours, watchdog[0])
    emit(theirs, "activated")
    theirs.close()
    watchdog[1].send(encode_json({"stands": False}))
    until(lambda: fallback_stops(log) == [False])
    watchdog[1].send(encode_json({"stands": True}))  # the last that it says, as it ends
    watchdog[1].close()
    monitor.close()
    assert fallback_stops(log) == [False, True]


@pytest.mark.promise("P42")
def test_each_time_that_a_guard_hangs_it_is_missed_anew(channel, watchdog, monkeypatch):
    monkeypatch.setattr("coneskin.session.guard_monitor.UNGUARDED_TIME", 0.01)
    ours, theirs = channel
    log, monitor = monitored(ours, watchdog[0])
    emit(theirs, "activated")
    for count in (1, 2):
        seen = len(log.events)
        assert "has sent nothing" in log.wait_for(("guard_unresponsive",), 60.0, after=seen).details["what"]
        watchdog[1].send(encode_json({"stands": True}))
        until(lambda count=count: len(fallback_stops(log)) == count)
        emit(theirs, "latched")
        assert log.wait_for(("latched",), 60.0, after=seen) is not None
    emit(theirs, "ending")
    theirs.close()
    monitor.close()
    assert monitor.lost == ""


def test_the_end_is_set_whatever_happens_in_the_thread(channel, watchdog, caplog):
    ours, theirs = channel
    log, monitor = monitored(ours, watchdog[0])
    emit(theirs, "activated")
    watchdog[1].send(b"nonsense")
    with caplog.at_level(logging.ERROR, "coneskin"):
        theirs.close()
        until(lambda: log.ended)
        monitor.close()
    assert "the guard is not monitored any more" in caplog.text
    assert log.wait_for(("never",), 60.0) is None


def test_a_guard_is_missed_whatever_a_program_does_with_the_events(channel):
    ours, theirs = channel
    log, monitor = monitored(ours)
    emit(theirs, "activated")
    assert log.wait_for(("activated",), 60.0) is not None
    log.events.clear()
    theirs.close()
    until(lambda: log.ended)
    monitor.close()
    assert "unannounced" in monitor.lost


@pytest.mark.parametrize(("names", "said"), [(["waiting"], 1), (["waiting", "activated"], 0), (["activated"], 0)])
def test_what_is_wrong_with_the_skins_line_is_said_while_the_guard_waits(channel, monkeypatch, names, said):
    monkeypatch.setattr("coneskin.session.guard_monitor._ACTIVATION_TIME", 0.0)
    ours, theirs = channel
    log = EventLog()
    for name in names:
        theirs.send(encode_block(GuardEvent(name, 1.0, {"reasons": ["no frame"]}).block()))
    emit(theirs, "ending", what="done")
    emit(theirs, "guard_exited", what="done")
    theirs.flush()
    monitor = GuardMonitor(log, ours, (), lambda why: f"the checksum, because {why[0]}")
    assert log.wait_for(("guard_exited",), 60.0)
    theirs.close()
    monitor.close()
    lines = [(event.time, event.details["what"]) for event in log.events if event.name == "skin_line"]
    assert lines == [(1.0, "the checksum, because no frame")] * said  # as old as what it explains
