"""Frames of one sensor in which nothing shows, many at once: for replays. They change only what a detector learns.

A frame is *plain* where, whatever came before, it is neither a fault nor a touch. ``reading.read`` must say the same,
and is asked about every 32nd. What a detector learns from plain frames is worked out here with the same numbers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from coneskin.skin.frame_batch import FrameBatch
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame, Status, frame_at

from .frame.reading import GUIDE_SLACK, LEVEL_NOISE, read
from .frame.untouched import GUIDE_JUMP

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["QuietFrames", "find_quiet_frames", "learn_quiet_frames"]

# fields that have noise in a working device, in the order of ``Detector``
_LIVELY_FIELDS = ("radial_current", "angular_current", "touch_supply", "radial_supply", "angular_supply")
_FAULT_BITS = int(~Status.TOUCH & 0xFF)
_FRAME_LENGTHS = (36, 40)  # bytes; frames with the driven potentials are read one by one
_CHECK_INTERVAL = 32  # frames, of which one is read as a live one


class QuietFrames(NamedTuple):
    """Frames of one sensor, one list for each quantity. What a frame shows that is not plain is never used.

    Attributes:
        plain: in which nothing shows.
        sequences: sequence numbers.
        clocks: device clock [us].
        times: host clock when each arrived [s].
        levels: as in ``Reading``.
        radial: mean potential of the guides in the radial phase, over the supply.
        angular: the same in the angular phase.
        radial_currents: over the supply.
        angular_currents: over the supply.
        supplies: in the touch phase [counts].
        lively: the fields ``_LIVELY_FIELDS``.
        repeats: how many frames in a row before it had the same value, for each of those.
        data: bytes of the frames.
        starts: offsets of the frames in them.
    """

    plain: NDArray[np.bool_]
    sequences: list[int]
    clocks: list[int]
    times: list[float]
    levels: list[float]
    radial: list[float]
    angular: list[float]
    radial_currents: list[float]
    angular_currents: list[float]
    supplies: list[int]
    lively: list[list[int]]
    repeats: list[list[int]]
    data: bytes
    starts: list[int]

    def frame(self, number: int) -> Frame:
        """Return a frame as the decoder does."""
        frame = frame_at(self.data, self.starts[number])
        assert frame is not None
        return frame


def find_quiet_frames(sensor: Sensor, batch: FrameBatch, times: NDArray[np.float64]) -> QuietFrames:
    """Return the frames of a sensor.

    Args:
        sensor: the sensor.
        batch: its frames.
        times: host clock when each arrived [s].
    """
    import numpy as np

    bounds, limits = sensor.bounds, sensor.thresholds
    names = ("touch_c", "touch_d", "touch_current", "radial_c", "radial_d", "angular_a", "angular_b", *_LIVELY_FIELDS)
    count = {name: batch.field(name).astype(np.int64) for name in names}
    touch, radial, angular = (
        count["touch_c"] + count["touch_d"],
        count["radial_c"] + count["radial_d"],
        count["angular_a"] + count["angular_b"],
    )
    supply, supply1, supply2 = count["touch_supply"], count["radial_supply"], count["angular_supply"]
    current1, current2 = count["radial_current"], count["angular_current"]
    plain = (np.isin(batch.lengths, _FRAME_LENGTHS)) & (batch.statuses & _FAULT_BITS == 0)
    for each in (supply, supply1, supply2):
        plain &= (bounds.supply_low <= each) & (each <= bounds.supply_high)
    plain &= (bounds.radial_low <= current1) & (current1 <= bounds.radial_high)
    plain &= (bounds.angular_low <= current2) & (current2 <= bounds.angular_high)
    for name in names[:2] + names[3:7]:
        plain &= count[name] < bounds.full
    with np.errstate(divide="ignore", invalid="ignore"):
        level = touch / (2.0 * supply)
        plain &= level < limits.release_level
        plain &= np.abs(count["touch_current"] - touch * bounds.touch_current_per_guide) <= bounds.touch_current_slack
        high, low = np.maximum(*(count[n] for n in names[:2])), np.minimum(*(count[n] for n in names[:2]))
        plain &= low + bounds.noise >= bounds.weaker_guide * high
        most = 1.0 / (1.0 + bounds.load_ratio * (1.0 / (level + LEVEL_NOISE / supply) - 1.0)) + GUIDE_SLACK
        plain &= (radial <= 2.0 * most * supply1) & (angular <= 2.0 * most * supply2)
        plain &= np.abs(count["radial_c"] - count["radial_d"]) <= GUIDE_JUMP * supply
        plain &= np.abs(count["angular_a"] - count["angular_b"]) <= GUIDE_JUMP * supply
        currents = current1 / supply1, current2 / supply2
        guides = 0.5 * radial / supply1, 0.5 * angular / supply2
    lively = [count[name] for name in _LIVELY_FIELDS]
    found = QuietFrames(
        plain=plain,
        sequences=batch.field("sequence").tolist(),
        clocks=batch.clocks.tolist(),
        times=times.tolist(),
        levels=level.tolist(),
        radial=guides[0].tolist(),
        angular=guides[1].tolist(),
        radial_currents=currents[0].tolist(),
        angular_currents=currents[1].tolist(),
        supplies=supply.tolist(),
        lively=[each.tolist() for each in lively],
        repeats=[_repeats(each).tolist() for each in lively],
        data=batch.bytes.tobytes(),
        starts=batch.starts.tolist(),
    )
    for number in np.flatnonzero(plain)[::_CHECK_INTERVAL].tolist():
        reading = read(sensor, found.frame(number))
        if reading.fault is not None or reading.level != found.levels[number]:
            plain[:] = False  # this code and ``read`` do not agree, and ``read`` decides
    return found


def _repeats(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many values in a row before each are the same."""
    import numpy as np

    index = np.arange(len(values))
    changed = np.ones(len(values), bool)
    changed[1:] = values[1:] != values[:-1]
    found: NDArray[np.int64] = index - np.maximum.accumulate(np.where(changed, index, 0))
    return found


def learn_quiet_frames(parts: tuple[Any, ...], frames: QuietFrames, begin: int, end: int, final: bool) -> int:
    """Let the parts of one detector learn from plain frames in a row. Arguments and result as of ``Detector.learn``.

    Args:
        parts: timing, guides, currents, level, stuck values and leak of the detector.
        frames: of the sensor.
        begin: the first of them.
        end: the one behind the last.
        final: False: only tell what would be returned.
    """
    timing, guides, currents, level, stuck, leak = parts
    taken: int
    before = [dict(vars(part)) for part in parts[:-1]]  # the leak is learned last, when nothing has to be restored
    part = slice(begin, end)
    levels = frames.levels[part]
    periods = timing.learn(frames.sequences[part], frames.clocks[part], frames.times[part])
    count = len(periods)
    taken = guides.learn(frames.radial[part][:count], frames.angular[part][:count], levels[:count], periods)
    taken = level.learn(levels[:taken], periods)
    if taken == end - begin:
        taken = currents.learn(
            frames.radial_currents[part], frames.angular_currents[part], frames.supplies[part], periods
        )
    if taken == end - begin:
        taken = stuck.learn(frames, begin, end)
    if taken < end - begin or not final:
        for learner, values in zip(parts[:-1], before, strict=True):
            vars(learner).update(values)
        return begin + taken
    if leak.wants(max(levels)):
        for number in range(begin, end):
            leak.feed(frames.frame(number), frames.levels[number])
    return end
