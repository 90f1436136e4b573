"""Touches of a script: they slide, grow, and press with more than a fingertip, through skin and detector."""

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import TouchEvent, TouchMoved
from coneskin.skin.detection.frame.reading import TouchReading
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual import scripted_touch
from coneskin.skin.virtual.command import _parse_press
from coneskin.skin.virtual.imperfections import ContactLaw, Foam, Imperfections
from coneskin.skin.virtual.scripted_touch import TOUCH_SHAPES, ScriptedTouch, across_seam
from coneskin.skin.virtual.skin import VirtualSkin

SENSOR = Sensor(Frustum(0.054, 0.054, 0.434))
SLIDE = ScriptedTouch(0.05, 1.05, 0.1, 1.0, slide_u=0.2, slide_phi=1.0)
PERIOD = 1e-3  # s


def touched(skin: VirtualSkin) -> list[TouchEvent]:
    stream = TouchStream(list(skin.sensors))
    events = [event for time, data in skin.packets() for event in stream.feed(data, time)]
    return [event for event in events if isinstance(event, TouchEvent)]


def test_the_way_is_straight_and_even_and_stays_where_it_ends():
    assert SLIDE.place_at(0.0) == (0.1, 1.0)
    assert SLIDE.place_at(0.3) == pytest.approx((0.15, 1.25))
    assert SLIDE.place_at(1.05) == SLIDE.place_at(2.0) == pytest.approx((0.3, 2.0))
    assert ScriptedTouch(0.0, math.inf, 0.1, 1.0).place_at(9.0) == (0.1, 1.0)


def test_a_slide_that_is_let_go_early_keeps_the_way_it_has_come():
    skins = [VirtualSkin(SENSOR, [SLIDE], model="ladder", seed=2, duration=0.25) for _ in range(2)]
    whole, short = ([frame for _, frame in skin.frames()] for skin in skins)
    skins[0].release(0.15)
    early = [frame for _, frame in skins[0].frames()]
    assert early[:150] == whole[:150] == short[:150]
    assert early[249].touch_c < 10 < 300 < whole[249].touch_c


@pytest.mark.parametrize(
    ("slide_u", "slide_phi", "expected"),
    [(0.2, 0.0, (0.2, 0.0)), (-0.05, 1.0, (-0.05, 0.054)), (0.0, -0.9, (0.0, -0.0486))],
)
@pytest.mark.long
def test_the_decode_reads_where_it_is_and_how_fast_it_moves(slide_u, slide_phi, expected, monkeypatch):
    """In fine steps, as a finger slides: each of a millimetre is a jump, after which no velocity is told."""
    monkeypatch.setattr(scripted_touch, "_SLIDE_STEP", 1e-4)
    touch = ScriptedTouch(0.05, 1.05, 0.15, 2.0, slide_u=slide_u, slide_phi=slide_phi)
    moved = [e for e in touched(VirtualSkin(SENSOR, [touch], seed=1, duration=1.0)) if isinstance(e, TouchMoved)]
    steady = [event for event in moved if 0.4 < event.time < 1.0 and event.location_valid]
    assert len(steady) > 10
    for event in steady:
        u, phi = touch.place_at(event.time)
        # 0.1 mm of the steps in which it slides, and 2 mm of the decode
        assert math.hypot(event.u - u, 0.054 * (event.phi - phi)) < 2.1e-3
    along = sum(event.velocity[0] for event in steady) / len(steady)
    around = sum(event.velocity[1] for event in steady) / len(steady)
    assert (along, around) == (pytest.approx(expected[0], abs=0.01), pytest.approx(expected[1], abs=0.01))


def test_a_slide_must_end_on_the_sensor_and_may_end_at_its_corner():
    skin = VirtualSkin(SENSOR, [], model="ladder")
    with pytest.raises(SensorError, match=r"a touch must lie on sensor 0/0: .* got 0\.1 m and 7\.0 rad"):
        skin.touch(ScriptedTouch(0.0, 1.0, 0.1, 6.0, slide_phi=1.0))
    with pytest.raises(SensorError, match="got -0"):
        skin.touch(ScriptedTouch(0.0, 1.0, 0.1, 6.0, slide_u=-0.2))
    skin.touch(ScriptedTouch(0.0, 1.0, 0.1, 0.0, slide_u=0.434 - 0.1, slide_phi=2.0 * math.pi))  # to the very corner
    quiet = VirtualSkin(SENSOR, model="ladder", imperfections=Imperfections(noise_counts=0.0), duration=0.2)
    quiet.touch(ScriptedTouch(0.0, 0.1, 0.434, 0.0, slide_u=-0.434, slide_phi=2.0 * math.pi))
    assert len(list(quiet.frames())) == 200


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"end": math.inf}, "a touch that slides must have an end"),
        ({"slide_u": math.nan}, "slide_u and touch.slide_phi must be finite"),
        ({"slide_phi": math.inf}, "slide_u and touch.slide_phi must be finite"),
    ],
)
def test_a_slide_that_cannot_be(change, message):
    with pytest.raises(SensorError, match=message):
        ScriptedTouch(**{"start": 0.0, "end": 1.0, "u": 0.1, "phi": 1.0, "slide_u": 0.1, **change})


def test_it_is_typed_as_a_way():
    assert _parse_press("1:3:100..300:90") == ("finger", ScriptedTouch(1.0, 3.0, 0.1, math.pi / 2, slide_u=0.2))
    shape, touch = _parse_press("grip:1:3:300..100:90..45:7@2")
    assert (shape, touch.force, touch.sensor) == ("grip", 7.0, "2")
    assert touch.place_at(3.0) == pytest.approx((0.1, math.pi / 4))
    for text in ("1:3:100..:90", "1:3:..100:90", "1:3:100..200..300:90", "1:3:100...200:90", "1..2:3:100:90"):
        with pytest.raises(SensorError, match=r"a touch must be START_S.*; where it slides, .* is FROM\.\.TO"):
            _parse_press(text)
    with pytest.raises(SensorError, match="must have an end"):
        _parse_press("1:inf:100..200:90")


@pytest.mark.parametrize("shape", TOUCH_SHAPES)
def test_every_contact_of_a_shape_slides_the_same_way(shape):
    touch = ScriptedTouch(0.0, 1.0, 0.2, 1.0, slide_u=0.1, slide_phi=0.2)
    for contact in TOUCH_SHAPES[shape](SENSOR.frustum, touch):
        assert contact.place_at(1.0) == pytest.approx((contact.u + 0.1, contact.phi + 0.2))


FOREARM = Frustum(0.0375, 0.0375, 0.24, math.radians(350))
TURN = Frustum(0.0375, 0.0375, 0.24)
TOUCH = ScriptedTouch(0.12, 1.0, 0.12, 2.0, force=8.0)


def read(cone: Frustum, touches: Sequence[ScriptedTouch], end: float = 0.3) -> list[TouchReading]:
    """What a detector reads of each frame of the touches, at 1000 frames a second."""
    sensor = Sensor(cone)
    detector, found = Detector(sensor), []
    for time, frame in VirtualSkin(sensor, touches, duration=end).frames():
        detector.feed(frame, time)
        if detector.reading_now is not None:
            found.append(detector.reading_now)
    return found


def opposite(touch, **changes):
    """A press and another one on the other side of the link."""
    return [touch, replace(touch, phi=(touch.phi + math.pi) % (2.0 * math.pi), **changes)]


@pytest.mark.parametrize(
    "shape",
    [
        TOUCH_SHAPES["seam"](FOREARM, replace(TOUCH, phi=math.radians(20.0))),
        opposite(TOUCH, force=3.0),
        opposite(TOUCH, u=0.05),
        [replace(TOUCH, u=TOUCH.u + 0.02 * k, phi=TOUCH.phi + 0.8 * k) for k in (-1, 1)],
    ],
    ids=["palm", "uneven grip", "clamp", "fingers"],
)
@pytest.mark.long
def test_no_place_of_several_contacts_is_certain(shape):
    found = read(FOREARM, shape)
    assert len(found) > 120
    assert not any(reading.location_valid for reading in found)


def test_one_fingertip_is_certain():
    assert read(FOREARM, [TOUCH])[-1].location_valid


def test_a_body_over_the_gap_presses_both_sides():
    press = ScriptedTouch(0.12, 1.0, 0.12, 0.05, force=30.0)  # 1.9 mm from the edge, 11.7 mm in radius
    found = read(TURN, [press])
    places = [
        (reading.u, math.remainder(reading.phi - 0.05, 2.0 * math.pi)) for reading in found if reading.location_valid
    ]
    assert all(abs(u - 0.12) < 0.002 and abs(off) < math.radians(5.0) for u, off in places)  # one press, where it is
    farther = ScriptedTouch(0.12, 1.0, 0.12, 0.35, force=30.0)
    assert read(TURN, [farther])[-1].location_valid


def test_the_part_beyond_the_gap():
    assert across_seam(TURN, 0.1, 0.5, 0.01) is None
    assert across_seam(FOREARM, 0.1, 0.0, 0.006) is None  # the gap of 10 deg is 6.5 mm wide
    phi, share = across_seam(TURN, 0.1, 0.0, 0.01)
    assert share == pytest.approx(0.5)
    assert (2.0 * math.pi - phi) * 0.0375 == pytest.approx(4.0 * 0.01 / (3.0 * math.pi))  # centroid of a half disc
    phi, share = across_seam(TURN, 0.1, 2.0 * math.pi - 0.1, 0.01)
    assert 0.0 < phi < 0.1
    assert 0.0 < share < 0.5


def test_a_press_off_the_sensor_is_refused():
    with pytest.raises(SensorError, match=r"a touch must lie on sensor 0/0: .* got 0\.25"):
        VirtualSkin(Sensor(FOREARM), TOUCH_SHAPES["fingers"](FOREARM, replace(TOUCH, u=0.23)), model="ladder")
    with pytest.raises(SensorError, match=r"touch\.growth_time must be above 0 s"):
        ScriptedTouch(0.0, 1.0, 0.1, 1.0, grown_force=5.0)


def test_a_press_grows_evenly_and_its_level_with_it():
    press = ScriptedTouch(0.0, 2.0, 0.1, 1.0, force=2.0, grown_force=100.0, growth_time=1.0, rise=0.01)
    forces = [press.force_at(time) for time in (0.01, 0.51, 1.01, 1.5, 1.995, 2.0)]
    assert forces == pytest.approx([2.0, 51.0, 100.0, 100.0, 50.0, 0.0])
    assert press.firmest == 100.0
    growing = ScriptedTouch(0.12, 2.0, 0.1, 1.0, force=2.0, grown_force=100.0, growth_time=0.25)
    levels = [reading.level for reading in read(FOREARM, [growing], 0.4)]
    assert levels[30] + 0.03 < levels[-1]
    assert levels[30] < levels[90] < levels[-1]


def test_the_foam_under_a_growing_press_is_exact():
    """Against many small steps of constant force; from 0.75 s on the foam rests."""
    foam = Foam(relaxation_time=0.01)
    press = ScriptedTouch(0.0, 1.0, 0.1, 1.0, force=2.0, grown_force=50.0, growth_time=0.3, rise=0.05)
    state, step = 0.0, 2e-5
    for k in range(50_000):
        state = foam.advance(state, press.force_at((k + 0.5) * step), step)
        if k % 4987 == 0:
            time = (k + 1) * step
            assert press.seated_at(time, foam) == pytest.approx(foam.seated(state, press.force_at(time)), abs=2e-3)
    assert ContactLaw().touch(press.firmest).radius > ContactLaw().touch(press.force).radius
