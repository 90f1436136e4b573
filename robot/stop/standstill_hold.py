"""Standstill hold: it stops an arm that has lost its guard, and stops it again whenever a program moves it."""

from __future__ import annotations

import time
from collections.abc import Callable

from coneskin.robot.driver.protocol import PayloadReader

from .backup_stop import BLIND_TIMEOUT, BackupStop
from .standstill import WATCH_DURATION, StandstillWatch

__all__ = ["StandstillHold"]

_REPEAT_PERIOD = 1.0  # s between two stops while no state comes


class StandstillHold:
    """Hold of one arm at standstill. A person who pushes or jogs the arm is left alone: no program runs then.

    Args:
        backup_stop: of the arm.
        standstill: joint speed below which the arm stands [rad/s].
        clock: monotonic seconds.

    Attributes:
        stands: True where the arm was seen standing for a whole watch after the newest stop, and ever since.
        failed: True where the newest stop was given up before the arm was seen standing, or where its state has been
            missing for so long since then that it would be given up.
    """

    def __init__(self, backup_stop: BackupStop, standstill: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._stop = backup_stop
        self._clock = clock
        self._watch = StandstillWatch(standstill)
        self._due: float | None = None  # None until the first stop
        self.stands = self.failed = False

    @property
    def reader(self) -> PayloadReader | None:
        """Connection that tells of new states; None while there is none."""
        return self._stop.reader

    def rest(self) -> None:
        """Take what has come and do nothing more: the arm is guarded."""
        self._stop.read()

    def begin(self, deceleration: float | None = None, over: Callable[[], bool] = lambda: False) -> None:
        """Stop the arm now; ``look`` then watches whether it stands. Arguments as of ``BackupStop.stop``."""
        self._watch.end()
        self.stands = False
        self.failed = not self._stop.stop(deceleration, over, self._watch.insists)
        self._due = self._clock() + _REPEAT_PERIOD
        if not self.failed:
            self._watch.begin(self._clock(), WATCH_DURATION)

    def look(self, over: Callable[[], bool] = lambda: False) -> bool:
        """Look at the arm, and stop it where it moves. To be called continuously.

        Returns:
            whether there is an outcome to report: ``stands`` has become true, or a stop has failed.
        """
        states = self._stop.read()
        moved = sum(self._watch.moved(state, True) for state in states) > 0  # every state has to be taken
        if self._due is not None and self._stop.states_missing():
            self.stands = False
            if self._clock() < self._due:
                return False
            self._stop.repeat()
            self._due = self._clock() + _REPEAT_PERIOD
            self.failed = self.failed or self._stop.states_missing(BLIND_TIMEOUT)
            return False
        if moved or not self._watch.under_way:
            self.begin(over=over)
            return self.failed
        self.failed = False
        if self.stands:
            return False
        self.stands = self._watch.confirmed
        if not self.stands:
            self._stop.insist()
        return self.stands
