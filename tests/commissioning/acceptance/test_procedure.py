"""The procedure in virtual time: what a person does, what the skin reads, what comes of it."""

import math
from collections.abc import Callable

import pytest

from coneskin.commissioning.acceptance.commission import prepare
from coneskin.commissioning.acceptance.procedure import Procedure
from coneskin.commissioning.misreadings import WRONG, Place, misread
from coneskin.commissioning.touching import Notice, Touching
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import Scene
from coneskin.skin.detection.frame.reading import TouchReading
from tests.support.scenes import START, forearm_scene

STEP = 0.01  # s
TWO = 'id = 2\nname = "two"\nradius1_mm = 37\nradius2_mm = 37\nheight_mm = 100\nxyz_mm = [0, 0, 300]\n'


def scene(two: bool = False) -> Scene:
    text = forearm_scene().replace("[[link.sensor]]", '[[link.sensor]]\nname = "one"')
    return parse_scene(text.replace("[source]", f"[[link.sensor]]\n{TWO}[source]") if two else text)


class Person:
    """A person who touches what is asked for; the skin reads it in some way."""

    def __init__(self, procedure: Procedure, reads: Callable[[Place], Place] = lambda place: place) -> None:
        self.procedure, self.reads, self.touching = procedure, reads, Touching(procedure)
        self.now, self.notices = 100.0, list[Notice]()

    def let(self, seconds: float, valid: bool = True, doubt: str = "", **places: Place) -> "Person":
        """Let time pass while sensors are touched at places."""
        for _ in range(round(seconds / STEP)):
            self.now += STEP
            seen = {name: TouchReading(self.now, 0.7, *place, valid, doubt, 0, 0) for name, place in places.items()}
            names = [item.sensor.name for item in self.procedure.sensors]
            self.notices += self.touching.update(self.now, {name: seen.get(name) for name in names})
        return self

    def touch(self, seconds: float = 0.5) -> "Person":
        """Touch the mark that is asked for."""
        assert self.procedure.mark is not None
        name = self.procedure.current.sensor.name
        return self.let(seconds, **{name: self.reads(self.procedure.mark.place)}).let(0.2)

    def carry_out(self) -> "Person":
        self.let(0.2)
        while not self.procedure.over:
            self.touch()
        return self

    @property
    def kinds(self) -> list[str]:
        return [notice.kind for notice in self.notices]


def person(two: bool = False, reads: Callable[[Place], Place] = lambda place: place) -> Person:
    return Person(prepare(scene(two), START), reads)


def test_a_right_skin_passes() -> None:
    done = person().carry_out()
    assert done.procedure.passed
    assert done.procedure.cause == ""
    assert done.kinds == ["mark", "passed"] * 5 + ["sensor"]
    assert done.notices[-1].text == "one has passed"
    (item,) = done.procedure.sensors
    assert [result.attempts for result in item.results] == [1] * 5
    assert all(result.passed and result.distance_mm == 0.0 for result in item.results)


@pytest.mark.promise("P13")
@pytest.mark.parametrize("wrong", WRONG, ids=lambda item: item.cause[:40])
def test_each_wrong_wiring_fails_with_its_cause(wrong) -> None:
    sensor = scene().sensors[0].sensor
    done = person(reads=lambda place: misread(sensor, wrong, place)).carry_out()
    assert done.procedure.over
    assert not done.procedure.passed
    assert done.procedure.cause == f"one: it reads as if {wrong.cause}"
    assert done.notices[-1].text == f"one has NOT passed: it reads as if {wrong.cause}"


@pytest.mark.parametrize(
    ("along", "around", "passes"),
    [
        (0.009, 0.0, True),
        (0.011, 0.0, False),  # within the tolerance of each mark, but all of them are off to the same side
        (0.0, 12.0, True),
        (0.0, -13.0, False),
        (0.0, 30.0, False),
        (0.0, 180.0, False),
        (-0.05, 0.0, False),
    ],
)
def test_a_sheet_at_another_place_fails(along: float, around: float, passes: bool) -> None:
    done = person(
        reads=lambda place: Place(place.u + along, (place.phi + math.radians(around)) % (2.0 * math.pi))
    ).carry_out()
    assert done.procedure.passed == passes
    assert passes or ("turned about" if around else "shifted along") in done.procedure.cause


def test_people_who_miss_by_a_little_to_all_sides_pass() -> None:
    misses = iter([(0.015, 0.0), (-0.015, 15.0), (0.0, -15.0), (0.012, 10.0), (-0.012, -10.0)])

    def reads(place: Place) -> Place:
        along, around = next(misses)
        return Place(place.u + along, place.phi + math.radians(around))

    assert person(reads=reads).carry_out().procedure.passed


def test_a_mark_that_was_missed_once_may_be_touched_once_more() -> None:
    someone = person().let(0.2)
    mark = someone.procedure.mark
    assert mark is not None
    someone.let(0.5, one=Place(mark.u, mark.phi + 1.0)).let(0.2)
    assert someone.kinds == ["mark", "remark", "again"]
    assert "from the mark" in someone.notices[1].text
    assert someone.procedure.mark == mark
    someone.carry_out()
    assert someone.procedure.passed
    assert someone.procedure.sensors[0].results[0].attempts == 2
    someone = person().let(0.2)
    for _ in range(2):
        someone.let(0.5, one=Place(mark.u, mark.phi + 1.0)).let(0.2)
    assert someone.kinds == ["mark", "remark", "again", "failed", "mark"]
    assert not someone.carry_out().procedure.passed, "right touches afterwards do not make up for it"


def test_a_touch_must_rest_be_certain_and_be_one() -> None:
    someone = person(two=True).let(0.2)
    mark = someone.procedure.mark
    assert mark is not None
    someone.let(0.2, one=mark.place).let(0.2)
    assert someone.kinds == ["mark", "remark"]
    assert "too short" in someone.notices[-1].text
    someone.let(3.0, valid=False, doubt="it presses too lightly", one=mark.place).let(0.2)
    assert someone.kinds == ["mark", "remark", "remark", "remark"]
    assert "it presses too lightly" in someone.notices[2].text
    someone.let(1.0, one=mark.place, two=Place(0.05, 1.0)).let(0.2)
    assert "touched at once" in someone.notices[4].text
    for step in range(10):  # a finger that slides
        someone.let(0.1, one=Place(mark.u + 0.01 * step, mark.phi))
    assert "passed" not in someone.kinds
    assert not any(item.results for item in someone.procedure.sensors)


def test_exchanged_numbers_of_two_sensors_are_named() -> None:
    someone = person(two=True).let(0.2)
    assert someone.procedure.mark is not None
    for _ in range(2):
        someone.let(1.0, two=Place(0.05, 1.0)).let(0.2)
    assert someone.kinds[:4] == ["mark", "remark", "again", "failed"]
    assert "two reads this touch" in someone.notices[3].text
    someone.carry_out()
    assert "one: two reads this touch" in someone.procedure.cause
    assert not someone.procedure.passed


def test_two_sensors_one_after_the_other() -> None:
    done = person(two=True).carry_out()
    assert done.procedure.passed
    assert done.kinds.count("passed") == 10
    assert done.kinds.count("sensor") == 2
    numbers = [notice.details["number"] for notice in done.notices if notice.kind == "mark"]
    assert numbers == list(range(1, 11))


def test_a_mark_out_of_reach_is_replaced_until_too_few_are_left() -> None:
    someone = person().let(0.2)
    refused = someone.procedure.mark
    someone.notices += someone.touching.refuse()
    assert someone.procedure.mark not in (None, refused)
    assert someone.kinds == ["mark", "mark"]
    assert someone.carry_out().procedure.passed
    someone = person().let(0.2)
    while not someone.procedure.incomplete:
        someone.touching.refuse()
    assert "cannot show every wrong wiring and mounting" in someone.procedure.incomplete
    assert not someone.procedure.passed
    assert someone.touching.update(someone.now, {"one": None}) == []


def test_it_waits_until_the_skin_is_let_go() -> None:
    someone = person()
    someone.let(1.0, one=Place(0.1, 1.0))
    assert someone.kinds == []
    someone.let(0.2)
    assert someone.kinds == ["mark"]
