"""Measurements of the frames of one sensor: what the counts themselves say about the firmware."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from math import gcd, sqrt
from statistics import median_high

from coneskin.core.finding import Finding
from coneskin.skin.detection.fault_diagnosis import explain_frame
from coneskin.skin.detection.frame.contact_matrix import FrameInversion
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.untouched import UntouchedZero
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame, Status

from .capture import swap_bytes
from .cause import Cause

_MEASURED_FIELDS = slice(Frame._fields.index("touch_c"), Frame._fields.index("driven"))
#: The measured fields of a frame, in the order of the wire.
MEASURED = Frame._fields[_MEASURED_FIELDS]
_SUPPLY_AT = MEASURED.index("touch_supply")
_TOUCH_AT, _RADIAL_AT, _ANGULAR_AT = (MEASURED.index(f"{phase}_current") for phase in ("touch", "radial", "angular"))
_GUIDE_PLACES = tuple(MEASURED.index(name) for name in ("radial_c", "radial_d", "angular_a", "angular_b"))
_MIN_FRAMES = 8
_STUCK_FRAMES = 400  # in a row with the same reading
_REMARKABLE_SHARE = 0.05  # of a drive current; layers vary by more, which a guard learns and a design does not know
_RAIL_SHARE = 0.95  # of full scale, from which on an amplifier may stand at its rail
_SHORT_SIEMENS, _CORNER = 0.1, 0.05  # a firm touch is 0.002 S; parts of a side and of the supply
_ZERO_SLACK = 2  # counts; a drive current that is no more than this above the zero is none
_UNTOUCHED_SHARE = 0.03  # of the supply, on both guides of the touch phase together
_REMARKABLE_HUM = 0.004  # of the supply, on a guide; it moves a place by as much of the sheet
_NEAR_SHARE = 0.06  # a reading is another one
_FULL_SCALES = (255, 1023, 4095, 16383, 65535)
_STATUS_FAULTS = (Status.SUPPLY, Status.ADC, Status.OVERRUN, Status.SELF_TEST, Status.OVERCURRENT)


def expected_counts(sensor: Sensor) -> tuple[int, ...]:
    """Return what an untouched sensor should read, in the order of ``MEASURED`` [counts]."""
    parts = sensor.electronics
    supply = parts.count_volts(parts.supply_volts)
    zero, radial, angular = map(parts.count_amperes, (0.0, sensor.radial_amperes, sensor.angular_amperes))
    return (0, 0, zero, 0, 0, radial, 0, 0, angular, supply, supply, supply)


def find_big_endian(frames: Sequence[Frame]) -> Finding | None:
    """Find frames whose numbers have their high byte first, by sequence and clock."""
    if len(frames) < _MIN_FRAMES:
        return None
    pairs = list(itertools.pairwise(frames))

    def share(number: Callable[[Frame], int], size: int, most: int) -> float:
        return sum(0 < (number(b) - number(a)) % (1 << 8 * size) <= most for a, b in pairs) / len(pairs)

    names = []
    for name, field, size, most in (("sequence", "sequence", 2, 1), ("clock", "clock_us", 4, 999_999)):
        straight = share(lambda f: getattr(f, field), size, most)  # noqa: B023  # called at once
        if share(lambda f: swap_bytes(getattr(f, field), size), size, most) > 0.8 and straight < 0.5:  # noqa: B023
            names.append(name)
    if names:
        return Cause.BIG_ENDIAN.found(f"the {' and the '.join(names)} of the frames come high byte first (big-endian)")
    counts = [count for frame in frames[-64:] for count in _measured(frame)]
    low = max(swap_bytes(count) for count in counts)
    if max(counts) > 0xFFF and low <= 0xFFF and gcd(*counts) % 16:
        return Cause.BIG_ENDIAN.found("the measurements come high byte first (big-endian)")
    return None


def _measured(frame: Frame) -> tuple[int, ...]:
    return frame[_MEASURED_FIELDS]  # type: ignore[return-value]  # integers, all of them


def find_status(frames: Sequence[Frame]) -> Finding | None:
    """Say what the device reports about itself."""
    if len(frames) < _MIN_FRAMES:
        return None
    restarts = sum(bool(b.status & Status.RESTARTED) and a[4:6] != b[4:6] for a, b in itertools.pairwise(frames))
    if restarts >= 0.5 * len(frames):
        return Cause.RESTARTED_ALWAYS.found("every frame says that the device has just started")
    if restarts >= 2:
        return Cause.RESTARTS.found(f"the device has started {restarts} times in {len(frames)} frames")
    if sum(bool(frame.status & Status.RESERVED) for frame in frames) > 0.1 * len(frames):
        return Cause.STATUS_RESERVED.found(f"the status is 0x{frames[-1].status:02X}, with its reserved bit")
    for bit in _STATUS_FAULTS:
        if sum(bool(frame.status & bit) for frame in frames) > 0.1 * len(frames):
            return Cause.STATUS.found(f"the device reports {bit.name} in its status")
    return None


def find_wrong_measurements(frames: Sequence[Frame], sensor: Sensor | None) -> Finding | None:
    """Say what is wrong with the measurements of one sensor, or of one without a scene."""
    if len(frames) < _MIN_FRAMES:
        return None
    columns = list(zip(*map(_measured, frames), strict=True))
    return (
        _find_scaling(columns, sensor)
        or find_short(frames, sensor)
        or _find_zero(columns)
        or (_find_unexpected(columns, sensor) if sensor is not None else None)
        or _find_still(columns)
        or _find_floating(columns)
    )


def find_short(frames: Sequence[Frame], sensor: Sensor | None) -> Finding | None:
    """Say which wires are shorted, before anything else is made of the readings of a sensor, or of one without a scene.

    A current that is cut off at full scale tells no resistance, and has no noise.
    """
    middles = [median_high(column) for column in zip(*map(_measured, frames), strict=True)]
    full = 4095 if sensor is None else sensor.electronics.full_count
    cut = [_RAIL_SHARE * full <= middles[k] <= full for k in (_TOUCH_AT, _RADIAL_AT, _ANGULAR_AT)]
    if all(cut):
        return Cause.CURRENT_OFF.found("all three drive currents stand at full scale")
    words = ""
    if sensor is not None and min(middles[_SUPPLY_AT:]) > 0:
        frame = UntouchedZero(sensor).take_off(frames[-1]._replace(**dict(zip(MEASURED, middles, strict=True))))
        said, matrix = explain_frame(sensor, frame), FrameInversion(sensor).invert(frame[6:18])
        words = said if "joined" in said or "stuck" in said else ""
        if matrix is not None and matrix.conductance > _SHORT_SIEMENS:
            off = max(abs(matrix.split), *(min(abs(part), abs(part - 1.0)) for part in (matrix.x, matrix.y)))
            if off < _CORNER:
                words = f"{'BA'[round(matrix.x)]} joined with {'DC'[round(matrix.y)]}"
    if any(cut):
        words = words or ("A or B joined to ground" if cut[0] else "")
        words = words or (Fault.SHORT_UPPER if cut[1] else Fault.SHORT_LOWER).value
        if middles[0] + middles[1] > _UNTOUCHED_SHARE * middles[_SUPPLY_AT]:
            words += "; or it is touched firmly"
        return Cause.SHORT.found(f"a short, a drive current stands at full scale: {words}")
    return Cause.SHORT.found(f"a short: {words}") if words else None


_Columns = Sequence[Sequence[int]]


def _find_scaling(columns: _Columns, sensor: Sensor | None) -> Finding | None:
    counts = [count for column in columns for count in column]
    top = max(counts)
    bits = 12 if sensor is None else sensor.electronics.adc_bits
    full = (1 << bits) - 1
    if all(len({*column}) == 1 for column in columns) and min(counts) == top and top in _FULL_SCALES:
        return Cause.SATURATED.found(f"every reading is {top}")
    if top <= full:
        return None
    negative = sum(count >= 0xF000 for count in counts)
    middling = sum(full < count < 0xF000 for count in counts)
    if negative and not middling and negative < 0.6 * len(counts):
        return Cause.NEGATIVE.found(f"some readings are negative: {top} is {top - 0x10000}")
    step = gcd(*counts)
    if step >= 4 and step & (step - 1) == 0 and top <= 0xFFFF:
        what = f"every reading is a multiple of {step}: the counts are shifted up by {step.bit_length() - 1} bits"
        return Cause.LEFT_JUSTIFIED.found(what)
    return Cause.SCALED.found(f"readings go up to {top}; the full scale of {bits} bits is {full}")


def _find_zero(columns: _Columns) -> Finding | None:
    if max(columns[_SUPPLY_AT]) == 0:
        return Cause.SUPPLY_ZERO.found("the supply reads 0 in every frame")
    zero = max((count for _, counts in _untouched(columns, (_TOUCH_AT,)) for count in counts), default=0)  # with a bias
    radial, angular = (max(columns[k]) <= zero + _ZERO_SLACK for k in (_RADIAL_AT, _ANGULAR_AT))
    if not (radial or angular):
        return None
    reads = f"{zero}, as without a current," if zero > 2 else "0"
    if radial and angular:
        return Cause.CURRENTS_ZERO.found(f"both drive currents read {reads} in every frame")
    phase, cause = ("radial", Cause.RADIAL_CURRENT_ZERO) if radial else ("angular", Cause.ANGULAR_CURRENT_ZERO)
    return cause.found(f"the drive current of the {phase} phase reads {reads} in every frame")


def _find_still(columns: _Columns) -> Finding | None:
    """Find readings without noise: each of those that the detector's STUCK looks at must have some."""
    if len(columns[0]) < _STUCK_FRAMES:
        return None
    still = [k for k, column in enumerate(columns) if len({*column[-_STUCK_FRAMES:]}) == 1]
    if len(still) == len(columns):
        return Cause.COUNTS_STUCK.found(f"no reading has changed in {_STUCK_FRAMES} frames")
    for k in still:
        if k in (_RADIAL_AT, _ANGULAR_AT) or k >= _SUPPLY_AT:
            return Cause.NO_NOISE.found(f"{MEASURED[k]} has not changed in {_STUCK_FRAMES} frames")
    return None


def _find_unexpected(columns: _Columns, sensor: Sensor) -> Finding | None:
    """Compare what does not depend on a touch with what the scene says: supply and drive currents."""
    parts, bounds = sensor.electronics, sensor.bounds
    expected = expected_counts(sensor)
    middles = [median_high(column) for column in columns]
    supply, wanted = middles[_SUPPLY_AT], expected[_SUPPLY_AT]
    said = f"the supply reads {supply:.0f} counts, the scene expects {wanted}"
    if not bounds.supply_low <= supply <= bounds.supply_high:
        for k, middle in enumerate(middles[:_SUPPLY_AT]):
            if abs(middle - wanted) < 0.03 * wanted:
                return Cause.FIELD_ORDER.found(f"{said}, and {MEASURED[k]} reads {middle:.0f}")
        if abs(supply - 1e3 * parts.supply_volts) < _NEAR_SHARE * supply:
            return Cause.MILLIVOLTS.found(f"{said}; these are the millivolts of {parts.supply_volts:g} V")
        for bits in range(8, 17):
            if bits != parts.adc_bits and abs(supply / wanted * 2.0 ** (parts.adc_bits - bits) - 1.0) < _NEAR_SHARE:
                return Cause.CONVERTER_BITS.found(f"{said}: as a converter of {bits} bits, not {parts.adc_bits}")
        return Cause.SUPPLY_OFF.found(said)
    radial, angular = middles[_RADIAL_AT] / expected[_RADIAL_AT], middles[_ANGULAR_AT] / expected[_ANGULAR_AT]
    turned = middles[_RADIAL_AT] / expected[_ANGULAR_AT], middles[_ANGULAR_AT] / expected[_RADIAL_AT]
    if all(abs(part - 1.0) < 0.1 for part in turned) and abs(radial - 1.0) > 0.2 and abs(angular - 1.0) > 0.2:
        what = f"the currents read {middles[_RADIAL_AT]:.0f} and {middles[_ANGULAR_AT]:.0f} counts"
        return Cause.PHASES_EXCHANGED.found(
            f"{what}, the scene expects {expected[_RADIAL_AT]} and {expected[_ANGULAR_AT]}"
        )
    limits = sensor.thresholds
    for name, part, k in (("radial", radial, _RADIAL_AT), ("angular", angular, _ANGULAR_AT)):
        if not limits.current_low <= part <= limits.current_high:
            what = f"the drive current of the {name} phase reads {middles[k]:.0f} counts"
            return Cause.CURRENT_OFF.found(f"{what}, the scene expects {expected[k]}")
    return None


def current_remarks(frames: Sequence[Frame], sensor: Sensor) -> list[str]:
    """Return what is remarkable though a guard takes it, drive currents off the design's and hum; a few words each."""
    columns, expected = list(zip(*map(_measured, frames), strict=True)), expected_counts(sensor)
    found = []
    for name, k in (("radial", _RADIAL_AT), ("angular", _ANGULAR_AT)):
        off = median_high(columns[k]) / max(expected[k], 1) - 1.0
        if abs(off) > _REMARKABLE_SHARE:
            found.append(f"{name} current {100.0 * off:+.0f} % of the design's: see coneskin doctor")
    hum = _measure_hum(columns)
    if hum > _REMARKABLE_HUM * expected[_SUPPLY_AT]:
        found.append(f"guides swing by {hum:.0f} counts, as by mains: shield the wires, join the grounds")
    return found


def _measure_hum(columns: _Columns) -> float:
    """Return the amplitude of what swings on the untouched guides [counts]; they stand at 0, which cuts half of it."""
    guides = _untouched(columns, _GUIDE_PLACES)
    squares = (sum(count * count for count in column) / len(column) for _, column in guides)
    return 2.0 * sqrt(max(squares, default=0.0))


def _untouched(columns: _Columns, places: Sequence[int]) -> Iterator[tuple[int, list[int]]]:
    """Yield places and their counts while nothing touches the sensor, where these are enough."""
    touch_c, touch_d, supply = columns[0], columns[1], columns[_SUPPLY_AT]
    untouched = [c + d < _UNTOUCHED_SHARE * s for c, d, s in zip(touch_c, touch_d, supply, strict=True)]
    if sum(untouched) >= _MIN_FRAMES:
        for k in places:
            yield k, list(itertools.compress(columns[k], untouched))


def _find_floating(columns: _Columns) -> Finding | None:
    """Find guides that wander although nothing touches the sensor."""
    supply = median_high(columns[_SUPPLY_AT])
    for k, counts in _untouched(columns, _GUIDE_PLACES):
        column = sorted(counts)
        spread = column[int(0.95 * (len(column) - 1))] - column[int(0.05 * (len(column) - 1))]
        if spread > max(0.02 * supply, 12.0):
            what = f"{MEASURED[k]} wanders by {spread:.0f} counts although nothing touches the sensor"
            return Cause.GUIDES_FLOAT.found(what)
    return None
