"""Statistics of what an untouched skin sends: frames of each sensor with their times, and what is no frame. Pure."""

from __future__ import annotations

import statistics
from itertools import pairwise
from typing import TYPE_CHECKING

from coneskin.skin.diagnosis.capture import CaptureWindow
from coneskin.skin.wire import Frame, FrameDecoder

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["CHANNELS", "SensorStatistics", "SkinStatistics"]

CHANNELS = (
    *("touch_c", "touch_d", "touch_current", "radial_c", "radial_d", "radial_current"),
    *("angular_a", "angular_b", "angular_current", "touch_supply"),
)
_WRAP, _CLOCK_WRAP = 1 << 16, 1 << 32
_MOST = 20_000  # frames that are kept of a sensor


class SensorStatistics:
    """Frames of one sensor.

    Attributes:
        frames: with the time at which each was read [s].
        status: bits that any of them carried.
    """

    def __init__(self) -> None:
        self.frames: list[tuple[float, Frame]] = []
        self.status = 0

    def add(self, time: float, frame: Frame) -> None:
        """Take a frame."""
        self.status |= frame.status
        if len(self.frames) < _MOST:
            self.frames.append((time, frame))

    def steps(self) -> list[int]:
        """Return by how much the sequence grew from frame to frame."""
        return [(b.sequence - a.sequence) % _WRAP for (_, a), (_, b) in self._pairs()]

    def device_time(self) -> float:
        """Return the time between the first frame and the last by the device's clock [s]."""
        return sum((b.clock_us - a.clock_us) % _CLOCK_WRAP for (_, a), (_, b) in self._pairs()) * 1e-6

    def host_time(self) -> float:
        """Return the same by this computer's clock [s]."""
        return self.frames[-1][0] - self.frames[0][0]

    def mean(self, channel: str) -> float:
        """Return the mean of a reading [counts]."""
        return statistics.fmean(self.values(channel))

    def noise(self, channel: str) -> float:
        """Return the standard deviation of a reading [counts]."""
        return statistics.pstdev(self.values(channel))

    def values(self, channel: str) -> Sequence[int]:
        """Return a reading of every frame [counts]."""
        return [getattr(frame, channel) for _, frame in self.frames]

    def _pairs(self) -> list[tuple[tuple[float, Frame], tuple[float, Frame]]]:
        return list(pairwise(self.frames))


class SkinStatistics:
    """Everything that came from one source.

    Args:
        start: when the listening began [s].

    Attributes:
        received: bytes.
        window: the newest of them, for the diagnosis.
        decoder: has counted what is no frame.
        sensors: by device and sensor number.
    """

    def __init__(self, start: float) -> None:
        self.received = 0
        self.window = CaptureWindow(start)
        self.decoder = FrameDecoder()
        self.sensors: dict[tuple[int, int], SensorStatistics] = {}

    def add(self, time: float, data: bytes) -> list[Frame]:
        """Take bytes that were read at a time [s]; return the frames that they complete."""
        self.received += len(data)
        self.window.add(data, time)
        frames = self.decoder.feed(data)
        for frame in frames:
            self.sensors.setdefault((frame.device, frame.sensor), SensorStatistics()).add(time, frame)
        return frames
