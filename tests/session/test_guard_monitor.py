"""Guard monitor: a guard that hangs, or has ended unannounced, is missed, and the fallback stop stands in for it."""

import logging
import threading
import time

import pytest

from coneskin.core.channel import Channel, pair
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


def monitored(channel, fallback):
    """Return a log and a running monitor."""
    log = EventLog()
    monitor = GuardMonitor(log, channel, fallback)
    monitor.start()
    return log, monitor


class Standing:
    """Fallback stop that counts the stops; ``stands`` from the first on."""

    def __init__(self):
        self.stops, self.ends, self.stands = 0, 0, False
        self.moves = threading.Event()
        self.moves.set()

    def poll(self, over):
        moved = self.moves.is_set()
        self.moves.clear()
        self.stops += moved
        self.stands = True
        return moved

    def end(self):
        self.ends += 1
        self.moves.set()  # the next first look is a stop again


@pytest.mark.parametrize(
    ("reported", "times"),
    [(["activated"], 1), (["activated", "latched"], 1), (["activated", "ending"], 0), (["waiting", "guard_exited"], 0)],
)
def test_an_active_guard_that_ends_unannounced_is_missed(channel, reported, times):
    ours, theirs = channel
    fallback = Standing()
    log, monitor = monitored(ours, fallback)
    for name in reported:
        emit(theirs, name)
    theirs.close()
    monitor.close()
    assert fallback.stops == times
    assert ("guard_exited" in [event.name for event in log.events[len(reported) :]]) is bool(times)
    assert ("unannounced" in monitor.lost) is bool(times)


def test_a_guard_that_is_gone_is_stood_in_for_until_the_program_ends(channel):
    ours, theirs = channel
    fallback = Standing()
    log, monitor = monitored(ours, fallback)
    emit(theirs, "activated")
    theirs.close()
    stop = log.wait_for(("fallback_stop",), 5.0) or next(event for event in fallback_stops(log, 1))
    assert stop.details["stands"] is True
    fallback.moves.set()  # a program moves the arm
    assert fallback_stops(log, 2)
    monitor.close()
    assert fallback.stops == 2


def fallback_stops(log, count):
    """Return the fallback stops once there are this many; the log's own wait does not work after its end."""
    end = time.monotonic() + 5.0
    while len(stops := [event for event in log.events if event.name == "fallback_stop"]) < count:
        assert time.monotonic() < end
        time.sleep(0.001)
    return stops


@pytest.mark.promise("P42")
def test_each_time_that_a_guard_hangs_it_is_missed_anew(channel, monkeypatch):
    monkeypatch.setattr("coneskin.session.guard_monitor._SESSION_HEARTBEAT_TIMEOUT", 0.01)
    ours, theirs = channel
    fallback = Standing()
    log, monitor = monitored(ours, fallback)
    emit(theirs, "activated")
    for _ in range(2):
        seen = len(log.events)
        assert "has sent nothing" in log.wait_for(("guard_unresponsive",), 5.0, after=seen).details["what"]
        assert log.wait_for(("fallback_stop",), 5.0, after=seen) is not None
        emit(theirs, "latched")
        assert log.wait_for(("latched",), 5.0, after=seen) is not None
    emit(theirs, "ending")
    theirs.close()
    monitor.close()
    assert fallback.stops == 2
    assert monitor.lost == ""


def test_the_end_is_set_whatever_happens_in_the_thread(channel, monkeypatch, caplog):
    ours, theirs = channel

    class Broken(Standing):
        def poll(self, over):
            raise OSError("no descriptor is left")

    log, monitor = monitored(ours, Broken())
    emit(theirs, "activated")
    theirs.close()
    with caplog.at_level(logging.ERROR, "coneskin"):
        monitor.close()
    assert log.ended
    assert "no descriptor is left" in caplog.text
    assert log.wait_for(("never",), 60.0) is None


def test_a_guard_is_missed_whatever_a_program_does_with_the_events(channel):
    ours, theirs = channel
    fallback = Standing()
    log, monitor = monitored(ours, fallback)
    emit(theirs, "activated")
    assert log.wait_for(("activated",), 5.0) is not None
    log.events.clear()
    theirs.close()
    monitor.close()
    assert "unannounced" in monitor.lost
    assert fallback.stops == 1


@pytest.mark.parametrize(("names", "said"), [(["waiting"], 1), (["waiting", "activated"], 0), (["activated"], 0)])
def test_what_is_wrong_with_the_skins_line_is_said_while_the_guard_waits(channel, monkeypatch, names, said):
    monkeypatch.setattr("coneskin.session.guard_monitor._ACTIVATION_TIME", 0.0)
    ours, theirs = channel
    log = EventLog()
    monitor = GuardMonitor(log, ours, None, lambda why: f"the checksum, because {why[0]}")
    for name in names:
        theirs.send(encode_block(GuardEvent(name, 1.0, {"reasons": ["no frame"]}).block()))
    emit(theirs, "ending", what="done")
    emit(theirs, "guard_exited", what="done")
    theirs.flush()
    monitor.start()
    assert log.wait_for(("guard_exited",), 5.0)
    theirs.close()
    monitor.close()
    lines = [event.details["what"] for event in log.events if event.name == "skin_line"]
    assert lines == ["the checksum, because no frame"] * said
