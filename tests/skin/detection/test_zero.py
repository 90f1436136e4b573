"""Offset of the amplifier of the drive current: taken off within what parts have, named beyond, and no place is off."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import SkinFault
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.untouched import CURRENT_BLOCK, UntouchedCurrents, UntouchedZero
from coneskin.skin.diagnosis.measurements import MEASURED, expected_counts, find_wrong_measurements
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame

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
    assert detector._zero.counts == pytest.approx(zero * PARTS.full_count, abs=2.0)


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
    assert sensor_noise._zero.counts == 0


def test_a_current_of_a_short_is_none():
    faults, _, ready, _ = play(PLAIN, 4.0)
    assert set(faults) == {Fault.LEAK}
    assert ready == math.inf


def frames(count, number=CURRENT_BLOCK):
    skin = VirtualSkin(PLAIN, rate_hz=200, imperfections=Imperfections(noise_counts=0.0), model="ladder")
    frame = next(iter(skin.frames()))[1]
    return [frame._replace(touch_current=count)] * number


@pytest.mark.parametrize(("bits", "unit"), [(10, 1), (12, 1), (16, 16)])
def test_it_is_found_at_once_and_followed_slowly_once_somebody_relies_on_it(bits, unit):
    zero = UntouchedZero(replace(PLAIN, electronics=replace(PLAIN.electronics, adc_bits=bits)))
    start, later, near = 7 * unit, 12 * unit, 10 * unit  # the share of the scale is what counts, beyond 12 bits
    assert [zero.feed(frame, 0.005, free=True) for frame in frames(start)].count(True) == 1
    for _ in range(19):  # 3.04 s
        for frame in frames(later):
            zero.feed(frame, 0.005, free=False)
    assert zero.counts == 9 * unit
    for _ in range(40):  # within a unit it rests
        for frame in frames(near):
            zero.feed(frame, 0.005, free=False)
    assert zero.counts == 9 * unit
    noisy = [frames(start + round(unit * off), 1)[0] for off in (-1.0, 0.0, 1.0)]
    for n in range(8 * CURRENT_BLOCK):  # noise of its share hides nothing while nobody relies on it
        zero.feed(noisy[n % 3], 0.005, free=True)
    assert zero.counts == start


def run(offset_at, seconds=8.0, rate=500, sensor=BIASED, touches=()):
    """Faults and detector of frames whose amplifier is off by counts that change with time, between touches."""
    chance, detector, faults = np.random.default_rng(1), Detector(sensor), []
    parts, still = sensor.electronics, expected_counts(sensor)
    skin = VirtualSkin(sensor, [replace(TOUCH, start=0.0, end=1.0)], rate_hz=200, duration=0.5, model="ladder")
    touched = list(skin.frames())[-1][1][6:18]
    for n in range(round(seconds * rate)):
        time = n / rate
        exact = np.array((touched if any(a <= time < b for a, b in touches) else still)[:9], float)
        exact[2::3] += offset_at(time)
        counts = np.clip(np.rint(exact + chance.normal(0.0, 0.7, 9)), 0, parts.full_count).astype(int).tolist()
        frame = Frame(36, 0, 0, 0, n, round(1e6 * time), *counts, *still[9:])
        faults += [event.fault for event in detector.feed(frame, time) if isinstance(event, SkinFault)]
    return faults, detector


@pytest.mark.parametrize("millivolts", [0.01, 0.015, 0.03])
def test_an_offset_that_parts_may_have_is_no_leak_of_a_low_ring(millivolts):
    """Its touch current is small: a zero may rest less far off than a count of 12 bits, which here is 16."""
    ring = Sensor(Frustum(0.06, 0.06, 0.02, math.radians(350.0)))
    faults, _, ready, _ = play(ring, millivolts, touches=())
    assert faults == []
    assert ready < 0.5


@pytest.mark.parametrize("rate", [-0.8, 0.8])
@pytest.mark.long
def test_learned_currents_go_with_a_zero_that_creeps(rate):
    """After a touch of seconds it is off by counts, and the small current of a slender sheet was called changed."""
    plain = Sensor(Frustum(0.02, 0.02, 0.6, math.radians(340)))
    full = plain.electronics.current_full_scale
    slender = replace(plain, electronics=replace(plain.electronics, current_zero=0.0125 * full))
    faults, detector = run(lambda t: rate * max(0.0, t - 1.0), 24.0, 200, slender, [(4.0, 10.0), (15.0, 20.0)])
    assert faults == []
    assert detector.ready
    counts = expected_counts(slender)
    left = 51.0 + rate * 23.0 - detector._zero.counts  # of the zero, in the currents of every frame
    for learned, at in ((detector._currents.means[1], 5), (detector._currents.means[2], 8)):
        assert learned * counts[9] == pytest.approx(counts[at] - 51.0 + left, abs=1.0)


@pytest.mark.parametrize(
    ("radial", "angular", "named"),
    [
        (0.98, 1.0, "the upper sheet, or its bond to A or B: radial -2.00 %, angular +0.00 %"),
        (1.001, 1.02, "the lower sheet, or its bond to C or D: radial +0.10 %, angular +2.00 %"),
        (0.97, 0.982, "the gain of the current, or both sheets: radial -3.00 %, angular -1.80 %"),
        (0.988, 0.993, "the gain of the current, or both sheets: radial -1.20 %, angular -0.70 %"),
        (0.97, 1.02, "the gain of the current, or both sheets: radial -3.00 %, angular +2.00 %"),
    ],
)
def test_which_sheet_has_changed_is_named(radial, angular, named):
    """An electrode of which a fifth has peeled off takes 1.5 % of one current; the other one stays."""
    currents, (frame,), found = UntouchedCurrents(PLAIN, 1e-4), frames(0, 1), None
    frame = frame._replace(radial_current=10_000, angular_current=10_000)  # so many that no rounding shows
    for n in range(20 * CURRENT_BLOCK):
        now = frame._replace(radial_current=round(1e4 * radial), angular_current=round(1e4 * angular))
        found = currents.feed(frame if n < 16 * CURRENT_BLOCK else now, 0.005) or found
    assert found == (Fault.CURRENT_CHANGED, named)


@pytest.mark.parametrize(("hertz", "rate"), [(3.0, 500), (5.0, 1000), (10.0, 100)])
def test_a_zero_that_swings_is_not_followed(hertz, rate):
    """Not even while nobody relies on it: the currents were learned anew with each swing, and never known."""
    zero, (frame,) = UntouchedZero(PLAIN), frames(20, 1)
    found = []
    for n in range(12 * rate):
        hum = round(20.0 + 8.0 * math.cos(2.0 * math.pi * hertz * n / rate))
        found.append(zero.feed(frame._replace(touch_current=hum), 1.0 / rate, free=True))
    assert sum(found) == 1  # the first block
    assert zero.counts == pytest.approx(20, abs=3)


def test_one_frame_of_a_sensor_without_noise_is_a_contact_that_changes():
    """Its zero has stood at 0 in every frame, which says nothing of it. Four in a row are no contact any more."""
    detector, faults, skin = (
        Detector(PLAIN),
        [],
        VirtualSkin(
            PLAIN, [TOUCH], rate_hz=200, imperfections=Imperfections(noise_counts=0.0), model="ladder", duration=1.6
        ),
    )
    for n, (time, frame) in enumerate(skin.frames()):
        if n == 200 or 240 <= n < 246:
            frame = frame._replace(touch_current=frame.touch_current - 90)
        faults += [(n, event.fault) for event in detector.feed(frame, time) if isinstance(event, SkinFault)]
    assert faults == [(243, Fault.ZERO)]


def test_the_monitor_expects_the_bias_where_no_current_flows():
    expected = dict(zip(MEASURED, expected_counts(BIASED), strict=True))
    plain = dict(zip(MEASURED, expected_counts(PLAIN), strict=True))
    assert expected["touch_current"] == 51
    assert plain["touch_current"] == 0
    assert expected["radial_current"] - plain["radial_current"] == pytest.approx(51, abs=1)


@pytest.mark.parametrize(
    ("dead", "cause"), [("r", "radial_current_zero"), ("a", "angular_current_zero"), ("ra", "currents_zero")]
)
@pytest.mark.parametrize("bias", [0, 51])
def test_a_drive_without_a_current_is_named_beside_a_bias(dead, cause, bias):
    """It read 51 counts where 428 were expected, and the shunt and the sheets' resistance were to be checked."""
    chance, seen = random.Random(1), []
    for n in range(64):
        counts = list(expected_counts(BIASED if bias else PLAIN))
        for at, name in ((5, "r"), (8, "a")):
            counts[at] = bias if name in dead else counts[at]
        for at in (2, 5, 8):
            counts[at] = max(0, counts[at] + chance.choice((-1, 0, 1)))
        seen.append(Frame(36, 0, 0, 0, n, 1000 * n, *counts))
    for sensor in (BIASED if bias else PLAIN, None):
        found = find_wrong_measurements(seen, sensor)
        assert found is not None
        assert found.item == cause
        assert ("as without a current" in found.value) == bool(bias)


def test_full_scale_stays_full_scale():
    zero = UntouchedZero(BIASED)
    frame = frames(zero.counts, 1)[0]._replace(radial_current=4095, angular_current=2000)
    after = zero.take_off(frame)
    assert (after.touch_current, after.radial_current, after.angular_current) == (0, 4095, 2000 - zero.nominal)


@pytest.mark.parametrize(("more", "told"), [(2, False), (-2, False), (5, True)])
def test_two_counts_of_a_small_current_are_no_peel(more, told):
    """The zeros of two days may differ by as much, which is 1.8 % of so few counts."""
    full_scale = PLAIN.radial_amperes * PLAIN.electronics.full_count / 110.0
    coarse = replace(PLAIN, electronics=replace(PLAIN.electronics, current_full_scale=full_scale))
    (frame,) = frames(0, 1)

    def learn(sensor, radial):
        currents = UntouchedCurrents(sensor, 1e-4)
        now = frame._replace(radial_current=radial, angular_current=110)
        return currents, [currents.feed(now, 0.005) for _ in range(CURRENT_BLOCK)][-1]

    then, _ = learn(coarse, 110)
    _, fault = learn(replace(coarse, known_ohms=coarse.sheet_ohms(*then.sheets())), 110 + more)
    assert (fault is not None and fault[0] is Fault.CURRENT_CHANGED) is told
