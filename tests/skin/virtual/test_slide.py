"""Touch that slides over a virtual skin: its way, how it is typed, and what the decode says of its velocity."""

import math

import pytest

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.events import TouchEvent, TouchMoved
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.virtual.typed_script import TOUCH_SHAPES, parse_press

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
    skins = [VirtualSkin(SENSOR, [SLIDE], model="ladder", seed=2, duration=0.6) for _ in range(2)]
    whole, short = ([frame for _, frame in skin.frames()] for skin in skins)
    skins[0].release(0.5)
    early = [frame for _, frame in skins[0].frames()]
    assert early[:500] == whole[:500] == short[:500]
    assert early[599].touch_c < 10 < 300 < whole[599].touch_c


@pytest.mark.parametrize(
    ("slide_u", "slide_phi", "expected"),
    [(0.2, 0.0, (0.2, 0.0)), (-0.05, 1.0, (-0.05, 0.054)), (0.0, -0.9, (0.0, -0.0486))],
)
@pytest.mark.long
def test_the_decode_reads_where_it_is_and_how_fast_it_moves(slide_u, slide_phi, expected):
    touch = ScriptedTouch(0.05, 1.05, 0.15, 2.0, slide_u=slide_u, slide_phi=slide_phi)
    moved = [e for e in touched(VirtualSkin(SENSOR, [touch], seed=1, duration=1.0)) if isinstance(e, TouchMoved)]
    steady = [event for event in moved if 0.4 < event.time < 1.0 and event.location_valid]
    assert len(steady) > 10
    for event in steady:
        u, phi = touch.place_at(event.time)
        # 1 mm of the steps in which it slides, and 2 mm of the decode
        assert math.hypot(event.u - u, 0.054 * (event.phi - phi)) < 3e-3
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
    assert parse_press("1:3:100..300:90") == ("finger", ScriptedTouch(1.0, 3.0, 0.1, math.pi / 2, slide_u=0.2))
    shape, touch = parse_press("grip:1:3:300..100:90..45:7@2")
    assert (shape, touch.force, touch.sensor) == ("grip", 7.0, "2")
    assert touch.place_at(3.0) == pytest.approx((0.1, math.pi / 4))
    for text in ("1:3:100..:90", "1:3:..100:90", "1:3:100..200..300:90", "1:3:100...200:90", "1..2:3:100:90"):
        with pytest.raises(SensorError, match=r"a touch must be START_S.*; where it slides, .* is FROM\.\.TO"):
            parse_press(text)
    with pytest.raises(SensorError, match="must have an end"):
        parse_press("1:inf:100..200:90")


@pytest.mark.parametrize("shape", TOUCH_SHAPES)
def test_every_contact_of_a_shape_slides_the_same_way(shape):
    touch = ScriptedTouch(0.0, 1.0, 0.2, 1.0, slide_u=0.1, slide_phi=0.2)
    for contact in TOUCH_SHAPES[shape](SENSOR.frustum, touch):
        assert contact.place_at(1.0) == pytest.approx((contact.u + 0.1, contact.phi + 0.2))
