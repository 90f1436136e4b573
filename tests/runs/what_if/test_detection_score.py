"""Missed touches, false alarms and delays, counted by hand."""

from pathlib import Path

import pytest

from coneskin.core.errors import RecordingError
from coneskin.robot.guard.signals.journal import EventName, GuardEvent
from coneskin.runs.decisions import Decisions
from coneskin.runs.what_if.detection_score import score_detection
from coneskin.runs.what_if.touch_labels import TouchLabel, read_labels, recorded_labels


def contacts(*times: float, sensor: str = "a", until: float = float("inf")) -> Decisions:
    events = tuple(GuardEvent(EventName.CONTACT, 100.0 + time, {"sensor": sensor}) for time in times)
    return Decisions("", events, None, start=100.0, until=until)


def test_each_touch_is_seen_once_missed_or_a_false_alarm() -> None:
    labels = [TouchLabel(1.0, 1.5, "a"), TouchLabel(2.0, 2.5, "a"), TouchLabel(3.0, 3.5, "a")]
    score = score_detection(contacts(0.5, 1.01, 1.2, 3.002), labels)  # one too early, one twice
    assert (score.touches, score.missed, score.false_alarms) == (3, 1, 1)
    assert score.delays == pytest.approx((0.01, 0.002))
    assert score.median_delay == pytest.approx(0.006)


def test_a_contact_on_another_sensor_is_a_false_alarm_and_an_unnamed_sensor_is_any() -> None:
    assert score_detection(contacts(1.1, sensor="b"), [TouchLabel(1.0, 1.5, "a")]).false_alarms == 1
    assert score_detection(contacts(1.1, sensor="b"), [TouchLabel(1.0, 1.5)]).missed == 0


def test_a_touch_after_the_recording_was_lost_does_not_count() -> None:
    score = score_detection(contacts(1.1, until=102.0), [TouchLabel(1.0, 1.5), TouchLabel(2.5, 3.0)])
    assert (score.touches, score.missed) == (1, 0)


def test_recorded_contacts_are_labels_until_the_touch_is_over() -> None:
    events = [
        GuardEvent(EventName.CONTACT, 101.0, {"sensor": "a"}),
        GuardEvent(EventName.TOUCH_ENDED, 101.5, {"sensor": "a"}),
        GuardEvent(EventName.CONTACT, 103.0, {"sensor": "a"}),
    ]
    first, second = recorded_labels(Decisions("", tuple(events), None, start=100.0))
    assert first[:3] == (1.0, 1.5, "a")
    assert second[:2] == (3.0, float("inf"))
    early = score_detection(contacts(0.9, 3.0), [first, second])
    assert (early.missed, early.false_alarms) == (0, 0)
    assert early.delays == pytest.approx((-0.1, 0.0))


def test_labels_are_read_from_a_file_beside_the_run(tmp_path: Path) -> None:
    path = tmp_path / "run.touches.toml"
    path.write_text('[[touch]]\nstart_s = 2\nend_s = 2.5\n[[touch]]\nstart_s = 1\nend_s = 1.5\nsensor = "a"\n')
    assert read_labels(path) == [TouchLabel(1, 1.5, "a"), TouchLabel(2, 2.5, "")]


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
        read_labels(tmp_path / "run.touches.toml")
