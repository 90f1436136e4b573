"""From one frame to what it says: how firmly the sensor is touched, where, and whether it can be believed.

An untouched sensor and a broken one must never look the same. Each of A, B, C, D is driven in one phase and read in
another, so the two drive currents prove all four wires in every frame, touched or not; in the touch phase the drive
current must be what flows through the two pull-downs (Kirchhoff), which proves both inputs whenever there is a touch.
"""

from __future__ import annotations

from typing import NamedTuple

from .diagnosis import Fault
from .sensor import Sensor
from .wire import Frame, Status

__all__ = ["Reading", "read"]

_STATUS_FAULTS = int(~(Status.RESTARTED | Status.TOUCH) & 0xFF)
_LEVEL_NOISE = 0.002  # of the level, for the bound on what a leak between the layers can put on a guide
_GUIDE_SLACK = 0.05  # of the supply, the same
_SAME = 0.5  # two guides contradict each other if reciprocity is off by more than this part of the larger side


class Reading(NamedTuple):
    """What one frame says."""

    sensor: Sensor
    sequence: int  #: from the frame, modulo 65536
    clock_us: int  #: device clock [us], modulo 2**32
    level: float  #: 0 untouched .. 1 layers firmly joined; monotone in the conductance of the contact
    u: float  #: slant distance from end 1 [m]; 0.0 where nothing is known
    phi: float  #: azimuth [rad]; 0.0 where nothing is known
    location_valid: bool  #: u and phi are to be trusted; a touch may be certain while they are not yet
    fault: Fault | None  #: the first reason not to believe the frame


def read(sensor: Sensor, frame: Frame) -> Reading:
    """Work out what a frame says.

    The level is the mean of the two guides in the touch phase over the supply. The place comes from the potentials *at
    the contact*: an extended contact lets a current flow along the guide sheet, so its two electrodes differ, and the
    potential at the contact lies between them in proportion to its place (a fixed point, two passes).

    Args:
        sensor: the sensor that sent the frame.
        frame: the frame.

    Returns:
        the reading; a frame that cannot be believed has ``fault`` set, and then its other values are a guess.
    """
    (_, _, _, status, sequence, clock_us, c0, d0, _, c1, d1, i1, a2, b2, i2, supply) = frame
    bounds, limits = sensor.bounds, sensor.thresholds
    if not bounds.supply_low <= supply <= bounds.supply_high:
        worst = Fault.DEVICE if status & _STATUS_FAULTS else Fault.SUPPLY
        return Reading(sensor, sequence, clock_us, 0.0, 0.0, 0.0, False, worst)
    level = (c0 + d0) / (2.0 * supply)
    fault = _fault(sensor, frame, level)
    if level < limits.release_level:
        return Reading(sensor, sequence, clock_us, level, 0.0, 0.0, False, fault)

    # The guides' input resistors load the contact; how much follows from the same contact's level over the pull-downs.
    load = 1.0 + bounds.load_ratio * (1.0 / level - 1.0)
    drop1, drop2 = i1 * bounds.drop_per_current, i2 * bounds.drop_per_current
    span1, span2 = supply - 2.0 * drop1, supply - 2.0 * drop2
    b_positive, c_positive = sensor.b_positive, sensor.c_positive
    radial, angular = 0.5, (0.5 * (a2 + b2) * load - drop2) / span2
    for _ in (0, 1):
        towards_c = angular if c_positive else 1.0 - angular
        radial = ((d1 + (c1 - d1) * towards_c) * load - drop1) / span1
        towards_a = 1.0 - radial if b_positive else radial
        angular = ((b2 + (a2 - b2) * towards_a) * load - drop2) / span2
    u, phi = sensor.place(radial, angular)

    slack = limits.overshoot
    inside = -slack <= radial <= 1.0 + slack and -slack <= angular <= 1.0 + slack
    firm = level >= limits.location_level
    if firm and not inside and fault is None:
        fault = Fault.OUT_OF_RANGE
    spread = limits.guide_spread * supply
    valid = firm and inside and fault is None and abs(c1 - d1) <= spread and abs(a2 - b2) <= spread
    return Reading(sensor, sequence, clock_us, level, u, phi, valid, fault)


def _fault(sensor: Sensor, frame: Frame, level: float) -> Fault | None:
    """The first thing that is wrong with a frame whose supply is right, or None."""
    (_, _, _, status, _, _, c0, d0, i0, c1, d1, i1, a2, b2, i2, supply) = frame
    bounds, limits = sensor.bounds, sensor.thresholds
    if status & _STATUS_FAULTS:
        return Fault.DEVICE
    touched = level >= limits.touch_level
    if i1 < bounds.radial_low:
        names = (Fault.OPEN_A, Fault.OPEN_B) if sensor.b_positive else (Fault.OPEN_B, Fault.OPEN_A)
        return _which_open(0.5 * (c1 + d1), supply, touched, *names, Fault.OPEN_UPPER)
    if i2 < bounds.angular_low:
        names = (Fault.OPEN_D, Fault.OPEN_C) if sensor.c_positive else (Fault.OPEN_C, Fault.OPEN_D)
        return _which_open(0.5 * (a2 + b2), supply, touched, *names, Fault.OPEN_LOWER)
    if i1 > bounds.radial_high:
        return Fault.SHORT_UPPER
    if i2 > bounds.angular_high:
        return Fault.SHORT_LOWER
    full = bounds.full
    if c0 >= full or d0 >= full or c1 >= full or d1 >= full or a2 >= full or b2 >= full:
        return Fault.SATURATED
    if abs(i0 - (c0 + d0) * bounds.touch_current_per_guide) > bounds.touch_current_slack:
        return Fault.LEAK
    high, low = (c0, d0) if c0 >= d0 else (d0, c0)
    if low + bounds.noise < bounds.weaker_guide * high:
        return Fault.GUIDES_DISAGREE
    most = supply * (1.0 / (1.0 + bounds.load_ratio * (1.0 / (level + _LEVEL_NOISE) - 1.0)) + _GUIDE_SLACK)
    if c1 + d1 > 2.0 * most or a2 + b2 > 2.0 * most:
        return Fault.GUIDE_DRIVEN
    if touched:
        # Two touches at once also make the guides differ, but then reciprocity holds: (Vc - Vd)/I1 = -(Va - Vb)/I2.
        lower, upper = (c1 - d1) / i1, (a2 - b2) / i2
        spread = limits.guide_spread * supply
        if (abs(c1 - d1) > spread or abs(a2 - b2) > spread) and (
            abs(lower + upper if sensor.b_positive == sensor.c_positive else lower - upper)
            > _SAME * max(abs(lower), abs(upper))
        ):
            return Fault.GUIDES_DISAGREE
    return None


def _which_open(guide: float, supply: int, touched: bool, grounded: Fault, driven: Fault, either: Fault) -> Fault:
    """Name the open wire: through a touch the guide sees the sheet, which stands at the end that is still connected."""
    if not touched:
        return either
    if guide > 0.9 * supply:
        return grounded
    return driven if guide < 0.1 * supply else either
