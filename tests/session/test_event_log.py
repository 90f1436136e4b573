"""Event log: blocks to the file, events to waiting threads; neither a full disk nor a bad callback ends it."""

import logging
import os
import threading
from collections.abc import Callable

import pytest

from coneskin.core.channel import Channel, pair
from coneskin.core.recording.block import Block, encode_block
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent
from coneskin.runs.replay.run import read_run
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import RecordingScene
from coneskin.session.event_log import EventLog, _EventDelivery, _HeardLine, new_recording
from coneskin.session.guard_monitor import GuardMonitor
from coneskin.session.outcome import activation_error
from coneskin.skin.virtual.skin import VirtualSkin
from tests.scene.scenes import SERIAL_RETREAT


@pytest.fixture
def channel():
    ours, theirs = (Channel(end) for end in pair())
    yield ours, theirs
    ours.close()
    theirs.close()


def emit(theirs, name, time=1.0, **details):
    theirs.send(encode_block(GuardEvent(name, time, details).block()))


def listen(log, channel):
    """Let the log take what comes over the channel, as a session does."""
    log.monitor = GuardMonitor(log, channel)


def close(log):
    log.monitor.close()
    log.close()


def test_what_is_told_is_recorded_and_waited_for(tmp_path, channel):
    ours, theirs = channel
    seen = []
    log = EventLog(tmp_path / "run.rec", seen.append)
    log.open({"scene": "", "name": "x", "folder": "."})
    listen(log, ours)
    theirs.send(encode_block(Block(BlockKind.TICK, 0.5, b"")))
    emit(theirs, "activated")
    assert log.wait_for(("contact", "activated"), 60.0).name == "activated"
    assert log.wait_for(("contact",), 0.0) is None
    threading.Timer(0.01, emit, (theirs, "contact")).start()
    assert log.wait_for(("contact",), 60.0, after=1).name == "contact"
    theirs.close()
    close(log)
    close(log)
    assert log.ended
    assert log.wait_for(("never",), 60.0) is None  # nothing more will come
    run = read_run(tmp_path / "run.rec")
    assert run.missing == ""
    assert [block.kind for block in run.blocks] == [BlockKind.TICK, BlockKind.EVENT, BlockKind.EVENT, BlockKind.EVENT]
    assert [event.name for event in seen] == ["activated", "contact", "guard_exited"]  # without a word


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system to stand for a full disk")
def test_a_full_disk_ends_the_recording_and_says_so(tmp_path, channel):
    ours, theirs = channel
    log = EventLog(tmp_path / "run.rec", None)
    log.open({})
    log._recorder._file.close()
    log._recorder._file = open("/dev/full", "wb", buffering=0)  # noqa: SIM115 - the log closes it
    listen(log, ours)
    emit(theirs, "activated")
    message = log.wait_for(("message",), 60.0)
    assert "recording ended" in message.details["what"]
    assert "No space left" in message.details["what"]
    emit(theirs, "contact")
    assert log.wait_for(("contact",), 60.0) is not None
    theirs.close()
    close(log)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system to stand for a full disk")
def test_a_disk_that_is_full_at_the_end_is_said_and_hides_no_collision(tmp_path):
    """``close`` ends a ``with``: what it raised would stand in the place of what the guard has stopped."""
    seen = []
    log = EventLog(tmp_path / "run.rec", seen.append)
    log.open({})
    log._recorder._file.close()
    log._recorder._file = open("/dev/full", "wb", buffering=0)  # noqa: SIM115 - the log closes it
    log.close()
    assert "recording ended: cannot write to the recording" in log.events[-1].details["what"]
    assert seen == log.events


def test_a_file_that_cannot_be_closed_ends_the_recording_and_loses_no_event(tmp_path, channel):
    ours, theirs = channel

    class Network:
        def write(self, data):
            return len(data)

        def close(self):
            raise OSError(28, "No space left on device")

    log = EventLog(tmp_path / "run.rec", None, RecordingScene(tmp_path, max_size=1000))
    log.open({})
    log._recorder._file.close()
    log._recorder._file = Network()
    listen(log, ours)
    theirs.send(
        encode_block(Block(BlockKind.TICK, 0.5, os.urandom(2000)))
        + encode_block(GuardEvent("contact", 1.0, {}).block())
    )
    assert log.wait_for(("contact",), 60.0) is not None
    assert "cannot close the recording" in log.wait_for(("message",), 60.0).details["what"]
    theirs.close()
    close(log)


def test_a_callback_that_fails_is_called_no_more(channel, caplog):
    ours, theirs = channel

    def fail(event):
        raise KeyError(event.name)

    log = EventLog(None, fail)
    log.open({})
    listen(log, ours)
    with caplog.at_level(logging.ERROR, "coneskin"):
        emit(theirs, "activated")
        emit(theirs, "contact")
        assert log.wait_for(("contact",), 60.0) is not None
        theirs.close()
        close(log)
    assert caplog.text.count("on_event has failed") == 1


def test_two_runs_in_one_second_have_folders_of_their_own(tmp_path):
    assert len({new_recording(tmp_path / "runs") for _ in range(4)}) == 4


@pytest.mark.skipif(os.name != "posix", reason="permissions of files are POSIX's")
def test_folders_that_a_run_makes_are_for_their_owner_alone(tmp_path):
    tmp_path.chmod(0o755)
    made = new_recording(tmp_path / "all" / "runs").parent
    assert [path.stat().st_mode & 0o777 for path in (made, *made.parents[:3])] == [0o700, 0o700, 0o700, 0o755]


def test_what_cannot_be_taken_is_said_and_the_rest_is_heard(channel, monkeypatch, caplog):
    ours, theirs = channel
    log = EventLog(None, None)
    write, fails = log._write, [True]

    def once(blocks):
        if fails and any(b"contact" in block.payload for block in blocks):
            fails.clear()
            raise MemoryError
        write(blocks)

    monkeypatch.setattr(log, "_write", once)
    listen(log, ours)
    with caplog.at_level(logging.CRITICAL, "coneskin"):
        emit(theirs, "contact")
        assert "is lost: MemoryError" in log.wait_for(("message",), 60.0).details["what"]
        theirs.send(encode_block(Block(BlockKind.EVENT, 2.0, b"no event")))
        assert "holds no event" in log.wait_for(("message",), 60.0, after=1).details["what"]
        emit(theirs, "latched")
        assert log.wait_for(("latched",), 60.0) is not None
        theirs.close()
        close(log)


def test_what_touches_a_virtual_skin_is_recorded_by_the_thread_that_writes(tmp_path, channel):
    ours, theirs = channel
    log = EventLog(tmp_path / "run.rec")
    log.open({"scene": "", "name": "x", "folder": "."})
    listen(log, ours)
    log.note_truth({"touches": []})
    emit(theirs, "activated")
    assert log.wait_for(("activated",), 60.0) is not None
    theirs.close()
    log.monitor.close()
    log.note_truth({"released": 5.0})
    log.close()
    run = read_run(tmp_path / "run.rec")
    assert run.start == log.began
    told = [block.payload for block in run.blocks if block.kind == BlockKind.TRUTH]
    assert told == [b'{"touches": []}', b'{"released": 5.0}']


def numbered(*numbers):
    return [GuardEvent("contact", float(number), {"number": number}) for number in numbers]


def test_every_event_comes_in_order_and_the_rest_at_the_end():
    seen = []
    delivery = _EventDelivery(seen.append)
    for number in range(500):
        delivery.put(numbered(number))
    delivery.close()
    assert seen == numbered(*range(500))
    delivery.close()


@pytest.mark.promise("P52")
def test_a_function_that_blocks_delays_nobody_and_is_told_what_it_has_missed(caplog):
    free, took, seen = threading.Event(), threading.Event(), []

    def block(event):
        took.set()
        free.wait(60.0)
        seen.append(event)

    delivery = _EventDelivery(block, bound=5)
    delivery.put(numbered(0))
    assert took.wait(60.0)
    delivery.put(numbered(*range(1, 20)))  # returns, though nobody takes them
    with caplog.at_level(logging.WARNING, "coneskin"):
        free.set()
        delivery.close()
    assert seen[:6] == numbered(*range(6))
    (gap,) = seen[6:]
    assert "14 events were not delivered" in gap.details["what"]
    assert "14 events" in caplog.text


def test_one_that_raises_is_not_called_again_and_the_log_goes_on(caplog):
    seen = []

    def fail(event):
        seen.append(event)
        raise KeyError("mine")

    log = EventLog(on_event=fail)
    with caplog.at_level(logging.ERROR, "coneskin"):
        for event in numbered(1, 2, 3):
            log._write([event.block()])
        log.close()
    assert seen == numbered(1)
    assert [event.details["number"] for event in log.events] == [1, 2, 3]
    assert "is not called any more" in caplog.text


def test_the_function_itself_may_end_the_session():
    done = threading.Event()

    def close(event):
        delivery.close()
        done.set()

    delivery = _EventDelivery(close)
    delivery.put(numbered(1))
    assert done.wait(60.0)


@pytest.mark.parametrize("request_", [3, 4])
def test_an_answer_is_known_by_its_number(request_):
    log = EventLog()
    log._write([GuardEvent("refused", 1.0, {"request": number}).block() for number in (3, 4)])
    log._write([GuardEvent("message", 1.0, {"what": "something else"}).block()])
    answer = log.wait_for(("activated", "refused"), 0.0, 0, lambda event: event.details.get("request") == request_)
    assert answer is not None
    assert answer.details["request"] == request_


SCENE = parse_scene(SERIAL_RETREAT)
SENSOR = SCENE.sensors[0].sensor
NOW = 100.0  # s
WAITS = [f"{SENSOR.name}: no valid frame"]


def heard(change: Callable[[bytes], bytes]) -> _HeardLine:
    """Half a second of a skin, until ``NOW``."""
    line = _HeardLine()
    packets = list(VirtualSkin(SENSOR, model="ladder", duration=0.5, seed=1).packets())
    line.feed([Block(BlockKind.SKIN, NOW - 0.5 + at, change(data)) for at, data in packets])
    return line


def test_the_refusal_names_the_mistake_in_the_firmware() -> None:
    line = heard(lambda data: data[:-2] + data[-1:] + data[-2:-1])
    error = activation_error(
        [GuardEvent("waiting", 1.0, {"reasons": WAITS})], lambda why: line.describe(SCENE, why, NOW)
    )
    assert str(error).splitlines() == [
        "the guard did not become active:",
        "  on serial hwgrep://0403:6001, the checksum is another CRC: its low byte goes first: append the CRC with its "
        "high byte first",
        f"  {WAITS[0]}",
    ]


def test_a_silent_line_is_named_too() -> None:
    assert (
        _HeardLine()
        .describe(SCENE, WAITS, NOW)
        .startswith("no byte has come from serial hwgrep://0403:6001: check power")
    )


@pytest.mark.parametrize("reasons", [[], ["the arm is not powered"]])
def test_reasons_of_the_arm_get_no_words_about_the_skin(reasons: list[str]) -> None:
    assert heard(lambda _: b"nonsense").describe(SCENE, reasons, NOW) == ""


def test_a_line_on_which_all_is_right_gets_none_either() -> None:
    assert heard(lambda data: data).describe(SCENE, WAITS, NOW) == ""
