"""Keeps an arm standing that nobody guards: stops it, and stops it again when a program moves it."""

from __future__ import annotations

import time
from collections.abc import Callable

from .latch import Latch
from .state_reader import StateReader
from .stopper import Stopper

__all__ = ["Vigil"]

_AGAIN = 1.0  # s between two stops while no state comes


class Vigil:
    """See the module. A person who pushes or jogs the arm is left alone: no program plays then.

    Args:
        stopper: of the arm.
        standstill: joint speed below which the arm stands [rad/s].
        clock: monotonic seconds.

    Attributes:
        stands: whether the arm was seen standing after the newest stop, and states have shown it since.
    """

    def __init__(self, stopper: Stopper, standstill: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._stopper = stopper
        self._standstill = standstill
        self._clock = clock
        self._latch = Latch(standstill)
        self._due: float | None = None  # None until the first stop
        self.stands = False

    @property
    def reader(self) -> StateReader | None:
        """What tells of new states; None while there is none."""
        return self._stopper.reader

    def rest(self) -> None:
        """The arm is guarded: only take what has come."""
        self._stopper.read()

    def begin(self, deceleration: float | None = None, over: Callable[[], bool] = lambda: False) -> bool:
        """Stop the arm now; whether it stands. Arguments as of ``Stopper.stop``."""
        self.stands = self._stopper.stop(deceleration, over)
        self._latch = Latch(self._standstill)
        self._due = self._clock() + _AGAIN
        return self.stands

    def look(self, over: Callable[[], bool] = lambda: False) -> bool:
        """Look at the arm, and stop it where it has to be; whether it had to be. Call it all the time."""
        states = self._stopper.read()
        moved = sum(self._latch.moved(state, True) for state in states) > 0  # it takes every one
        if self._due is not None and self._stopper.blind():
            self.stands = False
            if self._clock() < self._due:
                return False
            self._stopper.repeat()
            self._due = self._clock() + _AGAIN
            return False
        if self.stands and not moved:
            return False
        self.begin(over=over)
        return True
