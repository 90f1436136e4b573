"""Text of a report: a screen for a terminal, a line for a pipe, an object for a program."""

from __future__ import annotations

import math
from typing import Any

from coneskin.core.text import printable
from coneskin.skin.diagnosis.measurements import MEASURED

from .line_monitor import LineReport, SensorReport

__all__ = ["describe_line", "describe_report", "draw_screen", "draw_sheet"]

_PHASES = (("touch", "C", "D"), ("radial", "C", "D"), ("angular", "A", "B"))
_BAR = 20  # characters of a full level
_MARK, _UNMARK = "\x1b[7m", "\x1b[0m"
_BAD, _GOOD = "\x1b[31m", "\x1b[32m"


def draw_screen(report: LineReport, *, with_hex: bool, columns: int, color: bool) -> list[str]:
    """Draw a report for a terminal; the first line is the diagnosis.

    Args:
        report: what to draw.
        with_hex: show the bytes of the newest frame of each sensor, or the newest bytes.
        columns: width of the terminal.
        color: changed numbers and the diagnosis may be highlighted.
    """
    line = printable(report.diagnosis.line)
    if color:
        line = f"{_GOOD if report.diagnosis.good else _BAD}{line}{_UNMARK}"
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
    return {
        "diagnosis": {"cause": named.cause.name.lower(), "what": named.what, "do": named.cause.value},
        "good": named.good,
        "time_s": round(report.time, 3),
        "bytes": report.size,
        "bytes_per_s": _finite(report.byte_rate),
        "bytes_skipped": report.skipped,
        "crc_errors": report.crc_errors,
        "sensors": [_sensor_object(sensor) for sensor in report.sensors],
    }


def _sensor_object(sensor: SensorReport) -> dict[str, Any]:
    return {
        "name": sensor.name,
        "frames": sensor.frames,
        "missing": sensor.missing,
        "rate_hz": _finite(sensor.numbers.rate),
        "clock_ratio": _finite(sensor.numbers.clock_ratio),
        "counts": sensor.counts,
        "expected": sensor.expected,
        "level": round(sensor.level, 4),
        "along": None if sensor.place is None else round(sensor.place[0], 4),
        "around": None if sensor.place is None else round(sensor.place[1], 4),
        "certain": sensor.certain,
        "health": sensor.health,
        "frame": sensor.raw.hex(),
    }


def _finite(value: float) -> float | None:
    return round(value, 6) if math.isfinite(value) else None


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "?"


def _draw_sensor(sensor: SensorReport, *, with_hex: bool, columns: int, color: bool) -> list[str]:
    numbers = sensor.numbers
    bar = "#" * round(_BAR * min(max(sensor.level, 0.0), 1.0))
    lines = [
        f"{sensor.name}: {_number(numbers.rate, 1)} frames/s, {sensor.missing} missing of "
        f"{sensor.frames + sensor.missing}, clock ratio {_number(numbers.clock_ratio, 4)}; {sensor.health}",
        f"level {sensor.level:5.3f} [{bar:<{_BAR}}] {sensor.words}",
        "counts (expected)  guide 1        guide 2        current        supply",
    ]
    for row, (phase, first, second) in enumerate(_PHASES):
        cells = [_cell(sensor, MEASURED[3 * row + k], color) for k in range(3)]
        cells.append(_cell(sensor, MEASURED[9 + row], color))
        lines.append(f"  {phase:<8} {first}, {second}    " + " ".join(cells))
    lines += draw_sheet(sensor.place, sensor.certain, max(16, min(60, columns - 12)))
    if with_hex:
        cells = [f"{byte:02X}" for byte in sensor.raw]
        if color:
            cells = [f"{_MARK}{cell}{_UNMARK}" if k in sensor.raw_changed else cell for k, cell in enumerate(cells)]
            lines += _rows(cells)
        else:
            marks = ["^^" if k in sensor.raw_changed else "  " for k in range(len(cells))]
            for above, below in zip(_rows(cells), _rows(marks), strict=True):
                lines += [above, below]
    return lines


def _cell(sensor: SensorReport, name: str, color: bool) -> str:
    text = f"{sensor.counts[name]:5d}"
    wanted = f"({sensor.expected[name]})" if sensor.expected else ""
    padding = " " * (14 - len(text) - len(wanted))
    return (f"{_MARK}{text}{_UNMARK}" if color and name in sensor.changed else text) + wanted + padding


def draw_sheet(place: tuple[float, float] | None, certain: bool, width: int, height: int = 7) -> list[str]:
    """Draw the unrolled sheet: end 1 (B) above, end 2 (A) below, D at the left edge and C at the right.

    Args:
        place: parts of the length from end 1 and of the wrap from D, 0 to 1; None for no touch.
        certain: whether the place is certain: it is drawn as O, else as a question mark.
        width: of the drawing [characters].
        height: of it [lines].
    """
    rows = [["."] * width for _ in range(height)]
    if place is not None:
        row, column = round(place[0] * (height - 1)), round(place[1] * (width - 1))
        rows[row][column] = "O" if certain else "?"
    label = "D" + " " * (width - 2) + "C"
    above, below = " B ", " A "
    return [
        f"   +{above.center(width, '-')}+",
        *(f" {label[0] if k == height // 2 else ' '} |{''.join(row)}| {label[-1] if k == height // 2 else ''}".rstrip()
          for k, row in enumerate(rows)),
        f"   +{below.center(width, '-')}+",
    ]  # fmt: skip


def _rows(cells: list[str], count: int = 20) -> list[str]:
    return ["  " + " ".join(cells[at : at + count]) for at in range(0, len(cells), count)]
