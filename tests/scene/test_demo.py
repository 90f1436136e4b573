"""What the demo prints: the lines of the guard and of the program stand in the order of their times."""

import time

import pytest

from coneskin.demo import _Told
from coneskin.robot.journal import GuardEvent


def test_the_program_speaks_after_the_event_that_let_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The guard's events come through a thread that may lag behind the program."""
    lines: list[str] = []
    told = _Told(lines.append)
    armed = time.monotonic()

    def lagging(seen, timeout):  # type: ignore[no-untyped-def]
        told.event(GuardEvent("armed", armed, {}))
        return seen()

    monkeypatch.setattr(told._changed, "wait_for", lagging)
    told.line("the arm moves", after="armed")
    assert [line.split(" s  ")[1] for line in lines] == ["armed", "the arm moves"]
    times = [float(line.split()[0]) for line in lines]
    assert times == sorted(times)
