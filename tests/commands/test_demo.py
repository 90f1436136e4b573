"""Output of the demo: the lines of the guard and of the program stand in the order of their times."""

import time

import pytest

from coneskin.commands.demo import _Transcript
from coneskin.robot.guard.journal import GuardEvent


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
