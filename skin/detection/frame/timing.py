"""Sequence numbers and clocks of a sensor: tells new frames from lost, late and repeated ones.

Numbers wrap: the sequence at 65536, the device clock at 2**32 us (71.6 minutes). Differences are taken modulo that and
read as signed, so a frame from the past has a negative difference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from coneskin.core.errors import SensorError

from .faults import Fault

_LEARNING_FRAMES: Final = 16  # frames; from then on the period is known well enough to judge by
# s; in it what had piled up before the port was opened is read, and looks like a fast clock
_BACKLOG_TIME: Final = 0.25
_RESTART_FRAMES: Final = 32  # frames; so many old ones in a row mean that the device has started anew


@dataclass(frozen=True, slots=True)
class TimingLimits:
    """Limits of how irregular frames may be.

    Attributes:
        missing: missing frames that are allowed at once. They drain from memory at ``missing_share``.
        missing_share: share of frames that may be missing in the long run.
        clock_slack: device time that an interval may be off the learned period, besides half of it [s].
        late: how much later than the quickest frame one may arrive [s].
        clock_drift: largest difference in speed of the device's clock and the host's, as a ratio. A lag that grows
            more slowly is not noticed. Crystals keep 1e-4. A board whose clock is a ceramic resonator needs 5e-3.

    Raises:
        SensorError: a limit is not positive, or the drift is not below 1.
    """

    missing: int = 2
    missing_share: float = 0.02
    clock_slack: float = 0.002
    late: float = 0.05
    clock_drift: float = 1e-4

    def __post_init__(self) -> None:
        if not self.missing >= 0:
            raise SensorError(f"timing.missing must not be negative, got {self.missing!r}")
        for name in ("missing_share", "clock_slack", "late", "clock_drift"):
            if not getattr(self, name) > 0.0:
                raise SensorError(f"timing.{name} must be above 0, got {getattr(self, name)!r}")
        if not self.clock_drift < 1.0:
            raise SensorError(f"timing.clock_drift must be below 1, got {self.clock_drift!r}")


class FrameTiming:
    """The sequence numbers and the clock of one sensor, followed frame by frame.

    Attributes:
        frames: frames taken.
        missing: frames that never came.
        period: device time from frame to frame, learned [s], 0 before the second frame.
        sequence: of the newest frame.
        clock_us: of the newest frame [us].
        lag: how much later than the quickest frame the newest one arrived [s].
        held_up: for how long the reader itself may have kept frames waiting [s].
        detail: numbers that belong to the newest fault.
    """

    def __init__(self, limits: TimingLimits) -> None:
        self.limits = limits
        self._drift = limits.clock_drift
        self.frames = self.missing = 0
        self.sequence = self.clock_us = 0
        self.detail = ""
        self.held_up = 0.0
        self._newest = -math.inf, -math.inf  # host clock of the newest frame, and of the newest valid one
        self.restart()

    def restart(self) -> None:
        """Forget sequence, clock and period. The counts stay."""
        self.period = self.lag = 0.0
        self._clocks = 0.0, math.inf, 0.0, 0.0  # device time, its offset, what it has gained, host clock at its start
        self._rhythm = 0, 0.0  # frames by which the period is known, and missing ones that are remembered
        self._old_run = 0

    def age(self, now: float, valid: bool = True) -> float:
        """Return the time since the newest frame, or the newest valid one [s]. Infinite before the first."""
        fed, seen = self._newest
        return now - (seen if valid else fed)

    def measured_age(self, now: float) -> float:
        """Return for how long the newest valid frame has been history, its way to this computer included [s]."""
        return now - self._newest[1] + self.lag

    def seen_valid(self, now: float) -> None:
        """Note that a valid frame came."""
        self._newest = now, now

    def feed(self, sequence: int, clock_us: int, now: float) -> Fault | None:
        """Take the numbers of the next frame.

        Args:
            sequence: sequence number, 0..65535.
            clock_us: device clock [us], 0..2**32 - 1.
            now: host clock [s].

        Returns:
            what is wrong with them, or None.
        """
        self._newest = now, self._newest[1]
        if self._rhythm[0] == 0:
            self._rhythm = 1, 0.0
            self.frames += 1
            self.sequence, self.clock_us = sequence, clock_us
            self._clocks = 0.0, now, 0.0, now
            return None
        steps = (sequence - self.sequence + 0x8000 & 0xFFFF) - 0x8000
        elapsed = ((clock_us - self.clock_us + 0x80000000 & 0xFFFFFFFF) - 0x80000000) * 1e-6
        if steps <= 0 or elapsed <= 0.0:
            self._old_run += 1
            if self._old_run >= _RESTART_FRAMES:
                self.restart()
            self.detail = f"sequence {steps:+d}, clock {elapsed * 1e3:+.3f} ms"
            return Fault.REPLAYED
        self.frames += 1
        self._old_run = 0
        self.sequence, self.clock_us = sequence, clock_us
        arrival = self._judge_arrival(now, elapsed)
        return self._judge_interval(steps, elapsed) or arrival

    def _judge_arrival(self, now: float, elapsed: float) -> Fault | None:
        """Judge how late a frame has arrived, and whether the device's clock runs away from the host's.

        The offset of the two clocks is known from the quickest frame. It may rise by the drift, and an older quickest
        frame is then given up. Where it falls faster than the drift explains, the device's clock is too fast, and a
        lag would hide behind it.

        Args:
            now: host clock [s].
            elapsed: device time since the last frame [s].
        """
        device_time, quickest, gained, started = self._clocks
        late = self.limits.late
        drift = elapsed * self._drift  # by which the clocks may have moved apart since the last frame
        device_time += elapsed
        offset = now - device_time  # host clock minus device time
        quickest += drift
        gained = gained - 2.0 * drift if gained > 2.0 * drift else 0.0
        if offset < quickest:
            if now - started > _BACKLOG_TIME:  # the first frames, which may have been waiting, are read
                gained += quickest - offset
            quickest = offset
        self.lag = lag = offset - quickest
        fast = gained > late and lag <= late + self.held_up
        self._clocks = device_time, quickest, 0.0 if fast else gained, started
        if lag > late + self.held_up:
            limit = f"{self.lag * 1e3:.1f} ms late, skin_silence_ms = {1e3 * late:g}"
            self.detail = f"{limit}; a busy computer needs more, or fewer frames a second; or {self._advice('slow')}"
            return Fault.LATE
        if fast:
            self.detail = f"{late * 1e3:g} ms gained; {self._advice('fast')}"
            return Fault.CLOCK_FAST
        return None

    def _advice(self, pace: str) -> str:
        ppm = 1e6 * self._drift
        return f"the device's clock is {pace} by more than clock_drift_ppm = {ppm:g}; a ceramic resonator needs 5000"

    def _judge_interval(self, steps: int, elapsed: float) -> Fault | None:
        known, bucket = self._rhythm
        limits, fault = self.limits, None
        bucket = bucket - limits.missing_share if bucket > limits.missing_share else 0.0
        if steps > 1:
            self.missing += steps - 1
            bucket += steps - 1
            if bucket > limits.missing:
                bucket = float(limits.missing)
                self.detail = f"{steps - 1} missing at once, {self.missing} in all"
                fault = Fault.GAP
        each = elapsed / steps
        learning = known < _LEARNING_FRAMES
        self._rhythm = known + 1 if learning else known, bucket
        if learning:
            self.period += (each - self.period) / known
            return fault
        off = abs(elapsed - steps * self.period)
        if off > 0.5 * steps * self.period + limits.clock_slack:
            self.detail = f"{elapsed * 1e3:.3f} ms for {steps} frames of {self.period * 1e3:.3f} ms"
            return fault or Fault.CLOCK_JUMP
        self.period += (each - self.period) / _LEARNING_FRAMES
        return fault
