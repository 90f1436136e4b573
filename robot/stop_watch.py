"""Whether a stop works, judged by measured joint speed, and what to try next while it does not. Pure.

A host that is held up reads states late, all at once. So time is what the samples themselves say (``ControllerClock``):
a way to stop is called slow when samples measured so long after it show no slowdown, and not because nobody has looked.
Only where no sample arrives at all does the host's clock count.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

__all__ = ["FOREIGN", "OWNED", "PROTECTED", "STEADY", "StopWatch", "Use", "Way"]

STEADY = 5  #: samples in a row below the standstill speed that count as standing
_SLOWER = 0.05  # rad/s; a drop by this much, or by a tenth, is a slowdown and not noise of the measurement
_FASTER = 0.1  # rad/s; an arm that has slowed down and is this much faster again is moved by something new
PROTECTED = 4.0  #: of the patience: a protective stop is left to work for so long


class Way(Enum):
    """A way to stop the arm, in the order in which they are tried."""

    OWNER = "owner"  #: the stop of ur_rtde's mode, through the process that owns it
    SCRIPT = "script"  #: a program of one stopj, sent to the controller: it replaces whatever program runs
    DASHBOARD = "dashboard"  #: the dashboard's stop
    PROTECTIVE = "protective"  #: a program that triggers a protective stop; a person has to unlock it
    KEEPER = "keeper"  #: the keeper's stop, which opens new connections where the controller has closed the others


class Use(NamedTuple):
    """Take a way.

    Attributes:
        way: which; OWNER is taken by ``Stop`` and ``Halt``.
        deceleration: of the leading joint, where the way can have one [rad/s2].
    """

    way: Way
    deceleration: float


#: the ways that there are where ur_rtde is ours, and where another program moves the arm
OWNED = (Way.OWNER, Way.SCRIPT, Way.DASHBOARD, Way.PROTECTIVE)
FOREIGN = (Way.SCRIPT, Way.DASHBOARD, Way.PROTECTIVE, Way.KEEPER)


class StopWatch:
    """Follows one stop, and does not give up: the ways are named one after the other, again and again, until it stands.

    Args:
        now: when it was commanded [s].
        speed: largest joint speed then [rad/s]; None where it is not known.
        ways: those that there are, the first of which has been used.
        patience: without slowdown for this long, the next way is taken [s].
        budget: time after which the arm should stand; beyond it a slowdown is no reason to wait, and the protective
            stop is next [s].
        standstill: joint speed below which the arm stands [rad/s].
        silence: without any sample for this long, the host's clock counts [s].

    Attributes:
        slowed_at: when the measured speed first showed a slowdown, or None.
        standing_at: when the arm was first seen standing, or None.
        used: the ways used so far, each once.
        rounds: how often all of them have been used.
        rippled: whether the arm has become faster again since the newest way was taken.
    """

    def __init__(
        self,
        now: float,
        speed: float | None,
        ways: tuple[Way, ...],
        patience: float,
        budget: float,
        standstill: float,
        silence: float = 0.0,
    ) -> None:
        self._top = speed
        self._ways = tuple(way for way in ways if way is not Way.OWNER)  # whose stop is not repeated
        self._left = list(ways[1:])
        self._patience = patience
        self._standstill = standstill
        self._silence = silence
        self._began = self._newest = self._arrived = now
        self._last = -math.inf
        self._next = now + patience * (PROTECTED if ways[:1] == (Way.PROTECTIVE,) else 1.0)
        self._budget = budget
        self._deadline = now + budget
        self._steady = 0
        self._lowest = math.inf  # speed since it slowed down
        self.used = list(ways[:1])
        self.rounds = 0
        self.rippled = False
        self._current = ways[0] if ways else None
        self.slowed_at: float | None = None
        self.standing_at: float | None = None

    def sample(self, time: float, speed: float, measured_at: float | None = None) -> None:
        """Take a measured speed.

        Args:
            time: host time at which it was read [s].
            speed: largest joint speed [rad/s].
            measured_at: host time at which it was measured [s]; by default when it was read. What was measured before
                the stop was commanded says nothing about it.
        """
        self._arrived = time
        measured_at = time if measured_at is None else measured_at
        if measured_at < self._began or measured_at <= self._last:  # a state that repeats itself is no new one
            return
        self._newest = self._last = measured_at
        if self._top is None or (speed > self._top and self.slowed_at is None):
            self._top = speed  # it may still have been speeding up when the stop was commanded
        slower = self._top - speed >= min(_SLOWER, 0.1 * self._top)
        if self.slowed_at is None and (slower or speed < self._standstill):
            self.slowed_at, self._lowest = time, speed
        self._lowest = min(self._lowest, speed)
        if self.slowed_at is not None and speed > self._lowest + _FASTER:
            self.slowed_at, self._top = None, speed
            if not self.rippled:  # once for each way, or an arm that shakes would put the next one off for ever
                self.rippled = True
                self._next = max(self._next, measured_at + self._patience)
                self._deadline = measured_at + self._budget
        self._steady = self._steady + 1 if speed < self._standstill else 0
        if self._steady >= STEADY and self.standing_at is None:
            self.standing_at = time
        elif speed >= self._standstill:
            self.standing_at = None

    def hurry(self, now: float) -> None:
        """Take the next way at the next look, slowdown or not: the one in use is known to be broken."""
        self._next = self._newest = now
        self.slowed_at = None

    def forget(self, ways: frozenset[Way], now: float) -> None:
        """These ways are gone; where one of them is in use, take the next at once."""
        self._ways = tuple(way for way in self._ways if way not in ways)
        self._left = [way for way in self._left if way not in ways]
        if self._current in ways:
            self.hurry(now)

    def next_ways(self, now: float) -> list[Way]:
        """The way to take now [s], if it is time for one."""
        if self.standing_at is not None:
            return []
        silent = now - self._arrived > self._silence
        seen = now if silent else max(self._newest, now - self._silence)  # a controller's clock may stand still
        late = seen >= self._deadline
        strongest = late and Way.PROTECTIVE in self._left and Way.PROTECTIVE not in self.used
        if not strongest and (seen < self._next or (self.slowed_at is not None and not late)):
            return []
        if not self._left:
            self._left, self.rounds = list(self._ways), self.rounds + 1
        if not self._left:
            return []
        way = self._left.pop(self._left.index(Way.PROTECTIVE) if strongest else 0)
        self._next = now + self._patience * (PROTECTED if way is Way.PROTECTIVE else 1.0)
        self._current, self.rippled = way, False
        if way not in self.used:
            self.used.append(way)
        return [way]
