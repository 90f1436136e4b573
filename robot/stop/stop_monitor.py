"""Monitor of one stop: it judges the stop by measured joint speed and names the next stop path while it fails. Pure.

A host that is held up reads states late, all at once. So time is what the samples themselves say (``arm_supervisor``):
a stop path counts as ineffective when samples measured so long after it show no slowdown, and not because none was
read. Only where no sample arrives at all does the host's clock count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from coneskin.robot.driver.values import StopPath

from .limits import MonitoringLimits

STANDSTILL_SAMPLES = 5  #: samples in a row below the standstill speed that count as standing
PROTECTIVE_PATIENCE = 4.0  #: times the patience for which a protective stop is left to work
_SPEED_DROP = 0.05  # rad/s; a drop by this much, or by a tenth, is a slowdown and not noise of the measurement
_MAX_STALL_DROP = 0.01  # rad/s; a slowdown by less in a path's patience has ended: a program has replaced the stop's
_SPEED_RISE = 0.1  # rad/s above the lowest speed since the slowdown: something new moves the arm


@dataclass(frozen=True, slots=True)
class _Course:
    """Course of one stop, by measured joint speed."""

    arrived: float  # when the newest sample was read [s]
    newest: float  # when it was measured [s]
    top: float | None  # highest speed until it slowed down [rad/s]; None where none is known
    slowed_at: float | None = None  # when the measured speed first showed a slowdown
    lowest: float = math.inf  # speed since then
    mark: float = math.inf  # speed at which the slowdown was last seen to go on
    marked_at: float = -math.inf
    undone: bool = False  # something has undone a stop that had begun to work
    steady: int = 0  # samples in a row below the standstill speed
    standing_at: float | None = None  # when the arm was first seen standing


@dataclass(frozen=True, slots=True)
class _PathUse:
    """Use of the newest stop path."""

    path: StopPath | None
    until: float  # when the next path is used where nothing slows down [s]
    deadline: float  # ... slowdown or not
    rippled: bool = False  # the arm has become faster again meanwhile


class StopMonitor:
    """Monitor of one stop, which names the stop paths one after the other, again and again, until the arm stands.

    Args:
        now: when the stop was commanded [s].
        speed: largest joint speed then [rad/s]; None where it is not known.
        paths: those that there are, the first of which has been used.
        budget: time after which the arm should stand; beyond it a slowdown is no reason to wait, and the protective
            stop is next [s].

    Attributes:
        course: of the stop, as measured.
        use: of the newest path.
        used: the paths used so far, each once.
        rounds: how often all of them have been used.
    """

    def __init__(
        self, now: float, speed: float | None, paths: tuple[StopPath, ...], limits: MonitoringLimits, budget: float
    ) -> None:
        self._began, self._limits, self._budget = now, limits, budget
        self._alone = StopPath.DRIVER in paths  # no program but ours moves the arm
        self._paths = tuple(path for path in paths if path is not StopPath.DRIVER)  # its stop is not repeated
        self._left = list(paths[1:])
        seconds = budget - PROTECTIVE_PATIENCE * limits.escalate  # that the stop takes as commanded
        due = _MAX_STALL_DROP if not speed or seconds <= 0.0 else 0.25 * speed / seconds * limits.escalate
        self._stall_drop = min(_MAX_STALL_DROP, due)
        self.course = _Course(now, now, speed)
        path = paths[0] if paths else None
        self.use = _PathUse(path, now + self._patience(path), now + budget)
        self.used = list(paths[:1])
        self.rounds = 0

    def _patience(self, path: StopPath | None) -> float:
        """Return for how long a path is left to work where nothing slows down [s]."""
        return self._limits.escalate * (PROTECTIVE_PATIENCE if path is StopPath.PROTECTIVE else 1.0)

    def sample(self, time: float, speed: float, measured_at: float | None = None) -> None:
        """Take the speed of a fresh state (``state_age``).

        Args:
            time: host time at which it was read [s].
            speed: largest joint speed [rad/s].
            measured_at: host time at which it was measured [s]; by default when it was read. What was measured before
                the stop was commanded says nothing about it.
        """
        before, patience, standstill = self.course, self._limits.escalate, self._limits.standstill
        measured_at = time if measured_at is None else measured_at
        if measured_at < self._began:
            self.course = replace(before, arrived=time)
            return
        top, slowed_at, undone = before.top, before.slowed_at, before.undone
        lowest, mark, marked_at = before.lowest, before.mark, before.marked_at
        if top is None or (speed > top and slowed_at is None):
            top = speed  # it may still have been speeding up when the stop was commanded
        if slowed_at is None and (top - speed >= min(_SPEED_DROP, 0.1 * top) or speed < standstill):
            slowed_at, lowest, mark = time, speed, math.inf
        lowest = min(lowest, speed)
        if slowed_at is not None and speed > lowest + _SPEED_RISE:
            slowed_at, top, undone = None, speed, True
            use = self.use
            if not use.rippled:  # once for each path: an arm that shakes must not postpone the next one for ever
                until = max(use.until, measured_at + patience)
                self.use = _PathUse(use.path, until, measured_at + self._budget, rippled=True)
        elif slowed_at is not None and speed > _SPEED_RISE:
            if speed <= mark - self._stall_drop:
                mark, marked_at = speed, measured_at
            elif measured_at - marked_at > patience:  # it goes on at a steady speed instead of braking to the end
                slowed_at, top, undone = None, speed, True
        steady, standing_at = before.steady + 1 if speed < standstill else 0, before.standing_at
        if steady >= STANDSTILL_SAMPLES and standing_at is None:
            standing_at = time
        elif speed >= standstill:
            standing_at = None
        self.course = _Course(time, measured_at, top, slowed_at, lowest, mark, marked_at, undone, steady, standing_at)

    def forget(self, paths: frozenset[StopPath], now: float) -> None:
        """Drop paths that are lost; where one of them is in use, use the next at once, slowdown or not."""
        self._paths = tuple(path for path in self._paths if path not in paths)
        self._left = [path for path in self._left if path not in paths]
        if self.use.path in paths:
            self.use = replace(self.use, until=now)
            self.course = replace(self.course, newest=now, slowed_at=None)

    def next_paths(self, now: float) -> list[StopPath]:
        """Return the path to use now [s], if one is due: a list of one, or an empty one."""
        course, use, silence = self.course, self.use, self._limits.arm_silence
        if course.standing_at is not None:
            return []
        silent = now - course.arrived > silence
        seen = now if silent else max(course.newest, now - silence)  # a controller's clock may stand still
        late = seen >= use.deadline
        due = seen >= use.until and (course.slowed_at is None or late)
        # a program that has undone one stop will undo the next; a protective stop is what none replaces
        strongest = late or (due and course.undone and not self._alone)
        strongest = strongest and StopPath.PROTECTIVE in self._left and StopPath.PROTECTIVE not in self.used
        if not (strongest or due):
            return []
        if not self._left:
            self._left, self.rounds = list(self._paths), self.rounds + 1
        if not self._left:
            return []
        path, deadline = self._left.pop(self._left.index(StopPath.PROTECTIVE) if strongest else 0), use.deadline
        if path is StopPath.PROTECTIVE and path not in self.used:
            deadline = max(deadline, seen + self._budget)  # what it slows down may brake to the end
        self.use = _PathUse(path, now + self._patience(path), deadline)
        if path not in self.used:
            self.used.append(path)
        return [path]
