"""A skin that gives places: what it says is what the detector sees, and its faults are faults."""

import math

import pytest

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.events import SkinFault, TouchBegan, TouchEnded
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Polarity, Sensor
from coneskin.skin.virtual.place_frames import PlaceFrames
from coneskin.skin.wire import Status

CYLINDER = Sensor(Frustum(0.054, 0.054, 0.434), 3, device_id=7)
CONE = Sensor(Frustum(0.038, 0.055, 0.2, math.radians(300)), polarity=Polarity("A", "D"))


def heard(sensor: Sensor, level: float, u: float, phi: float):  # type: ignore[no-untyped-def]
    """Events of 200 quiet frames, 300 touched ones, and 50 quiet ones."""
    frames = PlaceFrames(sensor, seed=4)
    stream = TouchStream([sensor], DetectorSettings(stuck_frames=200))
    events = []
    for number in range(550):
        touch = (level, u, phi) if 200 <= number < 500 else (0.0, 0.0, 0.0)
        events += stream.feed(frames.encode(1e-3 * number, *touch), 1e-3 * number)
        if number == 490:
            reading = stream.detectors[0].reading_now
    return events, reading


@pytest.mark.parametrize("sensor", [CYLINDER, CONE], ids=["cylinder", "cone"])
@pytest.mark.parametrize("level", [0.4, 0.8])
def test_a_place_arrives_where_it_was(sensor: Sensor, level: float) -> None:
    u, phi = 0.6 * sensor.frustum.slant, 0.4 * sensor.frustum.wrap
    events, reading = heard(sensor, level, u, phi)
    assert not [event for event in events if isinstance(event, SkinFault)]
    assert isinstance(events[0], TouchBegan)
    assert isinstance(events[-1], TouchEnded)
    assert reading.location_valid, reading.doubt
    assert math.hypot(reading.u - u, 0.05 * (reading.phi - phi)) < 0.003
    assert reading.level == pytest.approx(level, abs=0.05)


def test_a_fault_that_the_device_reports_is_one() -> None:
    frames, stream = PlaceFrames(CYLINDER), TouchStream([CYLINDER])
    events = []
    for number in range(200):
        events += stream.feed(
            frames.encode(1e-3 * number, status=Status.SELF_TEST if number == 150 else 0), 1e-3 * number
        )
    assert [event.fault for event in events if isinstance(event, SkinFault)] == [Fault.DEVICE]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0, 1.5), "a level must be from 0 to 1, got 1.5"),
        ((math.nan, 0.5), "the time of a frame must be finite"),
        ((0.0, 0.5, 9.0), "a contact must lie on"),
    ],
)
def test_what_cannot_be_is_refused(arguments: tuple[float, ...], message: str) -> None:
    with pytest.raises(SensorError, match=message):
        PlaceFrames(CYLINDER).encode(*arguments)
