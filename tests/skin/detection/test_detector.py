"""Touch or no touch, from true frames: latency, hysteresis, drift, lasting contacts."""

import math
import random

import pytest

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector, _ReportedTouch
from coneskin.skin.detection.events import SkinEvent, SkinFault, TouchBegan, TouchEnded, TouchMoved
from coneskin.skin.detection.frame.contact_matrix import FrameInversion
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.reading import TouchReading
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.frame.untouched import CURRENT_BLOCK
from coneskin.skin.detection.place.touch_place import TouchPlace
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Status, encode
from tests.skin.bench_top import measured, unrounded
from tests.skin.detection.detector_bench import FIRM, SENSOR, DetectorBench, faults_of, play


def test_three_in_a_row_may_be_a_contact_and_each_one_more_is_a_fault() -> None:
    detector = Detector(SENSOR)
    assert [detector._is_change(Fault.LEAK) for _ in range(5)] == [True, True, True, False, False]


def test_ten_good_frames_make_up_for_one_and_are_no_credit() -> None:
    bench = DetectorBench()
    bench.feed(times=100)
    taken = [bench.detector._is_change(Fault.OUT_OF_RANGE) for _ in range(4)]
    bench.feed(times=10)
    taken += [bench.detector._is_change(Fault.OUT_OF_RANGE) for _ in range(2)]
    assert taken == [True, True, True, False, True, False]


@pytest.mark.parametrize("fault", [Fault.STUCK, Fault.RESTARTED, Fault.SILENT])
def test_no_contact_looks_like_another_fault(fault: Fault) -> None:
    detector = Detector(SENSOR)
    assert not detector._is_change(fault)
    assert all(detector._is_change(Fault.LEAK) for _ in range(3))


CERTAIN = 200  # frames; within them a second contact is excluded


def test_not_ready_until_a_run_of_untouched_frames():
    bench = DetectorBench(DetectorSettings(settle_frames=40))
    assert not bench.detector.ready
    assert bench.feed(times=39) == []
    assert not bench.detector.ready
    bench.feed()
    assert bench.detector.ready


def test_not_ready_before_the_untouched_drive_currents_are_known():
    bench = DetectorBench(DetectorSettings(settle_frames=3))
    bench.feed(times=CURRENT_BLOCK - 1)
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


def test_events_of_a_touch_have_all_that_its_frame_says():
    told = _ReportedTouch(SENSOR, DetectorSettings())
    first = TouchReading(1.0, 0.5, 0.1, 1.0, True, "", 7, 8, (1e-6, 2e-7, 3e-6), 0.004, 0.2, None, (0.01, -0.02))
    line = first._replace(location_valid=False, doubt="a line", elongation=(0.03, 0.7), u=0.2, phi=2.0)
    for frame, event in ((first, told.begin(first)), (line, told.move(line))):
        assert {name: getattr(event, name) for name in TouchReading._fields} == frame._asdict()


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


def contact_of(level: float) -> LayerContact:
    """A contact of this level, by bisection of its resistance."""
    low, high = 1.0, 1e7
    for _ in range(60):
        ohms = math.sqrt(low * high)
        counts = unrounded(SENSOR, [LayerContact(0.2, 1.0, 1.0 / ohms)])
        above = counts["touch_c"] + counts["touch_d"] > 2.0 * level * counts["touch_supply"]
        low, high = (ohms, high) if above else (low, ohms)
    return LayerContact(0.2, 1.0, 1.0 / low)


@pytest.mark.promise("P01")
@pytest.mark.parametrize("early", [False, True])
def test_a_touch_begins_at_the_threshold_of_the_scene_and_not_beside_it(early: bool) -> None:
    """The level is the mean of C and D over the supply; 3 % below its threshold of 0.1 nothing begins."""
    bench, alarms = DetectorBench(), []
    bench.alarm = (lambda name, level: alarms.append(level)) if early else None
    bench.feed(times=100)
    assert bench.feed([contact_of(0.097)], times=200) == []
    assert alarms == []
    (began,) = bench.feed([contact_of(0.103)])
    assert isinstance(began, TouchBegan)
    assert alarms == ([pytest.approx(0.103, abs=1e-3)] if early else [])


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


@pytest.mark.long
def test_slow_drift_is_followed_while_untouched_and_frozen_while_touched():
    damp = Imperfections(leak_drift=2.5e-8)  # level 0.025 after 100 s, 1/8 of the fastest drift that is followed
    skin = VirtualSkin(SENSOR, [ScriptedTouch(60, 70, 0.2, 1.0)], rate_hz=50, duration=100.0, imperfections=damp)
    events, detector = play(skin, DetectorSettings(settle_frames=10))
    assert faults_of(events) == []
    assert [type(e) for e in events if not isinstance(e, TouchMoved)] == [TouchBegan, TouchEnded]
    assert detector._level.value == pytest.approx(0.0125, abs=0.001)
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


@pytest.mark.long
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


@pytest.mark.pure
def test_the_alarm_sounds_before_the_place_is_worked_out(monkeypatch):
    bench, order, begin, invert = DetectorBench(), [], TouchPlace.begin, FrameInversion.invert
    bench.feed(times=100)
    monkeypatch.setattr(TouchPlace, "begin", lambda *inputs: order.append("place") or begin(*inputs))
    monkeypatch.setattr(FrameInversion, "invert", lambda *inputs: order.append("matrix") or invert(*inputs))
    bench.alarm = lambda name, level: order.append((name, level))
    (began,) = bench.feed(FIRM)
    assert order[:2] == [(SENSOR.name, began.level), "matrix"]
    assert "place" in order
    bench.feed(FIRM)
    assert sum(isinstance(what, tuple) for what in order) == 1  # once for each touch


def test_no_alarm_sounds_before_a_touch_is_confirmed():
    bench, heard = DetectorBench(DetectorSettings(confirm_frames=2)), []
    bench.alarm = lambda *inputs: heard.append(inputs)
    bench.feed(times=100)
    assert bench.feed(FIRM) == []
    assert heard == []
    assert len(bench.feed(FIRM)) == len(heard) == 1


def test_what_has_happened_before_the_touch_decides_first():
    """A fault stops the arm for good, a touch may let it move away: so an alarm must not come before the fault."""
    bench, heard = DetectorBench(), []
    bench.alarm = lambda *inputs: heard.append(inputs)
    bench.feed(times=100)
    fault, began = bench.feed(FIRM, status=int(Status.RESTARTED))
    assert isinstance(fault, SkinFault)
    assert isinstance(began, TouchBegan)
    assert heard == []


@pytest.mark.parametrize("status", [0, int(Status.RESTARTED)])
def test_a_fault_in_a_frame_before_it_decides_first_as_well(status):
    stream, heard = TouchStream([SENSOR]), []
    quiet, touch = (measured(SENSOR, contacts)._replace(status=0) for contacts in ((), FIRM))
    frames = [encode(quiet._replace(sequence=k, clock_us=1000 * k)) for k in range(100)]
    frames.append(encode(quiet._replace(sequence=100, clock_us=100_000, status=status)))
    frames.append(encode(touch._replace(sequence=101, clock_us=101_000)))
    for number in range(100):
        stream.feed(frames[number], 1e-3 * number, lambda *inputs: heard.append(inputs))
    events = stream.feed(frames[100] + frames[101], 0.101, lambda *inputs: heard.append(inputs))
    assert isinstance(events[-1], TouchBegan)
    assert len(heard) == (0 if status else 1)
