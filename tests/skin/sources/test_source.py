"""Reopening of a source that is gone: again and again, for a bounded time, until it is told to stop."""

import pytest

from coneskin.core.errors import SkinConnectionError
from coneskin.skin.sources.source import Source, SourceReopening


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


@pytest.mark.parametrize(("opens_at", "attempts"), [(2, 2), (3, 3), (10_000, 1200)])
def test_it_is_closed_once_and_tried_for_ten_minutes_until_it_is_there(opens_at, attempts):
    source, waits = Absent(opens_at), []
    reopening = SourceReopening(source, wait=lambda time: bool(waits.append(time)))
    reopening._thread.join(60.0)
    assert reopening.done
    assert reopening.opened is (attempts == opens_at)
    assert source.calls == ["close", *["open"] * attempts]
    assert waits == [0.5] * attempts


def test_it_can_be_told_to_stop():
    source = Absent(10_000)
    reopening = SourceReopening(source)
    assert not reopening.done
    reopening.stop()
    assert reopening.done
    assert not reopening.opened
