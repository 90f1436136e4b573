"""Output of the demo: the lines of the guard and of the program stand in the order of their times."""

import argparse
import time

import pytest

from coneskin.commands import demo
from coneskin.commands.demo import _hold_up, _Transcript
from coneskin.core.errors import ConeSkinError, RobotRefused
from coneskin.core.recording.block import Block
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent


def test_a_line_of_the_program_follows_the_event_that_it_waits_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """The guard's events come through a thread that may lag behind the program."""
    lines: list[str] = []
    active_at = time.monotonic()
    transcript = _Transcript(lines.append, lambda: active_at - 1.0)

    def lagging(seen, timeout):  # type: ignore[no-untyped-def]
        transcript.event(GuardEvent("activated", active_at, {}))
        return seen()

    monkeypatch.setattr(transcript._changed, "wait_for", lagging)
    transcript.line("the arm moves", after="activated")
    assert [line.split(" s  ")[1] for line in lines] == ["activated", "the arm moves"]
    times = [float(line.split()[0]) for line in lines]
    assert times == sorted(times)
    assert times[0] == 1.0  # since the run began


def flow(kind: BlockKind, *times: float) -> list[Block]:
    return [Block(kind, time, b"") for time in times]


def test_what_a_busy_computer_held_up_is_named_before_what_followed() -> None:
    skin, arm = flow(BlockKind.SKIN, 1.0, 1.01, 1.08, 1.09), flow(BlockKind.ARM, 1.0, 1.02, 1.06)
    late = Block(BlockKind.OVERRUN, 1.2, b'{"late": 0.12}')
    assert _hold_up([*skin, *arm]).startswith(
        "this computer was too busy: it held up frames of the skin for 70 ms (50 ms"
    )
    assert "frames of the skin for 70 ms, the guard for 120 ms (" in _hold_up([*skin, *arm, late])


def test_a_computer_that_was_not_busy_is_not_blamed() -> None:
    assert (
        _hold_up([*flow(BlockKind.SKIN, 1.0, 1.04), *flow(BlockKind.ARM, 2.0), *flow(BlockKind.TICK, 1.0, 9.0)]) == ""
    )


@pytest.mark.parametrize(("cause", "touches"), [("it was too busy", 3), ("", 1)])
def test_a_demo_that_a_busy_computer_held_up_is_run_again_and_then_says_so(
    monkeypatch, tmp_path, capsys, cause, touches
) -> None:  # type: ignore[no-untyped-def]
    made = []

    def held_up(scene, folder, say):  # type: ignore[no-untyped-def]
        (folder / "run.rec").touch(exist_ok=False)
        made.append(folder)
        raise RobotRefused("the guard did not become active")

    monkeypatch.setattr(demo, "_touch_by_script", held_up)
    monkeypatch.setattr(demo, "_commission", lambda scene, say: None)
    monkeypatch.setattr("coneskin.runs.replay.run.read_run", lambda folder: argparse.Namespace(blocks=cause))
    monkeypatch.setattr(demo, "_hold_up", lambda blocks: blocks)
    with pytest.raises(ConeSkinError) as refused:
        demo.run(argparse.Namespace(output=tmp_path / "run", reaction="retreat", json=True))
    assert len(made) == touches
    assert capsys.readouterr().err.count("it was too busy; the arm is touched again\n") == touches - 1
    said = "the guard did not become active"
    remedy = f"it was too busy; end what else it does, and run the demo again. What followed: {said}"
    assert str(refused.value) == (remedy if cause else said)
