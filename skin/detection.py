"""How a detector decides between touch and no touch."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from coneskin.errors import SensorError

from .timing import TimingLimits

__all__ = ["Detection"]


@dataclass(frozen=True, slots=True)
class Detection:
    """How a detector decides.

    Attributes:
        confirm_frames: frames above the threshold that make a touch, 1 or 2.
        release_frames: frames below the release threshold that end it.
        settle_frames: valid untouched frames in a row before the sensor is ready.
        settle_distance: a location is settled once two frames in a row agree to within this [m].
        move_distance: movement along the surface that is reported [m].
        level_step: change of level that is reported.
        drift_rate: fastest drift of the untouched level that is followed [1/s].
        drift_limit: largest drift that is followed; beyond it the sensor is at fault. Below the release threshold.
        lasting_touch: a touch this long is a fault as well [s]; it is never taken for the new zero.
        stuck_frames: this many frames in which a drive current or the supply shows no noise at all are a fault; 0: off.
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
    lasting_touch: float = 30.0
    stuck_frames: int = 0
    timing: TimingLimits = field(default_factory=TimingLimits)

    def __post_init__(self) -> None:
        if self.confirm_frames not in (1, 2):
            raise SensorError(f"detection.confirm_frames must be 1 or 2, got {self.confirm_frames!r}")
        for name in ("release_frames", "settle_frames"):
            if not getattr(self, name) >= 1:
                raise SensorError(f"detection.{name} must be at least 1, got {getattr(self, name)!r}")
        for name in ("settle_distance", "move_distance", "level_step", "lasting_touch"):
            if not getattr(self, name) > 0.0:
                raise SensorError(f"detection.{name} must be above 0, got {getattr(self, name)!r}")
        for name in ("drift_rate", "drift_limit", "stuck_frames"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise SensorError(f"detection.{name} must be finite and not negative, got {getattr(self, name)!r}")
