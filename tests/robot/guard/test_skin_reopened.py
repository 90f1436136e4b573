"""Skin that is unplugged and plugged in again: latched until a person resets, and no other device counts."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from coneskin.core.channel import Channel, pair
from coneskin.core.errors import SkinConnectionError
from coneskin.robot.guard.loop import GuardLoop, GuardPorts
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.robot.reaction.types import Reaction
from coneskin.skin.electronics import Electronics
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.serial_port import SerialPort
from coneskin.skin.sources.source import Source, SourceReopening
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from tests.support.guard_rig import CONE, GuardRig, make_core


def a_skin(device: int = 0, sensor: int = 0, *touches: ScriptedTouch) -> VirtualSkin:
    one = Sensor(CONE.frustum, sensor, Electronics(adc_bits=16), name="one", device_id=device)
    return VirtualSkin(one, touches, model="ladder", seed=device)


def unplugged() -> GuardRig:
    """A guard whose arm moved when its skin was pulled off."""
    rig = GuardRig(faults=FaultInjection(unplug_after=500), speed=1.0, reaction=Reaction()).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    return rig


def refusals(rig: GuardRig) -> list[str]:
    rig.reset()
    rig.run(0.2)
    return [reason for event in rig.events if event.name == "refused" for reason in event.details["reasons"]]


@pytest.mark.long
@pytest.mark.promise("P09")
def test_the_same_device_is_guarded_again_after_a_reset_and_not_before():
    rig = unplugged()
    rig.replug(a_skin())
    rig.run(2.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.event("message").details["what"] == "the skin's port is open again; a reset is needed"
    assert refusals(rig) == []
    rig.run(1.0)
    assert rig.core.phase is Phase.ACTIVE
    rig.skin.touch(ScriptedTouch(rig.now - 101.4, 99.0, 0.13, 1.57))  # in a tenth of a second
    start = len(rig.events)
    rig.run(0.4)
    assert "contact" in [event.name for event in rig.events[start:]]
    assert rig.core.phase is Phase.LATCHED


def test_a_reset_at_once_is_refused_until_the_sensor_is_ready_anew():
    rig = unplugged()
    rig.replug(a_skin())
    rig.run(0.01)
    assert refusals(rig) == ["one: no valid frame has come for too long: check power, cable and frame rate"]
    assert rig.core.phase is Phase.LATCHED


@pytest.mark.promise("P09")
@pytest.mark.parametrize(("device", "sensor"), [(7, 0), pytest.param(0, 3, marks=pytest.mark.long)])
def test_another_device_is_refused_by_name_until_the_right_one_is_there(device, sensor):
    rig = unplugged()
    rig.replug(a_skin(device, sensor))
    rig.run(1.0)
    for _ in range(2):
        reasons = refusals(rig)
        assert (
            f"another device is on the skin's port: it sends as device/sensor {device}/{sensor}, guarded was 0/0; "
            "plug in the one that was there"
        ) in reasons
    assert rig.core.phase is Phase.LATCHED
    rig.feed(BlockKind.LOST, b"skin\nthe port is gone")
    rig.events.clear()
    assert refusals(rig)[0] == "the port is gone"
    rig.replug(a_skin())
    rig.run(1.0)
    rig.events.clear()
    assert refusals(rig) == []
    rig.run(1.0)
    assert rig.core.phase is Phase.ACTIVE


@pytest.mark.long
def test_a_port_that_is_open_and_silent_or_touched_does_not_count():
    rig = unplugged()
    rig.replug(a_skin())
    rig.mute_skin = True
    rig.run(1.0)
    assert any(reason.startswith("one: no valid frame") for reason in refusals(rig))
    rig = unplugged()
    rig.replug(a_skin(0, 0, ScriptedTouch(0.0, 99.0, 0.13, 1.57)))
    rig.run(1.0)
    assert any("touched" in reason for reason in refusals(rig))
    assert rig.core.phase is Phase.LATCHED


@pytest.mark.promise("P09")
@pytest.mark.long
def test_before_the_arm_is_latched_an_open_port_changes_nothing():
    rig = GuardRig(speed=1.0, reaction=Reaction()).run(0.5)
    rig.feed(BlockKind.LOST, b"skin\nthe port is gone")
    rig.feed(BlockKind.REOPENED, b"skin")
    rig.run(1.5)
    assert "the port is gone" in refusals(rig)
    rig.feed(BlockKind.LOST, b"driver\nthe driver is gone")
    rig.feed(BlockKind.REOPENED, b"driver")
    assert "the driver is gone" in refusals(rig)


@pytest.mark.long
def test_a_replay_of_it_is_the_same_run():
    rig = unplugged()
    rig.replug(a_skin(7))
    refusals(rig)
    rig.feed(BlockKind.LOST, b"skin\nthe port is gone")
    rig.replug(a_skin())
    rig.run(1.0)
    refusals(rig)
    core = make_core([Sensor(CONE.frustum, 0, Electronics(adc_bits=16), name="one")], Reaction())
    again: list[object] = []
    for block in rig.blocks:
        core.feed(block, again)
    assert again == rig.outputs


class _Latched:
    """A core that stands latched, or not, and notes what it takes."""

    def __init__(self) -> None:
        self.phase = Phase.STOPPING
        self.taken: list[tuple[BlockKind, bytes]] = []

    def feed(self, block, out) -> None:
        if block.kind != BlockKind.TICK:
            self.taken.append((block.kind, block.payload))


class _Pulled(Source):
    """A source that is gone until it is opened again."""

    name = "the port"

    def __init__(self) -> None:
        self.there = False

    def open(self) -> None:
        self.there = True

    def close(self) -> None:
        self.there = False

    def fileno(self) -> int | None:
        return None

    def read(self, timeout: float) -> bytes:
        if not self.there:
            raise SkinConnectionError("the port is gone")
        return b"frame"


class _Attempt:
    """What opens a source again, by hand."""

    def __init__(self, source: Source) -> None:
        self.source, self.done, self.opened, self.stopped = source, False, False, False

    def stop(self) -> None:
        self.stopped = True


@pytest.fixture
def session() -> Iterator[Channel]:
    ours, theirs = pair()
    channels = Channel(ours), Channel(theirs)
    yield channels[0]
    for channel in channels:
        channel.close()


@pytest.mark.pure  # its core is a stub
def test_the_loop_opens_it_only_once_the_arm_is_latched(session):
    core, attempts, source = _Latched(), [], _Pulled()
    ports = GuardPorts(session, source, reopen=lambda gone: attempts.append(_Attempt(gone)) or attempts[-1])
    loop = GuardLoop(core, ports)
    loop._open()
    for _ in range(3):
        loop.poll(0.0)
    assert core.taken == [(BlockKind.LOST, b"skin\nthe port is gone")]
    assert not attempts
    core.phase = Phase.LATCHED
    for _ in range(3):
        loop.poll(0.0)
    (attempt,) = attempts
    assert attempt.source is source
    assert len(core.taken) == 1
    source.open()
    attempt.done = attempt.opened = True
    loop.poll(0.0)
    loop.poll(0.0)
    assert core.taken[1:3] == [(BlockKind.REOPENED, b"skin"), (BlockKind.SKIN, b"frame")]
    source.close()
    loop.poll(0.0)
    loop.poll(0.0)
    attempts[1].done = True
    loop.poll(0.0)
    loop.poll(0.0)
    lost = b"skin\nthe port is gone and could not be opened again: start the guard anew"
    assert core.taken[-1] == (BlockKind.LOST, lost)
    assert len(attempts) == 2
    loop._close()


@pytest.mark.pure  # its core is a stub
def test_a_loop_that_ends_stops_the_attempts(session):
    core, attempts = _Latched(), []
    core.phase = Phase.LATCHED
    ports = GuardPorts(session, _Pulled(), reopen=lambda gone: attempts.append(_Attempt(gone)) or attempts[-1])
    loop = GuardLoop(core, ports)
    loop._open()
    loop.poll(0.0)
    loop.poll(0.0)
    loop._close()
    assert attempts[0].stopped


@pytest.mark.pure  # its core is a stub
@pytest.mark.promise("P09")
@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
def test_a_real_port_that_comes_back_is_read_again(session, tmp_path: Path):
    from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal

    link = tmp_path / "skin"
    core = _Latched()
    core.phase = Phase.LATCHED
    ends = list(open_raw_terminal())
    link.symlink_to(ends.pop())
    with SerialPort(str(link)) as port:
        reopenings = []

        def reopen(source: Source) -> SourceReopening:
            reopenings.append(SourceReopening(source, wait=lambda _: False))
            return reopenings[-1]

        loop = GuardLoop(core, GuardPorts(session, port, reopen=reopen))
        loop._open()
        os.write(ends[0], b"before")
        loop.poll(2.0)
        link.unlink()
        for end in ends:
            os.close(end)
        loop.poll(2.0)
        ends = list(open_raw_terminal())
        link.symlink_to(ends.pop())
        loop.poll(0.0)
        reopenings[0]._thread.join(60.0)
        loop.poll(0.0)
        os.write(ends[0], b"after")
        loop.poll(2.0)
        loop._close()
    for end in ends:
        os.close(end)
    kinds = [kind for kind, _ in core.taken]
    assert kinds == [BlockKind.SKIN, BlockKind.LOST, BlockKind.REOPENED, BlockKind.SKIN]
    assert (core.taken[0][1], core.taken[-1][1]) == (b"before", b"after")
