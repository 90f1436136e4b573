"""Touches of all sensors on one stream: bytes in, events out.

Nothing that arrives is dropped in silence: frames of an unexpected sensor or version, and bytes that are no
frames, are counted, and reported once each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from coneskin.core.errors import SensorError
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import FRAME_LENGTH, Frame, FrameDecoder

from .detector import Detector, TouchAlarm
from .events import SkinEvent, SkinFault
from .frame.faults import Fault
from .frame.settings import DetectorSettings

_MAX_BAD_BYTES: Final = 4 * FRAME_LENGTH  # bytes; more of them outside any frame are a corrupt stream
_BAD_BYTES_DECAY: Final = 1  # byte; each good frame takes so many off the count


class TouchStream:
    """The detectors of all sensors that share one port.

    Args:
        sensors: the sensors expected.
        settings: how their detectors decide.

    Attributes:
        decoder: finds the frames. Its counters tell what else was on the line.
        detectors: one for each sensor, in the order given.
        unknown: frames from unexpected devices or sensors: (device, sensor) -> count.

    Raises:
        SensorError: there is no sensor, or two have the same numbers or the same name.
    """

    def __init__(self, sensors: Sequence[Sensor], settings: DetectorSettings | None = None) -> None:
        if not sensors:
            raise SensorError("a stream needs at least one sensor, got none")
        self.decoder = FrameDecoder()
        self.detectors = tuple(Detector(sensor, settings) for sensor in sensors)
        self._by_number = {d.sensor.device_id << 8 | d.sensor.sensor_id: d for d in self.detectors}
        names = {d.sensor.name for d in self.detectors}
        if len(self._by_number) < len(self.detectors) or len(names) < len(self.detectors):
            listing = ", ".join(f"{s.name} = {s.number}" for s in sensors)
            raise SensorError(f"sensors on one stream must differ in name and in (device_id, sensor_id), got {listing}")
        self.unknown: dict[tuple[int, int], int] = {}
        self._skipped = 0, 0  # bytes in all, and those that are not forgiven yet
        self._versions = 0.0  # packets of unknown versions that are no news
        self._corrupt = self._starting = False

    @property
    def ready(self) -> bool:
        """True while every sensor is ready: silence then means "no touch"."""
        return all(detector.ready for detector in self.detectors)

    def feed(self, data: bytes, now: float, alarm: TouchAlarm | None = None, held_up: float = 0.0) -> list[SkinEvent]:
        """Take the next bytes.

        Args:
            data: any number of bytes.
            now: host clock when they arrived [s], monotonic.
            alarm: called where the first that happens is that a touch begins, before its place is worked out.
            held_up: for how long the reader itself may have kept them waiting [s]: that is no lag of theirs.

        Returns:
            what happened, in the order of the frames.
        """
        events: list[SkinEvent] = []
        frames = self.decoder.feed(data)
        if held_up != self.detectors[0].timing.held_up:
            for detector in self.detectors:
                detector.timing.held_up = held_up
        for frame in frames:
            found = self._by_number.get(frame[1] << 8 | frame[2])
            if found is not None:
                happened = found.feed(frame, now, alarm)
                if happened:
                    events += happened
                    alarm = None  # what has happened decides first
            else:
                self._note_unknown(events, frame, now)
                alarm = None
        skipped, bad = self._skipped
        if self.decoder.bytes_skipped != skipped or bad:
            self._watch_bytes(events, len(frames), now)
        if self.decoder.unknown_versions > self._versions:
            self._versions = math.inf  # it is reported once
            detail = f"version {self.decoder.last_unknown_version}"
            events.append(SkinFault("", now, 0, 0, Fault.UNKNOWN_VERSION, detail))
        return events

    def silence(self, now: float, longest: float) -> list[SkinEvent]:
        """Report a fault, once, for each sensor that has sent no valid frame for longer than allowed [s]."""
        events: list[SkinEvent] = []
        for detector in self.detectors:
            if detector.timing.age(now) > longest:
                events += detector.silence(now, longest)
        return events

    def reconnect(self, now: float) -> None:
        """Take that the port is open again [s]: each sensor has to become ready anew, and its clocks are not known."""
        self.forget_faults()
        for detector in self.detectors:
            detector.timing.restart()
            detector.distrust(Fault.SILENT, now, "")  # that it was gone is reported

    def forget_faults(self) -> None:
        """Report faults of the line once more if they go on: a person has reset the guard."""
        self._corrupt, self._versions = False, float(self.decoder.unknown_versions)
        self.unknown.clear()

    def _note_unknown(self, events: list[SkinEvent], frame: Frame, now: float) -> None:
        key = (frame.device, frame.sensor)
        if key not in self.unknown and len(self.unknown) < 256:
            detail = f"device {frame.device}, sensor {frame.sensor}"
            events.append(SkinFault("", now, frame.clock_us, frame.sequence, Fault.UNKNOWN_SENSOR, detail))
            self.unknown[key] = 0
        if key in self.unknown:
            self.unknown[key] += 1

    def _watch_bytes(self, events: list[SkinEvent], frames: int, now: float) -> None:
        """Forgive a few bad bytes with time (a port opened in mid-frame). Report many as a fault.

        Before the sensors are ready, it is a fault of theirs that passes with the bad bytes, as every fault does then:
        many boards print a banner when they start.
        """
        skipped = self.decoder.bytes_skipped
        before, bad = self._skipped
        bad = max(0, bad + skipped - before - _BAD_BYTES_DECAY * frames)
        self._skipped = skipped, min(bad, _MAX_BAD_BYTES)
        if bad > _MAX_BAD_BYTES:
            if not self.ready and not self._corrupt:
                self._starting = True
            elif not self._corrupt:
                self._corrupt = True
                events.append(SkinFault("", now, 0, 0, Fault.CORRUPT, self._bad_bytes()))
        elif not bad:
            self._corrupt = self._starting = False
        if self._starting:
            for detector in self.detectors:
                events += detector.distrust(Fault.CORRUPT, now, self._bad_bytes())

    def _bad_bytes(self) -> str:
        return f"{self.decoder.bytes_skipped} bytes skipped, {self.decoder.crc_errors} wrong checksums"
