"""The touches of a run are those that the guard has seen, with the same first and last frame; gaps do not matter."""

from collections.abc import Iterator
from dataclasses import replace as changed
from pathlib import Path

import pytest

from coneskin.core.recording.block import Block
from coneskin.robot.guard.signals.journal import BlockKind, EventName
from coneskin.runs.replay.run import Run, read_run
from coneskin.skin.wire import encode, frame_at
from tests.scene.scenes import record
from tests.support.paths import COLLISION


@pytest.fixture(scope="module")
def collision() -> Run:
    return read_run(COLLISION)


def contacts(run: Run) -> list[tuple[str, float, float]]:
    began = [event for event in run.events if event.name == EventName.CONTACT]
    ended = [event.time for event in run.events if event.name == EventName.TOUCH_ENDED]
    return [(b.details["sensor"], b.time, e) for b, e in zip(began, ended, strict=True)]


def test_they_are_the_contacts_of_the_guard(tmp_path: Path, collision: Run) -> None:
    record(tmp_path / "run.rec")
    for run in (read_run(tmp_path), collision):
        found = run.touches()
        assert [(touch.sensor, touch.began, touch.ended) for touch in found] == contacts(run)
        assert found[0].peak > 0.3


def test_a_run_that_ends_in_a_touch(collision: Run) -> None:
    contact = next(event.time for event in collision.events if event.name == EventName.CONTACT)
    blocks = tuple(block for block in collision.blocks if block.time < contact + 0.1)
    (touch,) = changed(collision, blocks=blocks).touches()
    assert (touch.began, touch.ended) == (contact, float("inf"))


def test_a_gap_in_which_the_clock_of_the_device_wraps_hides_no_touch(collision: Run) -> None:
    gap = 80 * 60.0  # s, of which the clock shows 505 s

    def later() -> Iterator[Block]:
        for block in collision.select(kinds=frozenset({BlockKind.SKIN})):
            frame = frame_at(block.payload)
            assert frame is not None
            clock, sequence = (frame.clock_us + round(1e6 * gap)) % 2**32, (frame.sequence + 5000) % 2**16
            moved = frame._replace(clock_us=clock, sequence=sequence)
            yield block._replace(time=block.time + gap, payload=encode(moved))

    one, other = changed(collision, blocks=(*collision.blocks, *later())).touches()
    assert other.began - one.began == pytest.approx(gap)
    assert other.peak == pytest.approx(one.peak, rel=1e-4)
