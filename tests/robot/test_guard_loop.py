"""The loop's clock: whatever else talks, the core hears that time passes."""

import socket

import pytest

from coneskin.robot.channel import Channel, pair
from coneskin.robot.guard_loop import GuardLoop, GuardPorts
from coneskin.robot.phase import Phase
from coneskin.robot.spill import Spill
from coneskin.skin.recording import Block, decode_blocks, encode_block


class Core:
    """Counts what it takes."""

    phase = Phase.LATCHED

    def __init__(self):
        self.taken = []

    def take(self, block, out):
        self.taken.append(block.kind)


class Talkative:
    """Connections on which the controller says something all the time."""

    def __init__(self):
        self.near, self.far = socket.socketpair()

    def sockets(self):
        return {"script": self.near}

    def drain(self):
        self.near.recv(1 << 16)
        return []


@pytest.fixture
def ends():
    ours, theirs = pair()
    channels = Channel(ours), Channel(theirs)
    yield channels
    for channel in channels:
        channel.close()


def test_a_connection_that_talks_does_not_stop_the_clock(ends):
    core, foreign = Core(), Talkative()
    loop = GuardLoop(core, GuardPorts(ends[0], None, foreign=foreign))
    loop._open()
    for number in range(1, 50):
        foreign.far.send(b"state")
        loop.step(0.002)
        assert len(core.taken) == number
    loop._close()
    foreign.near.close()
    foreign.far.close()


def test_a_program_that_has_gone_does_not_stop_the_clock(ends):
    core = Core()
    loop = GuardLoop(core, GuardPorts(ends[0], None))
    loop._open()
    ends[1].close()
    for number in range(1, 20):
        loop.step(0.001)
        assert len(core.taken) == number
    loop._close()


def test_the_last_word_is_handed_over_to_a_reader_who_is_slow(ends):
    ours, theirs = ends
    ours.spill = Spill()
    block = encode_block(Block(1, 0.0, bytes(10_000)))
    for _ in range(500):  # 5 MB, more than the channel keeps
        ours.send(block)
    assert ours.dropped
    read = b""
    while not ours.finish(0.0):
        read += b"".join(theirs.receive())
    read += b"".join(theirs.receive())
    blocks = [block for _, block in decode_blocks(read)]
    assert b"not recorded" in blocks[-1].payload
