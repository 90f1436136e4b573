"""Sequence numbers and clocks: is this frame the next one, and is it news?

Numbers wrap: the sequence at 65536, the device clock at 2**32 us (71.6 minutes). Differences are taken modulo that and
read as signed, so a frame from the past has a negative difference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from coneskin.errors import SensorError

from .diagnosis import Fault

__all__ = ["FrameTiming", "TimingLimits"]

_LEARNING = 16  # frames from which the period is known well enough to judge by
_PERSISTENT = 32  # old frames in a row after which the device is taken to have started anew
_CLOCK_DRIFT = 1e-3  # largest difference in speed between the two clocks; a crystal has 1e-4


@dataclass(frozen=True, slots=True)
class TimingLimits:
    """How regular frames must be.

    Attributes:
        missing: missing frames that are allowed at once. They drain from memory at ``missing_share``.
        missing_share: share of frames that may be missing in the long run.
        clock_slack: device time that an interval may be off the learned period, besides half of it [s].
        late: how much later than the quickest frame one may arrive [s].

    Raises:
        SensorError: a limit is not positive.
    """

    missing: int = 2
    missing_share: float = 0.02
    clock_slack: float = 0.002
    late: float = 0.05

    def __post_init__(self) -> None:
        if not self.missing >= 0:
            raise SensorError(f"timing.missing must not be negative, got {self.missing!r}")
        for name in ("missing_share", "clock_slack", "late"):
            if not getattr(self, name) > 0.0:
                raise SensorError(f"timing.{name} must be above 0, got {getattr(self, name)!r}")


class FrameTiming:
    """Follows one sensor's sequence and clock.

    Attributes:
        frames: frames taken.
        missing: frames that never came.
        old: frames that came twice or out of order.
        period: device time from frame to frame, learned [s]; 0 before the second frame.
        sequence: of the newest frame.
        clock_us: of the newest frame [us].
        lag: how much later than the quickest frame the newest one arrived [s].
        detail: numbers that belong to the newest fault.
    """

    __slots__ = (
        "_bucket",
        "_device_time",
        "_known",
        "_offset",
        "_old_run",
        "_valid_at",
        "clock_us",
        "detail",
        "frames",
        "lag",
        "limits",
        "missing",
        "old",
        "period",
        "sequence",
    )

    def __init__(self, limits: TimingLimits) -> None:
        self.limits = limits
        self.frames = self.missing = self.old = 0
        self.sequence = self.clock_us = 0
        self.detail = ""
        self._valid_at = -math.inf
        self.restart()

    def restart(self) -> None:
        """Forget sequence, clock and period; the counts stay."""
        self.period = self.lag = 0.0
        self._bucket = 0.0
        self._device_time = 0.0
        self._offset = math.inf
        self._known = self._old_run = 0

    def age(self, now: float) -> float:
        """Time since the newest valid frame came [s]; infinite before the first."""
        return now - self._valid_at

    def seen_valid(self, now: float) -> None:
        """Note that a valid frame came."""
        self._valid_at = now

    def advance(self, sequence: int, clock_us: int, now: float) -> Fault | None:
        """Take the numbers of the next frame.

        Args:
            sequence: sequence number, 0..65535.
            clock_us: device clock [us], 0..2**32 - 1.
            now: host clock [s].

        Returns:
            what is wrong with them, or None.
        """
        if self._known == 0:
            self._known = 1
            self.frames += 1
            self.sequence, self.clock_us = sequence, clock_us
            self._offset = now
            return None
        steps = (sequence - self.sequence + 0x8000 & 0xFFFF) - 0x8000
        elapsed = ((clock_us - self.clock_us + 0x80000000 & 0xFFFFFFFF) - 0x80000000) * 1e-6
        if steps <= 0 or elapsed <= 0.0:
            self.old += 1
            self._old_run += 1
            if self._old_run >= _PERSISTENT:
                self.restart()
            self.detail = f"sequence {steps:+d}, clock {elapsed * 1e3:+.3f} ms"
            return Fault.REPLAYED
        self.frames += 1
        self._old_run = 0
        self.sequence, self.clock_us = sequence, clock_us
        self._device_time += elapsed
        fault = self._judge_interval(steps, elapsed)
        self._offset += elapsed * _CLOCK_DRIFT
        offset = now - self._device_time
        if offset < self._offset:
            self._offset = offset
        self.lag = offset - self._offset
        if fault is None and self.lag > self.limits.late:
            self.detail = f"{self.lag * 1e3:.1f} ms late"
            fault = Fault.LATE
        return fault

    def _judge_interval(self, steps: int, elapsed: float) -> Fault | None:
        limits = self.limits
        self._bucket -= limits.missing_share
        if self._bucket < 0.0:
            self._bucket = 0.0
        fault = None
        if steps > 1:
            self.missing += steps - 1
            self._bucket += steps - 1
            if self._bucket > limits.missing:
                self._bucket = float(limits.missing)
                self.detail = f"{steps - 1} missing at once, {self.missing} in all"
                fault = Fault.GAP
        each = elapsed / steps
        if self._known < _LEARNING:
            self._known += 1
            self.period += (each - self.period) / (self._known - 1)
            return fault
        off = abs(elapsed - steps * self.period)
        if off > 0.5 * steps * self.period + limits.clock_slack:
            self.detail = f"{elapsed * 1e3:.3f} ms for {steps} frames of {self.period * 1e3:.3f} ms"
            return fault or Fault.CLOCK_JUMP
        self.period += (each - self.period) / _LEARNING
        return fault
