"""Offset of the amplifier of the drive current: taken off within what parts have, named beyond, and no place is off."""

import math
from dataclasses import replace

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import SkinFault
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.untouched import CURRENT_BLOCK, UntouchedZero
from coneskin.skin.diagnosis.measurements import MEASURED, expected_counts
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin

PLAIN = Sensor(Frustum(0.0375, 0.0375, 0.24, math.radians(350)))
PARTS = PLAIN.electronics
BIASED = replace(PLAIN, electronics=replace(PARTS, current_zero=0.0125 * PARTS.current_full_scale))
PER_VOLT = 50.0 / PARTS.adc_volts  # part of full scale, of an offset before the amplifier
TOUCH = ScriptedTouch(0.7, 1.4, 0.130, math.radians(90.0), force=10.0)


def play(sensor, millivolts, touches=(TOUCH,), model="field", **options):
    """Faults, the last place of the touch, the time of readiness and the detector, with an offset."""
    flaws = Imperfections(current_offset=1e-3 * millivolts * PER_VOLT, **options)
    skin = VirtualSkin(sensor, touches, rate_hz=200, imperfections=flaws, model=model, duration=1.6)
    detector, faults, place, ready = Detector(sensor), [], None, math.inf
    for time, frame in skin.frames():
        faults += [event.fault for event in detector.feed(frame, time) if isinstance(event, SkinFault)]
        ready = time if detector.ready and ready == math.inf else ready
        place = detector.reading_now or place
    return faults, place, ready, detector


@pytest.mark.parametrize(("sensor", "millivolts"), [(PLAIN, 0.5), (BIASED, -0.5), (BIASED, 0.5), (BIASED, -0.1)])
def test_a_common_amplifiers_offset_moves_no_touch(sensor, millivolts):
    faults, place, ready, detector = play(sensor, millivolts)
    assert faults == []
    assert ready < 0.5
    assert place.location_valid
    assert place.u == pytest.approx(0.130, abs=5e-4)
    assert place.phi == pytest.approx(math.radians(90.0), abs=5e-3)
    zero = sensor.electronics.current_zero / PARTS.current_full_scale + 1e-3 * millivolts * PER_VOLT
    assert detector.zero == pytest.approx(zero * PARTS.full_count, abs=2.0)


@pytest.mark.parametrize(("sensor", "millivolts"), [(PLAIN, 1.0), (PLAIN, 3.0), (BIASED, -1.5), (BIASED, 1.0)])
def test_a_larger_one_is_named_and_the_sensor_never_ready(sensor, millivolts):
    faults, _, ready, _ = play(sensor, millivolts)
    assert set(faults) == {Fault.ZERO}
    assert ready == math.inf


@pytest.mark.parametrize("millivolts", [-0.5, -1.0])
def test_one_below_zero_that_no_bias_shows_is_named_in_the_touch(millivolts):
    assert set(play(PLAIN, millivolts)[0]) == {Fault.ZERO}


@pytest.mark.parametrize("noise", [0.0, 0.7, 3.0])
def test_where_there_is_none_no_count_changes(noise):
    sensor_noise = play(PLAIN, 0.0, noise_counts=noise, model="ladder")[3]
    assert sensor_noise.zero == 0


def test_a_current_of_a_short_is_none():
    faults, _, ready, _ = play(PLAIN, 4.0)
    assert set(faults) == {Fault.LEAK}
    assert ready == math.inf


def frames(count, number=CURRENT_BLOCK):
    skin = VirtualSkin(PLAIN, rate_hz=200, imperfections=Imperfections(noise_counts=0.0), model="ladder")
    frame = next(iter(skin.frames()))[1]
    return [frame._replace(touch_current=count)] * number


def test_it_is_found_at_once_and_followed_slowly_once_somebody_relies_on_it():
    zero = UntouchedZero(PLAIN)
    assert [zero.feed(frame, 0.005, free=True) for frame in frames(20)].count(True) == 1
    for _ in range(19):  # 3.04 s
        for frame in frames(40):
            zero.feed(frame, 0.005, free=False)
    assert zero.counts == 22
    for _ in range(40):  # within a count it rests
        for frame in frames(23):
            zero.feed(frame, 0.005, free=False)
    assert zero.counts == 22


def test_the_monitor_expects_the_bias_where_no_current_flows():
    expected = dict(zip(MEASURED, expected_counts(BIASED), strict=True))
    plain = dict(zip(MEASURED, expected_counts(PLAIN), strict=True))
    assert expected["touch_current"] == 51
    assert plain["touch_current"] == 0
    assert expected["radial_current"] - plain["radial_current"] == pytest.approx(51, abs=1)


def test_full_scale_stays_full_scale():
    zero = UntouchedZero(BIASED)
    frame = frames(zero.counts, 1)[0]._replace(radial_current=4095, angular_current=2000)
    after = zero.take_off(frame)
    assert (after.touch_current, after.radial_current, after.angular_current) == (0, 4095, 2000 - zero.nominal)
