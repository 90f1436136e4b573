"""All sensors on one stream: who is who, and what belongs to nobody."""

import gc
import random
import sys

import pytest

from coneskin.errors import SensorError, SkinConnectionError
from coneskin.skin.diagnosis import Fault
from coneskin.skin.events import Event, SkinFault, TouchBegan
from coneskin.skin.faults import Faults
from coneskin.skin.scripted_touch import ScriptedTouch
from coneskin.skin.sensor import Sensor
from coneskin.skin.stream import Stream
from coneskin.skin.virtual import VirtualSkin
from coneskin.skin.wire import FRAME_LENGTH, SYNC, encode

from .bench_top import CONE, UR10, measured

LOWER = Sensor(CONE, 1, name="lower half")
UPPER = Sensor(CONE, 2, name="upper half")


def play(stream: Stream, skin: VirtualSkin) -> list[Event]:
    events: list[Event] = []
    try:
        for time, data in skin.packets():
            events += stream.feed(data, time)
    except SkinConnectionError:
        pass
    return events


def faults_of(events: list[Event]) -> list[Fault]:
    return [event.fault for event in events if isinstance(event, SkinFault)]


def test_two_sensors_on_one_line_are_told_apart():
    skin = VirtualSkin([LOWER, UPPER], [ScriptedTouch(0.2, 0.3, 0.05, 2.0, sensor="upper half")], duration=0.4)
    stream = Stream([LOWER, UPPER])
    events = play(stream, skin)
    assert {event.sensor for event in events} == {"upper half"}
    assert isinstance(events[0], TouchBegan)
    assert stream.ready
    assert not stream.touched
    assert [detector.timing.missing for detector in stream.detectors] == [0, 0]


def test_ready_and_touched_speak_for_all():
    stream = Stream([LOWER, UPPER])
    play(stream, VirtualSkin(LOWER, duration=0.2))
    assert stream.detectors[0].ready
    assert not stream.ready  # the upper half has never been heard of
    assert [event.sensor for event in stream.silence(0.2, 0.02)] == ["upper half"]


def test_a_sensor_that_nobody_expects_is_reported_once_and_counted():
    stream = Stream([LOWER])
    events = play(stream, VirtualSkin([LOWER, UPPER], duration=0.1))
    assert faults_of(events) == [Fault.UNKNOWN_SENSOR]
    assert "device 0, sensor 2" in events[0].message
    assert stream.unknown == {(0, 2): 100}


def test_a_version_of_the_future_is_reported_once():
    frame = bytearray(encode(measured(LOWER)))
    frame[2] = 2
    from binascii import crc_hqx

    future = bytes(frame[:-2]) + crc_hqx(bytes(frame[:-2]), 0).to_bytes(2, "big")
    stream = Stream([LOWER])
    events = stream.feed(future * 3, 0.0) + stream.feed(future, 0.1)
    assert faults_of(events) == [Fault.UNKNOWN_VERSION]
    assert "version 2" in events[0].message


def test_a_port_opened_in_mid_frame_is_no_fault():
    stream = Stream([LOWER])
    data = b"".join(packet for _, packet in VirtualSkin(LOWER, duration=0.1).packets())
    assert stream.feed(data[FRAME_LENGTH // 2 :], 0.1) == []
    assert stream.decoder.bytes_skipped == FRAME_LENGTH // 2


@pytest.mark.parametrize("noise", [SYNC + b"\x01\x24", b"\x00", None], ids=["false starts", "zeros", "random"])
def test_noise_instead_of_frames_is_corrupt(noise):
    rng = random.Random(1)
    stream = Stream([LOWER])
    events: list[Event] = []
    for k in range(20):
        events += stream.feed(rng.randbytes(40) if noise is None else noise * 40, k * 1e-3)
    assert faults_of(events) == [Fault.CORRUPT]
    assert "bytes skipped" in events[0].message


def test_a_wrong_baud_rate_is_corrupt_and_silent_not_untouched():
    # what a receiver at another speed makes of the line has no frames in it
    stream = Stream([LOWER])
    events = play(stream, VirtualSkin(LOWER, duration=0.1, faults=Faults(corrupt_every=1)))
    assert Fault.CORRUPT in faults_of(events)
    assert not stream.ready


def test_one_damaged_frame_in_a_hundred_is_lived_with():
    stream = Stream([LOWER])
    events = play(stream, VirtualSkin(LOWER, duration=5.0, faults=Faults(corrupt_every=100), seed=4))
    assert faults_of(events) == []
    assert stream.decoder.crc_errors + stream.detectors[0].timing.missing >= 50


@pytest.mark.parametrize("touches", [[], [ScriptedTouch(0.5, 100.0, 0.05, 2.0)]], ids=["untouched", "touched"])
def test_no_allocation_outlives_a_frame(touches):
    packets = [data for _, data in VirtualSkin(LOWER, touches, duration=6.0).packets()]
    stream = Stream([LOWER])

    def play_packets(first: int, last: int) -> int:
        for k in range(first, last):
            stream.feed(packets[k], k * 1e-3)
        return sys.getallocatedblocks()

    play_packets(0, 1000)
    gc.collect()
    before = play_packets(1000, 1001)
    after = play_packets(1001, 6000)
    assert after - before < 50  # in 4999 frames: numbers that were cached become numbers that are not


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
        Stream(sensors)
