"""Learning of a detector from many quiet frames at once: for replays only, with the numbers of the live path."""

from __future__ import annotations

from typing import Any

from .frame.timing import FrameTiming
from .quiet_frames import QuietFrames
from .stuck_values import StuckValues
from .untouched.currents import UntouchedCurrents
from .untouched.guides import UntouchedGuides
from .untouched.leak import UntouchedLeak
from .untouched.level import UntouchedLevel

__all__ = ["QuietLearning"]


class QuietLearning:
    """The parts of one detector that a quiet frame changes.

    Args:
        timing: sequence and clocks.
        guides: noise of the guides.
        currents: of the untouched sensor.
        level: its drift.
        stuck: values that do not change.
        leak: between its layers.
    """

    def __init__(
        self,
        timing: FrameTiming,
        guides: UntouchedGuides,
        currents: UntouchedCurrents,
        level: UntouchedLevel,
        stuck: StuckValues,
        leak: UntouchedLeak,
    ) -> None:
        self._timing, self._guides, self._currents = timing, guides, currents
        self._level, self._stuck, self._leak = level, stuck, leak

    def take(self, frames: QuietFrames, begin: int, end: int, final: bool) -> int:
        """Take plain frames in a row; arguments and result as of ``Detector.learn``.

        Args:
            frames: of the sensor.
            begin: the first of them.
            end: the one behind the last.
            final: False: only tell what would be returned.
        """
        before = self._state()
        part = slice(begin, end)
        levels = frames.levels[part]
        periods = self._timing.learn(frames.sequences[part], frames.clocks[part], frames.times[part])
        count = len(periods)
        taken = self._guides.learn(frames.radial[part][:count], frames.angular[part][:count], levels[:count], periods)
        taken = self._level.learn(levels[:taken], periods)
        if taken == end - begin:
            taken = self._currents.learn(
                frames.radial_currents[part], frames.angular_currents[part], frames.supplies[part], periods
            )
        if taken == end - begin:
            taken = self._stuck.learn(frames, begin, end)
        if taken < end - begin or not final:
            self._restore(before)
            return begin + taken
        if self._leak.wants(max(levels)):
            for number in range(begin, end):
                self._leak.feed(frames.frame(number), frames.levels[number])
        return end

    @property
    def _learners(self) -> tuple[Any, ...]:
        return self._timing, self._guides, self._currents, self._level, self._stuck

    def _state(self) -> list[list[Any]]:
        """Return what a quiet frame changes; the leak is learned last, when nothing has to be restored."""
        return [[getattr(part, name) for name in part.__slots__] for part in self._learners]

    def _restore(self, before: list[list[Any]]) -> None:
        for part, values in zip(self._learners, before, strict=True):
            for name, value in zip(part.__slots__, values, strict=True):
                setattr(part, name, value)
