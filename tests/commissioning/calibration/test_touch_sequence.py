"""The touch sequence in virtual time: what a person does, what the skin reads, what comes of it."""

import math
import random
from collections.abc import Callable

import pytest

from coneskin.commissioning.calibration.calibrate import _calibration_marks
from coneskin.commissioning.calibration.touches import SensorTouches, TouchSequence
from coneskin.commissioning.misreadings import Place
from coneskin.commissioning.touching import Notice, Touching
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.frame.reading import TouchReading
from coneskin.skin.sensor import Sensor

STEP = 0.01  # s
ONE = Sensor(Frustum(0.0376, 0.0372, 0.26), name="one")
TWO = Sensor(Frustum(0.03, 0.03, 0.1), sensor_id=1, name="two")


class Person:
    """A person who touches what is asked for; the skin reads it in some way, with noise."""

    def __init__(self, sensors: list[Sensor], count: int, reads: Callable[[int, Place], Place]) -> None:
        self.sequence = TouchSequence([SensorTouches(one, _calibration_marks(one, count)) for one in sensors], 0.3e-3)
        self.touching = Touching(self.sequence)
        self.reads, self.rng = reads, random.Random(1)
        self.now, self.touches = 100.0, 0
        self.notices: list[Notice] = []

    def let(self, seconds: float, *, valid: bool = True, noise: float = 0.05e-3, **places: Place) -> None:
        """Let time pass while sensors are touched at places."""
        for _ in range(round(seconds / STEP)):
            self.now += STEP
            seen = {
                name: TouchReading(self.now, 0.7, u + self.rng.gauss(0.0, noise), phi, valid, "", 0, 0)
                for name, (u, phi) in places.items()
            }
            names = [item.sensor.name for item in self.sequence.sensors]
            self.notices += self.touching.update(self.now, {name: seen.get(name) for name in names})

    def touch(self, seconds: float = 0.6, noise: float = 0.05e-3) -> None:
        """Touch the mark that is asked for."""
        assert self.sequence.mark is not None
        place = self.reads(self.touches, self.sequence.mark.place)
        self.touches += 1
        self.let(seconds, noise=noise, **{self.sequence.current.sensor.name: place})
        self.let(0.2)

    def carry_out(self) -> None:
        self.let(0.2)
        while not self.sequence.over:
            self.touch()

    @property
    def kinds(self) -> list[str]:
        return [notice.kind for notice in self.notices]


def plainly(_: int, place: Place) -> Place:
    return place


def test_each_mark_of_each_sensor_is_touched_once() -> None:
    person = Person([ONE, TWO], 9, plainly)
    person.carry_out()
    assert person.kinds == ["mark", "read"] * 18
    for item in person.sequence.sensors:
        assert [touch.mark for touch in item.touches] == [mark.place for mark in item.marks]
        assert item.valid == list(range(9))
        for touch in item.touches:
            assert touch.read == pytest.approx(touch.mark, abs=0.1e-3)


def test_the_words_of_a_mark_hold_on_any_layer() -> None:
    first, *_, last = _calibration_marks(TWO, 9)
    assert first.where.startswith(
        "10.0 mm from electrode B (end 1) along the side, which is 10 % of the way to A, and 10 %"
    )
    assert (last.u, last.phi) == pytest.approx((0.09, 0.9 * math.tau))


def test_a_touch_is_read_only_once_its_mean_is_good() -> None:
    person = Person([ONE], 9, plainly)
    person.let(0.2)
    assert person.sequence.mark is not None
    person.let(0.2, one=person.sequence.mark.place)
    person.let(0.2)
    assert person.kinds == ["mark", "remark"]  # too short
    person.let(3.5, noise=1.5e-3, one=person.sequence.mark.place)
    assert person.kinds == ["mark", "remark", "remark"]  # it does not rest
    assert "does not rest" in person.notices[-1].text
    person.let(1.5, one=person.sequence.mark.place)
    assert person.kinds[-1] == "read"


def test_a_place_that_creeps_is_not_read() -> None:
    person = Person([ONE], 9, plainly)
    person.let(0.2)
    for k in range(30):
        person.let(0.05, noise=0.0, one=Place(0.03 + 0.1e-3 * k, 1.0))
    assert person.kinds == ["mark"]


def test_an_uncertain_place_and_two_touches_are_not_read() -> None:
    person = Person([ONE, TWO], 4, plainly)
    person.let(0.2)
    person.let(3.5, valid=False, one=Place(0.1, 1.0))
    assert "not certain" in person.notices[-1].text
    person.let(0.2)
    person.let(3.5, one=Place(0.1, 1.0), two=Place(0.05, 1.0))
    assert "touched now: one, two" in person.notices[-1].text
    person.let(0.2)
    person.let(3.5, two=Place(0.05, 1.0))
    assert person.notices[-1].text == "touched now: two; touch one only, at one place"
    assert "read" not in person.kinds


def test_a_touch_beside_its_mark_is_asked_for_once_more() -> None:
    person = Person([ONE], 9, lambda number, place: Place(place.u + (0.01 if number == 4 else 0.0), place.phi))
    person.carry_out()
    (item,) = person.sequence.sensors
    assert person.kinds == [*["mark", "read"] * 9, "remark", "again", "read"]
    assert len(item.touches) == 10
    assert item.repeated == {4}
    assert item.touches[9].mark == item.touches[4].mark
    assert item.valid == [0, 1, 2, 3, 5, 6, 7, 8, 9]


def test_a_mark_out_of_reach_is_left_out_until_too_few_are_left() -> None:
    person = Person([ONE], 9, plainly)
    person.let(0.2)
    for _ in range(5):
        person.notices += person.touching.refuse()
    assert not person.sequence.incomplete
    person.notices += person.touching.refuse()
    assert "fewer than 4 marks are left" in person.sequence.incomplete
    assert person.kinds == [*["mark"] * 6, "failed"]
