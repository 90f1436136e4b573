"""All sensors on one stream: bytes in, events out.

Nothing that arrives is dropped in silence: frames of a sensor or version that nobody expects, and bytes that are no
frames, are counted, and reported once each.
"""

from __future__ import annotations

from collections.abc import Sequence

from coneskin.errors import SensorError

from .detection import Detection
from .detector import Detector
from .diagnosis import Fault
from .events import Event, SkinFault
from .sensor import Sensor
from .wire import FRAME_LENGTH, Decoder, Frame

__all__ = ["Stream"]

_BAD_BYTES = 4 * FRAME_LENGTH  # bytes that belong to no frame before the stream is called corrupt
_FORGIVEN = 1  # of them, for each good frame


class Stream:
    """The detectors of all sensors that share one port.

    Args:
        sensors: the sensors expected.
        detection: how their detectors decide.

    Attributes:
        decoder: finds the frames; its counters tell what else was on the line.
        detectors: one for each sensor, in the order given.
        unknown: frames from devices or sensors that nobody expects: (device, sensor) -> count.

    Raises:
        SensorError: there is no sensor, or two have the same numbers or the same name.
    """

    __slots__ = (
        "_bad",
        "_by_number",
        "_corrupt",
        "_skipped",
        "_told_version",
        "_versions",
        "decoder",
        "detectors",
        "unknown",
    )

    def __init__(self, sensors: Sequence[Sensor], detection: Detection | None = None) -> None:
        if not sensors:
            raise SensorError("a stream needs at least one sensor, got none")
        self.decoder = Decoder()
        self.detectors = tuple(Detector(sensor, detection) for sensor in sensors)
        self._by_number = {(d.sensor.device_id, d.sensor.sensor_id): d for d in self.detectors}
        names = {d.sensor.name for d in self.detectors}
        if len(self._by_number) < len(self.detectors) or len(names) < len(self.detectors):
            listing = ", ".join(f"{s.name} = {s.device_id}/{s.sensor_id}" for s in sensors)
            raise SensorError(f"sensors on one stream must differ in name and in (device_id, sensor_id), got {listing}")
        self.unknown: dict[tuple[int, int], int] = {}
        self._bad = self._skipped = self._versions = 0
        self._corrupt = self._told_version = False

    @property
    def ready(self) -> bool:
        """Every sensor is ready: silence now means "no touch"."""
        return all(detector.ready for detector in self.detectors)

    @property
    def touched(self) -> bool:
        """Any sensor is touched."""
        return any(detector.touched for detector in self.detectors)

    def feed(self, data: bytes, now: float) -> list[Event]:
        """Take the next bytes.

        Args:
            data: any number of bytes.
            now: host clock when they arrived [s], monotonic.

        Returns:
            what happened, in the order of the frames.
        """
        events: list[Event] = []
        frames = self.decoder.feed(data)
        for frame in frames:
            detector = self._by_number.get((frame.device, frame.sensor))
            if detector is not None:
                happened = detector.feed(frame, now)
                if happened:
                    events += happened
            else:
                self._note_unknown(events, frame, now)
        if self.decoder.bytes_skipped != self._skipped or self._bad:
            self._watch_bytes(events, len(frames), now)
        if self.decoder.unknown_versions != self._versions:
            if not self._told_version:
                self._told_version = True
                detail = f"version {self.decoder.last_unknown_version}"
                events.append(SkinFault("", now, 0, 0, Fault.UNKNOWN_VERSION, detail))
            self._versions = self.decoder.unknown_versions
        return events

    def silence(self, now: float, longest: float) -> list[Event]:
        """A fault for each sensor that has sent no valid frame for longer than allowed [s], once."""
        events: list[Event] = []
        for detector in self.detectors:
            if detector.age(now) > longest:
                events += detector.silence(now, longest)
        return events

    def forget_faults(self) -> None:
        """Report faults of the line anew if they go on: a person has reset the guard."""
        self._corrupt = self._told_version = False
        self.unknown.clear()

    def _note_unknown(self, events: list[Event], frame: Frame, now: float) -> None:
        key = (frame.device, frame.sensor)
        if key not in self.unknown and len(self.unknown) < 256:
            detail = f"device {frame.device}, sensor {frame.sensor}"
            events.append(SkinFault("", now, frame.clock_us, frame.sequence, Fault.UNKNOWN_SENSOR, detail))
            self.unknown[key] = 0
        if key in self.unknown:
            self.unknown[key] += 1

    def _watch_bytes(self, events: list[Event], frames: int, now: float) -> None:
        """A few bad bytes are forgiven with time (a port opened in mid-frame), many are a fault."""
        skipped = self.decoder.bytes_skipped
        self._bad = max(0, self._bad + skipped - self._skipped - _FORGIVEN * frames)
        self._skipped = skipped
        if self._bad > _BAD_BYTES:
            self._bad = _BAD_BYTES
            if not self._corrupt:
                self._corrupt = True
                detail = f"{skipped} bytes skipped, {self.decoder.crc_errors} wrong checksums"
                events.append(SkinFault("", now, 0, 0, Fault.CORRUPT, detail))
        elif not self._bad:
            self._corrupt = False
