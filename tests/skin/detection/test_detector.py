"""Touch or no touch, from true frames: latency, hysteresis, drift, lasting contacts, and every fault on the way."""

import math
import random

import pytest

from coneskin.errors import SensorError, SkinConnectionError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import SkinEvent, SkinFault, TouchBegan, TouchEnded, TouchMoved
from coneskin.skin.detection.faults import Fault
from coneskin.skin.detection.settings import DetectorSettings
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.detection.untouched.currents import BLOCK
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, WiringFaults
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame, FrameDecoder

from ..bench_top import UR10, measured, unrounded

SENSOR = Sensor(UR10, name="forearm")
COUNTS = Frame._fields[6:-1]
FIRM = [LayerContact(0.2, 1.0, 1e-3)]


CERTAIN = 200  # frames; within them a second contact is excluded


class DetectorBench:
    """A detector that is fed one frame a millisecond, with the noise of a count that a converter has."""

    def __init__(self, settings: DetectorSettings | None = None) -> None:
        self.detector = Detector(SENSOR, settings)
        self.count = 0
        self._rng = random.Random(3)

    def feed(self, contacts=(), times: int = 1, **changes) -> list[SkinEvent]:
        frame = measured(SENSOR, contacts)
        exact = frame._asdict() | unrounded(SENSOR, contacts)
        events = []
        for _ in range(times):
            counts = {n: max(0, round(exact[n] + self._rng.gauss(0.0, 0.7))) for n in COUNTS}
            stamp = {"sequence": self.count & 0xFFFF, "clock_us": self.count * 1000 & 0xFFFFFFFF}
            events += self.detector.feed(frame._replace(**{**counts, **stamp, **changes}), self.count * 1e-3)
            self.count += 1
        return events


def play(skin: VirtualSkin, settings: DetectorSettings | None = None) -> tuple[list[SkinEvent], Detector]:
    """Everything that a detector says about a virtual skin's bytes, silence beyond 20 ms included."""
    detector, decoder = Detector(skin.sensors[0], settings), FrameDecoder()
    events: list[SkinEvent] = []
    try:
        for time, data in skin.packets():
            for frame in decoder.feed(data):
                events += detector.feed(frame, time)
            events += detector.silence(time, 0.02) if time > 0.02 else []
    except SkinConnectionError:
        pass
    return events, detector


def faults_of(events: list[SkinEvent]) -> list[Fault]:
    return [event.fault for event in events if isinstance(event, SkinFault)]


def test_not_ready_until_a_run_of_untouched_frames():
    bench = DetectorBench(DetectorSettings(settle_frames=40))
    assert not bench.detector.ready
    assert bench.feed(times=39) == []
    assert not bench.detector.ready
    bench.feed()
    assert bench.detector.ready


def test_not_ready_before_the_untouched_drive_currents_are_known():
    bench = DetectorBench(DetectorSettings(settle_frames=3))
    bench.feed(times=BLOCK - 1)
    assert not bench.detector.ready
    bench.feed()
    assert bench.detector.ready


def test_touched_from_the_start_is_a_touch_and_never_ready():
    bench = DetectorBench()
    events = bench.feed(FIRM, times=1000)
    assert [type(event) for event in events] == [TouchBegan]
    assert bench.detector.touched
    now = bench.detector.reading_now
    assert now is not None
    assert now.doubt == "the untouched drive currents are not known yet"
    assert not bench.detector.ready
    bench.feed(times=60)
    assert bench.detector.ready


@pytest.mark.parametrize(("confirm", "late"), [(1, 0), (2, 1)])
def test_a_touch_begins_on_its_first_frame_or_one_later(confirm, late):
    bench = DetectorBench(DetectorSettings(confirm_frames=confirm))
    bench.feed(times=100)
    events = [event for _ in range(5) for event in bench.feed(FIRM)]
    assert isinstance(events[0], TouchBegan)
    assert events[0].sequence == 100 + late
    assert events[0].time == (100 + late) * 1e-3


def test_one_frame_of_noise_does_not_confirm():
    bench = DetectorBench(DetectorSettings(confirm_frames=2))
    bench.feed(times=100)
    assert bench.feed(FIRM) + bench.feed() + bench.feed(FIRM) + bench.feed() == []


def test_the_place_is_certain_once_a_second_contact_is_excluded():
    bench = DetectorBench()
    bench.feed(times=200)
    (began,) = bench.feed(FIRM)
    assert isinstance(began, TouchBegan)
    assert (began.location_valid, began.doubt) == (False, "too few frames yet to exclude a second contact")
    (moved,) = bench.feed(FIRM, times=CERTAIN)
    assert isinstance(moved, TouchMoved)
    assert moved.location_valid
    assert moved.sequence > 202
    assert (moved.u, moved.phi) == (pytest.approx(0.2, abs=5e-4), pytest.approx(1.0, abs=5e-3))
    assert bench.feed(FIRM, times=100) == []


def test_every_frame_of_a_touch_can_be_read():
    bench = DetectorBench()
    bench.feed(times=200)
    assert bench.detector.reading_now is None
    for k in range(50):  # grows in steps below level_step: no events, but each frame has its level
        bench.feed([LayerContact(0.2, 1.0, 1e-3 * (1 + 0.01 * k))])
        now = bench.detector.reading_now
        assert now is not None
        assert (now.time, now.sequence, now.clock_us) == (pytest.approx(0.2 + k * 1e-3), 200 + k, 200_000 + 1000 * k)
        assert now.location_valid == (now.doubt == "")
        layers_ohms = 1e3 / (1 + 0.01 * k)
        assert now.level == pytest.approx(5e3 / (5e3 + layers_ohms + 515.0), abs=0.002)  # the sheets have the rest
        assert (now.u, now.phi) == (pytest.approx(0.2, abs=5e-4), pytest.approx(1.0, abs=5e-3))
    bench.feed([LayerContact(0.2, 1.0, 1e-4)], status=8)  # a frame that cannot be believed says nothing
    assert bench.detector.reading_now == now
    bench.feed(times=10)
    assert bench.detector.reading_now is None


def test_after_a_frame_that_cannot_be_believed_the_place_waits_for_two():
    bench = DetectorBench()
    bench.feed(times=200)
    bench.feed(FIRM, times=CERTAIN)
    (uncertain,) = bench.feed(FIRM, radial_c=0)  # contradicts itself
    assert isinstance(uncertain, TouchMoved)
    assert not uncertain.location_valid
    assert bench.feed(FIRM) == []
    now = bench.detector.reading_now
    assert now is not None
    assert (now.location_valid, now.doubt) == (False, "it has only begun, or moves")
    (moved,) = bench.feed(FIRM)
    assert isinstance(moved, TouchMoved)
    assert moved.location_valid


def test_an_uncertain_place_does_not_replace_a_certain_one():
    bench = DetectorBench()
    bench.feed(times=200)
    bench.feed(FIRM, times=CERTAIN)
    (moved,) = bench.feed([LayerContact(0.3, 5.0, 3e-5)])  # light and elsewhere
    assert isinstance(moved, TouchMoved)
    assert (moved.location_valid, moved.doubt) == (False, "it presses too lightly for a place")
    assert (moved.u, moved.phi) == (pytest.approx(0.2, abs=5e-4), pytest.approx(1.0, abs=5e-3))
    (ended,) = bench.feed(times=10)
    assert isinstance(ended, TouchEnded)
    assert (ended.u, ended.location_valid) == (moved.u, True)


def test_a_frame_from_the_past_neither_begins_nor_ends_a_touch():
    bench = DetectorBench()
    bench.feed(times=100)
    old = {"sequence": 50, "clock_us": 50_000}
    assert faults_of(bench.feed(FIRM, times=10, **old)) == [Fault.REPLAYED]
    assert not bench.detector.touched
    bench.feed(FIRM)
    bench.feed(times=10, **old)
    assert bench.detector.touched


def test_hysteresis_between_the_thresholds():
    bench = DetectorBench()
    bench.feed(times=100)
    between = [LayerContact(0.2, 1.0, 1.5e-5)]  # level 0.07
    assert bench.feed(between, times=100) == []
    bench.feed(FIRM)
    assert not any(isinstance(event, TouchEnded) for event in bench.feed(between, times=100))
    assert bench.detector.touched
    (ended,) = bench.feed(times=10)
    assert isinstance(ended, TouchEnded)
    assert ended.sequence == 303  # the third frame below the release threshold, counted from 301


def test_movement_is_reported_in_steps():
    bench = DetectorBench(DetectorSettings(move_distance=0.005))
    bench.feed(times=200)
    bench.feed(FIRM, times=CERTAIN)
    events = []
    for k in range(100):  # 20 mm in 100 frames
        events += bench.feed([LayerContact(0.2 + 0.0002 * k, 1.0, 1e-3)])
    assert 3 <= len(events) <= 4
    assert all(isinstance(event, TouchMoved) and event.location_valid for event in events)


@pytest.mark.long
def test_a_lasting_contact_is_never_zeroed_away():
    skin = VirtualSkin(SENSOR, [ScriptedTouch(0.2, math.inf, 0.2, 1.0, force=0.6)], rate_hz=20, duration=1200.0)
    events, detector = play(skin, DetectorSettings(settle_frames=3, lasting_touch=30.0))
    assert detector.touched  # 20 minutes of 0.1 N above the paper's threshold
    assert not any(isinstance(event, TouchEnded) for event in events)
    assert Fault.LAYERS_CLOSED in faults_of(events)
    lasting = next(event for event in events if isinstance(event, SkinFault) and event.fault is Fault.LAYERS_CLOSED)
    assert lasting.time == pytest.approx(30.2, abs=0.2)


def test_slow_drift_is_followed_while_untouched_and_frozen_while_touched():
    damp = Imperfections(leak_drift=2.5e-8)  # level 0.025 after 100 s, 1/8 of the fastest drift that is followed
    skin = VirtualSkin(SENSOR, [ScriptedTouch(60, 70, 0.2, 1.0)], rate_hz=50, duration=100.0, imperfections=damp)
    events, detector = play(skin, DetectorSettings(settle_frames=10))
    assert faults_of(events) == []
    assert [type(e) for e in events if not isinstance(e, TouchMoved)] == [TouchBegan, TouchEnded]
    assert detector.baseline == pytest.approx(0.0125, abs=0.001)
    before, _ = play(
        VirtualSkin(SENSOR, rate_hz=50, duration=60.0, imperfections=damp), DetectorSettings(settle_frames=10)
    )
    assert before == []


@pytest.mark.long
def test_a_slow_press_is_not_taken_for_drift():
    # a leak that grows for ever: the followed part is bounded, so it ends as a fault and then as a touch
    skin = VirtualSkin(SENSOR, rate_hz=20, duration=400.0, imperfections=Imperfections(leak_drift=1e-7))
    events, detector = play(skin, DetectorSettings(settle_frames=5))
    assert Fault.DRIFT in faults_of(events)
    assert detector.touched
    began = next(event for event in events if isinstance(event, TouchBegan))
    conductance = began.time * 1e-7
    level = 5e3 * conductance / (1 + 5e3 * conductance)
    assert level < SENSOR.thresholds.touch_level + DetectorSettings().drift_limit + 0.01


def test_the_same_bytes_give_the_same_events_bit_by_bit():
    def run() -> list[SkinEvent]:
        faults = FaultInjection(drop_every=97, corrupt_every=61, clock_jump_after=700)
        skin = VirtualSkin(SENSOR, [ScriptedTouch(0.2, 0.5, 0.1, 2.0)], seed=11, faults=faults, duration=1.0)
        return play(skin)[0]

    first, second = run(), run()
    assert first == second
    assert [repr(event) for event in first] == [repr(event) for event in second]
    assert len(first) > 3


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
    assert bench.detector.age(0.110) == pytest.approx(0.011)
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


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"confirm_frames": 3}, "confirm_frames must be 1 or 2, got 3"),
        ({"settle_frames": 0}, "settle_frames must be at least 1, got 0"),
        ({"move_distance": 0.0}, r"move_distance must be above 0 \[m\], got 0.0"),
        ({"drift_rate": math.nan}, "drift_rate must be finite"),
        ({"drift_limit": 0.05}, "drift_limit must be below thresholds.release_level"),
    ],
)
def test_a_detector_that_cannot_be_is_refused(changes, words):
    with pytest.raises(SensorError, match=words):
        Detector(SENSOR, DetectorSettings(**changes))


@pytest.mark.parametrize("seed", range(40))
def test_a_touch_that_begins_or_ends_between_two_phases_is_a_touch(seed):
    """The phases of one frame then contradict each other, for up to three frames while the layers close."""
    rng = random.Random(seed)
    sensor = Sensor(Frustum(0.0376, 0.0373, 0.24))
    start, end = 0.1 + 0.001 * rng.random(), 0.16 + 0.001 * rng.random()
    touch = ScriptedTouch(start, end, rng.uniform(0.01, 0.23), rng.uniform(0.1, 6.1))
    stream, events = TouchStream([sensor]), []
    for time, data in VirtualSkin(sensor, [touch], seed=seed, duration=0.25).packets():
        events += stream.feed(data, time)
    assert [type(event) for event in events if not isinstance(event, TouchMoved)] == [TouchBegan, TouchEnded]


def test_a_guide_that_stays_driven_is_a_fault_after_three_frames():
    sensor = Sensor(Frustum(0.0376, 0.0373, 0.24))
    detector, events = Detector(sensor), []
    for number in range(1, 80):
        guide = 2900 if number > 70 else 0
        frame = Frame(1, 0, 0, 0, number, 1000 * number, 0, 0, 0, guide, guide, 0, 0, 0, 0, 0, 0, 0)
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
