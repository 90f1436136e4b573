"""Detector on a twin of its sensor: frames go in, events come out."""

import random

from coneskin.core.errors import SkinConnectionError
from coneskin.skin.detection.detector import Detector, TouchAlarm
from coneskin.skin.detection.events import SkinEvent, SkinFault
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame, FrameDecoder

from ..bench_top import UR10, measured, unrounded

SENSOR = Sensor(UR10, name="forearm")
COUNTS = Frame._fields[6:-1]
FIRM = [LayerContact(0.2, 1.0, 1e-3)]


class DetectorBench:
    """A detector that is fed one frame a millisecond, with the noise of a count that a converter has."""

    def __init__(self, settings: DetectorSettings | None = None) -> None:
        self.detector = Detector(SENSOR, settings)
        self.alarm: TouchAlarm | None = None
        self.count = 0
        self._rng = random.Random(3)

    def feed(self, contacts=(), times: int = 1, **changes) -> list[SkinEvent]:
        frame = measured(SENSOR, contacts)
        exact = frame._asdict() | unrounded(SENSOR, contacts)
        events = []
        for _ in range(times):
            counts = {n: max(0, round(exact[n] + self._rng.gauss(0.0, 0.7))) for n in COUNTS}
            stamp = {"sequence": self.count & 0xFFFF, "clock_us": self.count * 1000 & 0xFFFFFFFF}
            events += self.detector.feed(
                frame._replace(**{**counts, **stamp, **changes}), self.count * 1e-3, self.alarm
            )
            self.count += 1
        return events


def play(skin: VirtualSkin, settings: DetectorSettings | None = None) -> tuple[list[SkinEvent], Detector]:
    """Everything that a detector says about a virtual skin's bytes, silence beyond 20 ms included."""
    detector, decoder = Detector(skin.sensors[0], settings), FrameDecoder()
    events: list[SkinEvent] = []
    try:
        for time, data in skin.packets():
            for frame in decoder.feed(data):
                events += detector.feed(frame, time)
            events += detector.silence(time, 0.02) if time > 0.02 else []
    except SkinConnectionError:
        pass
    return events, detector


def faults_of(events: list[SkinEvent]) -> list[Fault]:
    return [event.fault for event in events if isinstance(event, SkinFault)]
