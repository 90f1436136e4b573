"""Reading of one frame: how firmly the sensor is touched, where, and whether the frame can be believed.

An untouched sensor and a broken one must never look the same. Each of A, B, C, D is driven in one phase and read in
another, so the two drive currents prove all four wires in every frame, touched or not. In the touch phase the drive
current must be what flows through the two pull-downs (Kirchhoff). That proves both inputs whenever there is a touch.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import STATUS_FAULTS, Frame

from .contact_matrix import ContactMatrix, FrameInversion
from .faults import Fault


class TouchReading(NamedTuple):
    """One frame of a touch. Events come only where something changes. This comes with every frame."""

    time: float  #: host clock when the frame arrived [s]
    level: float  #: how firmly, 0..1, the drift of the untouched sensor taken off
    u: float  #: slant distance from end 1 [m]; while the touch rests, the mean of its frames
    phi: float  #: azimuth [rad], likewise
    location_valid: bool  #: u and phi can be trusted
    doubt: str  #: why the place is not certain, for people; empty where it is
    clock_us: int  #: device clock of the frame [us], modulo 2**32
    sequence: int  #: sequence number of the frame
    covariance: tuple[float, float, float] | None = None  #: uu, us, ss [m^2], s along the circle
    radius: float | None = None  #: of a round contact [m]; None where the frames do not tell
    radius_deviation: float | None = None  #: standard deviation of its logarithm
    elongation: tuple[float, float] | None = None  #: of what is not one disc: half length [m], direction [rad]
    velocity: tuple[float, float] = (0.0, 0.0)  #: along the side and around [m/s]


_LEVEL_NOISE: Final = 1.5  # counts; noise of the level in the bound on what a leak between the layers puts on a guide
_GUIDE_SLACK: Final = 0.05  # part of the supply that a guide may stand above that bound
_NOISE_DEVIATIONS: Final = 7.0  # standard deviations of noise that are no contradiction
_DRIVE_LOSS: Final = 0.03  # part of the supply that a driven electrode may lose beyond what its lead is told to
_RECIPROCITY_ERROR: Final = 0.5  # part of the larger side; beyond it two guides contradict each other


class Reading(NamedTuple):
    """The content of one frame."""

    sensor: Sensor
    sequence: int  #: from the frame, modulo 65536
    clock_us: int  #: device clock [us], modulo 2**32
    level: float  #: 0 untouched .. 1 layers firmly joined; monotone in the conductance of the contact
    matrix: ContactMatrix | None  #: what the contacts are to the electrodes; None where nothing is known
    location_valid: bool  #: a place can be had of it; a touch may be certain while its place is not yet
    fault: Fault | None  #: the first reason not to believe the frame

    @property
    def centre(self) -> tuple[float, float]:
        """Place of the electrical centre (eq. 20, 24), u [m] and phi [rad]. That of an extended contact is off it."""
        matrix, sensor = self.matrix, self.sensor
        if matrix is None:
            return 0.0, 0.0
        x, y = matrix.x, matrix.y
        return sensor.place(1.0 - x if sensor.b_positive else x, y if sensor.c_positive else 1.0 - y)


def judge(sensor: Sensor, frame: Frame, noise: float = 0.0) -> tuple[float, Fault | None]:
    """Work out what a frame says but for the place: the level, and the first reason not to believe it.

    The level is the mean of the two guides in the touch phase over the supply. Arguments as of ``read``.
    """
    supply, bounds = frame[15], sensor.bounds
    low, high = bounds.supply_low, bounds.supply_high
    if not (low <= supply <= high and low <= frame[16] <= high and low <= frame[17] <= high):
        return 0.0, Fault.DEVICE if frame.status & STATUS_FAULTS else Fault.SUPPLY
    level = (frame[6] + frame[7]) / (2.0 * supply)
    fault = _fault(sensor, frame, level, noise)
    if fault is None and frame[18] is not None and _loses_drive(sensor, frame):
        fault = Fault.LEAD
    return level, fault


def read(
    sensor: Sensor,
    frame: Frame,
    inversion: FrameInversion | None = None,
    noise: float = 0.0,
    judged: tuple[float, Fault | None] | None = None,
) -> Reading:
    """Work out what a frame says.

    Args:
        inversion: of this sensor, where it is at hand.
        noise: standard deviation of a reading that was learned [counts]. Thresholds may be raised by it.
        judged: what ``judge`` says of the frame, where that is known.

    Returns:
        the reading. A frame that cannot be believed has ``fault`` set, and then its other values are a guess.
    """
    level, fault = judge(sensor, frame, noise) if judged is None else judged
    sequence, clock_us, limits = frame.sequence, frame.clock_us, sensor.thresholds
    if level < limits.release_level:
        return tuple.__new__(Reading, (sensor, sequence, clock_us, level, None, False, fault))  # quicker than Reading()
    matrix = (inversion or FrameInversion(sensor)).invert(frame[6:18])
    if matrix is None:
        return Reading(sensor, sequence, clock_us, level, None, False, fault)
    slack = limits.overshoot
    inside = -slack <= matrix.x <= 1.0 + slack and -slack <= matrix.y <= 1.0 + slack
    firm = level >= limits.location_level
    if firm and not inside and fault is None:
        fault = Fault.OUT_OF_RANGE
    spread1, spread2 = limits.guide_spread * frame.radial_supply, limits.guide_spread * frame.angular_supply
    split1, split2 = frame.radial_c - frame.radial_d, frame.angular_a - frame.angular_b
    split = -spread1 <= split1 <= spread1 and -spread2 <= split2 <= spread2
    placed = firm and inside and split and fault is None
    return tuple.__new__(Reading, (sensor, sequence, clock_us, level, matrix, placed, fault))


def _fault(sensor: Sensor, frame: Frame, level: float, noise: float) -> Fault | None:
    """Return the first thing that is wrong with a frame whose supply is right, or None."""
    # one by one: compiled, a part of a tuple is slow to take
    touch_c, touch_d, current0 = frame[6], frame[7], frame[8]
    radial_c, radial_d, current1 = frame[9], frame[10], frame[11]
    angular_a, angular_b, current2 = frame[12], frame[13], frame[14]
    supply, supply1, supply2 = frame[15], frame[16], frame[17]
    bounds, limits = sensor.bounds, sensor.thresholds
    if frame[3] & STATUS_FAULTS:
        return Fault.DEVICE
    touched = level >= limits.touch_level
    lower_is_less = current2 * bounds.radial_low < current1 * bounds.angular_low  # a wire fed from elsewhere takes both
    if current1 < bounds.radial_low and not (lower_is_less and current2 < bounds.angular_low):
        names = (Fault.OPEN_A, Fault.OPEN_B) if sensor.b_positive else (Fault.OPEN_B, Fault.OPEN_A)
        return _which_open(0.5 * (radial_c + radial_d), supply1, touched, *names, Fault.OPEN_UPPER)
    if current2 < bounds.angular_low:
        names = (Fault.OPEN_D, Fault.OPEN_C) if sensor.c_positive else (Fault.OPEN_C, Fault.OPEN_D)
        return _which_open(0.5 * (angular_a + angular_b), supply2, touched, *names, Fault.OPEN_LOWER)
    full = bounds.full  # contacts far apart, or on both sides of the seam, multiply a current, but leave no short
    if current1 > (full - 1 if touched else bounds.radial_high):
        return Fault.SHORT_UPPER
    if current2 > (full - 1 if touched else bounds.angular_high):
        return Fault.SHORT_LOWER
    if (
        touch_c >= full
        or touch_d >= full
        or radial_c >= full
        or radial_d >= full
        or angular_a >= full
        or angular_b >= full
    ):
        return Fault.SATURATED
    off = abs(current0 - (touch_c + touch_d) * bounds.touch_current_per_guide)
    if off > bounds.touch_current_slack and off > _NOISE_DEVIATIONS * noise:
        return Fault.LEAK
    high, low = (touch_c, touch_d) if touch_c >= touch_d else (touch_d, touch_c)
    lacking = bounds.weaker_guide * high - low
    if lacking > bounds.noise and lacking > _NOISE_DEVIATIONS * noise:
        return Fault.GUIDES_DISAGREE
    most = 1.0 / (1.0 + bounds.load_ratio * (1.0 / (level + _LEVEL_NOISE / supply) - 1.0)) + _GUIDE_SLACK
    if radial_c + radial_d > 2.0 * most * supply1 or angular_a + angular_b > 2.0 * most * supply2:
        return Fault.GUIDE_DRIVEN
    if touched:
        # Several contacts can make the guides differ too, but then reciprocity holds: (Vc - Vd)/I1 = -(Va - Vb)/I2.
        split_cd, split_ab = radial_c - radial_d, angular_a - angular_b
        lower, upper = split_cd / current1, split_ab / current2
        spread = limits.guide_spread
        if (abs(split_cd) > spread * supply1 or abs(split_ab) > spread * supply2) and (
            abs(lower + upper if sensor.b_positive == sensor.c_positive else lower - upper)
            > _RECIPROCITY_ERROR * max(abs(lower), abs(upper))
        ):
            return Fault.GUIDES_DISAGREE
    return None


def _loses_drive(sensor: Sensor, frame: Frame) -> bool:
    """Tell whether a driven electrode's own potential is far from that of the rail that it is joined to."""
    assert frame.driven is not None
    touch_a, touch_b, radial_a, radial_b, angular_c, angular_d = frame.driven
    if not sensor.b_positive:
        radial_a, radial_b = radial_b, radial_a
    if not sensor.c_positive:
        angular_c, angular_d = angular_d, angular_c
    bounds, most = sensor.bounds, _DRIVE_LOSS * frame.touch_supply + sensor.bounds.noise
    radial, angular = (
        most + 2.0 * bounds.radial_drop * frame.radial_current,
        most + 2.0 * bounds.angular_drop * frame.angular_current,
    )
    return not (
        -most <= touch_a - frame.touch_supply <= most
        and -most <= touch_b - frame.touch_supply <= most
        and radial_a <= radial
        and -radial <= radial_b - frame.radial_supply <= radial
        and angular_d <= angular
        and -angular <= angular_c - frame.angular_supply <= angular
    )


def _which_open(guide: float, supply: int, touched: bool, grounded: Fault, driven: Fault, either: Fault) -> Fault:
    """Name the open wire: through a touch the guide sees the sheet, which stands at the end that is still connected."""
    if not touched:
        return either
    if guide > 0.9 * supply:
        return grounded
    return driven if guide < 0.1 * supply else either
