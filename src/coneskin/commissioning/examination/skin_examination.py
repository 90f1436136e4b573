"""Examination of an untouched skin: its line, its rates and clock, its noise and its currents. Pure."""

from __future__ import annotations

import functools
import math
import operator
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from coneskin.core.finding import Finding, Verdict, judged
from coneskin.skin.detection.frame.contact_matrix import FrameInversion
from coneskin.skin.detection.frame.untouched import compare_sheets
from coneskin.skin.diagnosis.capture import CaptureWindow
from coneskin.skin.diagnosis.diagnose import diagnose
from coneskin.skin.diagnosis.frame_numbers import FrameNumbers, measure_numbers
from coneskin.skin.diagnosis.measurements import MEASURED, find_short
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import FRAME_LENGTH, STATUS_FAULTS, Frame, FrameDecoder, Status

_CHANNELS = MEASURED[:10]  # of the supplies, one


@dataclass
class SensorStatistics:
    """Frames of one sensor, and when each was read [s]."""

    frames: list[Frame] = field(default_factory=list)
    times: list[float] = field(default_factory=list)

    def numbers(self) -> FrameNumbers:
        """Measure how the frames follow each other."""
        return measure_numbers(self.frames, self.times)

    def counts(self, channel: str) -> list[int]:
        """Return a reading of all frames [counts]."""
        return [getattr(frame, channel) for frame in self.frames]


class SkinStatistics:
    """Everything that came from one source since the listening began [s].

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

    def add(self, time: float, data: bytes) -> None:
        """Take bytes that were read at a time [s]."""
        self.received += len(data)
        self.window.feed(data, time)
        for frame in self.decoder.feed(data):
            seen = self.sensors.setdefault((frame.device, frame.sensor), SensorStatistics())
            seen.frames.append(frame)
            seen.times.append(time)


_BITS_PER_BYTE = 10  # on a serial line: start, eight, stop
_LINE_LOAD = 0.95  # part of a line's bytes that frames may take
_GOOD_RATE, _LOW_RATE = 200.0, 100.0  # Hz, docs/look-up/wire-format.md
_FRAMES_PER_SILENCE = 4.0  # frames in the time after which the skin is silent: a scene that is made for so low a rate
_CLOCK_ERROR = 0.01  # part by which the device's clock may be off as far as a few seconds show it
_MAX_LOST = 0.02  # part of the frames, as the detector allows
_NEAR_FACTOR, _FAR_FACTOR = 1.25, 2.0  # factors between a current and the design's: remarkable, refused
_GUIDE_NOISE = 0.01  # of the supply, on an untouched guide
_LEAST_LEAK, _MIDDLE = 2e-7, 0.1  # S between the layers that is no noise; part of a side, where that of damp is
_SUPPLY_ERROR = 0.10  # of the supply
_MAX_NOISE = 8.0  # counts of 12 bits
_CHANGED_SHEET, _CHANGED_SHEETS = 0.01, 0.05  # part by which one sheet, and both, may differ from what is known


def examine_line(
    seen: SkinStatistics, sensors: Sequence[Sensor], settings: Mapping[str, Any], now: float
) -> list[Finding]:
    """Examine what came from the source as a whole.

    Args:
        seen: from a few seconds.
        sensors: that the scene has there.
        settings: of the source; ``baud`` is asked for.
        now: when the listening ended [s].
    """
    count, baud = seen.decoder.frames, settings.get("baud")
    named = diagnose(seen.window.capture(now), sensors, baud)
    value = f"{count} frames in {seen.received} bytes, {seen.decoder.crc_errors} damaged"
    good = named.verdict == "ok"
    verdict: Verdict = "bad" if not count else "ok" if good else "warning"
    found = [Finding("frames", verdict, value if good else f"{value}; {named.value}", "", "" if good else named.remedy)]
    expected = {(sensor.device_id, sensor.sensor_id) for sensor in sensors}
    for device, number in sorted(expected - seen.sensors.keys()):
        there = ", ".join(f"{d}/{s}" for d, s in sorted(seen.sensors)) or "none"
        value, rule = f"it sends nothing; there are {there} (device/sensor)", "each sensor of the scene sends"
        remedy = "correct `device` and `id` of the sensor in the scene, or the numbers in the firmware"
        found.append(Finding(f"sensor {device}/{number}", "bad", value, rule, remedy))
    for device, number in sorted(seen.sensors.keys() - expected):
        value = "it sends, and the scene does not know it"
        found.append(Finding(f"sensor {device}/{number}", "warning", value, "", "add it"))
    if baud is not None and expected & seen.sensors.keys():
        rates = [one.numbers().rate for one in seen.sensors.values()]
        rate = sum(one for one in rates if math.isfinite(one))
        load = rate * FRAME_LENGTH * _BITS_PER_BYTE / baud
        value = f"{rate:.0f} frames/s take {100.0 * load:.0f} % of {baud} baud"
        remedy = "raise `baud` in the scene and in the firmware; a USB device of its own has no such limit"
        rule = f"at most {100 * _LINE_LOAD:.0f} %"
        found.append(judged("line", "warning" if load > _LINE_LOAD else "ok", value, rule, remedy))
    return found


def examine_sensor(
    sensor: Sensor, seen: SensorStatistics, drift: float, silence: float, rate: float = math.inf
) -> list[Finding]:
    """Examine one untouched sensor.

    Args:
        sensor: as the scene has it.
        seen: its frames, of a few seconds.
        drift: that the scene allows the device's clock, a part of the time.
        silence: after which the scene takes the skin for silent [s].
        rate: of frames, where the scene says it [Hz].
    """
    name = sensor.name
    if len(seen.frames) < 20:
        return [Finding(f"{name}, rate", "bad", f"{len(seen.frames)} frames only", "200 Hz or more", "see `frames`")]
    timing = _timing(name, seen, drift, silence, min(max(rate, _LOW_RATE), _GOOD_RATE))
    if short := find_short(seen.frames, sensor):  # the other readings say no more, and would be taken for more
        return [*timing, Finding(f"{name}, short", "bad", short.value, "no two wires are one", short.remedy)]
    return [
        *timing,
        *_levels(sensor, seen),
        *_noise(sensor, seen),
        *_currents(sensor, seen),
        *_since_known(sensor, seen),
    ]


def _timing(name: str, seen: SensorStatistics, drift: float, silence: float, wanted: float) -> list[Finding]:
    numbers = seen.numbers()
    rate, ratio = numbers.rate, numbers.clock_ratio
    enough = rate >= _LOW_RATE or rate * silence >= _FRAMES_PER_SILENCE
    good = rate >= (1.0 - max(_CLOCK_ERROR, drift)) * wanted  # as well as the device's clock knows it
    verdict: Verdict = "bad" if not enough else "ok" if good else "warning"
    remedy = "shorten the settling, raise the baud rate, or raise monitoring.skin_silence_ms"
    found = [judged(f"{name}, rate", verdict, f"{rate:.0f} frames/s", f"{wanted:.0f} to 1000", remedy)]
    remedy = "the line is too slow or disturbed, or this computer too busy"
    value = f"{100.0 * numbers.missing:.1f} % of the frames"
    found.append(judged(f"{name}, lost", numbers.missing <= _MAX_LOST, value, "at most 2 %", remedy))
    good = not abs(ratio - 1.0) > max(_CLOCK_ERROR, drift)
    verdict = "ok" if good else "warning" if numbers.hidden else "bad"
    remedy = "the frame's clock counts microseconds: correct the firmware's timer or prescaler"
    value, rule = f"{ratio:.3f} device seconds in a second", "1 +- 0.01, as far as a few seconds show it"
    if numbers.hidden and not good:
        value = f"not told: this computer held frames up, {1e3 * numbers.held_up:.0f} ms of them at once"
        remedy = "end what else this computer does, and look again; the board may be right"
    found.append(judged(f"{name}, clock", verdict, value, rule, remedy))
    return found


def _levels(sensor: Sensor, seen: SensorStatistics) -> list[Finding]:
    name, parts = sensor.name, sensor.electronics
    expected = parts.supply_volts / parts.adc_volts * parts.full_count
    supply = statistics.fmean(seen.counts("touch_supply"))
    good = abs(supply - expected) <= _SUPPLY_ERROR * expected
    remedy = "correct supply_v, adc_v and adc_bits of the sensor, or the supply itself"
    found = [judged(f"{name}, supply", good, f"{supply:.0f} counts", f"{expected:.0f} +- 10 %", remedy)]
    guides = [channel for channel in _CHANNELS if not channel.endswith(("current", "supply"))]
    parts_of_supply = {channel: statistics.fmean(seen.counts(channel)) / max(supply, 1.0) for channel in guides}
    worst, part = max(parts_of_supply.items(), key=operator.itemgetter(1))
    remedy = "nothing may touch it now; else shield the wires, lower input_ohm, look for a short"
    value = f"at most {100.0 * part:.2f} % of the supply, on {worst}"
    means = [statistics.fmean(counts) for counts in zip(*(frame[6:18] for frame in seen.frames), strict=True)]
    matrix = FrameInversion(sensor).invert(means) if min(means[-3:]) > 0.0 else None
    if matrix is not None and matrix.conductance > _LEAST_LEAK:
        value += f"; {1e6 * matrix.conductance:.2g} uS join the layers"
        if max(abs(matrix.x - 0.5), abs(matrix.y - 0.5)) < _MIDDLE:
            remedy = "nothing may touch it now; else it is damp all over: dry it, and seal its edges"
    found.append(judged(f"{name}, guides", part <= _GUIDE_NOISE, value, "untouched: at most 1 %", remedy))
    if status := functools.reduce(operator.or_, seen.counts("status")) & STATUS_FAULTS:
        value = f"the device reports {', '.join(bit.name or str(bit.value) for bit in Status if bit & status)}"
        found.append(Finding(f"{name}, status", "bad", value, "none", "docs/look-up/wire-format.md"))
    return found


def _noise(sensor: Sensor, seen: SensorStatistics) -> list[Finding]:
    name = sensor.name
    noise = {channel: statistics.pstdev(seen.counts(channel)) for channel in _CHANNELS}
    still = ", ".join(name for name in ("radial_current", "angular_current", "touch_supply") if noise[name] == 0.0)
    scale = sensor.electronics.full_count / 4095.0
    loud = ", ".join(channel for channel, value in noise.items() if value > _MAX_NOISE * scale)
    value = ", ".join(f"{channel} {value:.1f}" for channel, value in noise.items())
    remedy = f"{loud}: ground and shield the sensor, settle longer, average in the firmware"
    if still:
        remedy = f"{still} never changed: a converter of more bits, or monitoring.stuck_frames = 0"
    verdict: Verdict = "bad" if still else "warning" if loud else "ok"
    return [judged(f"{name}, noise", verdict, f"counts rms: {value}", "each current and supply moves", remedy)]


def _currents(sensor: Sensor, seen: SensorStatistics) -> list[Finding]:
    parts, found = sensor.electronics, []
    for phase, wires, key, design, ohms, sheet in (
        ("radial", "A or B", "upper_sheet_ohm", sensor.radial_amperes, sensor.radial_ohms, sensor.upper_sheet_ohms),
        ("angular", "C or D", "lower_sheet_ohm", sensor.angular_amperes, sensor.angular_ohms, sensor.lower_sheet_ohms),
    ):
        measured = parts.amperes(statistics.fmean(seen.counts(f"{phase}_current")))
        off = max(measured / design, design / measured) if measured > 0.0 else math.inf
        verdict: Verdict = "ok" if off <= _NEAR_FACTOR else "warning" if off <= _FAR_FACTOR else "bad"
        remedy = f"the wire of {wires} is open, shorted to the supply, or exchanged with one of the other sheet"
        if measured >= 0.2 * design:
            own = sheet * (1.0 + parts.supply_volts * (1.0 / measured - 1.0 / design) / ohms)  # the leads stay
            remedy = f"if nothing is broken your layer has {own:.0f} ohm per square: write {key} = {own:.0f}"
        value, rule = f"{1e3 * measured:.3f} mA", f"the design's {1e3 * design:.3f} mA, within {_NEAR_FACTOR:g} times"
        found.append(judged(f"{sensor.name}, {phase} current", verdict, value, rule, remedy))
    return found


def _since_known(sensor: Sensor, seen: SensorStatistics) -> list[Finding]:
    """Compare the untouched sheets with what they were when the sensor was commissioned or calibrated."""
    item = f"{sensor.name}, sheets"
    if not sensor.known_ohms:
        remedy = "an electrode that has peeled off before cannot be told: coneskin commission"
        return [Finding(item, "not tried", "nobody knows what the untouched sheets were", "", remedy)]
    mean = {name: statistics.fmean(seen.counts(name)) for name in _CHANNELS}
    zero = mean["touch_current"] - sensor.bounds.touch_current_per_guide * (mean["touch_c"] + mean["touch_d"])
    drawn = [(mean[f"{phase}_current"] - zero) / max(mean["touch_supply"], 1.0) for phase in ("radial", "angular")]
    if not min(drawn) > 0.0:
        return []  # which is another finding
    ohms = sensor.sheet_ohms(*FrameInversion(sensor).untouched(*drawn))
    where, value = compare_sheets(sensor.known_ohms, ohms, _CHANGED_SHEET, _CHANGED_SHEETS)
    remedy = f"{where}, has changed (peeled, damp, warm, torn): look at it, then calibrate and commission again"
    rule = f"one within {100 * _CHANGED_SHEET:g} % of the other, both within {100 * _CHANGED_SHEETS:g} %"
    return [judged(item, "warning" if where else "ok", value, rule, remedy)]
