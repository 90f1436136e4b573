"""``coneskin replay`` of several runs, and with other settings."""

import json
import re
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.commands.replay import _exit_code, _report
from coneskin.robot.guard.signals.journal import EventName, GuardEvent
from coneskin.runs.replay.run import Replay
from tests.support.paths import COLLISION


def test_a_what_if_shows_differences_and_invents_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(COLLISION), "--set", "reaction.kind=stop", "--events"]) == 0
    out = capsys.readouterr().out
    assert "  retreat: missing\n" in out
    assert "the arm is commanded otherwise" in out
    assert "NOT confirmed" not in out
    assert re.search(r"touch on forearm skin ended", out)
    assert main(["replay", str(COLLISION), "--set", "reaction.kind=dance"]) == 1
    assert "with reaction.kind=dance: 1 mistake\n  reaction.kind must be one of" in capsys.readouterr().err


def test_another_scene_is_a_what_if_as_well(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from coneskin.runs.replay.run import read_run

    scene = tmp_path / "scene.toml"
    scene.write_text(read_run(COLLISION).header["scene"].replace('kind = "retreat"', 'kind = "stop"'))
    assert main(["replay", str(COLLISION), "--scene", str(scene), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert [d["subject"] for d in facts["comparison"]["differences"]] == ["retreat"]
    assert "retreating" not in [event["name"] for event in facts["events"]]
    assert main(["replay", str(COLLISION), "--scene", str(scene), "--set", "a.b=1"]) == 1
    assert "exclude each other" in capsys.readouterr().err


@pytest.mark.long
def test_a_folder_of_runs_is_listed_and_several_runs_are_summed_up(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.rec").write_bytes(COLLISION.read_bytes())
    assert main(["replay", str(tmp_path)]) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith(f"coneskin replay: {tmp_path} is no run; there are 2 below it")
    assert f"coneskin replay {tmp_path / 'b'}\n" in printed.out
    both = [str(tmp_path / name) for name in ("a", "b")]
    assert main(["replay", *both, "--jobs", "1"]) == 0
    assert re.search(r"^as recorded +2 +0 +0 +2 +0 +0 ", capsys.readouterr().out, re.MULTILINE)
    (tmp_path / "b" / "run.rec").write_bytes(COLLISION.read_bytes()[:-50_000])
    assert main(["replay", *both, "--jobs", "1", "--json"]) == 4
    rows = json.loads(capsys.readouterr().out)["runs"]
    assert [row["complete"] for row in rows] == [True, False]
    assert main(["replay", *both, "--jobs", "1", "--allow-incomplete"]) == 0
    (tmp_path / "b" / "run.rec").write_bytes(b"broken")
    capsys.readouterr()
    assert main(["replay", *both, "--jobs", "1"]) == 1
    out = capsys.readouterr().out
    assert "b/run.rec: BROKEN: " in out
    assert "\n1 of 2 runs replayed the same as recorded\n" in out


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"same": True}, 0),
        ({"first_difference": "contact"}, 1),
        ({"diverged_s": 0.5}, 1),
        ({"complete": True}, 1),
        ({}, 4),
        ({"error": "broken"}, 1),
    ],
)
def test_a_run_that_only_lacks_something_is_told_from_one_that_differs(changes: dict[str, object], code: int) -> None:
    row = {"error": "", "same": False, "first_difference": "", "diverged_s": None, "complete": False, **changes}
    assert _exit_code([row], compared=True, incomplete_too=False) == code


@pytest.mark.parametrize(
    ("compared", "differences", "missing", "verdict"),
    [
        (0, [], "its end", "INCOMPLETE: no event that could be compared was recorded"),
        (1, [], "its end", "INCOMPLETE: 1 event up to what is missing are the same, bit by bit; 2 events behind "),
        (0, ["is new"], "", "the events are NOT the same:"),
        (3, [], "", "the events are the same, bit by bit"),
    ],
)
def test_a_replay_says_how_far_its_run_was_compared(
    compared: int, differences: list[str], missing: str, verdict: str, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded = [GuardEvent(EventName.ACTIVATED, float(k), {}) for k in range(3)]
    _report(Replay([], recorded, compared, differences, 0, 3.0, missing), 0.0, False)
    assert f"\n{verdict}" in capsys.readouterr().out


def test_a_variant_that_cannot_be_is_named_with_its_reason(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(COLLISION), "--vary", "reaction.kind=stop,dance", "--jobs", "1"]) == 1
    out = capsys.readouterr().out
    assert "collision.rec: BROKEN with reaction.kind=dance: " in out
    assert "reaction.kind must be one of slow, comply, retreat, stop, got 'dance'" in out
    assert "the contacts that they recorded count as the truth there" in out


@pytest.mark.long
def test_several_values_make_a_row_each(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    words = ["--vary", "detection.touch_level=0.1,0.2", "--jobs", "1", "--json"]
    assert main(["replay", str(COLLISION), *words]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert [row["variant"] for row in facts["runs"]] == ["detection.touch_level=0.1", "detection.touch_level=0.2"]
    assert [score["missed"] for score in facts["variants"]] == [0, 0]
    assert main(["replay", str(COLLISION), *words, "--table", str(tmp_path / "a.csv")]) == 1
    assert "is a .parquet file" in capsys.readouterr().err


@pytest.mark.long
def test_the_detector_itself_can_be_another_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(COLLISION), "--set", "detector.confirm_frames=2", "--json"]) == 0
    (touch, *_) = json.loads(capsys.readouterr().out)["comparison"]["differences"]
    assert touch["subject"] == "contact 1"
    assert 0.5 < touch["delay_ms"] < 2.0  # one frame of 1 kHz
