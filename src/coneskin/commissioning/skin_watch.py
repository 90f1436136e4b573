"""Live touching: what the sensors of a scene read now, and who touches them. Nothing is guarded, and nothing moves."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from coneskin.core.errors import SceneError, SkinConnectionError, SkinError, SkinTimeout
from coneskin.scene.summary import missing_parts
from coneskin.skin.detection.events import SkinFault
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.frame.timing import TimingLimits
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sources.kinds import is_simulated, open_source

from .touching import REQUESTS, Notice, Touching, TouchJudge

if TYPE_CHECKING:
    from coneskin.scene.values.scene import Scene
    from coneskin.session.skin_client import SkinClient
    from coneskin.skin.detection.frame.reading import TouchReading
    from coneskin.skin.sources.source import Source

_FRAME_TIMEOUT = 30.0  # s that frames may be late or missing: nothing is guarded, and a late place is as good
_READY_TIMEOUT = 10.0  # s for every sensor to send a run of good frames
_POLL_PERIOD = 0.02  # s between two looks at what is not skin
_AGAIN_TIME = 2.0  # s, and the time of two touches, after which a virtual touch that was too short is made again


class SkinWatch:
    """Readings of a scene's sensors, judged as the guard judges them but for their age.

    Args:
        source: of their bytes, opened once the watch is there.
    """

    def __init__(self, scene: Scene, source: Source) -> None:
        limits = scene.monitoring_limits
        timing = TimingLimits(late=_FRAME_TIMEOUT, clock_drift=limits.clock_drift)
        settings = DetectorSettings(stuck_frames=limits.stuck_frames, self_test=False, timing=timing)
        sensors = [item.sensor for item in scene.sensors]
        self._stream = TouchStream(sensors, settings)
        # wires that are exchanged contradict themselves too; their places name them first, and this has the last word
        self._judge = TouchStream(sensors, replace(settings, self_test=True))
        self._contradictions: dict[str, str] = {}
        self._source = source
        self._faults: list[str] = []

    def await_ready(self) -> None:
        """Wait until every sensor has sent a run of good untouched frames.

        Raises:
            SkinError: one does not in time; what was wrong is listed.
        """
        end = time.monotonic() + _READY_TIMEOUT
        while not self._stream.ready:
            self._read(0.05)
            if time.monotonic() > end:
                late = [detector.sensor.name for detector in self._stream.detectors if not detector.ready]
                why = "; ".join(dict.fromkeys(self._faults)) or "it is touched, or nothing arrives"
                raise SkinError(f"{', '.join(late)}: no run of good untouched frames in {_READY_TIMEOUT:g} s: {why}")
        self._faults.clear()

    def untouched_ohms(self) -> dict[str, tuple[float, float]]:
        """Return what the untouched sheets of each sensor have per square [ohm], upper and lower, as its currents say.

        The leads are taken to be those of the scene.
        """
        return {detector.sensor.number: detector.untouched_ohms for detector in self._stream.detectors}

    def contradiction(self, sensor: str) -> str:
        """Return why a sensor's places must not be believed although they look right; empty where they may be.

        The inputs contradict each other while it is touched: a gain is off, and a fit would take that for leads.
        """
        said = self._contradictions.get(sensor, "")
        return said and f"{said}: the inputs contradict each other while it is touched; check their gains and wires"

    def read(self, timeout: float) -> dict[str, TouchReading | None]:
        """Wait for bytes, for a time at most [s], and return what each sensor reads by its name; None where untouched.

        Raises:
            SkinError: a sensor has a fault, or is silent; a place that it read would say nothing.
        """
        self._read(timeout)
        if self._faults:
            raise SkinError("; ".join(dict.fromkeys(self._faults)))
        return {detector.sensor.name: detector.reading_now for detector in self._stream.detectors}

    def _read(self, timeout: float) -> None:
        try:
            data = self._source.read(timeout)
        except SkinTimeout:
            data = b""
        now = time.monotonic()
        events = self._stream.feed(data, now) if data else []
        for event in self._judge.feed(data, now) if data else ():
            if isinstance(event, SkinFault) and event.fault is Fault.GUIDES_DISAGREE:
                self._contradictions[event.sensor] = event.message
        events += self._stream.silence(now, _FRAME_TIMEOUT)
        self._faults += [event.message for event in events if isinstance(event, SkinFault)]


def check_touchable(scene: Scene, simulated: bool) -> None:
    """Refuse a scene whose marks nobody can touch.

    Args:
        simulated: its virtual skin is touched by this program, not by a person.

    Raises:
        SceneError: the scene has no source, or no sensor.
        SkinConnectionError: it is to be simulated, and its skin is not virtual, or the other way round.
    """
    if missing := missing_parts(scene):
        raise SceneError(missing, scene.name)
    assert scene.source is not None
    if simulated and not is_simulated(scene.source.kind):
        raise SkinConnectionError(
            f"the skin of {scene.name} is not virtual: only a person can touch it, so leave --simulated out"
        )
    if not simulated and is_simulated(scene.source.kind):
        raise SkinConnectionError(f"the skin of {scene.name} is virtual, and nobody can touch it: use --simulated")


def skin_source(scene: Scene, stack: ExitStack, played_as: Scene | None) -> tuple[Source, SkinClient | None]:
    """Return the source of a scene's skin, not open yet: what it sends before it is read would be lost.

    Args:
        stack: that ends the process.
        played_as: scene whose virtual skin, without its script of touches, is to send the bytes, from a process that
            ends with the stack; None for a real skin.

    Returns:
        the source, and the client that touches a virtual skin.
    """
    assert scene.source is not None
    client, port = None, ""
    if played_as is not None:
        from coneskin.session.skin_client import SkinClient

        folder = str(played_as.folder.resolve())
        start = {"scene": played_as.text, "name": played_as.name, "folder": folder, "script": False}
        client = SkinClient(start, [item.sensor for item in played_as.sensors])
        stack.callback(client.process.wait, 10.0)
        stack.callback(client.channel.close)
        port = client.port()
    return open_source(scene.source.kind, scene.source.settings, port), client


class TouchSession:
    """Session with the skin of a scene, and the person, or this program, who touches it.

    Args:
        scene: with a source.
        notice: called with what the person is told.
        reading: called some 50 times a second with what the sensors read now.
        refused: tells whether the person has said since the last call that a mark cannot be reached.
        simulated: touch the scene's virtual skin at the marks.
        wired_as: scene from which the virtual skin is made, where it is another.

    Raises:
        SceneError: the scene has no source, or no sensor.
        SkinConnectionError: it is to be simulated, and its skin is not virtual, or the other way round.
    """

    def __init__(
        self,
        scene: Scene,
        notice: Callable[[Notice], None] = lambda _: None,
        reading: Callable[[dict[str, TouchReading | None]], None] = lambda _: None,
        refused: Callable[[], bool] = lambda: False,
        simulated: bool = False,
        wired_as: Scene | None = None,
    ) -> None:
        check_touchable(scene, simulated)
        self.scene, self.simulated = scene, simulated
        self._notice, self._reading, self._refused = notice, reading, refused
        self._wired_as = wired_as or scene
        self._client: SkinClient | None = None
        self._again_at = math.inf  # when a touch of a virtual skin that was not read is made once more

    @contextmanager
    def watch(self) -> Iterator[SkinWatch]:
        """Open the skin, and yield its watch once every sensor is ready.

        Raises:
            SkinError: the skin has a fault, or cannot be read.
        """
        with ExitStack() as stack:
            source, self._client = skin_source(self.scene, stack, self._wired_as if self.simulated else None)
            watch = SkinWatch(self.scene, source)
            stack.enter_context(source)
            watch.await_ready()
            yield watch

    def carry_out(
        self,
        judge: TouchJudge[TouchReading],
        watch: SkinWatch,
        duration: float = 0.0,
        check: Callable[[], None] = lambda: None,
    ) -> None:
        """Have all marks of a judge touched, until it is over or cannot be carried out.

        Args:
            watch: of the sensors, ready.
            duration: of each touch of a virtual skin [s].
            check: called some 50 times a second; raises what ends it.

        Raises:
            SkinError: a sensor has a fault, or is silent.
        """
        touching, polled = Touching(judge), 0.0
        while not touching.over:
            readings = watch.read(_POLL_PERIOD)
            now = time.monotonic()
            self._tell(judge, touching.update(now, readings), duration)
            if now >= self._again_at and judge.mark is not None:
                self._touch(judge, duration)
            if now - polled >= _POLL_PERIOD:
                polled = now
                check()
                self._reading(readings)
                if self._refused():
                    self._tell(judge, touching.refuse(), duration)

    def _tell(self, judge: TouchJudge[TouchReading], notices: list[Notice], duration: float) -> None:
        """Tell the person; a virtual skin is touched in the person's place."""
        for notice in notices:
            self._notice(notice)
            if notice.kind in REQUESTS:
                self._touch(judge, duration)
            elif self._client is not None and notice.kind == "read":
                self._client.release()

    def _touch(self, judge: TouchJudge[TouchReading], duration: float) -> None:
        if self._client is not None and judge.mark is not None:
            self._client.touch(*judge.mark.place, judge.force, duration, judge.current.sensor.name)
            self._again_at = time.monotonic() + 2.0 * duration + _AGAIN_TIME
