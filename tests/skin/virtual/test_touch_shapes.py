"""Touches by more than a fingertip, and presses that grow, through skin and detector."""

import math
from collections.abc import Sequence

import pytest

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.frame.touch_reading import TouchReading
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.seam import across_seam
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.virtual.substrate import ContactLaw, Foam
from coneskin.skin.virtual.touch_shapes import clamp, fingers, grip, palm_over_seam

FOREARM = Frustum(0.0375, 0.0375, 0.24, math.radians(350))
TURN = Frustum(0.0375, 0.0375, 0.24)
TOUCH = ScriptedTouch(0.2, 1.0, 0.12, 2.0, force=8.0)


def read(cone: Frustum, touches: Sequence[ScriptedTouch], end: float = 0.5) -> list[TouchReading]:
    """What a detector reads of each frame of the touches, at 1000 frames a second."""
    sensor = Sensor(cone)
    detector, found = Detector(sensor), []
    for time, frame in VirtualSkin(sensor, touches, duration=end).frames():
        detector.feed(frame, time)
        if detector.reading_now is not None:
            found.append(detector.reading_now)
    return found


@pytest.mark.parametrize(
    "shape",
    [
        palm_over_seam(FOREARM, TOUCH, math.radians(20.0)),
        grip(FOREARM, TOUCH),
        grip(FOREARM, TOUCH, 3.0),
        clamp(FOREARM, TOUCH, 0.05),
        fingers(FOREARM, TOUCH, [(-0.02, -0.03), (0.02, 0.03)]),
    ],
    ids=["palm", "grip", "uneven grip", "clamp", "fingers"],
)
def test_no_place_of_several_contacts_is_certain(shape):
    found = read(FOREARM, shape)
    assert len(found) > 200
    assert not any(reading.location_valid for reading in found)


def test_one_fingertip_is_certain():
    assert read(FOREARM, [TOUCH])[-1].location_valid


def test_a_body_over_the_gap_presses_both_sides():
    press = ScriptedTouch(0.2, 1.0, 0.12, 0.05, force=30.0)  # 1.9 mm from the edge, 11.7 mm in radius
    found = read(TURN, [press])
    places = [
        (reading.u, math.remainder(reading.phi - 0.05, 2.0 * math.pi)) for reading in found if reading.location_valid
    ]
    assert all(abs(u - 0.12) < 0.002 and abs(off) < math.radians(5.0) for u, off in places)  # one press, where it is
    farther = ScriptedTouch(0.2, 1.0, 0.12, 0.35, force=30.0)
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
    with pytest.raises(SensorError, match="each press must lie on the sensor"):
        fingers(FOREARM, TOUCH, [(0.2, 0.0)])
    with pytest.raises(SensorError, match=r"touch\.growth_time must be above 0 s"):
        ScriptedTouch(0.0, 1.0, 0.1, 1.0, grown_force=5.0)


def test_a_press_grows_evenly_and_its_level_with_it():
    press = ScriptedTouch(0.0, 2.0, 0.1, 1.0, force=2.0, grown_force=100.0, growth_time=1.0, rise=0.01)
    forces = [press.force_at(time) for time in (0.01, 0.51, 1.01, 1.5, 1.995, 2.0)]
    assert forces == pytest.approx([2.0, 51.0, 100.0, 100.0, 50.0, 0.0])
    assert press.firmest == 100.0
    growing = ScriptedTouch(0.2, 2.0, 0.1, 1.0, force=2.0, grown_force=100.0, growth_time=0.5)
    levels = [reading.level for reading in read(FOREARM, [growing], 0.7)]
    assert levels[50] + 0.03 < levels[-1]
    assert levels[50] < levels[150] < levels[-1]


def test_the_foam_under_a_growing_press_is_exact():
    """Against many small steps of constant force."""
    foam = Foam()
    press = ScriptedTouch(0.0, 1.0, 0.1, 1.0, force=2.0, grown_force=50.0, growth_time=0.3, rise=0.05)
    state, step = 0.0, 1e-5
    for k in range(100_000):
        state = foam.advance(state, press.force_at((k + 0.5) * step), step)
        if k % 9973 == 0:
            time = (k + 1) * step
            assert press.seated_at(time, foam) == pytest.approx(foam.seated(state, press.force_at(time)), abs=2e-3)
    assert ContactLaw().touch(press.firmest).radius > ContactLaw().touch(press.force).radius
