"""Session with a skin: bytes of its source over a time, and touches that a person, or the virtual skin, makes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from coneskin.core.errors import SkinTimeout
from coneskin.skin.wire import Frame, FrameDecoder

from .skin_statistics import SkinStatistics
from .touch_capture import TouchCapture
from .wire_examination import touch_words
from .wire_order import TouchReadings, touch_places

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor
    from coneskin.skin.sources.source import Source

__all__ = ["collect", "guided_touches"]

_STEP = 0.05  # s between two looks at the clock


def collect(source: Source, duration: float, clock: Callable[[], float] = time.monotonic) -> SkinStatistics:
    """Take what an open source sends for a time [s].

    Raises:
        SkinConnectionError: the source is gone.
    """
    start = clock()
    seen, end = SkinStatistics(start), start + duration
    while (now := clock()) < end:
        try:
            seen.add(clock(), source.read(min(_STEP, end - now)))
        except SkinTimeout:
            continue
    return seen


def guided_touches(
    source: Source,
    sensor: Sensor,
    ask: Callable[[str, str], None],
    patience: float = 60.0,
    clock: Callable[[], float] = time.monotonic,
    keep: Callable[[Frame], None] = lambda _: None,
) -> dict[str, TouchReadings] | None:
    """Ask for touches near A, B, C and D of a sensor, and return what it read at each.

    Args:
        source: open.
        sensor: to be touched.
        ask: called with the electrode and the words for the person, then again with an empty electrode to let go.
        patience: for each touch [s].
        clock: monotonic [s].
        keep: called with each frame of the sensor.

    Returns:
        the readings; None where a touch did not come.

    Raises:
        SkinConnectionError: the source is gone.
    """
    number, frames = (sensor.device_id, sensor.sensor_id), FrameDecoder()
    capture, touched = TouchCapture(sensor), {}

    def wait(rest: bool) -> TouchReadings | None:
        return _wait(_frames(source, frames, number, clock, clock() + patience), capture, rest, keep)

    for electrode in touch_places(sensor):
        if wait(rest=True) is None:
            return None
        ask(electrode, touch_words(sensor, electrode))
        read = wait(rest=False)
        if read is None:
            return None
        touched[electrode] = read
        ask("", "let go")
        capture = TouchCapture(sensor, capture.rest)
    return touched


def _wait(
    frames: Iterator[tuple[float, Frame]], capture: TouchCapture, rest: bool, keep: Callable[[Frame], None]
) -> TouchReadings | None:
    """Return the resting readings, or those of the touch; None where the time is over before."""
    for now, frame in frames:
        keep(frame)
        read = capture.take(now, frame)
        if rest and capture.resting:
            return capture.rest
        if not rest and read is not None:
            return read
    return None


def _frames(
    source: Source, decoder: FrameDecoder, number: tuple[int, int], clock: Callable[[], float], end: float
) -> Iterator[tuple[float, Frame]]:
    """Yield the frames of one sensor until a time [s]."""
    while clock() < end:
        try:
            data = source.read(_STEP)
        except SkinTimeout:
            continue
        now = clock()
        yield from ((now, frame) for frame in decoder.feed(data) if (frame.device, frame.sensor) == number)
