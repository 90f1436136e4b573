"""Monitor of one stop: it judges the stop by measured joint speed and names the next stop path while it fails. Pure.

A host that is held up reads states late, all at once. So time is what the samples themselves say (``arm_supervisor``):
a stop path counts as ineffective when samples measured so long after it show no slowdown, and not because none was
read. Only where no sample arrives at all does the host's clock count.
"""

from __future__ import annotations

import math

from coneskin.robot.driver.values import StopPath

STANDSTILL_SAMPLES = 5  #: samples in a row below the standstill speed that count as standing
PROTECTIVE_PATIENCE = 4.0  #: times the patience for which a protective stop is left to work
_SPEED_DROP = 0.05  # rad/s; a drop by this much, or by a tenth, is a slowdown and not noise of the measurement
_MAX_STALL_DROP = 0.01  # rad/s; a slowdown by less in a path's patience has ended: a program has replaced the stop's
_SPEED_RISE = 0.1  # rad/s above the lowest speed since the slowdown: something new moves the arm


class StopMonitor:
    """Monitor of one stop, which names the stop paths one after the other, again and again, until the arm stands.

    Args:
        now: when the stop was commanded [s].
        speed: largest joint speed then [rad/s]; None where it is not known.
        paths: those that there are, the first of which has been used.
        patience: without slowdown for this long, the next path is used [s].
        budget: time after which the arm should stand; beyond it a slowdown is no reason to wait, and the protective
            stop is next [s].
        standstill: joint speed below which the arm stands [rad/s].
        silence: without any sample for this long, the host's clock counts [s].

    Attributes:
        slowed_at: when the measured speed first showed a slowdown, or None.
        standing_at: when the arm was first seen standing, or None.
        used: the paths used so far, each once.
        rounds: how often all of them have been used.
        rippled: True where the arm has become faster again since the newest path was used.
    """

    def __init__(
        self,
        now: float,
        speed: float | None,
        paths: tuple[StopPath, ...],
        patience: float,
        budget: float,
        standstill: float,
        silence: float = 0.0,
    ) -> None:
        self._top = speed
        self._paths = tuple(path for path in paths if path is not StopPath.DRIVER)  # its stop is not repeated
        self._alone = StopPath.DRIVER in paths  # no program but ours moves the arm
        self._undone = False  # something has undone a stop that had begun to work
        self._left = list(paths[1:])
        self._patience = patience
        self._standstill = standstill
        self._silence = silence
        self._began = self._newest = self._arrived = now
        self._next = now + patience * (PROTECTIVE_PATIENCE if paths[:1] == (StopPath.PROTECTIVE,) else 1.0)
        self._budget = budget
        self._deadline = now + budget
        self._steady = 0
        self._lowest = math.inf  # speed since it slowed down
        seconds = budget - PROTECTIVE_PATIENCE * patience  # that the stop takes as commanded
        due = _MAX_STALL_DROP if not speed or seconds <= 0.0 else 0.25 * speed / seconds * patience
        self._stall_drop = min(_MAX_STALL_DROP, due)
        self._mark = math.inf  # speed at which the slowdown was last seen to go on
        self._marked_at = now
        self.used = list(paths[:1])
        self.rounds = 0
        self.rippled = False
        self._current = paths[0] if paths else None
        self.slowed_at: float | None = None
        self.standing_at: float | None = None

    def sample(self, time: float, speed: float, measured_at: float | None = None) -> None:
        """Take the speed of a fresh state (``state_age``).

        Args:
            time: host time at which it was read [s].
            speed: largest joint speed [rad/s].
            measured_at: host time at which it was measured [s]; by default when it was read. What was measured before
                the stop was commanded says nothing about it.
        """
        self._arrived = time
        measured_at = time if measured_at is None else measured_at
        if measured_at < self._began:
            return
        self._newest = measured_at
        if self._top is None or (speed > self._top and self.slowed_at is None):
            self._top = speed  # it may still have been speeding up when the stop was commanded
        slower = self._top - speed >= min(_SPEED_DROP, 0.1 * self._top)
        if self.slowed_at is None and (slower or speed < self._standstill):
            self.slowed_at, self._lowest, self._mark = time, speed, math.inf
        self._lowest = min(self._lowest, speed)
        if self.slowed_at is not None and speed > self._lowest + _SPEED_RISE:
            self.slowed_at, self._top, self._undone = None, speed, True
            if not self.rippled:  # once for each path: an arm that shakes must not postpone the next one for ever
                self.rippled = True
                self._next = max(self._next, measured_at + self._patience)
                self._deadline = measured_at + self._budget
        elif self.slowed_at is not None and speed > _SPEED_RISE:
            self._see_stall(measured_at, speed)
        self._steady = self._steady + 1 if speed < self._standstill else 0
        if self._steady >= STANDSTILL_SAMPLES and self.standing_at is None:
            self.standing_at = time
        elif speed >= self._standstill:
            self.standing_at = None

    def _see_stall(self, measured_at: float, speed: float) -> None:
        """Take the slowdown for over where the arm goes on at a steady speed instead of braking to the end."""
        if speed <= self._mark - self._stall_drop:
            self._mark, self._marked_at = speed, measured_at
        elif measured_at - self._marked_at > self._patience:
            self.slowed_at, self._top, self._undone = None, speed, True

    def expire_current_path(self, now: float) -> None:
        """Use the next path at the next look, slowdown or not: the current one is known to be broken."""
        self._next = self._newest = now
        self.slowed_at = None

    def forget(self, paths: frozenset[StopPath], now: float) -> None:
        """Drop paths that are lost; where one of them is in use, use the next at once."""
        self._paths = tuple(path for path in self._paths if path not in paths)
        self._left = [path for path in self._left if path not in paths]
        if self._current in paths:
            self.expire_current_path(now)

    def next_paths(self, now: float) -> list[StopPath]:
        """Return the path to use now [s], if one is due: a list of one, or an empty one."""
        if self.standing_at is not None:
            return []
        silent = now - self._arrived > self._silence
        seen = now if silent else max(self._newest, now - self._silence)  # a controller's clock may stand still
        late = seen >= self._deadline
        due = seen >= self._next and (self.slowed_at is None or late)
        # a program that has undone one stop will undo the next; a protective stop is what none replaces
        strongest = late or (due and self._undone and not self._alone)
        strongest = strongest and StopPath.PROTECTIVE in self._left and StopPath.PROTECTIVE not in self.used
        if not (strongest or due):
            return []
        if not self._left:
            self._left, self.rounds = list(self._paths), self.rounds + 1
        if not self._left:
            return []
        path = self._left.pop(self._left.index(StopPath.PROTECTIVE) if strongest else 0)
        self._next = now + self._patience * (PROTECTIVE_PATIENCE if path is StopPath.PROTECTIVE else 1.0)
        self._current, self.rippled = path, False
        if path is StopPath.PROTECTIVE and path not in self.used:
            self._deadline = max(self._deadline, seen + self._budget)  # what it slows down may brake to the end
        if path not in self.used:
            self.used.append(path)
        return [path]
