"""Panel: the timeline of what lies in its stretch of time, the card of a stop, one entry a stop, colours."""

from dataclasses import replace
from itertools import combinations

import pytest

from coneskin.robot.guard.signals.journal import EventName, GuardEvent
from coneskin.view.panel import state_of, stop_entries, timeline
from coneskin.view.run_course import PHASE_COLOURS, RunCourse, read_courses
from coneskin.view.stage.level_scale import SHEET_COLOURS
from tests.support.eyes import EYES, contrast
from tests.support.paths import COLLISION

RUN = COLLISION
TICK = 'width="4"'


def test_ticks_stand_where_touches_are_in_the_stretch_that_is_shown() -> None:
    (course,) = read_courses([RUN])
    contact = next(event for event in course.history.events if event.name == EventName.CONTACT)
    at = contact.time - course.zero
    drawn = timeline([course], at - 1.0, at + 1.0)
    assert 'x="498.00" y="0.0" width="4"' in drawn
    assert TICK not in timeline([course], at - 2.0, at - 1.0)


def test_the_newest_touches_of_a_long_run_are_drawn_and_not_the_oldest() -> None:
    """A page that stays open had 400 ticks of minutes ago."""
    (course,) = read_courses([RUN])
    contact = next(event for event in course.history.events if event.name == EventName.CONTACT)
    course.history.events[:] = [contact._replace(time=course.zero + number) for number in range(1000)]
    long = replace(course)
    assert timeline([long], 980.0, 1000.0).count(TICK) == 20
    assert timeline([long], 0.0, 1000.0).count(TICK) == 400


@pytest.fixture
def course() -> RunCourse:
    return read_courses([RUN])[0]


def test_the_card_of_a_touch_stays_until_the_reset_and_says_what_the_guard_has_recorded(course: RunCourse) -> None:
    latched = next(event for event in course.history.events if event.name == EventName.LATCHED)
    card = state_of(course, latched.time + 600.0)
    for said in (
        "forearm skin (forearm)",
        "u = 130.0 mm, phi = 89.0 deg, +- 5.3 mm (95 %)",
        "<td>0.77 then</td>",
        "2.949 s",
    ):
        assert said in card
    assert "driver, stands after 107 ms" in card
    assert "retreated 19.5 mm: the distance is made" in card
    assert [mark.strength for mark in course.history.contacts.marks(latched.time + 600.0)] == [1.0]
    course.history.feed(GuardEvent(EventName.RESET, latched.time + 1.0, {}).block())
    assert state_of(course, latched.time + 1.1) == ""
    assert course.history.contacts.marks(latched.time + 6.0) == []
    assert "forearm skin" in state_of(course, latched.time + 0.9), "as it was before"


def test_a_stop_for_a_fault_says_one_cause_and_one_remedy(course: RunCourse) -> None:
    why = "skin: frames are late (50 ms late, skin_silence_ms = 20; a busy computer needs more)"
    told = [
        GuardEvent(EventName.ACTIVATED, 1.0, {"request": 0}),
        GuardEvent(EventName.FAULT, 2.0, {"what": why}),
        GuardEvent(EventName.STOPPING, 2.0, {"why": why, "stop": 1}),
        GuardEvent(EventName.STANDSTILL, 2.1, {"speed": 0.0, "paths": ["driver"]}),
        *(GuardEvent(EventName.FAULT, 2.2 + 0.1 * k, {"what": why.replace("50", f"{50 + k}")}) for k in range(4)),
        GuardEvent(EventName.FAULT, 2.8, {"what": "arm: nothing comes; look at its cable"}),
        GuardEvent(EventName.LATCHED, 2.9, {"why": why, "stop": 1}),
    ]
    lines = [line for _, line in stop_entries(told, 0.0)]
    assert [line.split()[2].strip(":;") for line in lines] == ["activated", "stop"]
    course.history.events[:] = told[2:]
    card = state_of(course, 3.0)
    assert card.count("frames are late (50 ms late, skin_silence_ms = 20)") == 1
    assert "<td>a busy computer needs more</td>" in card
    assert "<td>arm: nothing comes</td>" in card
    assert next(line for _, line in stop_entries(told[2:], 0.0)).count("late (") == 1


def test_a_stop_that_another_version_has_recorded_has_a_card_all_the_same(course: RunCourse) -> None:
    course.history.events[:] = [GuardEvent(EventName.STOPPING, 2.0, {"why": "<b>", "contact": {"number": "x"}})]
    assert "&lt;b&gt;" in state_of(course, 3.0)
    assert len(stop_entries(course.history.events, 0.0)) == 1


@pytest.mark.parametrize("eye", EYES)
def test_no_eye_mistakes_a_touched_sheet_or_a_stopped_arm(eye: str) -> None:
    assert contrast((0, 0, 0), (255, 255, 255), eye) == pytest.approx(21.0)
    phases = [tuple(bytes.fromhex(PHASE_COLOURS[kind][1:])) for kind in ("active", "moving", "stopped")]
    for pair in (*combinations(SHEET_COLOURS, 2), *combinations(phases, 2), (SHEET_COLOURS[1], (255, 255, 255))):
        assert contrast(*pair, eye) >= 3.0, pair


def test_a_message_that_comes_again_with_other_numbers_is_one_entry() -> None:
    said = [GuardEvent(EventName.MESSAGE, time, {"what": f"it waits (load {time})"}) for time in (9.4, 10.5, 11.6)]
    ((first, words),) = stop_entries(said, 0.0)
    assert first is said[0]
    assert words.endswith("it waits (load 9.4) (3 times)")
