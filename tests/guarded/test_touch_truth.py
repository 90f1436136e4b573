"""A session records with what its virtual skin was touched."""

import sys
from pathlib import Path

import pytest

from coneskin.robot.guard.signals.journal import EventName
from coneskin.runs.replay.run import read_run
from coneskin.runs.what_if.what_if import _judge_run, _true_touches
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard

from .guarded_session import DEADLINE

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")

SCENE = """
[[link]]
name = "tube"
[[link.sensor]]
name = "skin"
radius1_mm = 54
radius2_mm = 54
height_mm = 434
[source]
kind = "virtual"
model = "ladder"
rate_hz = 200
[[source.touch]]
start_s = 1.5
end_s = 2.0
u_mm = 200
phi_deg = 90
[monitoring]
skin_silence_ms = 1000
"""


@pytest.mark.long
def test_the_script_and_the_programs_touches_are_recorded_as_they_were(tmp_path: Path) -> None:
    with guard(parse_scene(SCENE), recording=tmp_path / "run.rec") as session:
        assert session.wait_for((EventName.TOUCH_ENDED,), DEADLINE) is not None
        seen = len(session.events)
        began = session.touch(0.1, 2.0, duration=0.5)
        assert session.wait_for((EventName.TOUCH_ENDED,), DEADLINE, after=seen) is not None
    run = read_run(tmp_path / "run.rec")
    assert run.start == session.began
    touches = _true_touches(run)
    assert touches is not None
    assert [one.sensor for one in touches] == ["skin", "skin"]
    assert [one.end - one.start for one in touches] == pytest.approx([0.5, 0.5])
    assert touches[1].start == pytest.approx(began - run.start)
    (row,) = _judge_run(tmp_path / "run.rec")
    assert (row["truth"], row["touches"], row["missed"], row["false_alarms"]) == ("virtual skin", 2, 0, 0)
    assert row["delay_median_ms"] > 0.0
