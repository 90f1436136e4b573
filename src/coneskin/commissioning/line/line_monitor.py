"""Model of what a monitor shows: bytes and times go in, a report comes out. It knows no port and no terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.diagnosis.capture import CaptureWindow, find_frames
from coneskin.skin.diagnosis.cause import Diagnosis
from coneskin.skin.diagnosis.diagnose import diagnose
from coneskin.skin.diagnosis.frame_numbers import FrameNumbers, measure_numbers
from coneskin.skin.diagnosis.measurements import MEASURED, expected_counts
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame, FrameDecoder, Status, encode

__all__ = ["LineMonitor", "LineReport", "SensorReport"]

_TOUCHED = 0.10  # level; that of a sensor about which nothing else is known
_NEWEST = 64  # bytes that are shown where there is no frame
_STATUS_FAULTS = int(~(Status.RESTARTED | Status.TOUCH) & 0xFF)


@dataclass(frozen=True, slots=True)
class SensorReport:
    """What one sensor sends.

    Attributes:
        name: of the scene, or its numbers.
        frames: valid frames since the beginning.
        missing: frames that never came, by their sequence.
        numbers: how the newest frames follow each other.
        counts: of the newest frame, by field.
        changed: fields that differ from the frame before.
        expected: counts of the untouched sensor; empty without a scene.
        level: how firmly it is touched, 0 to 1.
        place: part of the length from end 1 and of the wrap from D, 0 to 1; None while it is not touched.
        certain: the place is certain; False without a scene.
        words: the place in words, or why there is none.
        health: in a word or a sentence.
        raw: bytes of the newest frame.
        raw_changed: places in them that differ from the frame before.
    """

    name: str
    frames: int
    missing: int
    numbers: FrameNumbers
    counts: dict[str, int]
    changed: frozenset[str]
    expected: dict[str, int]
    level: float
    place: tuple[float, float] | None
    certain: bool
    words: str
    health: str
    raw: bytes
    raw_changed: frozenset[int]


@dataclass(frozen=True, slots=True)
class LineReport:
    """What arrives on a line.

    Attributes:
        diagnosis: what is wrong, if anything is.
        time: since the beginning [s].
        size: bytes since the beginning.
        byte_rate: of the newest bytes [1/s].
        skipped: bytes that belong to no frame.
        crc_errors: frames with a wrong checksum.
        sensors: that send.
        newest: the newest bytes.
    """

    diagnosis: Diagnosis
    time: float
    size: int
    byte_rate: float
    skipped: int
    crc_errors: int
    sensors: tuple[SensorReport, ...]
    newest: bytes


class _Heard:
    """What has been heard of one sensor."""

    __slots__ = ("before", "frames", "missing", "newest")

    def __init__(self, frame: Frame) -> None:
        self.newest = self.before = frame
        self.frames = self.missing = 0

    def take(self, frame: Frame) -> None:
        self.before, self.newest = self.newest, frame
        self.frames += 1
        step = (frame.sequence - self.before.sequence) & 0xFFFF
        if 1 < step < 0x8000 and not frame.status & Status.RESTARTED:
            self.missing += step - 1


class LineMonitor:
    """Monitor of one line.

    Args:
        start: host clock when the listening begins [s].
        sensors: that a scene expects; empty without a scene.
        baud: rate at which the port listens [1/s], or None.
        timed: the times of the bytes say something; False for those of a file.
    """

    def __init__(
        self, start: float, sensors: Sequence[Sensor] = (), baud: int | None = None, timed: bool = True
    ) -> None:
        self._start = start
        self._sensors = tuple(sensors)
        self._baud = baud
        self._timed = timed
        self._window = CaptureWindow(start)
        self._decoder = FrameDecoder()
        self._stream = TouchStream(self._sensors) if self._sensors else None
        self._heard: dict[tuple[int, int], _Heard] = {}
        self._size = 0

    def feed(self, data: bytes, now: float) -> None:
        """Take the next bytes, which came at a host time [s]."""
        self._size += len(data)
        self._window.add(data, now)
        for frame in self._decoder.feed(data):
            key = frame.device, frame.sensor
            if key not in self._heard and len(self._heard) >= 64:
                continue
            self._heard.setdefault(key, _Heard(frame)).take(frame)
        if self._stream is not None:
            self._stream.feed(data, now)

    def report(self, now: float) -> LineReport:
        """Return what has arrived until a host time [s]."""
        capture = self._window.capture(now, self._timed)
        data = capture.data
        found = find_frames(data)
        times = capture.arrivals(found.offsets)
        rows: dict[tuple[int, int], tuple[list[Frame], list[float]]] = {}
        for frame, time in zip(found.frames, times, strict=True):
            frames, at = rows.setdefault((frame.device, frame.sensor), ([], []))
            frames.append(frame)
            at.append(time)
        sensors = [
            self._sensor_report(heard, measure_numbers(*rows.get(key, ([heard.newest], [now]))))
            for key, heard in sorted(self._heard.items())
        ]
        return LineReport(
            diagnose(capture, self._sensors, self._baud),
            now - self._start,
            self._size,
            len(data) / capture.duration if capture.duration > 0.0 else math.nan,
            self._decoder.bytes_skipped,
            self._decoder.crc_errors,
            tuple(sensors),
            data[-_NEWEST:],
        )

    def _sensor_report(self, heard: _Heard, numbers: FrameNumbers) -> SensorReport:
        frame, before = heard.newest, heard.before
        counts = {name: getattr(frame, name) for name in MEASURED}
        changed = frozenset(name for name in MEASURED if counts[name] != getattr(before, name))
        raw, old = encode(frame), encode(before)
        raw_changed = frozenset(k for k, byte in enumerate(raw) if k >= len(old) or byte != old[k])
        sensor = next((s for s in self._sensors if (s.device_id, s.sensor_id) == (frame.device, frame.sensor)), None)
        expected = {} if sensor is None else dict(zip(MEASURED, expected_counts(sensor), strict=True))
        name = f"sensor {frame.device}/{frame.sensor}" if sensor is None else sensor.name
        level = (frame.touch_c + frame.touch_d) / (2.0 * frame.touch_supply) if frame.touch_supply else 0.0
        look = _look_at(frame, level) if sensor is None else self._look_by_scene(sensor)
        return SensorReport(
            *(name, heard.frames, heard.missing, numbers, counts, changed, expected, level),
            *(*look, raw, raw_changed),
        )

    def _look_by_scene(self, sensor: Sensor) -> tuple[tuple[float, float] | None, bool, str, str]:
        """Return place, certainty, words and health as the detector of a scene's sensor has them."""
        assert self._stream is not None
        detector = next(item for item in self._stream.detectors if item.sensor is sensor)
        health = detector.fault.value if detector.fault else "ready" if detector.ready else "settling"
        touch = detector.reading_now
        if touch is None:
            return None, False, "not touched", health
        cone = sensor.frustum
        words = f"u = {1e3 * touch.u:.1f} mm, phi = {math.degrees(touch.phi):.1f} deg"
        if touch.doubt:
            words += f", not certain: {touch.doubt}"
        return (touch.u / cone.slant, touch.phi / cone.wrap), touch.location_valid, words, health


def _look_at(frame: Frame, level: float) -> tuple[tuple[float, float] | None, bool, str, str]:
    """Return place, certainty, words and health as far as they show without a scene."""
    health = f"status 0x{frame.status:02X}" if frame.status & _STATUS_FAULTS else "no fault in its status"
    if level < _TOUCHED or not (frame.radial_supply and frame.angular_supply):
        return None, False, "not touched", health
    along = 1.0 - 0.5 * (frame.radial_c + frame.radial_d) / frame.radial_supply
    around = 0.5 * (frame.angular_a + frame.angular_b) / frame.angular_supply
    along, around = min(max(along, 0.0), 1.0), min(max(around, 0.0), 1.0)
    words = f"about {100.0 * along:.0f} % of the length from B and {100.0 * around:.0f} % of the wrap from D"
    return (along, around), False, words, health
