"""Reports of a sensor's faults: each fault of a twin is noticed, reported once, and never looks untouched."""

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import SkinFault, TouchBegan
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import WiringFaults
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame

from .detector_bench import FIRM, SENSOR, DetectorBench, faults_of, play

ONE_FAULT = {
    "stall": (FaultInjection(stall_after=300), Fault.SILENT),
    "missing": (FaultInjection(stall_after=300, stall_frames=10), Fault.GAP),
    "every third lost": (FaultInjection(drop_every=3), Fault.GAP),
    "twice": (FaultInjection(duplicate_every=100), Fault.REPLAYED),
    "out of order": (FaultInjection(swap_every=100), Fault.REPLAYED),
    "replayed": (FaultInjection(replay_after=300), Fault.REPLAYED),
    "restart": (FaultInjection(restart_after=300), Fault.RESTARTED),
    "clock jump": (FaultInjection(clock_jump_after=300), Fault.CLOCK_JUMP),
    "clock back": (FaultInjection(clock_jump_after=300, clock_jump_us=-50_000), Fault.REPLAYED),
    "stuck": (FaultInjection(stuck_after=300), Fault.STUCK),
    "one channel stuck": (FaultInjection(stuck_after=300, stuck_channel="radial_current"), Fault.STUCK),
    "supply": (FaultInjection(saturate_after=300, stuck_channel="supply", saturate_count=0), Fault.SUPPLY),
    "full scale": (FaultInjection(saturate_after=300, stuck_channel="radial_d", saturate_count=4095), Fault.SATURATED),
    "status": (FaultInjection(status_after=300), Fault.DEVICE),
    "open": (FaultInjection(wiring_after=300, wiring=WiringFaults(opened=("C",))), Fault.OPEN_LOWER),
    "short": (FaultInjection(wiring_after=300, wiring=WiringFaults(shorts=(("A", "B"),))), Fault.SHORT_UPPER),
}


@pytest.mark.promise("P08")
@pytest.mark.parametrize("name", ONE_FAULT)
def test_every_fault_of_the_twin_is_noticed_and_never_looks_untouched(name):
    faults, expected = ONE_FAULT[name]
    skin = VirtualSkin(SENSOR, seed=2, faults=faults, duration=0.6)
    events, detector = play(skin, DetectorSettings(settle_frames=20, stuck_frames=25))
    found = faults_of(events)
    assert found[0] is expected
    assert not any(isinstance(event, TouchBegan) for event in events)
    lasting = name in {"stall", "every third lost", "stuck", "one channel stuck", "supply", "full scale", "status"}
    if lasting or name in {"open", "short"}:
        assert not detector.ready
        assert detector.fault is not None
        assert len(found) <= 3  # reported, not repeated with each frame
    first = next(event for event in events if isinstance(event, SkinFault))
    assert first.message.startswith(f"forearm: {expected.value}")


@pytest.mark.long
def test_a_good_line_with_noise_has_no_fault_in_a_minute():
    skin = VirtualSkin(SENSOR, rate_hz=1000, duration=60.0, seed=8)
    events, detector = play(skin, DetectorSettings(stuck_frames=200))
    assert events == []
    assert detector.ready


def test_a_fault_does_not_end_a_touch_and_a_touch_is_seen_during_a_gap():
    bench = DetectorBench()
    bench.feed(times=100)
    bench.feed(FIRM, times=5)
    assert faults_of(bench.feed(FIRM, status=8)) == [Fault.DEVICE]
    assert bench.detector.touched
    bench.feed(times=200)
    assert bench.detector.ready
    bench.count += 10
    events = bench.feed(FIRM)
    assert [type(event) for event in events] == [SkinFault, TouchBegan]


def test_silence_is_reported_once_and_ends_with_untouched_frames():
    bench = DetectorBench()
    assert bench.detector.silence(0.0, 0.02)[0].detail == "none at all"
    bench.feed(times=100)
    assert bench.detector.ready
    assert bench.detector.timing.age(0.110) == pytest.approx(0.011)
    assert bench.detector.silence(0.110, 0.02) == []
    (event,) = bench.detector.silence(0.130, 0.02)
    assert isinstance(event, SkinFault)
    assert event.fault is Fault.SILENT
    assert "31.0 ms" in event.message
    assert bench.detector.silence(0.140, 0.02) == []
    assert not bench.detector.ready


def test_where_frames_come_that_cannot_be_believed_silence_is_not_the_name():
    bench = DetectorBench()
    bench.feed(times=100)
    assert faults_of(bench.feed(status=8, times=50)) == [Fault.DEVICE]
    assert bench.detector.silence(0.151, 0.02) == []
    assert bench.detector.fault is Fault.DEVICE
    (event,) = bench.detector.silence(0.180, 0.02)
    assert isinstance(event, SkinFault)
    assert event.fault is Fault.SILENT


def test_a_guide_that_stays_driven_is_a_fault_after_three_frames():
    sensor = Sensor(Frustum(0.0376, 0.0373, 0.24))
    detector, events = Detector(sensor), []
    for number in range(1, 80):
        guide = 2900 if number > 70 else 0
        frame = Frame(36, 0, 0, 0, number, 1000 * number, 0, 0, 0, guide, guide, 0, 0, 0, 0, 0, 0, 0)
        currents = {
            "radial_current": sensor.electronics.count_amperes(sensor.radial_amperes),
            "angular_current": sensor.electronics.count_amperes(sensor.angular_amperes),
            **dict.fromkeys(("touch_supply", "radial_supply", "angular_supply"), sensor.electronics.count_volts(2.5)),
        }
        events += detector.feed(frame._replace(**currents), 0.001 * number)
    assert [(event.fault, event.sequence) for event in events] == [(Fault.GUIDE_DRIVEN, 74)]


def test_a_fault_in_a_touch_forgets_the_currents_and_the_touch_goes_on():
    """Its frames lack a learned zero from then on: the place is doubted, and nothing divides by their number."""
    faults = FaultInjection(clock_jump_after=260)
    skin = VirtualSkin(SENSOR, [ScriptedTouch(0.2, 0.5, 0.1, 2.0)], seed=3, faults=faults, duration=0.4)
    events, detector = play(skin)
    assert Fault.CLOCK_JUMP in faults_of(events)
    assert detector.touched
    assert detector.reading_now is not None
    assert detector.reading_now.doubt
    assert detector.reading_now.elongation is None
