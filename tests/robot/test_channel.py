"""Messages between processes: whole, in order, never waiting."""

import select
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.errors import RobotConnectionError
from coneskin.robot import channel as module
from coneskin.robot.channel import Channel, inherit, pair, spawn
from coneskin.robot.journal import GuardEvent, Kind, decode_event
from coneskin.robot.spill import Spill
from coneskin.skin.recording import Block, decode_blocks, encode_block


def ends():
    a, b = pair()
    return Channel(a), Channel(b)


@given(st.lists(st.binary(max_size=300), max_size=40), st.integers(1, 50))
@settings(deadline=None, max_examples=50)
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


def test_a_child_gets_its_end(tmp_path, monkeypatch):
    (tmp_path / "echo_child.py").write_text(
        "import select, sys\n"
        "from coneskin.robot.channel import inherit\n"
        "(c,) = inherit(sys.argv[1:])\n"
        "while not c.closed:\n"
        "    select.select([c], [], [], 1)\n"
        "    for m in c.receive(): c.send(m[::-1])\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    a, b = pair()
    child = spawn("echo_child", b)
    ours = Channel(a)
    ours.send(b"abc")
    assert select.select([ours], [], [], 20)[0]
    assert ours.receive() == [b"cba"]
    ours.close()
    assert child.wait(20) == 0


def test_a_child_that_cannot_start_is_said(monkeypatch):
    monkeypatch.setattr(module.sys, "executable", "/nowhere/python")
    a, b = pair()
    with pytest.raises(RobotConnectionError, match=r"cannot start the process x: No such file"):
        spawn("x", b)
    a.close()
    b.close()
    assert sys.executable == "/nowhere/python"
    assert inherit([]) == []


# ---- a program that does not read, and goes on


def test_no_event_is_lost_and_the_gap_is_told_once():
    sender, reader = ends()
    sender._limit, sender.spill = 1 << 18, Spill()
    bulk = encode_block(Block(Kind.SKIN, 1.0, bytes(5000)))
    for number in range(3000):
        event = GuardEvent("contact", float(number), {"number": number}).block() if number % 100 == 0 else None
        sender.send(
            encode_block(Block(Kind.SKIN, float(number), bytes(5000))) + (encode_block(event) if event else b"")
        )
    lost = sender.dropped
    assert lost > 1000
    got = []
    for _ in range(2000):
        got += [block for message in reader.receive() for _, block in decode_blocks(message)]
        sender.flush()
    assert len(got) < 3000
    sender.send(bulk)
    got += [block for message in reader.receive() for _, block in decode_blocks(message)]
    events = [decode_event(block) for block in got if block.kind == Kind.EVENT]
    assert [event.details["number"] for event in events if event.name == "contact"] == list(range(0, 3000, 100))
    (gap,) = [event.details for event in events if event.name == "missing"]
    assert gap["blocks"] == lost
    assert (gap["since"], gap["until"]) == (3000.0 - lost, 2999.0)
    assert f"{lost} blocks of {lost - 1:.3f} s are not recorded" in gap["what"]
    assert [block.kind for block in got[-2:]] == [Kind.EVENT, Kind.SKIN]  # said before what follows the gap
    sender.close()
    reader.close()


def test_even_events_have_a_bound():
    sender, reader = ends()
    sender._limit, sender.spill = 1 << 12, Spill()
    event = encode_block(GuardEvent("contact", 0.0, {"why": "x" * 1000}).block())
    for _ in range(2000):
        sender.send(event)
    assert len(sender._out) <= (2 << 12) + 8
    assert not sender.send(event)
    sender.close()
    reader.close()
