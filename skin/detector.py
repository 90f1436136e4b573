"""Touch or no touch: thresholds with hysteresis on the level, and everything that can be wrong between frames.

A detector is a machine of plain numbers for one sensor. It begins *not ready*: until it has seen a run of valid
untouched frames, nobody may take its silence for "no touch". Time is an argument, so the same frames at the same times
give the same events, bit by bit, live and in a replay.
"""

from __future__ import annotations

import math

from coneskin.errors import SensorError

from .detection import Detection
from .diagnosis import Fault
from .events import Event, SkinFault, TouchBegan, TouchEnded, TouchMoved
from .reading import read
from .sensor import Sensor
from .timing import FrameTiming
from .wire import Frame, Status

__all__ = ["Detector"]

#: what a frame shows during whose phases a contact changes
_CONTRADICTIONS = frozenset({Fault.GUIDE_DRIVEN, Fault.OUT_OF_RANGE, Fault.GUIDES_DISAGREE, Fault.LEAK})
_FORGIVEN = 2.5  # such frames: three in a row, for a contact that closes slowly
_FORGOTTEN = 0.1  # of them, for each good frame


class Detector:
    """Touch detection on one sensor.

    Args:
        sensor: the sensor.
        detection: how to decide.

    Attributes:
        sensor: the sensor.
        ready: a run of valid untouched frames was seen, and no fault since: silence now means "no touch".
        touched: a touch lasts.
        fault: why the sensor cannot be believed at present, or None.
        baseline: drift of the untouched level that is taken off.
        timing: sequence and clocks; counts of what was missing.
    """

    __slots__ = (
        "_above",
        "_began",
        "_below",
        "_changes",
        "_last_counts",
        "_lasting",
        "_level",
        "_phi",
        "_placed",
        "_quiet",
        "_radius",
        "_reported",
        "_seen_phi",
        "_seen_u",
        "_seen_valid",
        "_still",
        "_u",
        "_valid",
        "baseline",
        "detection",
        "fault",
        "ready",
        "sensor",
        "timing",
        "touched",
    )

    def __init__(self, sensor: Sensor, detection: Detection | None = None) -> None:
        self.sensor = sensor
        self.detection = detection or Detection()
        if not self.detection.drift_limit < sensor.thresholds.release_level:
            raise SensorError(
                "detection.drift_limit must be below thresholds.release_level, got "
                f"{self.detection.drift_limit!r} and {sensor.thresholds.release_level!r}"
            )
        self.timing = FrameTiming(self.detection.timing)
        self.ready = self.touched = False
        self.fault: Fault | None = None
        self._reported: set[Fault] = set()
        self.baseline = 0.0
        self._radius = max(sensor.frustum.radius1, sensor.frustum.radius2)
        self._above = self._below = self._quiet = 0
        self._began = self._changes = 0.0
        self._lasting = False
        self._level = self._u = self._phi = 0.0
        self._valid = self._placed = False
        self._seen_u = self._seen_phi = 0.0
        self._seen_valid = False
        self._last_counts = (-1, -1, -1)
        self._still = [0, 0, 0]

    def age(self, now: float) -> float:
        """Time since the newest valid frame came [s]; infinite before the first."""
        return self.timing.age(now)

    def feed(self, frame: Frame, now: float) -> list[Event]:
        """Take the next frame of this sensor.

        Args:
            frame: the frame.
            now: host clock when it arrived [s], monotonic.

        Returns:
            what happened; mostly nothing.
        """
        events: list[Event] = []
        restarted = frame.status & Status.RESTARTED and self.timing.frames > 0
        if restarted:
            self.timing.restart()
        late = self.timing.advance(frame.sequence, frame.clock_us, now)
        if restarted:
            self._report(events, Fault.RESTARTED, frame, now)
        elif late is not None:
            self._report(events, late, frame, now, self.timing.detail)
            if late is Fault.REPLAYED:
                return events  # an old frame says nothing about now
        reading = read(self.sensor, frame)
        if reading.fault is not None:
            self._seen_valid = False
            if not self._is_change(reading.fault):
                self._report(events, reading.fault, frame, now)
                return events
            if reading.level < self.sensor.thresholds.touch_level:
                return events  # the next frames say what it was
        else:
            self._changes = max(0.0, self._changes - _FORGOTTEN)
            self.timing.seen_valid(now)
        if self.detection.stuck_frames and self._stands_still(frame):
            self._report(events, Fault.STUCK, frame, now)
            return events
        level = reading.level - self.baseline
        u, phi = reading.u, reading.phi
        agrees = self._distance(u, phi, self._seen_u, self._seen_phi) <= self.detection.settle_distance
        settled = reading.location_valid and self._seen_valid and agrees
        self._seen_u, self._seen_phi, self._seen_valid = u, phi, reading.location_valid
        if self.touched:
            self._while_touched(events, frame, now, level, u, phi, settled)
        else:
            self._while_untouched(events, frame, now, level, u, phi, settled)
        return events

    def _is_change(self, fault: Fault) -> bool:
        """Whether a fault may be a contact that came or went between the phases of this one frame.

        The phases are measured one after the other, so such a frame contradicts itself. A few frames later the contact
        rests, or has passed the threshold; if they go on, or come more often than now and then, it is a fault.
        """
        if fault not in _CONTRADICTIONS or self._changes > _FORGIVEN:
            return False
        self._changes += 1.0
        return True

    def silence(self, now: float, longest: float) -> list[Event]:
        """Report that no valid frame has come for too long.

        Args:
            now: host clock [s].
            longest: silence that is allowed [s].

        Returns:
            a SkinFault, once until the sensor is ready again, or nothing.
        """
        age = self.timing.age(now)
        events: list[Event] = []
        if age > longest:
            frame_clock, sequence = self.timing.clock_us, self.timing.sequence
            detail = f"{age * 1e3:.1f} ms" if math.isfinite(age) else "none at all"
            self._put_fault(events, Fault.SILENT, now, frame_clock, sequence, detail)
        return events

    def _while_untouched(
        self, events: list[Event], frame: Frame, now: float, level: float, u: float, phi: float, valid: bool
    ) -> None:
        detection, thresholds = self.detection, self.sensor.thresholds
        if level >= thresholds.touch_level:
            self._quiet = 0
            self._above += 1
            if self._above >= detection.confirm_frames:
                self.touched, self._lasting, self._began = True, False, now
                self._below, self._placed = 0, False
                self._remember(level, u, phi, valid)
                events.append(TouchBegan(self.sensor.name, now, frame.clock_us, frame.sequence, level, u, phi, valid))
            return
        self._above = 0
        if level >= thresholds.release_level:  # neither touched nor quiet: no drift is learned from it
            self._quiet = 0
            return
        self._quiet += 1
        if self._quiet >= detection.settle_frames:
            self.ready, self.fault = True, None
            self._reported.clear()
        most = detection.drift_rate * self.timing.period
        self.baseline += most if level > most else -most if level < -most else level
        if abs(self.baseline) > detection.drift_limit:
            self.baseline = math.copysign(detection.drift_limit, self.baseline)
            if abs(level) > most:
                self._report(events, Fault.DRIFT, frame, now, f"{self.baseline + level:+.3f} of the level")

    def _while_touched(
        self, events: list[Event], frame: Frame, now: float, level: float, u: float, phi: float, valid: bool
    ) -> None:
        detection = self.detection
        name, clock, sequence = self.sensor.name, frame.clock_us, frame.sequence
        if level < self.sensor.thresholds.release_level:
            self._below += 1
            if self._below >= detection.release_frames:
                self.touched = False
                self._above = self._quiet = 0
                events.append(TouchEnded(name, now, clock, sequence, level, self._u, self._phi, self._placed))
            return
        self._below = 0
        if not self._lasting and now - self._began >= detection.lasting_touch:
            self._lasting = True
            self._report(events, Fault.LAYERS_CLOSED, frame, now, f"{now - self._began:.1f} s")
        moved = self._distance(u, phi, self._u, self._phi) > detection.move_distance
        changed = abs(level - self._level) > detection.level_step
        if valid != self._valid or (valid and moved) or changed:
            if not valid and self._placed:
                u, phi = self._u, self._phi  # the last place that was certain is the better guess
            self._remember(level, u, phi, valid)
            events.append(TouchMoved(name, now, clock, sequence, level, u, phi, valid))

    def _remember(self, level: float, u: float, phi: float, valid: bool) -> None:
        self._level, self._u, self._phi, self._valid = level, u, phi, valid
        self._placed = self._placed or valid

    def _distance(self, u1: float, phi1: float, u2: float, phi2: float) -> float:
        """Distance of two places along the surface [m], never too small: the larger radius counts."""
        return math.hypot(u1 - u2, self._radius * (phi1 - phi2))

    def _report(self, events: list[Event], fault: Fault, frame: Frame, now: float, detail: str = "") -> None:
        self._put_fault(events, fault, now, frame.clock_us, frame.sequence, detail)

    def _put_fault(
        self, events: list[Event], fault: Fault, now: float, clock_us: int, sequence: int, detail: str
    ) -> None:
        self._quiet = self._above = 0
        self.ready = False
        self.fault = fault
        if fault not in self._reported:  # each once until the sensor is ready again, though they may alternate
            self._reported.add(fault)
            events.append(SkinFault(self.sensor.name, now, clock_us, sequence, fault, detail))

    def _stands_still(self, frame: Frame) -> bool:
        counts = (frame.radial_current, frame.angular_current, frame.supply)
        still = self._still
        for k in (0, 1, 2):
            still[k] = still[k] + 1 if counts[k] == self._last_counts[k] else 0
        self._last_counts = counts
        return max(still) >= self.detection.stuck_frames
