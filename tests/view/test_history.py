"""History of a run: what is shown at a time is what was recorded then."""

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
import pytest

from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.protocol import load_driver
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent
from coneskin.runs.replay.run import read_run
from coneskin.view.panel import _envelope, _plots, event_list, state_of, status, timeline
from coneskin.view.run_course import (
    FADING,
    UNKNOWN,
    History,
    PhaseWords,
    RunCourse,
    _ContactLog,
    _phase_after,
    read_courses,
)
from tests.support.paths import COLLISION

RUN = COLLISION


@pytest.fixture(scope="module")
def course() -> RunCourse:
    return read_courses([RUN])[0]


def event(course: RunCourse, name: str) -> GuardEvent:
    return next(item for item in course.history.events if item.name == name)


def test_the_arm_stands_where_the_controller_measured_it(course: RunCourse) -> None:
    run = read_run(RUN)
    blocks = list(run.select(kinds=frozenset({BlockKind.ARM})))
    decode = load_driver(arm_model("UR5e").driver).decode_state
    for block in blocks[:: len(blocks) // 7]:
        assert course.history.q(block.time) == decode(block.time, block.payload).q
    between = 0.5 * (blocks[10].time + blocks[11].time)
    assert course.history.q(between) == decode(blocks[10].time, blocks[10].payload).q


def test_the_sheet_is_touched_while_the_touch_lasts(course: RunCourse) -> None:
    (sheet,) = course.stage.sheets
    began = event(course, EventName.CONTACT)
    assert course.history.level(sheet.name, began.time - 0.05) < sheet.touch_level
    assert course.history.level(sheet.name, began.time + 0.01) > sheet.touch_level


def test_the_mark_is_where_the_touch_was_read_and_stays_while_it_holds_the_arm(course: RunCourse) -> None:
    began, located = event(course, EventName.CONTACT), event(course, EventName.CONTACT_LOCATED)
    assert course.history.contacts.marks(began.time - 0.001) == []
    (mark,) = course.history.contacts.marks(located.time)
    assert list(mark.point) == located.details["point"]
    assert list(mark.normal) == located.details["normal"]
    assert mark.located
    assert mark.strength == 1.0
    over = event(course, EventName.TOUCH_ENDED).time
    assert course.history.contacts.marks(over + 100.0 * FADING)[0].strength == 1.0, "it holds the arm"


def touch(name: EventName, time: float, number: int = 1, **details: object) -> GuardEvent:
    place = {"point": [0.1, 0.0, 0.0], "normal": [1.0, 0.0, 0.0], "sensor": "s", "level": 0.3, "location_valid": False}
    return GuardEvent(name, time, {"number": number, **place, **details})


def fed(events: Iterable[GuardEvent]) -> _ContactLog:
    log = _ContactLog()
    for one in events:
        log.feed(one)
    return log


def test_a_touch_that_is_over_fades() -> None:
    ended = GuardEvent(EventName.TOUCH_ENDED, 2.0, {"sensor": "s"})  # as the guard tells it: one touch on a sensor
    log = fed([touch(EventName.CONTACT, 1.0), touch(EventName.CONTACT, 1.5, 2, sensor="t"), ended])
    assert [(mark.sensor, mark.strength) for mark in log.marks(2.0 + FADING)] == [("t", 1.0)]
    log = fed([touch(EventName.CONTACT, 1.0), ended, GuardEvent(ended.name, 3.0, ended.details)])
    assert [mark.strength for mark in log.marks(2.0)] == [1.0]
    assert log.marks(2.0 + 0.5 * FADING)[0].strength == pytest.approx(0.5)
    assert log.marks(2.0 + FADING) == []


@pytest.mark.parametrize("point", [None, [1.0, 2.0], [1.0, 2.0, "x"], [1e300, 0.0, 0.0], [math.nan, 0.0, 0.0], "abc"])
def test_a_place_that_is_nonsense_has_no_mark(point: object) -> None:
    assert fed([touch(EventName.CONTACT, 1.0, point=point)]).marks(1.0) == []


def test_a_page_that_stays_open_forgets_touches() -> None:
    log = fed(touch(EventName.CONTACT, float(k), number=k) for k in range(2000))
    assert len(log.marks(1e9)) == 400


def test_the_phases_are_those_of_the_guard(course: RunCourse) -> None:
    words = [change.phase.text for change in course.history.phases]
    assert words[0] == UNKNOWN.text
    assert [words.index(text) for text in ("active", "stopping", "latched: stands until a manual reset")]
    order = [words.index(text) for text in ("active", "stopping", "moving away from the touch")]
    assert order == sorted(order)
    latched = event(course, EventName.LATCHED)
    assert course.history.phase(latched.time).text.startswith("latched")
    assert not course.history.phase(latched.time - 1e-3).text.startswith("latched")


def test_a_latched_arm_that_is_measured_standing_again_stays_latched() -> None:
    latched = _phase_after(UNKNOWN, EventName.LATCHED)
    assert _phase_after(latched, EventName.STANDSTILL) == latched
    assert _phase_after(latched, EventName.WAITING) == latched
    assert _phase_after(latched, EventName.ACTIVATED).text == "active"


@pytest.mark.long
def test_a_page_that_follows_does_not_grow(course: RunCourse) -> None:
    run = read_run(RUN)
    blocks = list(run.select(kinds=frozenset({BlockKind.SKIN, BlockKind.ARM})))
    length = blocks[-1].time - blocks[0].time
    history = History(run.scene(), keep=1.0)
    sizes = []
    for turn in range(30):  # more than a few rounds of what is dropped together
        history.feed_all(block._replace(time=block.time + turn * length) for block in blocks)
        sizes.append(len(history.joints.times) + sum(len(series.times) for series in history.levels.values()))
        assert history.until - history.since <= 1.5
    assert max(sizes[15:]) <= 1.05 * max(sizes[:15])


def test_what_a_recording_says_is_never_taken_for_html() -> None:
    evil = '<img src=x onerror="alert(1)">'
    course = read_courses([RUN])[0]
    fault = GuardEvent(EventName.FAULT, 0.0, {"what": evil})
    course.history.events[:] = [fault]
    run = [(evil, PhaseWords(evil, "active"), state_of(course, 1.0))]
    for text in (status(run * 2), state_of(course, 1.0), event_list([(fault, evil)], 0)):
        assert "<img" not in text
        assert "&lt;img" in text


def test_traces_keep_the_peak(course: RunCourse) -> None:
    since, until = course.span
    plots = _plots([course])
    assert list(plots) == ["touch level", "joint speed [rad/s]", "channels of forearm skin"]
    ((_, series, column, zero),) = plots["touch level"]
    edges = np.linspace(since, until, 241)
    found = _envelope(series, column, zero, edges)
    levels = [value for (value,) in series.values]
    assert np.nanmax(found) == max(levels)
    peak = series.times[int(np.argmax(levels))] - zero
    assert edges[np.nanargmax(found) // 2] - 1e-9 <= peak <= edges[np.nanargmax(found) // 2 + 1] + 1e-9
    assert len(plots["channels of forearm skin"]) == 6


def test_the_timeline_has_a_band_for_each_phase(course: RunCourse) -> None:
    drawn = timeline([course], *course.span)
    phases = course.history.phases
    lasting = [change for change, after in pairwise(phases[1:]) if after.time > change.time]
    assert len(lasting) >= 4
    for change in lasting:
        assert f"<title>{change.phase.text}</title>" in drawn


def test_two_runs_are_laid_side_by_side_by_their_first_touch() -> None:
    first, second = read_courses([RUN, RUN])
    assert first.offset[1] == -second.offset[1] != 0.0
    assert event(first, EventName.CONTACT).time == first.zero
    assert [name for name, *_ in _plots([first, second])["touch level"]] == [
        "run 1: forearm skin",
        "run 2: forearm skin",
    ]
