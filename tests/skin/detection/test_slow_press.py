"""Presses that come as slowly as drift does, and last: each is a touch, and none becomes the new zero."""

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import SkinEvent, SkinFault, TouchBegan, TouchEnded
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin

SENSOR = Sensor(Frustum(0.0376, 0.0373, 0.24))
TEN_MINUTES = 600.0  # s
RATE = 5.0  # Hz; drift is followed by time, not by frames


def play(skin: VirtualSkin) -> tuple[list[SkinEvent], Detector, list[float]]:
    """Feed a skin in virtual time; events, detector, and baselines."""
    settings = DetectorSettings(settle_frames=10)
    detector, events, baselines = Detector(SENSOR, settings), [], []
    for time, frame in skin.frames():
        events += detector.feed(frame, time)
        baselines.append(detector._level.value)
    return events, detector, baselines


@pytest.mark.long
@pytest.mark.parametrize("newtons", [0.6, 1.0, 5.0])
def test_a_hand_laid_on_over_ten_minutes_is_a_touch(newtons):
    # 0.5 N close the layers; from there it grows evenly to so much
    hand = ScriptedTouch(5.0, 1e4, 0.1, 2.0, force=0.5, rise=0.1, grown_force=newtons, growth_time=TEN_MINUTES)
    skin = VirtualSkin(SENSOR, [hand], rate_hz=RATE, duration=660.0, model="ladder")
    events, detector, baselines = play(skin)
    began = [event for event in events if isinstance(event, TouchBegan)]
    assert len(began) == 1
    # not a count of it is hidden beyond what may be drift: 0.03
    limits = SENSOR.thresholds
    assert began[0].level < limits.touch_level + 0.02
    assert max(baselines) <= DetectorSettings().drift_limit
    assert detector.touched
    assert not any(isinstance(event, TouchEnded) for event in events)


@pytest.mark.long
def test_a_press_that_lasts_ten_minutes_stays_as_firm():
    hand = ScriptedTouch(5.0, 5.0 + TEN_MINUTES, 0.1, 2.0, force=1.0, rise=0.1)
    skin = VirtualSkin(SENSOR, [hand], rate_hz=RATE, duration=620.0, model="ladder")
    events, detector, baselines = play(skin)
    (began,) = [event for event in events if isinstance(event, TouchBegan)]
    (ended,) = [event for event in events if isinstance(event, TouchEnded)]
    assert ended.time - began.time == pytest.approx(TEN_MINUTES, abs=1.0)
    assert Fault.LAYERS_CLOSED in [event.fault for event in events if isinstance(event, SkinFault)]
    assert max(baselines) < 0.002
    assert detector.ready  # untouched again, and quiet


def test_a_leak_of_100_kohm_is_no_fault_and_a_touch_is_seen_through_it():
    damp = Imperfections(leak=1e-6, leak_drift=9e-8)  # 100 kohm after 100 s
    hand = ScriptedTouch(90.0, 95.0, 0.1, 2.0, force=3.0)
    skin = VirtualSkin(SENSOR, [hand], rate_hz=RATE, duration=100.0, imperfections=damp, model="ladder")
    events, detector, baselines = play(skin)
    assert [type(event) for event in events if isinstance(event, TouchBegan | TouchEnded | SkinFault)] == [
        TouchBegan,
        TouchEnded,
    ]
    assert detector.ready
    assert max(baselines) == pytest.approx(DetectorSettings().drift_limit)


def test_damp_between_the_thresholds_is_the_reason_why_a_sensor_is_not_ready_or_no_longer():
    skin = VirtualSkin(SENSOR, rate_hz=50.0, duration=3.0, model="ladder", imperfections=Imperfections(leak=2e-5))
    events, detector, _ = play(skin)
    assert [event.fault for event in events if isinstance(event, SkinFault)] == [Fault.DRIFT]
    assert not detector.ready
    # a touch lighter than the threshold is none for half a minute, and then something that lies on the sensor
    for seconds, faults in ((25.0, []), (40.0, [Fault.DRIFT])):
        light = ScriptedTouch(1.0, 100.0, 0.1, 2.0, force=0.51)
        events, detector, _ = play(VirtualSkin(SENSOR, [light], rate_hz=50.0, duration=seconds, model="ladder"))
        assert [event.fault for event in events if isinstance(event, SkinFault)] == faults
        assert not detector.touched


def test_one_quiet_frame_in_fifty_takes_no_damp_back():
    damp = VirtualSkin(SENSOR, rate_hz=50.0, duration=3.0, model="ladder", imperfections=Imperfections(leak=2e-5))
    dry = next(iter(VirtualSkin(SENSOR, rate_hz=50.0, model="ladder").frames()))[1]
    detector, faults = Detector(SENSOR), []
    for n, (time, frame) in enumerate(damp.frames()):
        frame = frame if n % 50 else dry._replace(sequence=frame.sequence, clock_us=frame.clock_us)
        faults += [event.fault for event in detector.feed(frame, time) if isinstance(event, SkinFault)]
    assert faults[0] is Fault.DRIFT
