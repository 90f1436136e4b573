"""The recorded collision of tests/data, read and replayed once for all tests of this folder."""

from pathlib import Path

import pytest

from coneskin.replay.run import Run, read_run
from coneskin.runs.decisions import Decisions, decide_again

COLLISION = Path(__file__).parents[1] / "data" / "collision.rec"


@pytest.fixture(scope="session")
def collision() -> Run:
    return read_run(COLLISION)


@pytest.fixture(scope="session")
def again(collision: Run) -> Decisions:
    """What today's guard decides in the collision."""
    return decide_again(collision, label="today")
