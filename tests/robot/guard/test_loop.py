"""The loop's clock: whatever else talks, the core hears that time passes."""

import select
import socket
from types import SimpleNamespace
from unittest.mock import Mock, call

import pytest

from coneskin.core.channel import Channel, pair
from coneskin.core.errors import SkinConnectionError
from coneskin.core.recording.block import Block, decode_blocks, encode_block
from coneskin.robot.driver.messages import DatedVelocity, EndReaction, SetJointVelocity, StopProgram
from coneskin.robot.driver.values import JointVelocitySetpoint, SetpointProgram, SetSpeedSlider, StopPath, UseStopPath
from coneskin.robot.guard import loop as module
from coneskin.robot.guard.loop import GuardLoop, GuardPorts, _Outbox
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, RecordingOverflowFilter


class Core:
    """Counts what it takes."""

    phase = Phase.LATCHED

    def __init__(self):
        self.taken = []

    def feed(self, block, out):
        self.taken.append(block.kind)


class Talkative:
    """Connections on which the controller says something all the time."""

    def __init__(self):
        self.near, self.far = socket.socketpair()

    def sockets(self):
        return {"program": self.near}

    def ask(self):
        pass

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


@pytest.mark.pure  # its core is a stub
def test_a_connection_that_talks_does_not_stop_the_clock(ends):
    core, stops = Core(), Talkative()
    loop = GuardLoop(core, GuardPorts(ends[0], None, stops=stops))
    loop._open()
    for number in range(1, 50):
        stops.far.send(b"state")
        loop.poll(0.002)
        assert len(core.taken) == number
    loop._close()
    stops.near.close()
    stops.far.close()


@pytest.mark.pure  # its core is a stub
def test_a_program_that_has_gone_does_not_stop_the_clock(ends):
    core = Core()
    loop = GuardLoop(core, GuardPorts(ends[0], None))
    loop._open()
    ends[1].close()
    for number in range(1, 20):
        loop.poll(0.001)
        assert len(core.taken) == number
    loop._close()


@pytest.mark.pure  # its core is a stub
@pytest.mark.promise("P59")
@pytest.mark.parametrize("asleep", [False, True])
def test_a_guard_that_was_suspended_says_so_to_its_core_before_anything_else(ends, asleep):
    """While a computer sleeps, its monotonic clock may stand still, and with it every silence that is measured."""
    core, now, sleepless = Core(), [10.0], [20.0]
    loop = GuardLoop(core, GuardPorts(ends[0], None), lambda: now[0], lambda: sleepless[0])
    loop._open()
    ends[1].send(b"heartbeat")
    loop.poll(0.0)
    assert BlockKind.SUSPENDED not in core.taken
    core.taken.clear()
    now[0], sleepless[0] = now[0] + (0.001 if asleep else 5.0), sleepless[0] + 5.0
    loop.poll(0.0)
    assert core.taken == [BlockKind.SUSPENDED]
    loop.poll(0.0)
    assert core.taken == [BlockKind.SUSPENDED, BlockKind.TICK]
    loop._close()


@pytest.mark.pure  # its core is a stub
@pytest.mark.parametrize(
    ("late", "told"),
    [
        (0.019, []),
        (0.021, [BlockKind.OVERRUN]),
        (0.99, [BlockKind.OVERRUN]),
        (1.01, [BlockKind.OVERRUN, BlockKind.SUSPENDED]),
    ],
)
def test_20_ms_between_two_rounds_are_recorded_and_a_second_is_told_to_the_core(ends, late, told):
    core, now, recorded = Core(), [10.0], []
    loop = GuardLoop(core, GuardPorts(ends[0], None), lambda: now[0], lambda: now[0])
    loop._record = recorded.append
    loop._open()
    loop.poll(0.0)
    recorded.clear()
    now[0] += late
    loop.poll(0.0)
    assert [block.kind for block in recorded if block.kind is not BlockKind.TICK] == told
    loop._close()


def test_what_can_be_read_has_a_bit_each():
    names = ("SKIN", "READER", "DRIVER", "WATCHDOG", "SLIDER", "HEARTBEAT", "STOPS", "SESSION", "SECOND")
    assert sorted(getattr(module, f"_{name}") for name in names) == [1 << k for k in range(len(names))]


@pytest.mark.pure  # its core is a stub
@pytest.mark.parametrize(("gone", "seconds"), [(False, 3.0), (True, 0.8)])
@pytest.mark.long
def test_at_its_end_it_waits_for_the_arm_to_stand(ends, gone, seconds):
    core, now = Core(), [10.0]
    core.phase = Phase.STOPPING

    def clock():
        now[0] += 0.001
        return now[0]

    loop = GuardLoop(core, GuardPorts(ends[0], None), clock, clock)
    loop._open()
    if gone:
        ends[1].close()
        loop.poll(0.0)
    began = now[0]
    loop._end()
    assert now[0] - began == pytest.approx(seconds, abs=0.05)
    loop._close()


@pytest.mark.pure  # its core is a stub
def test_four_times_a_second_the_controller_is_asked_and_a_helper_is_looked_at_once_it_misses_two_beats(ends):
    core, now, stops, asked = Core(), [10.0], Talkative(), []
    stops.ask = lambda: asked.append(now[0])
    helpers = {"driver": SimpleNamespace(waits=lambda since: True)}
    loop = GuardLoop(core, GuardPorts(ends[0], None, stops=stops, helpers=helpers), lambda: now[0], lambda: now[0])
    loop._open()
    held_up = []
    for _ in range(1000):
        now[0] += 0.001
        core.taken.clear()
        loop.poll(0.0)
        held_up += [now[0]] * (BlockKind.HELD_UP in core.taken)
    assert asked == pytest.approx([10.27, 10.55, 10.82], abs=0.03)  # with the next heartbeat, each 30 ms
    assert held_up[0] == pytest.approx(10.075, abs=0.015)
    loop._close()
    stops.near.close()
    stops.far.close()


@pytest.mark.pure  # its core is a stub
@pytest.mark.parametrize(("descriptor", "timeout"), [(7, 0.0), (None, 0.002)])
def test_a_skin_is_waited_for_only_where_no_descriptor_tells_that_it_has_bytes(ends, descriptor, timeout):
    core, skin = Core(), SimpleNamespace(fileno=lambda: descriptor, read=lambda timeout: asked.append(timeout) or b"x")
    asked = []
    GuardLoop(core, GuardPorts(ends[0], skin))._read_skin(skin)
    assert (asked, core.taken) == ([timeout], [BlockKind.SKIN])


@pytest.mark.pure  # its core is a stub
@pytest.mark.skipif(not hasattr(select, "epoll"), reason="without epoll everything wakes the loop")
def test_the_skin_alone_wakes_the_loop_and_all_else_waits_for_its_next_look(ends):
    core, now, (near, far) = Core(), [10.0], socket.socketpair()
    skin = SimpleNamespace(fileno=near.fileno, read=lambda _: near.recv(64))
    loop = GuardLoop(core, GuardPorts(ends[0], skin), lambda: now[0], lambda: now[0])
    loop._open()
    for later, frame, taken in (
        (0.0, b"", [BlockKind.TICK]),
        (0.001, b"frame", [BlockKind.SKIN]),
        (0.001, b"frame", [BlockKind.SKIN, BlockKind.RESET]),
        (0.0001, b"frame", [BlockKind.SKIN]),
        (0.0001, b"", [BlockKind.RESET]),  # nothing came in the whole of the wait
    ):
        now[0] += later
        if frame:
            far.send(frame)
            ends[1].send(b"reset 1 1")
        core.taken.clear()
        loop.poll(0.0)
        assert sorted(set(core.taken)) == sorted(taken)
    loop._close()
    near.close()
    far.close()


@pytest.mark.pure  # its core is a stub
def test_a_skin_without_a_descriptor_is_waited_for_once_and_no_more_when_it_is_gone(ends):
    def read(_):
        raise SkinConnectionError("it is gone")

    core, skin = Core(), SimpleNamespace(fileno=lambda: None, read=read)
    loop = GuardLoop(core, GuardPorts(ends[0], skin))
    skins = Mock(**{"poll.return_value": []})
    loop._epolls = [skins, skins]
    loop._wait(0.002)
    loop._read_skin(skin)
    loop._wait(0.002)
    assert core.taken == [BlockKind.LOST]
    assert [each.args[0] for each in skins.poll.mock_calls] == [0.0, 0.002]


def test_each_command_of_the_guard_s_own_goes_over_its_connection(ends):
    taken = dict.fromkeys(("use.return_value", "follow.return_value", "write.return_value", "set.return_value"), True)
    stops, setpoints, slider = Mock(**taken), Mock(**taken), Mock(**taken)
    starter = SimpleNamespace(use=stops.use, follow=stops.follow)  # a mock has no method before it is called
    outbox = _Outbox(GuardPorts(ends[0], None, stops=starter, setpoints=setpoints, slider=slider), lambda: 1.0)
    speeds, program = JointVelocitySetpoint(7, (0.1,) * 6, 4.0), SetpointProgram(7, 9.0, 20.0)
    for output in (UseStopPath(StopPath.COMMAND, 5.0), UseStopPath(StopPath.SLIDER, 5.0), speeds, program):
        outbox.append(output)
    outbox.append(SetSpeedSlider(0.25))
    assert stops.mock_calls == [call.use(StopPath.COMMAND, 5.0), call.follow(program)]
    assert setpoints.mock_calls == [call.write(speeds)]
    assert slider.mock_calls == [call.set(0.0), call.set(0.25)]
    names = [block.payload.partition(b"\n")[0].decode() for block in outbox.sent]
    assert names == ["command", "slider", "setpoint", "follow", "slider"]
    assert {block.time for block in outbox.sent} == {1.0}  # when it was sent, and not when its input came


@pytest.mark.promise("P43")
@pytest.mark.parametrize(("held_up", "sent"), [(0.09, True), (0.11, False)])
def test_a_guard_that_was_held_up_between_a_decision_and_its_command_moves_nothing(ends, held_up, sent):
    now = [1.0]
    taken = dict.fromkeys(("use.return_value", "follow.return_value", "write.return_value"), True)
    (driver, driver_end), stops, setpoints = ends, Mock(**taken), Mock(**taken)
    starter = SimpleNamespace(use=stops.use, follow=stops.follow)
    outbox = _Outbox(GuardPorts(driver, None, driver=driver, stops=starter, setpoints=setpoints), lambda: now[0])
    now[0] += held_up
    qd, stopping, stop_path = (0.1,) * 6, (StopProgram(10.0), EndReaction(10.0)), UseStopPath(StopPath.COMMAND, 5.0)
    motion, program = SetJointVelocity(qd, 4.0), SetpointProgram(7, 9.0, 20.0)
    ends_motion = JointVelocitySetpoint(0, qd, 0.0)
    for command in (motion, program, *stopping, stop_path, ends_motion):  # stops however late
        outbox.append(command)
    dated = DatedVelocity(1.0, motion)  # the driver process looks at that
    assert driver_end.receive() == [one.encode() for one in (dated, *stopping)]
    assert setpoints.mock_calls == [call.write(ends_motion)]
    assert stops.mock_calls == [*[call.follow(program)][:sent], call.use(*stop_path)]


def test_the_last_word_is_handed_over_to_a_reader_who_is_slow(ends):
    ours, theirs = ends
    ours.overflow = RecordingOverflowFilter()
    block = encode_block(Block(1, 0.0, bytes(10_000)))
    for _ in range(500):  # 5 MB, more than the channel keeps
        ours.send(block)
    assert ours.dropped
    read = b""
    while not ours.finish(0.0):
        read += b"".join(theirs.receive())
    read += b"".join(theirs.receive())
    blocks = decode_blocks(read)
    assert b"not recorded" in blocks[-1].payload
