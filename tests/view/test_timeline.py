"""Timeline of runs: what lies in its stretch of time, and nothing else."""

from dataclasses import replace

from coneskin.robot.guard.signals.journal import EventName
from coneskin.view.strand import read_strands
from coneskin.view.timeline import timeline
from tests.support.paths import COLLISION

RUN = COLLISION
TICK = 'width="3"'


def test_ticks_stand_where_touches_are_in_the_stretch_that_is_shown() -> None:
    (strand,) = read_strands([RUN])
    contact = next(event for event in strand.history.events if event.name == EventName.CONTACT)
    at = contact.time - strand.zero
    drawn = timeline([strand], at - 1.0, at + 1.0)
    assert 'x="498.50" y="0.0" width="3"' in drawn
    assert TICK not in timeline([strand], at - 2.0, at - 1.0)


def test_the_newest_touches_of_a_long_run_are_drawn_and_not_the_oldest() -> None:
    """A page that stays open had 400 ticks of minutes ago."""
    (strand,) = read_strands([RUN])
    contact = next(event for event in strand.history.events if event.name == EventName.CONTACT)
    strand.history.events[:] = [contact._replace(time=strand.zero + number) for number in range(1000)]
    long = replace(strand)
    assert timeline([long], 980.0, 1000.0).count(TICK) == 20
    assert timeline([long], 0.0, 1000.0).count(TICK) == 400
