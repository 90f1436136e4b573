"""The recorded collision of tests/data, read and replayed once for all tests of this folder."""

import pytest

from coneskin.runs.decisions import Decisions, decide_again
from coneskin.runs.replay.run import Run, read_run
from tests.support.paths import COLLISION


@pytest.fixture(scope="session")
def collision() -> Run:
    return read_run(COLLISION)


@pytest.fixture(scope="session")
def again(collision: Run) -> Decisions:
    """What today's guard decides in the collision."""
    return decide_again(collision, label="today")
