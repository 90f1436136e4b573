"""Faults of a sensor: one name and one sentence for each."""

from __future__ import annotations

from enum import Enum


class Fault(Enum):
    """A reason why a reading must not be taken for "no touch". The value is the sentence for people."""

    # in one frame (reading.py)
    DEVICE = "the device reports a fault of its own in its status bits"
    SUPPLY = "the supply of the sensor is outside its range: check the supply and supply_v of the scene"
    OPEN_UPPER = "no drive current between A and B: the wire of A or of B is open, or fed from elsewhere"
    OPEN_A = "no drive current between A and B: the wire of A is open, or fed from elsewhere"
    OPEN_B = "no drive current between A and B: the wire of B is open, or fed from elsewhere"
    OPEN_LOWER = "no drive current between C and D: the wire of C or of D is open, or fed from elsewhere"
    OPEN_C = "no drive current between C and D: the wire of C is open, or fed from elsewhere"
    OPEN_D = "no drive current between C and D: the wire of D is open, or fed from elsewhere"
    SHORT_UPPER = "too much drive current in the radial phase: A and B are shorted, or one of them to ground or supply"
    SHORT_LOWER = "too much drive current in the angular phase: C and D are shorted, or one of them to ground or supply"
    SATURATED = "a guide stands at the converter's full scale: an input is shorted to the supply or stuck"
    LEAK = (
        "the drive current of the touch phase is not what flows through the pull-downs: an electrode is shorted to "
        "ground or to the supply, an input is stuck, or its gain or that of the current is off"
    )
    ZERO = (
        "the drive current does not read its zero where none flows: the offset of its amplifier is too large, "
        "current_zero_ma of the scene is not the board's, or A or B leaks to ground; where it stays with the sensor "
        "unplugged it is the board"
    )
    GUIDES_DISAGREE = (
        "the guides contradict each other or the drive current: an input or a pull-down is broken, its gain is off, "
        "or wires are exchanged"
    )
    GUIDE_DRIVEN = (
        "a guide has a potential that no contact gives it: a switch of its electrodes is stuck, or the touch phase "
        "does not see a touch"
    )
    LEAD = (
        "a driven electrode does not have the potential that drives it: a lead, a connector or a switch has too much "
        "resistance, or the reading of the supply is off"
    )
    OUT_OF_RANGE = "the potential at the contact lies outside the driven range"
    # between frames (detector.py)
    LAYERS_CLOSED = (
        "the layers stay in contact: something rests on the sensor, they are stuck or damp, or two wires are joined"
    )
    DRIFT = "the level of the untouched sensor is too close to the touch threshold: it is damp, or something lies on it"
    CURRENT_CHANGED = (
        "a drive current of the untouched sensor has changed: a sheet or an electrode is damaged, or a touch is not "
        "seen"
    )
    NOISE = "the readings carry more noise than the thresholds bear: check shield, ground and supply of the electronics"
    STUCK = "a reading that always carries noise has not changed at all: the converter or the device is stuck"
    GAP = "more frames are missing than allowed: check cable, baud rate and what else keeps the computer busy"
    REPLAYED = "a frame came twice or out of order: its sequence number or its clock is not newer than the last"
    CLOCK_JUMP = "the device clock does not agree with the sequence number: the device stalled or its clock jumped"
    CLOCK_FAST = "the device clock runs faster than the host's: late frames would not be noticed"
    RESTARTED = "the device has started anew: check its power and its firmware's watchdog"
    LATE = "frames arrive too long after they were measured: the reader or the link lags behind"
    SILENT = "no valid frame has come for too long: check power, cable and frame rate"
    # on the stream (stream.py)
    UNKNOWN_SENSOR = "frames come from a device or sensor that is not in the scene: add it, or correct its id"
    UNKNOWN_VERSION = "frames come in a version of the wire format that cannot be read: update coneskin or the firmware"
    CORRUPT = "bytes arrive that are no frames, or frames with a wrong checksum: check baud rate and line"
