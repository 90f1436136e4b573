"""All sensors on one stream: who is who, and what belongs to nobody."""

import gc
import random
import sys
from itertools import pairwise

import pytest

from coneskin.core.errors import SensorError, SkinConnectionError
from coneskin.skin.detection.events import SkinEvent, SkinFault, TouchBegan
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import FRAME_LENGTH, SYNC, encode

from ..bench_top import CONE, UR10, measured

LOWER = Sensor(CONE, 1, name="lower half")
UPPER = Sensor(CONE, 2, name="upper half")


def play(stream: TouchStream, skin: VirtualSkin) -> list[SkinEvent]:
    events: list[SkinEvent] = []
    try:
        for time, data in skin.packets():
            events += stream.feed(data, time)
    except SkinConnectionError:
        pass
    return events


def faults_of(events: list[SkinEvent]) -> list[Fault]:
    return [event.fault for event in events if isinstance(event, SkinFault)]


def test_two_sensors_on_one_line_are_told_apart():
    skin = VirtualSkin([LOWER, UPPER], [ScriptedTouch(0.2, 0.3, 0.05, 2.0, sensor="upper half")], duration=0.4)
    stream = TouchStream([LOWER, UPPER])
    events = play(stream, skin)
    assert {event.sensor for event in events} == {"upper half"}
    assert isinstance(events[0], TouchBegan)
    assert stream.ready
    assert not any(detector.touched for detector in stream.detectors)
    assert [detector.timing.missing for detector in stream.detectors] == [0, 0]


def test_ready_and_touched_speak_for_all():
    stream = TouchStream([LOWER, UPPER])
    play(stream, VirtualSkin(LOWER, duration=0.2))
    assert stream.detectors[0].ready
    assert not stream.ready  # the upper half has never been heard of
    assert [event.sensor for event in stream.silence(0.2, 0.02)] == ["upper half"]


def test_a_sensor_that_nobody_expects_is_reported_once_and_counted():
    stream = TouchStream([LOWER])
    events = play(stream, VirtualSkin([LOWER, UPPER], duration=0.1))
    assert faults_of(events) == [Fault.UNKNOWN_SENSOR]
    assert "device 0, sensor 2" in events[0].message
    assert stream.unknown == {(0, 2): 100}


def test_a_version_of_the_future_is_reported_once():
    frame = bytearray(encode(measured(LOWER)))
    frame[2] = 3
    from binascii import crc_hqx

    future = bytes(frame[:-2]) + crc_hqx(bytes(frame[:-2]), 0).to_bytes(2, "big")
    stream = TouchStream([LOWER])
    events = stream.feed(future * 3, 0.0) + stream.feed(future, 0.1)
    assert faults_of(events) == [Fault.UNKNOWN_VERSION]
    assert "version 3" in events[0].message


def test_a_port_opened_in_mid_frame_is_no_fault():
    stream = TouchStream([LOWER])
    data = b"".join(packet for _, packet in VirtualSkin(LOWER, duration=0.1).packets())
    assert stream.feed(data[FRAME_LENGTH // 2 :], 0.1) == []
    assert stream.decoder.bytes_skipped == FRAME_LENGTH // 2


@pytest.mark.parametrize("noise", [SYNC + b"\x01\x24", b"\x00", None], ids=["false starts", "zeros", "random"])
def test_noise_instead_of_frames_is_corrupt(noise):
    rng = random.Random(1)
    stream = TouchStream([LOWER])
    events: list[SkinEvent] = []
    for k in range(20):
        events += stream.feed(rng.randbytes(40) if noise is None else noise * 40, k * 1e-3)
    assert faults_of(events) == [Fault.CORRUPT]
    assert "bytes skipped" in events[0].message


def test_a_wrong_baud_rate_is_corrupt_and_silent_not_untouched():
    # what a receiver at another speed makes of the line has no frames in it
    stream = TouchStream([LOWER])
    events = play(stream, VirtualSkin(LOWER, duration=0.1, faults=FaultInjection(corrupt_every=1)))
    assert Fault.CORRUPT in faults_of(events)
    assert not stream.ready


def test_a_board_that_prints_a_banner_becomes_ready():
    """Boot messages of 300 bytes, in one piece or in many, then good frames."""
    banner = (b"ets Jun  8 2016 00:22:57 rst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\r\n" * 4)[:300]
    for pieces in ([banner], [banner[k : k + 20] for k in range(0, 300, 20)]):
        stream = TouchStream([LOWER, UPPER])
        events: list[SkinEvent] = []
        for k, piece in enumerate(pieces):
            events += stream.feed(piece, k * 1e-3)
        assert {(event.sensor, event.fault) for event in events if isinstance(event, SkinFault)} == {
            ("lower half", Fault.CORRUPT),
            ("upper half", Fault.CORRUPT),
        }  # never of the whole stream, which would stand against the guard until a reset
        for time, data in VirtualSkin([LOWER, UPPER], duration=0.05).packets():
            events += stream.feed(data, time + 0.1)
        assert not stream.ready  # the bad bytes are not long enough ago
        for time, data in VirtualSkin([LOWER, UPPER], duration=0.3, seed=1).packets():
            stream.feed(data, time + 0.2)
        assert stream.ready


def test_a_line_that_goes_on_being_corrupt_never_becomes_ready():
    stream = TouchStream([LOWER])
    play(stream, VirtualSkin(LOWER, duration=2.0, faults=FaultInjection(corrupt_every=8)))
    assert stream.decoder.frames > 1500
    assert not stream.ready
    assert stream.detectors[0].fault in (Fault.CORRUPT, Fault.GAP)


def test_a_banner_while_the_sensors_are_ready_is_a_fault_of_the_stream():
    stream = TouchStream([LOWER])
    play(stream, VirtualSkin(LOWER, duration=0.2))
    assert stream.ready
    (event,) = stream.feed(b"watchdog reset\r\n" * 20, 0.2)
    assert isinstance(event, SkinFault)
    assert (event.sensor, event.fault) == ("", Fault.CORRUPT)


@pytest.mark.long
def test_one_damaged_frame_in_a_hundred_is_lived_with():
    stream = TouchStream([LOWER])
    events = play(stream, VirtualSkin(LOWER, duration=5.0, faults=FaultInjection(corrupt_every=100), seed=4))
    assert faults_of(events) == []
    assert stream.decoder.crc_errors + stream.detectors[0].timing.missing >= 50


@pytest.mark.long
@pytest.mark.parametrize("touches", [[], [ScriptedTouch(0.5, 100.0, 0.05, 2.0)]], ids=["untouched", "touched"])
def test_no_allocation_outlives_a_frame(touches):
    packets = [data for _, data in VirtualSkin(LOWER, touches, duration=6.0).packets()]
    stream = TouchStream([LOWER])

    def play_packets(first: int, last: int) -> int:
        for k in range(first, last):
            stream.feed(packets[k], k * 1e-3)
        gc.collect()
        return sys.getallocatedblocks()

    counts = [play_packets(first, first + 1000) for first in range(0, 6000, 1000)]
    # what stays shows in each round; what pytest's own threads allocate meanwhile, and new numbers, in some
    assert min(after - before for before, after in pairwise(counts)) < 10, counts


@pytest.mark.parametrize(
    ("sensors", "words"),
    [
        ([], "at least one sensor"),
        ([LOWER, Sensor(UR10, 1)], r"must differ in name and in \(device_id, sensor_id\)"),
        ([LOWER, Sensor(UR10, 7, name="lower half")], "must differ in name"),
    ],
)
def test_sensors_that_cannot_share_a_line(sensors, words):
    with pytest.raises(SensorError, match=words):
        TouchStream(sensors)


def test_a_port_that_is_open_again_has_to_become_ready_and_its_device_may_have_started_anew():
    stream = TouchStream([LOWER])
    for _ in range(2):
        assert not stream.ready
        events = play(stream, VirtualSkin(LOWER, model="ladder", duration=0.1))
        assert not events  # the second time neither an old frame nor a jump of the clock
        assert stream.ready
        stream.reconnect(0.1)
    stream.feed(next(data for _, data in VirtualSkin(UPPER, model="ladder", duration=0.1).packets()), 0.2)
    assert stream.unknown == {(0, 2): 1}
    stream.reconnect(0.3)
    assert not stream.unknown
