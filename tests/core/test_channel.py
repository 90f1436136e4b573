"""Messages between processes: whole, in order, never waiting."""

import os
import signal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.core.channel import Channel, decode_json, pair, wait_readable, wait_writable
from coneskin.core.recording.block import Block, decode_blocks, encode_block
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent, RecordingOverflowFilter, decode_event


def ends():
    a, b = pair()
    return Channel(a), Channel(b)


@given(st.lists(st.binary(max_size=300), max_size=40), st.integers(1, 50))
@settings(max_examples=50)
def test_messages_arrive_whole_and_in_order(messages, chop):
    a, b = pair()
    sender, reader = Channel(a), Channel(b)
    raw = b"".join(len(m).to_bytes(4, "little") + m for m in messages)
    got = []
    for at in range(0, len(raw), chop):
        a.send(raw[at : at + chop])
        got += reader.receive()
    assert got == messages
    sender.close()
    reader.close()


def test_a_reader_that_does_not_read_never_blocks_the_sender():
    sender, reader = ends()
    sender._limit = 1 << 20
    sent = sum(sender.send(bytes(4096)) for _ in range(2000))
    assert 0 < sent < 2000
    assert sender.dropped == 2000 - sent
    got = []
    while len(got) < sent:
        got += reader.receive()
        sender.flush()
    assert got == [bytes(4096)] * sent  # what was taken is whole, however much was refused
    sender.close()
    reader.close()


def test_the_end_of_the_other_side_is_seen():
    sender, reader = ends()
    sender.send(b"last words")
    sender.close()
    assert reader.receive() == [b"last words"]
    assert reader.closed or reader.receive() == []
    assert reader.closed
    assert reader.send(b"x") is False
    reader.close()
    reader.close()


def test_garbage_closes_the_channel():
    a, b = pair()
    reader = Channel(b)
    a.send(b"\xff" * 16)
    assert reader.receive() == []
    assert reader.closed
    a.close()
    reader.close()


@pytest.mark.parametrize("message", [b"", b"5", b"[]", b"\xff", b"{", b"[" * 200_000])
def test_what_is_no_object_is_a_value_error(message):
    with pytest.raises(ValueError, match=r"JSON|Expecting|utf-8|Extra"):
        decode_json(message)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows makes no copies of processes")
def test_a_forked_copy_does_not_keep_a_channel_open():
    """A worker of multiprocessing would hide the death of the program that guards."""
    ours, theirs = ends()
    ready, go = os.pipe()
    worker = os.fork()
    if worker == 0:
        try:
            os.write(go, b"still open" if ours.send(b"x") or ours.receive() or not ours.closed else b"closed")
            signal.pause()
        finally:
            os._exit(1)
    try:
        assert os.read(ready, 10) == b"closed"
        theirs.close()  # our copy of its other end must be the only one
        assert wait_readable([ours], 20.0) == [ours]
        assert ours.receive() == []
        assert ours.closed
    finally:
        os.kill(worker, signal.SIGKILL)
        os.waitpid(worker, 0)
        ours.close()
        os.close(ready)
        os.close(go)


def test_a_channel_of_a_number_beyond_1023_is_waited_for():
    resource = pytest.importorskip("resource", reason="Windows has no such limit")
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(2048, hard), hard))
    many = [os.open(os.devnull, os.O_RDONLY) for _ in range(1100)]
    try:
        ours, theirs = ends()
        assert ours.fileno() > 1023
        assert wait_readable([ours], 0.0) == []
        assert wait_writable(ours, 0.0)
        theirs.send(b"x")
        assert wait_readable([ours], 20.0) == [ours]
        ours.send(bytes(1 << 21))
        assert not ours.finish(0.01)  # it waits for a reader
        ours.close()
        theirs.close()
    finally:
        for number in many:
            os.close(number)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


# ---- a program that does not read, and goes on


@pytest.mark.promise("P56")
def test_no_event_is_lost_and_the_gap_is_told_once():
    sender, reader = ends()
    sender._limit, sender.overflow = 1 << 18, RecordingOverflowFilter()
    bulk = encode_block(Block(BlockKind.SKIN, 1.0, bytes(5000)))
    for number in range(3000):
        event = GuardEvent("contact", float(number), {"number": number}).block() if number % 100 == 0 else None
        sender.send(
            encode_block(Block(BlockKind.SKIN, float(number), bytes(5000))) + (encode_block(event) if event else b"")
        )
    lost = sender.dropped
    assert lost > 1000
    got = []
    for _ in range(2000):
        got += [block for message in reader.receive() for block in decode_blocks(message)]
        sender.flush()
    assert len(got) < 3000
    sender.send(bulk)
    got += [block for message in reader.receive() for block in decode_blocks(message)]
    events = [decode_event(block) for block in got if block.kind == BlockKind.EVENT]
    assert [event.details["number"] for event in events if event.name == "contact"] == list(range(0, 3000, 100))
    (gap,) = [event.details for event in events if event.name == "recording_gap"]
    assert gap["blocks"] == lost
    assert (gap["since"], gap["until"]) == (3000.0 - lost, 2999.0)
    assert f"{lost} blocks of {lost - 1:.3f} s are not recorded" in gap["what"]
    assert [block.kind for block in got[-2:]] == [BlockKind.EVENT, BlockKind.SKIN]  # said before what follows the gap
    sender.close()
    reader.close()


def test_even_events_have_a_bound():
    sender, reader = ends()
    sender._limit, sender.overflow = 1 << 12, RecordingOverflowFilter()
    event = encode_block(GuardEvent("contact", 0.0, {"why": "x" * 1000}).block())
    for _ in range(2000):
        sender.send(event)
    assert len(sender._out) <= (2 << 12) + 8
    assert not sender.send(event)
    sender.close()
    reader.close()


def test_what_the_other_side_said_before_it_left_is_read_though_sending_has_failed_since():
    """Another thread's heartbeat found the guard gone, and the guard's last word was never read."""
    ours, theirs = ends()
    assert theirs.send(b"the last word")
    theirs.close()
    assert not ours.send(b"a heartbeat")
    assert not ours.closed
    assert ours.receive() == [b"the last word"]
    assert ours.receive() == []
    assert ours.closed
    ours.close()
