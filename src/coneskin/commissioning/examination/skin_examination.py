"""Examination of an untouched skin: its line, its rates and clock, its noise and its currents. Pure."""

from __future__ import annotations

import math
import statistics
from typing import TYPE_CHECKING, Any

from coneskin.core.finding import Finding, Verdict
from coneskin.skin.diagnosis.capture import CaptureWindow
from coneskin.skin.diagnosis.diagnose import diagnose
from coneskin.skin.diagnosis.frame_numbers import FrameNumbers, measure_numbers
from coneskin.skin.wire import FRAME_LENGTH, Frame, FrameDecoder, Status

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from coneskin.skin.sensor import Sensor

_CHANNELS = (
    *("touch_c", "touch_d", "touch_current", "radial_c", "radial_d", "radial_current"),
    *("angular_a", "angular_b", "angular_current", "touch_supply"),
)
_MAX_FRAMES = 20_000  # frames that are kept of a sensor


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
        if len(self.frames) < _MAX_FRAMES:
            self.frames.append((time, frame))

    def numbers(self) -> FrameNumbers:
        """Measure how the frames follow each other."""
        return measure_numbers([frame for _, frame in self.frames], [time for time, _ in self.frames])

    def mean(self, channel: str) -> float:
        """Return the mean of a reading [counts]."""
        return statistics.fmean(self._values(channel))

    def noise(self, channel: str) -> float:
        """Return the standard deviation of a reading [counts]."""
        return statistics.pstdev(self._values(channel))

    def _values(self, channel: str) -> list[int]:
        return [getattr(frame, channel) for _, frame in self.frames]


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
        self.window.feed(data, time)
        frames = self.decoder.feed(data)
        for frame in frames:
            self.sensors.setdefault((frame.device, frame.sensor), SensorStatistics()).add(time, frame)
        return frames


_BITS_PER_BYTE = 10  # on a serial line: start, eight, stop
_LINE_LOAD = 0.95  # part of a line's bytes that frames may take
_GOOD_RATE, _LOW_RATE = 200.0, 100.0  # Hz, docs/look-up/wire-format.md
_FRAMES_PER_SILENCE = 4.0  # frames in the time after which the skin is silent: a scene that is made for so low a rate
_CLOCK_ERROR = 0.01  # part by which the device's clock may be off as far as a few seconds show it
_MAX_LOST = 0.02  # part of the frames, as the detector allows
_NEAR_FACTOR, _FAR_FACTOR = 1.25, 2.0  # factors between a current and the design's: remarkable, refused
_GUIDE_NOISE = 0.01  # of the supply, on an untouched guide
_SUPPLY_ERROR = 0.10  # of the supply
_MAX_NOISE = 8.0  # counts of 12 bits
_STATUS_FAULTS = int(~(Status.RESTARTED | Status.TOUCH) & 0xFF)


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
    if named.verdict != "ok":
        found = [Finding("frames", "warning" if count else "bad", f"{value}; {named.value}", "", named.remedy)]
    else:
        found = [Finding("frames", "ok" if count else "bad", value)]
    expected = {(sensor.device_id, sensor.sensor_id) for sensor in sensors}
    for device, number in sorted(expected - seen.sensors.keys()):
        there = ", ".join(f"{d}/{s}" for d, s in sorted(seen.sensors)) or "none"
        found.append(
            Finding(
                f"sensor {device}/{number}",
                "bad",
                f"it sends nothing; there are {there} (device/sensor)",
                "each sensor of the scene sends",
                "correct `device` and `id` of the sensor in the scene, or the numbers in the firmware",
            )
        )
    for device, number in sorted(seen.sensors.keys() - expected):
        found.append(
            Finding(f"sensor {device}/{number}", "warning", "it sends, and the scene does not know it", "", "add it")
        )
    if baud is not None and expected & seen.sensors.keys():
        rates = [one.numbers().rate for one in seen.sensors.values()]
        rate = sum(one for one in rates if math.isfinite(one))
        load = rate * FRAME_LENGTH * _BITS_PER_BYTE / baud
        value = f"{rate:.0f} frames/s take {100.0 * load:.0f} % of {baud} baud"
        full = load > _LINE_LOAD
        remedy = (
            "raise `baud` in the scene and in the firmware; a USB device of its own has no such limit" if full else ""
        )
        found.append(Finding("line", "warning" if full else "ok", value, f"at most {100 * _LINE_LOAD:.0f} %", remedy))
    return found


def examine_sensor(sensor: Sensor, seen: SensorStatistics, drift: float, silence: float) -> list[Finding]:
    """Examine one untouched sensor.

    Args:
        sensor: as the scene has it.
        seen: its frames, of a few seconds.
        drift: that the scene allows the device's clock, a part of the time.
        silence: after which the scene takes the skin for silent [s].
    """
    name = sensor.name
    if len(seen.frames) < 20:
        return [Finding(f"{name}, rate", "bad", f"{len(seen.frames)} frames only", "200 Hz or more", "see `frames`")]
    return [
        *_timing(name, seen, drift, silence),
        *_levels(sensor, seen),
        *_noise(sensor, seen),
        *_currents(sensor, seen),
    ]


def _timing(name: str, seen: SensorStatistics, drift: float, silence: float) -> list[Finding]:
    numbers = seen.numbers()
    rate = numbers.rate
    enough = rate >= _LOW_RATE or rate * silence >= _FRAMES_PER_SILENCE
    verdict: Verdict = "ok" if rate >= _GOOD_RATE else "warning" if enough else "bad"
    remedy = "" if verdict == "ok" else "shorten the settling, raise the baud rate, or raise monitoring.skin_silence_ms"
    found = [Finding(f"{name}, rate", verdict, f"{rate:.0f} frames/s", "200 to 1000", remedy)]
    verdict = "ok" if numbers.missing <= _MAX_LOST else "bad"
    remedy = "" if verdict == "ok" else "the line is too slow or disturbed, or this computer too busy"
    found.append(
        Finding(f"{name}, lost", verdict, f"{100.0 * numbers.missing:.1f} % of the frames", "at most 2 %", remedy)
    )
    ratio = numbers.clock_ratio
    verdict = "ok" if abs(ratio - 1.0) <= max(_CLOCK_ERROR, drift) else "bad"
    remedy = (
        "" if verdict == "ok" else "the frame's clock counts microseconds: correct the firmware's timer or prescaler"
    )
    value = f"{ratio:.3f} device seconds in a second"
    found.append(Finding(f"{name}, clock", verdict, value, "1 +- 0.01, as far as a few seconds show it", remedy))
    return found


def _levels(sensor: Sensor, seen: SensorStatistics) -> list[Finding]:
    name, parts = sensor.name, sensor.electronics
    expected = parts.supply_volts / parts.adc_volts * parts.full_count
    supply = seen.mean("touch_supply")
    good = abs(supply - expected) <= _SUPPLY_ERROR * expected
    remedy = "" if good else "correct supply_v, adc_v and adc_bits of the sensor, or the supply itself"
    found = [
        Finding(f"{name}, supply", "ok" if good else "bad", f"{supply:.0f} counts", f"{expected:.0f} +- 10 %", remedy)
    ]
    guides = [channel for channel in _CHANNELS if not channel.endswith(("current", "supply"))]
    worst = max(guides, key=seen.mean)
    part = seen.mean(worst) / max(supply, 1.0)
    good = part <= _GUIDE_NOISE
    remedy = "" if good else "nothing may touch it now; else shield the wires, lower input_ohm, look for a short"
    value = f"at most {100.0 * part:.2f} % of the supply, on {worst}"
    found.append(Finding(f"{name}, guides", "ok" if good else "bad", value, "untouched: at most 1 %", remedy))
    status = seen.status & _STATUS_FAULTS
    if status:
        names = ", ".join(bit.name or str(bit.value) for bit in Status if bit & status)
        found.append(
            Finding(f"{name}, status", "bad", f"the device reports {names}", "none", "docs/look-up/wire-format.md")
        )
    return found


def _noise(sensor: Sensor, seen: SensorStatistics) -> list[Finding]:
    name = sensor.name
    noise = {channel: seen.noise(channel) for channel in _CHANNELS}
    still = [channel for channel in ("radial_current", "angular_current", "touch_supply") if noise[channel] == 0.0]
    scale = sensor.electronics.full_count / 4095.0
    loud = [channel for channel, value in noise.items() if value > _MAX_NOISE * scale]
    value = ", ".join(f"{channel} {value:.1f}" for channel, value in noise.items())
    verdict: Verdict = "bad" if still else "warning" if loud else "ok"
    remedy = ""
    if still:
        remedy = f"{', '.join(still)} never changed: a converter of more bits, or monitoring.stuck_frames = 0"
    elif loud:
        remedy = f"{', '.join(loud)}: ground and shield the sensor, settle longer, average in the firmware"
    return [Finding(f"{name}, noise", verdict, f"counts rms: {value}", "each current and supply moves", remedy)]


def _currents(sensor: Sensor, seen: SensorStatistics) -> list[Finding]:
    parts, found = sensor.electronics, []
    ampere = parts.current_full_scale / parts.full_count
    for phase, design, wires, key, ohms, sheet, leads in (
        (
            "radial",
            sensor.radial_amperes,
            "A and B",
            "upper_sheet_ohm",
            sensor.radial_ohms,
            sensor.upper_sheet_ohms,
            (0, 1),
        ),
        (
            "angular",
            sensor.angular_amperes,
            "C and D",
            "lower_sheet_ohm",
            sensor.angular_ohms,
            sensor.lower_sheet_ohms,
            (2, 3),
        ),
    ):
        measured = seen.mean(f"{phase}_current") * ampere
        ratio = measured / design
        verdict: Verdict = "ok" if 1.0 / _NEAR_FACTOR <= ratio <= _NEAR_FACTOR else "warning"
        remedy = ""
        if ratio < 1.0 / _FAR_FACTOR or ratio > _FAR_FACTOR:
            verdict = "bad"
        if ratio < 0.02:
            remedy = f"no current: the wires of {wires} are open, or on the electrodes of both sheets"
        elif verdict != "ok":
            lead = sum(parts.lead_ohms[number] for number in leads)
            own = (parts.supply_volts / measured - lead) * sheet / ohms
            remedy = f"if nothing is broken your layer has {own:.0f} ohm per square: write {key} = {own:.0f}"
        value, rule = f"{1e3 * measured:.3f} mA", f"the design's {1e3 * design:.3f} mA, within {_NEAR_FACTOR:g} times"
        found.append(Finding(f"{sensor.name}, {phase} current", verdict, value, rule, remedy))
    return found
