"""Monitor of a line: bytes and times go in, a report comes out, as an object, a line or a screen. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from coneskin.core.finding import Finding
from coneskin.core.text import finite, printable
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.diagnosis.capture import CaptureWindow, find_frames
from coneskin.skin.diagnosis.cause import Cause
from coneskin.skin.diagnosis.diagnose import diagnose
from coneskin.skin.diagnosis.frame_numbers import FrameNumbers, measure_numbers
from coneskin.skin.diagnosis.measurements import MEASURED, expected_counts
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import STATUS_FAULTS, Frame, FrameDecoder, Status, encode

_TOUCH_LEVEL = 0.10  # level; that of a sensor about which nothing else is known
_NEWEST_SIZE = 64  # bytes that are shown where there is no frame


@dataclass(frozen=True, slots=True)
class _SensorReport:
    """What one sensor sends."""

    name: str  #: of the scene, or its numbers
    frames: int  #: valid frames since the beginning
    missing: int  #: frames that never came, by their sequence
    numbers: FrameNumbers  #: how the newest frames follow each other
    counts: dict[str, int]  #: of the newest frame, by field
    changed: frozenset[str]  #: fields that differ from the frame before
    expected: dict[str, int]  #: counts of the untouched sensor; empty without a scene
    level: float  #: how firmly it is touched, 0 to 1
    place: tuple[float, float] | None  #: part of the length from end 1 and of the wrap from D, 0 to 1; None: untouched
    certain: bool  #: the place is certain; False without a scene
    words: str  #: the place in words, or why there is none
    health: str  #: in a word or a sentence
    raw: bytes  #: bytes of the newest frame
    raw_changed: frozenset[int]  #: places in them that differ from the frame before


@dataclass(frozen=True, slots=True)
class LineReport:
    """What arrives on a line."""

    diagnosis: Finding  #: what is wrong, if anything is
    time: float  #: since the beginning [s]
    size: int  #: bytes since the beginning
    byte_rate: float  #: of the newest bytes [1/s]
    skipped: int  #: bytes that belong to no frame
    crc_errors: int  #: frames with a wrong checksum
    sensors: tuple[_SensorReport, ...]  #: that send
    newest: bytes  #: the newest bytes


class _Heard:
    """What has been heard of one sensor."""

    __slots__ = ("before", "frames", "missing", "newest")

    def __init__(self, frame: Frame) -> None:
        self.newest = self.before = frame
        self.frames = self.missing = 0

    def feed(self, frame: Frame) -> None:
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
        self._start, self._baud, self._timed = start, baud, timed
        self._sensors = tuple(sensors)
        self._window = CaptureWindow(start)
        self._decoder = FrameDecoder()
        self._stream = TouchStream(self._sensors) if self._sensors else None
        self._heard: dict[tuple[int, int], _Heard] = {}
        self._size = 0

    def feed(self, data: bytes, now: float) -> None:
        """Take the next bytes, which came at a host time [s]."""
        self._size += len(data)
        self._window.feed(data, now)
        for frame in self._decoder.feed(data):
            key = frame.device, frame.sensor
            if key not in self._heard and len(self._heard) >= 64:
                continue
            self._heard.setdefault(key, _Heard(frame)).feed(frame)
        if self._stream is not None:
            self._stream.feed(data, now)

    def report(self, now: float) -> LineReport:
        """Return what has arrived until a host time [s]."""
        capture = self._window.capture(now, self._timed)
        data = capture.data
        rows = capture.by_sensor(find_frames(data))
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
            data[-_NEWEST_SIZE:],
        )

    def _sensor_report(self, heard: _Heard, numbers: FrameNumbers) -> _SensorReport:
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
        return _SensorReport(
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
    health = f"status 0x{frame.status:02X}" if frame.status & STATUS_FAULTS else "no fault in its status"
    if level < _TOUCH_LEVEL or not (frame.radial_supply and frame.angular_supply):
        return None, False, "not touched", health
    along = 1.0 - 0.5 * (frame.radial_c + frame.radial_d) / frame.radial_supply
    around = 0.5 * (frame.angular_a + frame.angular_b) / frame.angular_supply
    along, around = min(max(along, 0.0), 1.0), min(max(around, 0.0), 1.0)
    words = f"about {100.0 * along:.0f} % of the length from B and {100.0 * around:.0f} % of the wrap from D"
    return (along, around), False, words, health


_PHASE_ROWS = (("touch", "C", "D"), ("radial", "C", "D"), ("angular", "A", "B"))
_BAR_WIDTH = 20  # characters of a full level
_MARK_CODE, _UNMARK_CODE = "\x1b[7m", "\x1b[0m"
_BAD_COLOR, _GOOD_COLOR = "\x1b[31m", "\x1b[32m"


def draw_screen(report: LineReport, *, with_hex: bool, columns: int, color: bool) -> list[str]:
    """Draw a report for a terminal; the first line is the diagnosis.

    Args:
        with_hex: show the bytes of the newest frame of each sensor, or the newest bytes.
        columns: width of the terminal.
        color: changed numbers and the diagnosis may be highlighted.
    """
    line = printable(report.diagnosis.line)
    if color:
        line = f"{_GOOD_COLOR if report.diagnosis.verdict == 'ok' else _BAD_COLOR}{line}{_UNMARK_CODE}"
    lines = [line, describe_line(report, with_diagnosis=False)]
    for sensor in report.sensors:
        lines += ["", *_draw_sensor(sensor, with_hex=with_hex, columns=columns, color=color)]
    if with_hex and not report.sensors and report.newest:
        lines += ["", *_rows(report.newest.hex(" ").upper().split(" "))]
    return lines


def describe_line(report: LineReport, with_diagnosis: bool = True) -> str:
    """Return a report in one line."""
    parts = [f"{report.time:.1f} s", f"{report.size} bytes", f"{_number(report.byte_rate, 0)} a second"]
    parts += [f"{report.skipped} in no frame", f"{report.crc_errors} wrong checksums"]
    for sensor in report.sensors[:8] if with_diagnosis else ():
        ratio = _number(sensor.numbers.clock_ratio, 4)
        parts.append(
            f"{sensor.name}: {_number(sensor.numbers.rate, 0)} frames/s, {sensor.missing} missing, clock {ratio}, "
            f"level {sensor.level:.2f}, {sensor.words}, {sensor.health}"
        )
    text = ", ".join(parts[:5]) + "".join(f"; {part}" for part in parts[5:])
    return f"{printable(report.diagnosis.line)} | {text}" if with_diagnosis else text


def describe_report(report: LineReport) -> dict[str, Any]:
    """Return a report as JSON has it; nan becomes null."""
    named = report.diagnosis
    values = {
        "diagnosis": {"cause": named.item, "what": named.value, "do": named.remedy or Cause.NONE.value},
        "good": named.verdict == "ok",
        "time_s": round(report.time, 3),
        "bytes": report.size,
        "bytes_per_s": round(report.byte_rate, 6),
        "bytes_skipped": report.skipped,
        "crc_errors": report.crc_errors,
        "sensors": [_sensor_object(sensor) for sensor in report.sensors],
    }
    return dict(finite(values))


def _sensor_object(sensor: _SensorReport) -> dict[str, Any]:
    return {
        "name": sensor.name,
        "frames": sensor.frames,
        "missing": sensor.missing,
        "rate_hz": round(sensor.numbers.rate, 6),
        "clock_ratio": round(sensor.numbers.clock_ratio, 6),
        "counts": sensor.counts,
        "expected": sensor.expected,
        "level": round(sensor.level, 4),
        "along": None if sensor.place is None else round(sensor.place[0], 4),
        "around": None if sensor.place is None else round(sensor.place[1], 4),
        "certain": sensor.certain,
        "health": sensor.health,
        "frame": sensor.raw.hex(),
    }


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "?"


def _draw_sensor(sensor: _SensorReport, *, with_hex: bool, columns: int, color: bool) -> list[str]:
    numbers = sensor.numbers
    bar = "#" * round(_BAR_WIDTH * min(max(sensor.level, 0.0), 1.0))
    lines = [
        f"{sensor.name}: {_number(numbers.rate, 1)} frames/s, {sensor.missing} missing of "
        f"{sensor.frames + sensor.missing}, clock ratio {_number(numbers.clock_ratio, 4)}; {sensor.health}",
        f"level {sensor.level:5.3f} [{bar:<{_BAR_WIDTH}}] {sensor.words}",
        "counts (expected)  guide 1        guide 2        current        supply",
    ]
    for row, (phase, first, second) in enumerate(_PHASE_ROWS):
        cells = [_cell(sensor, MEASURED[3 * row + k], color) for k in range(3)]
        cells.append(_cell(sensor, MEASURED[9 + row], color))
        lines.append(f"  {phase:<8} {first}, {second}    " + " ".join(cells))
    lines += draw_sheet(sensor.place, sensor.certain, max(16, min(60, columns - 12)))
    if with_hex:
        cells = [f"{byte:02X}" for byte in sensor.raw]
        if color:
            cells = [
                f"{_MARK_CODE}{cell}{_UNMARK_CODE}" if k in sensor.raw_changed else cell for k, cell in enumerate(cells)
            ]
            lines += _rows(cells)
        else:
            marks = ["^^" if k in sensor.raw_changed else "  " for k in range(len(cells))]
            for above, below in zip(_rows(cells), _rows(marks), strict=True):
                lines += [above, below]
    return lines


def _cell(sensor: _SensorReport, name: str, color: bool) -> str:
    text = f"{sensor.counts[name]:5d}"
    wanted = f"({sensor.expected[name]})" if sensor.expected else ""
    padding = " " * (14 - len(text) - len(wanted))
    return (f"{_MARK_CODE}{text}{_UNMARK_CODE}" if color and name in sensor.changed else text) + wanted + padding


_SHEET_HEIGHT = 7  # lines of the drawing


def draw_sheet(place: tuple[float, float] | None, certain: bool, width: int) -> list[str]:
    """Draw the unrolled sheet: end 1 (B) above, end 2 (A) below, D at the left edge and C at the right.

    Args:
        place: parts of the length from end 1 and of the wrap from D, 0 to 1; None for no touch.
        certain: whether the place is certain: it is drawn as O, else as a question mark.
        width: of the drawing [characters].
    """
    rows = [["."] * width for _ in range(_SHEET_HEIGHT)]
    if place is not None:
        row, column = round(place[0] * (_SHEET_HEIGHT - 1)), round(place[1] * (width - 1))
        rows[row][column] = "O" if certain else "?"
    lines = [f"   |{''.join(row)}|" for row in rows]
    lines[_SHEET_HEIGHT // 2] = f" D |{''.join(rows[_SHEET_HEIGHT // 2])}| C"
    return [f"   +{' B '.center(width, '-')}+", *lines, f"   +{' A '.center(width, '-')}+"]


def _rows(cells: list[str], count: int = 20) -> list[str]:
    return ["  " + " ".join(cells[at : at + count]) for at in range(0, len(cells), count)]
