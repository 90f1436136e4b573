"""Settings of a detector."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from coneskin.core.errors import SensorError

from .timing import TimingLimits


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """The rules by which a detector decides between touch and no touch.

    Attributes:
        confirm_frames: frames above the threshold that make a touch, 1 or 2.
        release_frames: frames below the release threshold that end it.
        settle_frames: valid untouched frames in a row before the sensor is ready.
        settle_distance: a location is settled once two frames in a row agree to within this [m].
        move_distance: movement along the surface that is reported [m].
        level_step: change of level that is reported.
        drift_rate: fastest drift of the untouched level that is followed [1/s].
        drift_limit: largest drift that is followed, below the release threshold. An untouched level that rests above
            that threshold although so much was taken off is a fault.
        current_drift: fastest drift of the untouched drive currents that is followed, as a ratio of them [1/s].
        second_contact: weakest second contact that a certain place excludes where its normal is 20 deg off [S]. The
            spreading in the sheets is part of it. 0.7 mS is what 2 N of the virtual skin's contact leave of 1.5 mS.
        largest_contact: radius up to which one contact is taken for one [m]; less on a narrow link, where it is 26 deg.
        lasting_touch: a touch this long is a fault as well [s]. It is never taken for the new zero.
        stuck_frames: once the radial current, the angular current or the supply of a phase has repeated its value in
            so many frames in a row, that is a fault: each of them has noise in a working device, and a current that is
            stuck would hide an open wire. 0: off.
        self_test: whether a touch that contradicts itself is a fault. Off where people look for the wires that are
            exchanged, which is a cause of it.
        timing: how regular the frames must be.

    Raises:
        SensorError: a value is outside its range.
    """

    confirm_frames: int = 1
    release_frames: int = 3
    settle_frames: int = 50
    settle_distance: float = 0.01
    move_distance: float = 0.002
    level_step: float = 0.1
    drift_rate: float = 0.002
    drift_limit: float = 0.03
    current_drift: float = 1e-4
    second_contact: float = 7e-4
    largest_contact: float = 0.02
    lasting_touch: float = 30.0
    stuck_frames: int = 0
    self_test: bool = True
    timing: TimingLimits = field(default_factory=TimingLimits)

    def __post_init__(self) -> None:
        if self.confirm_frames not in (1, 2):
            raise SensorError(f"detector.confirm_frames must be 1 or 2, got {self.confirm_frames!r}")
        for name in ("release_frames", "settle_frames"):
            if not getattr(self, name) >= 1:
                raise SensorError(f"detector.{name} must be at least 1, got {getattr(self, name)!r}")
        for name, unit in (
            ("settle_distance", "m"),
            ("move_distance", "m"),
            ("level_step", "ratio"),
            ("second_contact", "S"),
            ("largest_contact", "m"),
            ("lasting_touch", "s"),
        ):
            if not getattr(self, name) > 0.0:
                raise SensorError(f"detector.{name} must be above 0 [{unit}], got {getattr(self, name)!r}")
        for name, unit in (
            ("drift_rate", "1/s"),
            ("drift_limit", "ratio"),
            ("current_drift", "1/s"),
            ("stuck_frames", "frames"),
        ):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise SensorError(f"detector.{name} must be finite and not negative [{unit}], got {value!r}")
