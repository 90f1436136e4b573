"""What can be wrong with a sensor: one name and one sentence for each fault."""

from __future__ import annotations

from enum import Enum

__all__ = ["Fault"]


class Fault(Enum):
    """A reason why a reading must not be taken for "no touch"; the value is the sentence for people."""

    # in one frame (reading.py)
    DEVICE = "the device reports a fault of its own in its status bits"
    SUPPLY = "the supply of the sensor is outside its range"
    OPEN_UPPER = "no drive current between A and B: the wire of A or of B is open, or fed from elsewhere"
    OPEN_A = "no drive current between A and B: the wire of A is open, or fed from elsewhere"
    OPEN_B = "no drive current between A and B: the wire of B is open, or fed from elsewhere"
    OPEN_LOWER = "no drive current between C and D: the wire of C or of D is open, or fed from elsewhere"
    OPEN_C = "no drive current between C and D: the wire of C is open, or fed from elsewhere"
    OPEN_D = "no drive current between C and D: the wire of D is open, or fed from elsewhere"
    SHORT_UPPER = "too much drive current in the radial phase: A and B are shorted, or the positive one to ground"
    SHORT_LOWER = "too much drive current in the angular phase: C and D are shorted, or the positive one to ground"
    SATURATED = "a guide stands at the converter's full scale: an input is shorted to the supply or stuck"
    LEAK = (
        "the drive current of the touch phase is not what flows through the pull-downs: an electrode is shorted to "
        "ground or to the supply, or an input is stuck"
    )
    GUIDES_DISAGREE = "the two guides of a phase contradict each other: an input or a pull-down is broken"
    GUIDE_DRIVEN = "a guide has a potential although nothing joins the layers: a switch of its electrodes is stuck"
    OUT_OF_RANGE = "the potential at the contact lies outside the driven range"
    # between frames (detector.py)
    LAYERS_CLOSED = "the layers have been in contact for too long: something rests on the sensor, or they are stuck"
    DRIFT = "the level of the untouched sensor has drifted too close to the touch threshold"
    STUCK = "readings that always carry noise have stood exactly still: the converter or the device is stuck"
    GAP = "more frames are missing than allowed: the sequence number jumped"
    REPLAYED = "a frame came twice or out of order: its sequence number or its clock is not newer than the last"
    CLOCK_JUMP = "the device clock does not go with the sequence number: the device stalled or its clock jumped"
    RESTARTED = "the device has started anew"
    LATE = "frames arrive too long after they were measured: the reader or the link lags behind"
    SILENT = "no valid frame has come for too long"
    # on the stream (stream.py)
    UNKNOWN_SENSOR = "frames come from a device or sensor that is not in the scene"
    UNKNOWN_VERSION = "frames come in a version of the wire format that cannot be read"
    CORRUPT = "bytes arrive that are no frames, or frames with a wrong checksum"
