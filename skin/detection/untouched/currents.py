"""Untouched drive currents: learned slowly over quiet frames, with their noise, as the zero of what a contact adds.

The design's currents will not do: a sheet resistance that is 2 % off would hide what distinguishes two contacts from
one. Both currents are kept over the supply, which cancels its drift.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

__all__ = ["UntouchedCurrents"]

CURRENT_BLOCK = 32  # frames that are averaged at once; noise that lasts as long, as mains hum does, shows in the means
_CURRENT_MEMORY = 64  # blocks that the mean remembers
_FREE_BLOCKS = 8  # blocks in which it is found; from then on its drift is bounded
_PRIOR_BLOCKS = 16  # blocks that the noise taken from the start counts for
_PRIOR_NOISE = 0.7  # counts; standard deviation that is assumed at the start
_ROUNDING_VARIANCE = 1.0 / 12.0  # counts^2; variance of rounding alone
_CURRENT_JUMP = 0.01  # ratio; an untouched current that is off by this has changed
_JUMP_DEVIATIONS = 8.0
_THRESHOLD_DEVIATIONS = 7.0  # standard deviations between a threshold and what noise reaches: once in 1e11 frames
_MAX_GUIDE_THRESHOLD = 0.03  # part of the supply; the least threshold, on a guide, is raised by noise no further


class UntouchedCurrents:
    """The two drive currents of an untouched sensor.

    Args:
        sensor: the sensor.
        drift: fastest change that is followed once they are known, as a ratio of the current [1/s].

    Attributes:
        radial: drive current of the radial phase over the supply [counts over counts].
        angular: drive current of the angular phase over the supply.
        frames: frames that the means stand for; 0 before the first block: nothing is known.
        noise: standard deviation of a reading, rounding included [counts].
        variance: of (angular - aspect^2 radial) from frame to frame, as the means of blocks show it.
        bias: largest error of the same quantity that averaging cannot remove: rounding where there is no noise.
        aspect: length of the sheet over its breadth, in the rectangle of the field.
    """

    __slots__ = (
        "_blocks",
        "_count",
        "_drift",
        "_last",
        "_noisiest",
        "_sum1",
        "_sum2",
        "_weight",
        "angular",
        "aspect",
        "bias",
        "frames",
        "noise",
        "radial",
        "variance",
    )

    def __init__(self, sensor: Sensor, drift: float) -> None:
        self.aspect = sensor.radial_ohms / sensor.upper_sheet_ohms
        self._weight = self.aspect * self.aspect
        self._drift = drift
        parts = sensor.electronics
        supply = parts.supply_volts / parts.adc_volts * parts.full_count
        self.variance = (_PRIOR_NOISE * _PRIOR_NOISE + _ROUNDING_VARIANCE) * (1.0 + self._weight**2) / supply**2
        self.noise = math.sqrt(_PRIOR_NOISE * _PRIOR_NOISE + _ROUNDING_VARIANCE)
        limits, bounds = sensor.thresholds, sensor.bounds
        current = min(bounds.radial_low, bounds.angular_low) * (1.0 / limits.current_low - 1.0)
        guide = min(_MAX_GUIDE_THRESHOLD, math.sqrt(2.0) * (limits.touch_level - limits.release_level)) * supply
        self._noisiest = min(guide, current) / _THRESHOLD_DEVIATIONS  # counts
        self.bias = 0.0
        self.radial = self.angular = self._last = 0.0
        self.restart()

    def restart(self) -> None:
        """Learn the currents anew; the noise stays known."""
        self._blocks = self._count = self.frames = 0
        self._sum1 = self._sum2 = 0.0

    def skip(self) -> None:
        """Forget the block that was under way: the sensor is not quiet any more."""
        self._count = 0
        self._sum1 = self._sum2 = 0.0

    def feed(self, frame: Frame, period: float) -> tuple[Fault, str] | None:
        """Take the currents of a quiet frame.

        Args:
            frame: the frame.
            period: time from frame to frame [s].

        Returns:
            a fault, where a current has changed suddenly, or where there is more noise than thresholds bear; and what.
        """
        self._sum1 += frame.radial_current / frame.radial_supply
        self._sum2 += frame.angular_current / frame.angular_supply
        self._count += 1
        return None if self._count < CURRENT_BLOCK else self._close(frame.touch_supply, period)

    def learn(
        self, radial: Sequence[float], angular: Sequence[float], supplies: Sequence[int], periods: Sequence[float]
    ) -> int:
        """Take quiet frames in a row as ``feed`` does; return how many, up to the first that shows a change.

        Args:
            radial: currents of the radial phase over the supply.
            angular: the same of the angular phase.
            supplies: in the touch phase [counts].
            periods: time from frame to frame [s].
        """
        at, end = 0, len(periods)
        while at < end:
            stop = min(at + CURRENT_BLOCK - self._count, end)
            sum1, sum2 = self._sum1, self._sum2
            for value in radial[at:stop]:
                sum1 += value
            for value in angular[at:stop]:
                sum2 += value
            self._sum1, self._sum2 = sum1, sum2
            self._count += stop - at
            at = stop
            if self._count == CURRENT_BLOCK and self._close(supplies[at - 1], periods[at - 1]):
                return at - 1
        return at

    def _close(self, supply: int, period: float) -> tuple[Fault, str] | None:
        mean1, mean2 = self._sum1 / CURRENT_BLOCK, self._sum2 / CURRENT_BLOCK
        self.skip()
        mixed = mean2 - self._weight * mean1
        if not self._blocks:
            self.radial, self.angular, self._last = mean1, mean2, mixed
        limit = _JUMP_DEVIATIONS * math.sqrt(self.variance / CURRENT_BLOCK)
        step1, step2 = mean1 - self.radial, mean2 - self.angular
        if abs(step1) > max(_CURRENT_JUMP * self.radial, limit) or abs(step2) > max(
            _CURRENT_JUMP * self.angular, limit
        ):
            steps = f"radial {100.0 * step1 / self.radial:+.2f} %, angular {100.0 * step2 / self.angular:+.2f} %"
            return Fault.CURRENT_CHANGED, steps
        self._learn_noise(mixed - self._last, supply)
        self._last = mixed
        self._blocks = min(self._blocks + 1, _CURRENT_MEMORY)
        self.frames = self._blocks * CURRENT_BLOCK
        most = self._drift * CURRENT_BLOCK * period if self._blocks > _FREE_BLOCKS else math.inf
        self.radial += bounded(step1 / self._blocks, most * self.radial)
        self.angular += bounded(step2 / self._blocks, most * self.angular)
        if self.noise > self._noisiest:
            return Fault.NOISE, f"{self.noise:.1f} counts, at most {self._noisiest:.1f}"
        return None

    def _learn_noise(self, change: float, supply: int) -> None:
        scale = (1.0 + self._weight * self._weight) / (supply * supply)  # from counts^2
        seen = 0.5 * CURRENT_BLOCK * change * change if self._blocks else self.variance
        self.variance += (seen - self.variance) / (_PRIOR_BLOCKS + self._blocks)
        self.variance = max(self.variance, _ROUNDING_VARIANCE * scale)
        self.noise = math.sqrt(self.variance / scale)
        noise = max(0.0, self.variance / scale - _ROUNDING_VARIANCE)
        # The mean of a rounded value whose noise is Gaussian is off by at most this [counts]; here of two means.
        self.bias = 2.0 / math.pi * math.exp(-2.0 * math.pi * math.pi * noise) * math.sqrt(scale)


def bounded(step: float, most: float) -> float:
    """Return a step, or the largest that is allowed in its direction."""
    return most if step > most else -most if step < -most else step
