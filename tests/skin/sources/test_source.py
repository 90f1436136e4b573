"""Reopening of a source that is gone: again and again, for a bounded time, until it is told to stop."""

import pytest

from coneskin.core.errors import SkinConnectionError
from coneskin.skin.sources.source import Source, SourceReopening, open_again


class Absent(Source):
    """A source that can be opened at an attempt of a number; a port is gone that long."""

    name = "absent"

    def __init__(self, opens_at: int) -> None:
        self.left, self.calls = opens_at, []

    def open(self) -> None:
        self.calls.append("open")
        self.left -= 1
        if self.left:
            raise SkinConnectionError("no such port")

    def close(self) -> None:
        self.calls.append("close")

    def fileno(self) -> int | None:
        return None

    def read(self, timeout: float) -> bytes:
        return b""


def test_it_is_closed_once_and_tried_until_it_is_there():
    source, waits = Absent(3), []
    assert open_again(source, lambda time: bool(waits.append(time)))
    assert source.calls == ["close", "open", "open", "open"]
    assert waits == [0.5, 0.5, 0.5]


def test_it_is_given_up_after_ten_minutes():
    source, waits = Absent(10_000), []
    assert not open_again(source, lambda time: bool(waits.append(time)))
    assert sum(waits) == 600.0
    assert source.calls.count("open") == 1200


@pytest.mark.parametrize(("opens_at", "opened"), [(2, True), (10_000, False)])
def test_a_thread_does_it_and_says_how_it_ended(opens_at, opened):
    reopening = SourceReopening(Absent(opens_at), wait=lambda _: False)
    reopening._thread.join(10.0)
    assert reopening.done
    assert reopening.opened is opened


def test_it_can_be_told_to_stop():
    source = Absent(10_000)
    reopening = SourceReopening(source)
    assert not reopening.done
    reopening.stop()
    assert reopening.done
    assert not reopening.opened
