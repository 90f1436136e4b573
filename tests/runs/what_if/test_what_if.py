"""Missed touches, false alarms and delays, counted by hand."""

import json
import math
import statistics
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from coneskin.core.errors import RecordingError
from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent
from coneskin.runs.cut import cut_run
from coneskin.runs.decisions import Decisions
from coneskin.runs.replay.run import Run, read_run
from coneskin.runs.what_if.what_if import (
    _judge,
    _judge_run,
    _read_labels,
    _recorded_labels,
    _score_detection,
    _TouchLabel,
    _true_touches,
)

SKIN = "forearm skin"
TOUCHED = 2.94  # s since the start of the recorded collision; it is seen 9 ms later


def told(run: Run, *facts: Any) -> Run:
    """Return the run with blocks that tell these facts."""
    blocks = [Block(BlockKind.TRUTH, run.start + 1.0, json.dumps(one).encode()) for one in facts]
    return replace(run, blocks=(*blocks, *run.blocks))


def touch(run: Run, start: float, end: float | None, sensor: str = SKIN) -> dict[str, Any]:
    return {"sensor": sensor, "start": run.start + start, "end": None if end is None else run.start + end}


def write(path: Path, run: Run) -> Path:
    with Recorder(path) as recorder:
        recorder.write(Block(BlockKind.HEADER, run.start, json.dumps(run.header).encode()), *run.blocks)
    return path


def test_touches_end_where_all_is_released_and_nothing_told_is_not_untouched(collision: Run) -> None:
    assert _true_touches(collision) is None
    assert _true_touches(told(collision, {"touches": []})) == []
    touches = [touch(collision, 1.0, 2.0), touch(collision, 3.0, None), touch(collision, 9.0, None, "b")]
    found = _true_touches(told(collision, {"touches": touches}, {"released": collision.start + 4.0}))
    assert found is not None
    assert [(one.sensor, pytest.approx(one.start), pytest.approx(one.end)) for one in found] == [
        (SKIN, 1.0, 2.0),
        (SKIN, 3.0, 4.0),
        ("b", 9.0, math.inf),
    ]


def test_what_bodies_press_is_told_twice_counts_once_and_is_not_taken_off(collision: Run) -> None:
    begun, over = touch(collision, 3.0, None), touch(collision, 3.0, 5.0)
    resting, script = touch(collision, 6.0, None, "b"), touch(collision, 3.5, None, "c")
    facts = ({"pressed": []}, {"pressed": [begun]}, {"touches": [script]}, {"pressed": [over, resting]})
    found = _true_touches(told(collision, *facts, {"released": collision.start + 6.5}))
    assert found is not None
    assert [(one.sensor, pytest.approx(one.start), pytest.approx(one.end)) for one in found] == [
        (SKIN, 3.0, 5.0),
        ("c", 3.5, 6.5),
        ("b", 6.0, math.inf),
    ]


HUGE, SKINS = 10**400, {"sensor": SKIN}
DAMAGED = [
    *([], {}, {"toches": []}, {"contact_force_N": -3}, {"contact_force_N": HUGE}, {"touches": 5}),
    *({"pressed": [{}]}, {"touches": [{}]}, {"released": "now"}, {"released": math.nan}, {"released": HUGE}),
    *({"touches": [SKINS | {"start": start, "end": 2.0}]} for start in (3.0, HUGE, math.nan, "1", True)),
    *({"pressed": [SKINS | {"start": 1.0, "end": end}]} for end in (0.5, math.nan, "2")),
]


@pytest.mark.parametrize("facts", DAMAGED, ids=range(len(DAMAGED)))
@pytest.mark.long
def test_a_damaged_word_about_touches_is_refused(collision: Run, facts: Any) -> None:
    with pytest.raises(RecordingError, match="does not say what touched the skin"):
        _true_touches(told(collision, facts))


def test_words_about_touches_that_are_nested_without_end_are_refused(collision: Run) -> None:
    block = Block(BlockKind.TRUTH, collision.start + 1.0, b'{"touches":' + b"[" * 100_000)
    with pytest.raises(RecordingError, match="nested too deep"):
        _true_touches(replace(collision, blocks=(block, *collision.blocks)))


def judged(path: Path, run: Run, touches: Sequence[dict[str, Any]]) -> dict[str, Any]:
    (row,) = _judge_run(write(path, told(run, {"touches": list(touches)})))
    return row


@pytest.mark.long
def test_missed_touches_false_alarms_and_delay_need_no_labels(collision: Run, tmp_path: Path) -> None:
    seen = touch(collision, TOUCHED, TOUCHED + 0.15)
    row = judged(tmp_path / "a.rec", collision, [seen, touch(collision, 2.0, 2.2), touch(collision, 60.0, None)])
    assert (row["truth"], row["touches"], row["missed"], row["false_alarms"]) == ("virtual skin", 2, 1, 0)
    assert row["delay_median_ms"] == pytest.approx(9.03, abs=0.05)
    row = judged(tmp_path / "b.rec", collision, [])
    assert (row["touches"], row["missed"], row["false_alarms"]) == (0, 0, 1)


@pytest.mark.long
def test_a_cut_keeps_what_touched_the_skin_in_its_time(collision: Run, tmp_path: Path) -> None:
    touches = [touch(collision, 0.1, 0.2), touch(collision, TOUCHED, TOUCHED + 0.15)]
    cut = cut_run(told(collision, {"touches": touches}), tmp_path / "cut.rec", around=2.95)
    found = _true_touches(read_run(cut.path))
    assert found is not None
    assert len(found) == 2
    (row,) = _judge_run(cut.path)
    assert (row["touches"], row["missed"], row["false_alarms"]) == (1, 0, 0)


def contacts(*times: float, sensor: str = "a", until: float = float("inf")) -> Decisions:
    events = tuple(GuardEvent(EventName.CONTACT, 100.0 + time, {"sensor": sensor}) for time in times)
    return Decisions("", events, None, start=100.0, until=until)


def test_each_touch_is_seen_once_missed_or_a_false_alarm() -> None:
    labels = [_TouchLabel(1.0, 1.5, "a"), _TouchLabel(2.0, 2.5, "a"), _TouchLabel(3.0, 3.5, "a")]
    touches, false_alarms, delays = _score_detection(contacts(0.5, 1.01, 1.2, 3.002), labels)  # too early, twice
    assert (touches, false_alarms) == (3, 1)
    assert delays == pytest.approx((0.01, 0.002))
    assert statistics.median(delays) == pytest.approx(0.006)


def test_a_contact_on_another_sensor_is_a_false_alarm_and_an_unnamed_sensor_is_any() -> None:
    assert _score_detection(contacts(1.1, sensor="b"), [_TouchLabel(1.0, 1.5, "a")]) == (1, 1, [])
    touches, false_alarms, delays = _score_detection(contacts(1.1, sensor="b"), [_TouchLabel(1.0, 1.5)])
    assert (touches, false_alarms, len(delays)) == (1, 0, 1)


def test_a_touch_after_the_recording_was_lost_does_not_count() -> None:
    touches, _, delays = _score_detection(contacts(1.1, until=102.0), [_TouchLabel(1.0, 1.5), _TouchLabel(2.5, 3.0)])
    assert (touches, len(delays)) == (1, 1)


def test_a_touch_as_the_run_ends_counts_where_it_was_seen() -> None:
    prompt, late = _TouchLabel(1.0, 1.5), _TouchLabel(2.93, 3.5)
    assert _score_detection(contacts(1.01, 2.94), [prompt, late], 103.0) == (2, 0, pytest.approx([0.01, 0.01]))
    assert _score_detection(contacts(1.01), [prompt, late], 103.0) == (1, 0, pytest.approx([0.01]))
    assert _score_detection(contacts(1.01), [prompt, late], 103.04) == (2, 0, pytest.approx([0.01]))


def test_recorded_contacts_are_labels_until_the_touch_is_over() -> None:
    events = [
        GuardEvent(EventName.CONTACT, 101.0, {"sensor": "a"}),
        GuardEvent(EventName.TOUCH_ENDED, 101.5, {"sensor": "a"}),
        GuardEvent(EventName.CONTACT, 103.0, {"sensor": "a"}),
    ]
    first, second = _recorded_labels(Decisions("", tuple(events), None, start=100.0))
    assert first[:3] == (1.0, 1.5, "a")
    assert second[:2] == (3.0, float("inf"))
    touches, false_alarms, delays = _score_detection(contacts(0.9, 3.0), [first, second])
    assert (touches, false_alarms) == (2, 0)
    more = _judge(contacts(1.0), contacts(1.0, 9.0), [first], "recorded")  # touched, or a false alarm: no one knows
    assert (more["touches"], more["false_alarms"], more["unlabeled"]) == (1, 0, 1)
    told = _judge(contacts(1.0), contacts(1.0, 9.0), [first], "labels")
    assert (told["false_alarms"], told["unlabeled"]) == (1, 0)
    assert delays == pytest.approx((-0.1, 0.0))


def test_labels_are_read_from_a_file_beside_the_run(tmp_path: Path) -> None:
    path = tmp_path / "run.touches.toml"
    path.write_text('[[touch]]\nstart_s = 2\nend_s = 2.5\n[[touch]]\nstart_s = 1\nend_s = 1.5\nsensor = "a"\n')
    assert _read_labels(path) == [_TouchLabel(1, 1.5, "a"), _TouchLabel(2, 2.5, "")]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[touch]]\nstart_s = 2\n", "has no .*touch.* with start_s and end_s"),
        ("[[touch]]\nstart_s = 2\nend_s = 1\n", "start_s must be before end_s, got 2 s and 1 s"),
        ("touch = 5\n", "has no "),
        ("[[touch", "has no "),
        ('[[touch]]\nstart_s = "x"\nend_s = "y"\n', "start_s must be before"),
    ],
)
def test_a_file_of_labels_with_a_mistake_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "run.touches.toml").write_text(text)
    with pytest.raises(RecordingError, match=said):
        _read_labels(tmp_path / "run.touches.toml")
