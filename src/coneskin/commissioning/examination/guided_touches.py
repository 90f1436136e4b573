"""Guided touches near A, B, C and D of a sensor: what it reads there, however its wires are exchanged.

The detector of the guard cannot be asked: with wires exchanged between the sheets its sensor is never ready. So a touch
is whatever moves a reading away from where it rested, and stays.
"""

from __future__ import annotations

import math
import statistics
import time
from collections import deque
from collections.abc import Callable, Sequence

from coneskin.commissioning.touching import Held, Mark, Notice, Touching, TouchJudge
from coneskin.core.errors import SkinTimeout
from coneskin.core.finding import Finding, Verdict, judged
from coneskin.skin.detection.frame.contact_matrix import FrameInversion
from coneskin.skin.detection.frame.reading import read
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.frame.untouched import UntouchedCurrents, UntouchedZero
from coneskin.skin.detection.self_test import FrameSelfTest
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.source import Source
from coneskin.skin.wire import Frame, FrameDecoder

from .wires import READING_NAMES, TouchReadings, touch_places

_HOLD_TIME = 0.3  # s that a touch, or an untouched sensor, must rest
_TOUCH_CHANGE = 0.04  # of the supply or the full scale, by which a touch moves a reading
_REST_RANGE = 0.03  # likewise, by which a touch that rests may move
_READ_TIMEOUT = 0.05  # s
_MIN_FRAMES = 20  # firm ones
_GOOD_PART = 0.25  # of the limit; a sensor whose parts are within 1 % stays below a tenth


def guided_touches(
    source: Source,
    sensor: Sensor,
    tell: Callable[[Notice, Mark | None], None],
    patience: float = 60.0,
    clock: Callable[[], float] = time.monotonic,
    keep: Callable[[Frame], None] = lambda _: None,
) -> dict[str, TouchReadings] | None:
    """Ask for touches near A, B, C and D of a sensor, and return what it read at each.

    Args:
        tell: called with what the person is told, and with the mark to touch; None to let go.
        patience: for each touch, and for the sensor to come to rest [s].
        keep: called with each frame of the sensor.

    Returns:
        the readings; None where a touch did not come.

    Raises:
        SkinConnectionError: the source is gone.
    """
    decoder, capture, judge = FrameDecoder(), _TouchCapture(sensor), _WireTouches(sensor)
    touching, end = Touching(judge), clock() + patience
    while clock() < end:
        try:
            data = source.read(_READ_TIMEOUT)
        except SkinTimeout:
            continue
        now = clock()
        for frame in decoder.feed(data):
            if (frame.device, frame.sensor) != (sensor.device_id, sensor.sensor_id):
                continue
            keep(frame)
            if not capture.feed(now, frame):
                continue
            for notice in touching.update(now, {sensor.name: capture.touch}):
                tell(notice, judge.mark)
                end = clock() + patience
                if judge.mark is None:
                    capture.restart()
            if judge.over:
                return judge.touched
    return None


class _WireTouches(TouchJudge[TouchReadings]):
    """Judge that takes the first touch after each request, wherever it is read."""

    clear_time = 0.0  # the capture has waited already

    def __init__(self, sensor: Sensor) -> None:
        super().__init__()
        self.touched: dict[str, TouchReadings] = {}
        self._marks = {name: Mark(*place, _touch_words(sensor, name)) for name, place in touch_places(sensor).items()}

    def ask(self) -> Notice:
        self.mark = list(self._marks.values())[len(self.touched)]
        return Notice("mark", f"touch {self.mark.where}, firmly, and hold it")

    def hold(self, touch: Held[TouchReadings]) -> list[Notice]:
        (reading,) = touch.readings.values()
        assert reading is not None
        self.touched[list(self._marks)[len(self.touched)]] = reading
        self.mark, self.over = None, len(self.touched) == len(self._marks)
        return [Notice("read", "let go")]


def _touch_words(sensor: Sensor, electrode: str) -> str:
    """Return the place near an electrode, for a person."""
    u, phi = touch_places(sensor)[electrode]
    where = {
        "A": "end 2, half way between the straight edges",
        "B": "end 1, half way between the straight edges",
        "C": "the straight edge phi = wrap, half way between the ends",
        "D": "the straight edge phi = 0, half way between the ends",
    }[electrode]
    return (
        f"{sensor.name} near electrode {electrode}: {where} (u = {1e3 * u:.0f} mm, phi = {math.degrees(phi):.0f} deg)"
    )


class _TouchCapture:
    """Raw frames of one sensor, which rest untouched, rest touched, or move.

    Attributes:
        touch: mean readings of the touch that rests; None where the untouched sensor does.
    """

    def __init__(self, sensor: Sensor) -> None:
        self.touch: TouchReadings | None = None
        self._sensor = sensor
        self._rest: TouchReadings | None = None
        self._recent: deque[tuple[float, TouchReadings]] = deque()

    def feed(self, time: float, frame: Frame) -> bool:
        """Take a frame of a time [s]; tell whether the readings rest."""
        recent = self._recent
        recent.append((time, _normalize(self._sensor, frame)))
        if recent[-1][0] - recent[0][0] < _HOLD_TIME:
            return False
        while len(recent) > 2 and recent[-1][0] - recent[1][0] >= _HOLD_TIME:
            recent.popleft()
        columns = list(zip(*(values for _, values in recent), strict=True))
        if any(max(column) - min(column) > _REST_RANGE for column in columns):
            return False
        mean = tuple(sum(column) / len(column) for column in columns)
        if self._rest is None:
            self._rest = mean
        same = all(abs(a - b) <= _TOUCH_CHANGE for a, b in zip(mean, self._rest, strict=True))
        self.touch = None if same else mean
        return True

    def restart(self) -> None:
        """Forget the newest frames, but not how the untouched sensor rests."""
        self._recent.clear()


def _normalize(sensor: Sensor, frame: Frame) -> TouchReadings:
    """Return the readings of a frame over its supplies and over the full scale; all 0 without a supply."""
    full = sensor.electronics.full_count
    return tuple(
        getattr(frame, name) / (full if name.endswith("current") else getattr(frame, f"{name[:-2]}_supply") or full)
        for name in READING_NAMES
    )


def examine_touches(sensor: Sensor, untouched: Sequence[Frame], touched: Sequence[Frame], period: float) -> Finding:
    """Examine the frames of the guided touches.

    Args:
        sensor: as the scene describes it; its wires are in order.
        untouched: frames of the sensor at rest, by which its currents and noise are learned.
        touched: frames from the first touch to the last, those between them as well.
        period: from frame to frame [s].
    """
    item, rule = f"{sensor.name}, chi-squared", f"at most {_GOOD_PART:g} of the guard's limit"
    currents, zero = UntouchedCurrents(sensor, DetectorSettings().current_drift), UntouchedZero(sensor)
    for frame in untouched:
        zero.feed(frame, period, free=True)
    for frame in untouched:
        currents.feed(zero.take_off(frame), period)
    inversion, test = FrameInversion(sensor), FrameSelfTest(sensor, currents)
    found = []
    for frame in touched:
        reading = read(sensor, zero.take_off(frame), inversion, currents.noise)
        if reading.matrix is not None and reading.level >= sensor.thresholds.location_level:
            found.append(test.deviation(reading.matrix) ** 2)
    if len(found) < _MIN_FRAMES:
        value = f"{len(found)} frames were touched firmly enough for a place"
        return Finding(item, "not tried", value, "", "press harder")
    middle = statistics.median(found)
    verdict: Verdict = "ok" if middle <= _GOOD_PART else "warning" if middle <= 1.0 else "bad"
    remedy = (
        "the gains of the inputs, the shunt or the pull-downs are not what the scene says: measure pulldown_ohm, "
        "current_full_scale_ma and input_ohm of the sensor"
    )
    value = f"the median of {len(found)} touched frames is {middle:.2f} of the limit"
    return judged(item, verdict, value, rule, remedy)
