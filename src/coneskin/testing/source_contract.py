"""Contract of every source of bytes: what a guard relies on, as checks for whoever writes one.

    @pytest.mark.parametrize("check", SOURCE_CHECKS, ids=lambda check: check.__name__)
    def test_my_bus(check):
        check(open_line)

``open_line`` is a function that takes the bytes that the device shall send and returns a context manager of an
`OpenLine`: the source, open, and a hand that pulls the plug. Each check raises AssertionError where the source breaks
it.
"""

from __future__ import annotations

import select
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass

from coneskin.core.errors import SkinConnectionError, SkinTimeout
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.events import TouchBegan
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.source import Source
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import FRAME_LENGTH, FRAME_LENGTHS, FrameDecoder, encode

from . import expect_error

_LINE_TIMEOUT = 10.0  # s; far beyond what a line in one machine needs, so reached only where the contract is broken
_TOUCHED_SENSOR = Sensor(Frustum(0.054, 0.054, 0.434))
_FRAME_PERIOD = 1e-3  # s
_FRAME_COUNT = 75  # a pseudo-terminal holds 4 kB


@dataclass(frozen=True, slots=True)
class OpenLine:
    """A source that is open."""

    source: Source
    pull: Callable[[], None] | None = None  #: pulls the plug; None where the line ends by itself after its last byte

    def read(self, count: int) -> bytes:
        """Return so many bytes, or more.

        Raises:
            SkinTimeout: they do not come.
        """
        data = b""
        while len(data) < count:
            data += self.source.read(_LINE_TIMEOUT)
        return data


OpenLineFactory = Callable[[bytes], AbstractContextManager[OpenLine]]


def contract_bytes(frame_length: int = FRAME_LENGTH) -> bytes:
    """Return the bytes of 75 frames with a touch, which the checks send: less than 4 kB, which fits any buffer."""
    touch = ScriptedTouch(0.06, 0.3, u=0.2, phi=1.0)
    duration = _FRAME_COUNT * _FRAME_PERIOD
    skin = VirtualSkin(_TOUCHED_SENSOR, [touch], model="ladder", duration=duration, seed=3, frame_length=frame_length)
    return b"".join(encode(frame) for _, frame in skin.frames())


def _bytes_arrive_as_they_were_sent(open_line: OpenLineFactory) -> None:
    """Check that no byte is lost, added or changed, in a frame of any length."""
    for length in FRAME_LENGTHS:
        sent = contract_bytes(length)
        with open_line(sent) as line:
            assert isinstance(line.source, Source)
            assert line.source.name
            assert line.read(len(sent)) == sent


def _a_touch_arrives(open_line: OpenLineFactory) -> None:
    """Check that a detector sees the touch where it is."""
    sent = contract_bytes()
    stream = TouchStream([_TOUCHED_SENSOR])
    with open_line(sent) as line:
        events = stream.feed(line.read(len(sent)), _FRAME_COUNT * _FRAME_PERIOD)
    began = [event for event in events if isinstance(event, TouchBegan)]
    assert len(began) == 1
    assert stream.decoder.frames == _FRAME_COUNT


def _a_cut_frame_costs_that_frame_only(open_line: OpenLineFactory) -> None:
    """Check that bytes which are no frame do no harm to the frames around them, and arrive as well."""
    whole = contract_bytes()
    sent = whole[: 5 * FRAME_LENGTH + 10] + whole[6 * FRAME_LENGTH :]
    with open_line(sent) as line:
        received = line.read(len(sent))
    numbers = [frame.sequence for frame in FrameDecoder().feed(received)]
    assert received == sent
    assert numbers == [number for number in range(_FRAME_COUNT) if number != 5]


def _the_descriptor_is_readable_when_bytes_come(open_line: OpenLineFactory) -> None:
    """Check that what a guard waits on wakes it; a source without a descriptor is asked again and again instead."""
    with open_line(contract_bytes()) as line:
        descriptor = line.source.fileno()
        if descriptor is not None:
            assert select.select([descriptor], [], [], _LINE_TIMEOUT)[0] == [descriptor]
        assert line.source.read(_LINE_TIMEOUT)


def _silence_is_a_timeout_that_leaves_it_open(open_line: OpenLineFactory) -> None:
    """Check that nothing to read is a SkinTimeout, again and again, and no end."""
    sent = contract_bytes()[:360]
    with open_line(sent) as line:
        if line.pull is None:
            return  # it ends by itself
        line.read(len(sent))
        for _ in range(2):
            expect_error(SkinTimeout, lambda: line.source.read(0.01), "a silent source must raise SkinTimeout")


def _unplugged_is_an_error_and_stays_one(open_line: OpenLineFactory) -> None:
    """Check that a line that is gone raises SkinConnectionError: an end of bytes must never look like silence."""
    sent = contract_bytes()[:360]
    with open_line(sent) as line:
        received = b""
        with suppress(SkinConnectionError):
            while True:
                if len(received) >= len(sent) and line.pull is not None:
                    line.pull()
                received += line.source.read(_LINE_TIMEOUT)
        assert sent.startswith(received)
        for _ in range(2):
            gone = "a source that is gone must raise SkinConnectionError"
            expect_error(SkinConnectionError, lambda: line.source.read(0.05), gone)


def _closing_twice_is_fine_and_reading_then_is_not(open_line: OpenLineFactory) -> None:
    with open_line(contract_bytes()[:360]) as line:
        line.source.close()
        line.source.close()
        assert line.source.fileno() is None
        closed = "a closed source must raise SkinConnectionError"
        expect_error(SkinConnectionError, lambda: line.source.read(0.0), closed)


#: Every check, in the order in which a source is written.
SOURCE_CHECKS: tuple[Callable[[OpenLineFactory], None], ...] = (
    _bytes_arrive_as_they_were_sent,
    _a_touch_arrives,
    _a_cut_frame_costs_that_frame_only,
    _the_descriptor_is_readable_when_bytes_come,
    _silence_is_a_timeout_that_leaves_it_open,
    _unplugged_is_an_error_and_stays_one,
    _closing_twice_is_fine_and_reading_then_is_not,
)
