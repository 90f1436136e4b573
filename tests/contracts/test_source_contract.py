"""Contract of every source: a right one keeps it, and it notices each way to break it."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from coneskin.core.errors import SkinConnectionError, SkinTimeout
from coneskin.skin.sources.source import Source
from coneskin.skin.wire import FrameDecoder, encode
from coneskin.testing import source_contract
from coneskin.testing.source_contract import SOURCE_CHECKS, OpenLine, OpenLineFactory

each_check = pytest.mark.parametrize("check", SOURCE_CHECKS, ids=lambda check: check.__name__)


class _Memory(Source):
    """A right source in memory, of which the next test takes one virtue after the other."""

    name = "memory"

    def __init__(self, sent: bytes) -> None:
        self.rest, self.gone, self.opened = sent, False, False

    def open(self) -> None:
        self.opened = True

    def close(self) -> None:
        self.opened = False

    def fileno(self) -> int | None:
        return None

    def read(self, timeout: float) -> bytes:
        if not self.opened or self.gone:
            raise SkinConnectionError("gone, or not open")
        if not self.rest:
            raise SkinTimeout("silent")
        data, self.rest = self.rest[:1000], self.rest[1000:]
        return data

    def pull(self) -> None:
        self.gone = True


class _LosesAByte(_Memory):
    def read(self, timeout: float) -> bytes:
        return super().read(timeout)[:-1] or super().read(timeout)


class _SilentWhenGone(_Memory):
    def read(self, timeout: float) -> bytes:
        try:
            return super().read(timeout)
        except SkinConnectionError:
            raise SkinTimeout("silent") from None


class _GoneWhenSilent(_Memory):
    def read(self, timeout: float) -> bytes:
        try:
            return super().read(timeout)
        except SkinTimeout:
            raise SkinConnectionError("gone") from None


class _ReadsWhenClosed(_Memory):
    def close(self) -> None:
        pass


class _DropsWhatIsNoFrame(_Memory):
    def __init__(self, sent: bytes) -> None:
        super().__init__(b"".join(map(encode, FrameDecoder().feed(sent))))


class _NeverWakes(_Memory):
    def open(self) -> None:
        super().open()
        self.ends = os.pipe()

    def close(self) -> None:
        super().close()
        while self.ends:
            os.close(self.ends[-1])
            self.ends = self.ends[:-1]

    def fileno(self) -> int | None:
        return self.ends[0] if self.ends else None


class _KeepsADescriptor(_Memory):
    def fileno(self) -> int | None:
        return 7


def in_memory(kind: type[_Memory]) -> OpenLineFactory:
    @contextmanager
    def open_line(sent: bytes) -> Iterator[OpenLine]:
        with kind(sent) as source:
            yield OpenLine(source, source.pull)

    return open_line


@each_check
def test_a_right_source_in_memory_keeps_it(check: Callable[[OpenLineFactory], None]) -> None:
    check(in_memory(_Memory))


@pytest.mark.parametrize(
    ("kind", "first"),
    [
        (_LosesAByte, "_bytes_arrive_as_they_were_sent"),
        (_DropsWhatIsNoFrame, "_a_cut_frame_costs_that_frame_only"),
        (_NeverWakes, "_the_descriptor_is_readable_when_bytes_come"),
        (_GoneWhenSilent, "_silence_is_a_timeout_that_leaves_it_open"),
        (_SilentWhenGone, "_unplugged_is_an_error_and_stays_one"),
        (_ReadsWhenClosed, "_closing_twice_is_fine_and_reading_then_is_not"),
        (_KeepsADescriptor, "_closing_twice_is_fine_and_reading_then_is_not"),
    ],
)
@pytest.mark.long
def test_each_way_to_break_it_is_noticed(kind: type[_Memory], first: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source_contract, "_LINE_TIMEOUT", 0.05)
    broken = []
    for check in SOURCE_CHECKS:
        try:
            check(in_memory(kind))
        except (AssertionError, SkinTimeout, SkinConnectionError):
            broken.append(check.__name__)
    assert first in broken
