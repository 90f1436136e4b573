"""Diagnosis of a capture: every examination in the order in which one mistake would hide the next."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate, pairwise

from coneskin.core.finding import Finding
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import FRAME_LENGTH, MAX_LENGTH, Frame, FrameDecoder, encode

from .capture import Capture, FoundFrames, find_frames, printable_share, short_hex
from .cause import Cause
from .foreign_stream import find_baud, find_coding, find_constant, find_protocol, find_text, first_line
from .frame_numbers import find_wrong_numbers, measure_numbers
from .frame_shape import find_damage, find_foreign_sync, find_padding, find_shape
from .measurements import current_remarks, find_big_endian, find_status, find_wrong_measurements

_FEW_BYTES = 64  # bytes, of which nothing can be said
_STOPPED_TIME = 0.7  # s without a byte
_SHAPE_LENGTH = 1 << 13  # newest bytes in which the shape is looked for
_MIN_FRAMES = 3
_SAMPLE_COUNT = 48  # longer frames in which padding is looked for: a padded one of 36 bytes is as long
_MIN_COVERED = 0.02  # share of the bytes that are valid frames; fewer are chance


def diagnose(capture: Capture, sensors: Sequence[Sensor] = (), baud: int | None = None) -> Finding:
    """Say what is wrong with the bytes of a line.

    Args:
        capture: the newest bytes; two seconds of them say all that can be said.
        sensors: that a scene expects on this line; empty where there is no scene.
        baud: rate at which the port listens [1/s]; None where it has none.

    Returns:
        the likeliest cause; where several mistakes come together, that which has to be mended first.
    """
    data = capture.data
    if not data:
        return Cause.SILENT.found(f"no byte has come for {capture.silence:.1f} s")
    found = find_frames(data)
    if len(found.frames) >= _MIN_FRAMES and found.covered >= _MIN_COVERED:
        named = find_damage(data, found) or _find_in_frames(capture, found, sensors)
    else:
        named = _find_without_frames(capture, data, baud)
    if capture.timed and capture.silence > _STOPPED_TIME:
        return _stopped(capture, data, named)
    return named


def _stopped(capture: Capture, data: bytes, before: Finding) -> Finding:
    silence = f"nothing has come for {capture.silence:.1f} s"
    if before.item == Cause.TEXT.key and len(data) < 4096:
        return Cause.STOPPED.found(f"{silence}; before, the device wrote {first_line(data)!r}")
    good = "" if before.verdict == "ok" else f" ({before.value})"
    return Cause.STOPPED.found(f"{silence}, after {len(data)} bytes{good}")


def _find_without_frames(capture: Capture, data: bytes, baud: int | None) -> Finding:
    rate = len(data) / capture.duration if capture.duration > 0.0 else math.inf  # of a file, whose bytes have no times
    newest = data[-_SHAPE_LENGTH:]
    decoder = FrameDecoder()
    decoder.feed(newest)
    if decoder.unknown_versions >= _MIN_FRAMES:
        what = f"frames come in version {decoder.last_unknown_version}, which this coneskin does not know"
        return Cause.VERSION.found(what)
    named = (
        find_constant(data, rate, baud)
        or (find_text(newest) if len(data) >= 4 else None)
        or find_coding(newest)
        or find_shape(newest)
        or _find_seven_bits(newest)
        or find_foreign_sync(newest)
        or find_protocol(capture, newest)
        or find_baud(newest, baud)
    )
    if named:
        return named
    if len(data) < _FEW_BYTES:
        return Cause.FEW_BYTES.found(f"only {len(data)} bytes have come: {short_hex(data)}")
    how_many = f"{rate:.0f} bytes a second" if math.isfinite(rate) else f"{len(data)} bytes"
    return Cause.UNKNOWN.found(f"{how_many} come, but no frame: {short_hex(newest[-MAX_LENGTH:])}")


def _find_seven_bits(data: bytes) -> Finding | None:
    """Find frames whose eighth bits are gone, or have become a parity bit."""
    low = data.translate(bytes(n & 0x7F for n in range(256)))
    if max(data) < 0x80 and low.count(b"\x45\x3a") >= _MIN_FRAMES and printable_share(data) < 0.9:
        return Cause.SEVEN_BITS.found("no byte has its highest bit set, and frames seem to begin with 45 3A")
    return None


def _find_in_frames(capture: Capture, found: FoundFrames, sensors: Sequence[Sensor]) -> Finding:
    by_sensor = capture.by_sensor(found)
    known = {(sensor.device_id, sensor.sensor_id): sensor for sensor in sensors}
    good = []
    for key, (frames, at) in by_sensor.items():
        name = f"device {key[0]}, sensor {key[1]}"
        sensor = known.get(key)
        longer = [encode(frame) for frame in frames[-_SAMPLE_COUNT:] if frame.length > FRAME_LENGTH]
        named = find_padding(longer) or find_status(frames) or find_big_endian(frames)
        if named is None and sensors and sensor is None:
            listing = ", ".join(f"{device}/{number}" for device, number in known)
            named = Cause.UNKNOWN_SENSOR.found(f"frames come from {name}; the scene expects {listing}")
        if named is None:
            named = find_wrong_measurements(frames, sensor)
        if named is None or named.item == Cause.GUIDES_FLOAT.key:
            wrong = find_wrong_numbers(frames, at if capture.timed else _by_device(frames), len(by_sensor))
            named = wrong or named
        if named is not None:
            return replace(named, value=f"{name}: {named.value}") if len(by_sensor) > 1 else named
        numbers = measure_numbers(frames, at)
        ratio = "" if math.isnan(numbers.clock_ratio) else f", clock ratio {numbers.clock_ratio:.4f}"
        said = f"{name}: {numbers.rate:.0f} a second{ratio}" if capture.timed else name
        good.append(", ".join([said, *(current_remarks(frames, sensor) if sensor is not None else ())]))
    missing = [sensor.name for sensor in sensors if (sensor.device_id, sensor.sensor_id) not in by_sensor]
    if missing:
        return Cause.UNKNOWN_SENSOR.found(f"no frame comes from {', '.join(missing)}")
    return Cause.NONE.found(f"frames come as they should ({'; '.join(good)})")


def _by_device(frames: Sequence[Frame]) -> list[float]:
    """Return the times of frames by their own clock [s], for bytes from a file."""
    steps = ((after.clock_us - before.clock_us) & 0xFFFFFFFF for before, after in pairwise(frames))
    return [1e-6 * total for total in accumulate(steps, initial=0)]
