"""Timeline of runs: what lies in its stretch of time, and nothing else."""

from dataclasses import replace

from coneskin.robot.guard.signals.journal import EventName
from coneskin.view.panel import timeline
from coneskin.view.run_course import read_courses
from tests.support.paths import COLLISION

RUN = COLLISION
TICK = 'width="3"'


def test_ticks_stand_where_touches_are_in_the_stretch_that_is_shown() -> None:
    (course,) = read_courses([RUN])
    contact = next(event for event in course.history.events if event.name == EventName.CONTACT)
    at = contact.time - course.zero
    drawn = timeline([course], at - 1.0, at + 1.0)
    assert 'x="498.50" y="0.0" width="3"' in drawn
    assert TICK not in timeline([course], at - 2.0, at - 1.0)


def test_the_newest_touches_of_a_long_run_are_drawn_and_not_the_oldest() -> None:
    """A page that stays open had 400 ticks of minutes ago."""
    (course,) = read_courses([RUN])
    contact = next(event for event in course.history.events if event.name == EventName.CONTACT)
    course.history.events[:] = [contact._replace(time=course.zero + number) for number in range(1000)]
    long = replace(course)
    assert timeline([long], 980.0, 1000.0).count(TICK) == 20
    assert timeline([long], 0.0, 1000.0).count(TICK) == 400
