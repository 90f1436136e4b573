"""Touch detector: thresholds with hysteresis on the level, and every fault that shows between frames.

A detector is a machine of plain numbers for one sensor. It begins *not ready*: until it has seen a run of valid
untouched frames, its silence does not mean "no touch". Time is an argument, so the same frames at the same times
give the same events, bit by bit, live and in a replay.

Whether a touch is believed does not depend on its place. So who has to stop an arm is called first, and the place is
worked out afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from coneskin.core.errors import SensorError
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame, Status

from .events import SkinEvent, SkinFault, TouchBegan, TouchEnded, TouchMoved
from .fault_diagnosis import DIAGNOSED_FAULTS, FaultDiagnosis
from .frame.contact_matrix import FrameInversion
from .frame.faults import Fault
from .frame.reading import Reading, TouchReading, judge, read
from .frame.settings import DetectorSettings
from .frame.timing import FrameTiming
from .frame.untouched import UntouchedCurrents, UntouchedGuides, UntouchedLeak, UntouchedLevel, UntouchedZero
from .place.touch_place import TouchPlace
from .self_test import FrameSelfTest

#: called with the sensor's name and the level as soon as a touch is certain, before its place is worked out
TouchAlarm = Callable[[str, float], None]

_RESTARTED_BIT: Final = int(Status.RESTARTED)
#: Faults that a contact produces when it changes between the phases of one frame; over the seam it looks like a short.
_CONTACT_FAULTS = frozenset(
    {
        *(Fault.GUIDE_DRIVEN, Fault.OUT_OF_RANGE, Fault.GUIDES_DISAGREE, Fault.LEAK),
        *(Fault.SHORT_UPPER, Fault.SHORT_LOWER),
    }
)
_MAX_CONTRADICTIONS: Final = 2.5  # frames; the fourth in a row is a fault, three may be a contact that closes slowly
_UNREADY_TIME: Final = 1.0  # s of a sensor that is neither touched nor quiet, after which it says so: it is not ready
_QUIET_WEIGHT: Final = 9  # frames that are neither, besides one, that a quiet one takes off their count
_CONTRADICTION_DECAY: Final = 0.1  # frames; each good frame takes so many off the count
_FULL_TURN: Final = 2.0 * math.pi


class _StuckValues:
    """How long each lively value of a sensor's frames has stood still. A stuck current would hide an open wire.

    Args:
        most: frames in a row with the same value that are a fault. With 0 none is.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._last, self._still = (-1, -1, -1, -1, -1), (0, 0, 0, 0, 0)

    def feed(self, frame: Frame) -> bool:
        """Take a frame. Tell whether one of its values is stuck."""
        if not self._most:
            return False
        a, b, c, d, e = self._last
        i, j, k, m, n = self._still
        # two currents, and the supplies, written out: compiled, a loop over them is as slow as all else together
        v, w, x, y, z, most = frame[11], frame[14], frame[15], frame[16], frame[17], self._most
        i, j, k = i + 1 if v == a else 0, j + 1 if w == b else 0, k + 1 if x == c else 0
        m, n = m + 1 if y == d else 0, n + 1 if z == e else 0
        self._last, self._still = (v, w, x, y, z), (i, j, k, m, n)
        return i >= most or j >= most or k >= most or m >= most or n >= most


class _ReportedTouch:
    """The touches of one sensor as its events tell them.

    Args:
        settings: by how much a touch has to change.
    """

    def __init__(self, sensor: Sensor, settings: DetectorSettings) -> None:
        self._sensor = sensor
        self._radius = max(sensor.frustum.radius1, sensor.frustum.radius2)
        self._step, self._far = settings.level_step, settings.move_distance
        # level, place and doubt; a place was certain, a line was found
        self._told = 0.0, 0.0, 0.0, "", False, False

    def begin(self, touch: TouchReading) -> TouchBegan:
        """Return the event with which a touch begins, of the frame that confirms it."""
        self._told = touch.level, touch.u, touch.phi, touch.doubt, not touch.doubt, False
        return tuple.__new__(TouchBegan, (self._sensor.name, *touch))  # quicker than TouchBegan()

    def move(self, touch: TouchReading) -> TouchMoved | None:
        """Return the event that a frame above the release threshold makes due. None where it tells nothing new."""
        level_told, u_told, phi_told, doubted, placed, extended = self._told
        valid, step = touch.location_valid, touch.level - level_told
        shape = None if valid else touch.elongation
        if (
            valid is not (not doubted)
            or not -self._step <= step <= self._step
            or (valid and self._distance(touch.u - u_told, touch.phi - phi_told) > self._far)
            or (shape is not None and not extended)
        ):
            time, level, u, phi, _, doubt = touch[:6]
            certain = (u_told, phi_told) if placed and not valid else (u, phi)
            if shape is None:
                u, phi = certain  # the last place that was certain is the better guess; a line has its own
            self._told = level, *certain, doubt, placed or not doubt, extended or shape is not None
            return tuple.__new__(TouchMoved, (self._sensor.name, time, level, u, phi, *touch[4:]))
        return None

    def end(self, frame: Frame, now: float, level: float) -> TouchEnded:
        """Return the event with which a touch ends, at the last place that was told.

        Args:
            frame: the one that confirms the end.
            now: host clock when it arrived [s].
            level: its level, the drift taken off.
        """
        _, u, phi, _, placed, _ = self._told
        return TouchEnded(self._sensor.name, now, level, u, phi, placed, "", frame.clock_us, frame.sequence)

    def _distance(self, u: float, phi: float) -> float:
        """Return the distance of two places that differ by this [m], never too small."""
        return math.hypot(u, self._radius * math.remainder(phi, _FULL_TURN))


class Detector:
    """Touch detection on one sensor.

    Attributes:
        ready: a run of valid untouched frames was seen, and no fault since: silence now means "no touch".
        reading_now: the newest valid frame while the sensor is touched, else None.
        timing: sequence and clocks, and counts of what was missing.
    """

    def __init__(self, sensor: Sensor, settings: DetectorSettings | None = None) -> None:
        self.sensor = sensor
        self.settings = settings or DetectorSettings()
        if not self.settings.drift_limit < sensor.thresholds.release_level:
            raise SensorError(
                "detector.drift_limit must be below thresholds.release_level, got "
                f"{self.settings.drift_limit!r} and {sensor.thresholds.release_level!r}"
            )
        self.timing = FrameTiming(self.settings.timing)
        self.ready = False
        self.reading_now: TouchReading | None = None
        self._currents = UntouchedCurrents(sensor, self.settings.current_drift)
        self._guides = UntouchedGuides(self._currents)
        self._zero = UntouchedZero(sensor)
        self._diagnosis = FaultDiagnosis(sensor, self._currents)
        self._fault: Fault | None = None
        self._reported: set[Fault | str] = set()  # since it was ready last: each is reported once
        self._touch, self._release = sensor.thresholds.touch_level, sensor.thresholds.release_level
        self._level = UntouchedLevel(self.settings, self._release)
        self._stuck = _StuckValues(self.settings.stuck_frames)
        release = self._release
        self._leak = UntouchedLeak(sensor, 2.0 * release / (1.0 - release) / sensor.electronics.pulldown_ohms)
        self._self_test = FrameSelfTest(sensor, self._currents)
        self._inversion = FrameInversion(sensor)
        self._places = TouchPlace(sensor, self.settings, self._currents, self._leak, self._guides)
        self._told = _ReportedTouch(sensor, self.settings)
        self._against = self._quiet = 0  # frames in a row that speak against what is told, or for it while untouched
        self._contradictions = 0.0  # frames taken for a change of contact, less what good frames have taken off
        self._began = 0.0  # the touch, until it is reported as one that lasts

    @property
    def touched(self) -> bool:
        """True while a touch lasts."""
        return self.reading_now is not None

    @property
    def altered(self) -> str:
        """How the untouched sheets are not what they were, so that no place is certain; empty while they are."""
        return self._places.altered

    def feed(self, frame: Frame, now: float, alarm: TouchAlarm | None = None) -> list[SkinEvent]:
        """Take the next frame of this sensor.

        Args:
            now: host clock when it arrived [s], monotonic.
            alarm: called where a touch begins with this frame, and that is the first that happens in it.

        Returns:
            what happened, mostly nothing.
        """
        events: list[SkinEvent] = []
        restarted = frame[3] & _RESTARTED_BIT and self.timing.frames > 0
        if restarted:
            self.timing.restart()
        late = self.timing.feed(frame[4], frame[5], now)
        if restarted:
            self._report(events, Fault.RESTARTED, frame, now)
        elif late is not None:
            self._report(events, late, frame, now, self.timing.detail)
            if late is Fault.REPLAYED:
                return events  # an old frame says nothing about now
        zero = self._zero
        resting = frame[6] + frame[7] < 2.0 * self._release * frame[15]
        if resting and zero.feed(frame, self.timing.period, not self.ready):
            self._currents.restart()  # what was learned of them had another zero
        if zero.counts:
            frame = zero.take_off(frame)
        whole, fault = judged = judge(self.sensor, frame, self._currents.noise)
        level, stuck = whole - self._level.value, None
        if level >= self._touch and fault is None and alarm is not None and not events and self._begins(whole):
            stuck = self._stuck.feed(frame)
            if not stuck:
                alarm(self.sensor.name, level)
                alarm = None
        reading = None
        if self.touched or whole >= self._release or level >= self._release:
            reading = read(self.sensor, frame, self._inversion, judged=judged)
            fault = reading.fault
        if resting and not zero.known and fault is Fault.LEAK:
            self.timing.seen_valid(now)
            return events  # the first frames tell what no current reads
        if zero.excess and ((fault is None and resting) or fault is Fault.LEAK):
            self._skip()
            self._report(events, Fault.ZERO, frame, now, zero.excess)
            return events
        if fault is None and whole < self._release and self._guides.contradict(frame, whole, self.timing.period):
            fault = Fault.GUIDE_DRIVEN
        if self._diagnosis.name is not None and (fault is None or fault in DIAGNOSED_FAULTS):
            name = self._diagnosis.feed(frame, fault)
            if name is not None:
                self._report(events, name, frame, now, self._diagnosis.words)
        if fault is not None:
            self._places.interrupt()
            self._skip()
            if not self._is_change(fault):
                self._report(events, Fault.ZERO if fault is Fault.LEAK and zero.lacks(frame) else fault, frame, now)
                return events
            if whole < self._touch:
                return events  # the next frames say what it was
        else:
            if self._contradictions:
                self._contradictions = max(0.0, self._contradictions - _CONTRADICTION_DECAY)
            self.timing.seen_valid(now)
        if self._stuck.feed(frame) if stuck is None else stuck:
            self._report(events, Fault.STUCK, frame, now)
            return events
        if reading is None or (level < self._touch and not self.touched):
            self._while_untouched(events, frame, now, level)
        elif self.touched:
            matrix = reading.matrix
            firm = self.settings.self_test and fault is None and reading.level >= self.sensor.thresholds.location_level
            if firm and matrix is not None and self._self_test.feed(matrix):
                self._places.interrupt()
                detail = f"{self._self_test.deviation(matrix):.1f} times the limit"
                low = zero.hidden and self._self_test.lacks_current(matrix)
                self._report(events, Fault.ZERO if low else Fault.GUIDES_DISAGREE, frame, now, detail)
                return events
            if self._self_test.doubted:
                reading = reading._replace(location_valid=False)
            touch = self._places.feed(frame, reading, level, now, self.timing.period)
            self._while_touched(events, frame, touch)
        else:
            self._before_touch(events, frame, reading, level, now, alarm)
        return events

    def _begins(self, whole: float) -> bool:
        """Tell whether a frame above the threshold begins a touch, whatever the place is that it has, or has not."""
        certain = self._against + 1 >= self.settings.confirm_frames and self._contradictions <= _MAX_CONTRADICTIONS
        return certain and not self.touched and whole >= self._touch and self._diagnosis.name is None

    def _is_change(self, fault: Fault) -> bool:
        """Tell whether a frame's fault may be a contact that came or went between the phases of this one frame.

        The phases are measured one after the other, so such a frame contradicts itself. A few frames later the contact
        rests, or has passed the threshold. If they go on, or come more often than now and then, it is a fault.
        """
        if fault not in _CONTACT_FAULTS or self._contradictions > _MAX_CONTRADICTIONS:
            return False
        self._contradictions += 1.0
        return True

    @property
    def fault(self) -> Fault | None:
        """Why the sensor cannot be believed at present. None where it can."""
        return self._fault

    @property
    def untouched_ohms(self) -> tuple[float, float]:
        """What the upper and the lower sheet have per square, as the untouched frames of late have them [ohm]."""
        return self.sensor.sheet_ohms(*self._currents.sheets())

    def distrust(self, fault: Fault, now: float, detail: str) -> list[SkinEvent]:
        """Report a fault of what this sensor's frames come through: it has to become ready anew.

        Args:
            now: host clock [s].
        """
        events: list[SkinEvent] = []
        self._report(events, fault, self.timing, now, detail)
        return events

    def silence(self, now: float, longest: float) -> list[SkinEvent]:
        """Report that no valid frame has come for too long. Where others come, what is wrong with them is reported.

        Args:
            now: host clock [s].
            longest: silence that is allowed [s].

        Returns:
            a SkinFault, once until the sensor is ready again, or nothing.
        """
        age = self.timing.age(now)
        events: list[SkinEvent] = []
        if age > longest and (self._fault is None or self.timing.age(now, valid=False) > longest):
            detail = f"{age * 1e3:.1f} ms" if math.isfinite(age) else "none at all"
            self._report(events, Fault.SILENT, self.timing, now, detail)
        return events

    def _while_untouched(self, events: list[SkinEvent], frame: Frame, now: float, level: float) -> None:
        settings = self.settings
        if self._against:
            self._against = 0
            self._places.end()
        whole = level + self._level.value
        if self._level.exhausted(whole):
            self._report(events, Fault.DRIFT, frame, now, f"{whole:+.3f} of the level")
        if level >= self.sensor.thresholds.release_level:  # neither touched nor quiet: no drift is learned from it
            self._quiet = min(self._quiet, 0) - 1  # frames in a row that are neither, negative
            self._skip()
            if -self._quiet * self.timing.period > (settings.lasting_touch if self.ready else _UNREADY_TIME):
                self._report(events, Fault.DRIFT, frame, now, f"{whole:+.3f} of the level, for long")
            return
        self._quiet = (self._quiet if self._quiet >= 0 else min(self._quiet + _QUIET_WEIGHT, 0)) + 1
        if self._diagnosis.name is not None:
            self._diagnosis.end()
        self._leak.feed(frame, whole)
        changed = self._currents.feed(frame, self.timing.period)
        if changed is not None:
            if changed[0] is Fault.CURRENT_CHANGED:
                self._places.altered = changed[1]
            self._report(events, changed[0], frame, now, changed[1])
        if self._quiet >= settings.settle_frames and self._currents.means[0]:
            self.ready = True
            self._fault = None
            self._reported.clear()
        self._level.update(level, self.timing.period)

    def _before_touch(
        self,
        events: list[SkinEvent],
        frame: Frame,
        reading: Reading,
        level: float,
        now: float,
        alarm: TouchAlarm | None,
    ) -> None:
        """Take a frame above the threshold. A touch begins once there are enough of them."""
        self._against += 1
        certain = self._against >= self.settings.confirm_frames
        if certain and alarm is not None and not events:
            alarm(self.sensor.name, level)
        self._quiet = 0
        self._skip()
        touch = self._places.begin(frame, reading, level, now)
        if not certain:
            return
        self._began, self._against = now, 0
        self.reading_now = touch
        events.append(self._told.begin(touch))

    def _while_touched(self, events: list[SkinEvent], frame: Frame, touch: TouchReading) -> None:
        now, level = touch.time, touch.level
        if level < self._release:
            self._end(events, frame, now, level)
            return
        self.reading_now = touch
        self._against = 0
        if now - self._began >= self.settings.lasting_touch:
            self._report(events, Fault.LAYERS_CLOSED, frame, now, f"{now - self._began:.1f} s")
            self._began = math.inf
        moved = self._told.move(touch)
        if moved is not None:
            events.append(moved)

    def _end(self, events: list[SkinEvent], frame: Frame, now: float, level: float) -> None:
        """Take a frame of a touch that is below the release threshold."""
        self._against += 1
        if self._against < self.settings.release_frames:
            return
        self.reading_now = None
        self._against = self._quiet = 0
        self._self_test.begin()
        self._places.end()
        events.append(self._told.end(frame, now, level))

    def _skip(self) -> None:
        """Forget what was being learned: the sensor is not quiet any more."""
        self._currents.skip()
        self._leak.skip()

    def _report(
        self, events: list[SkinEvent], fault: Fault, at: Frame | FrameTiming, now: float, detail: str = ""
    ) -> None:
        """Take a fault, and report it where it was not. The diagnosis in words counts as another one."""
        self._quiet = 0
        if not self.touched:
            self._against = 0
        self._currents.restart()
        self.ready = False
        if fault in DIAGNOSED_FAULTS:
            fault = self._diagnosis.rename(fault)
        self._fault = fault
        told = detail if detail and detail == self._diagnosis.words else fault
        if told not in self._reported:
            self._reported |= {told, fault}
            events.append(SkinFault(self.sensor.name, now, at.clock_us, at.sequence, fault, detail))
