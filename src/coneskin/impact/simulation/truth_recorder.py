"""Recorder of what only physics knows of a run: the force of the contacts, and where the bodies are. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.core.recording.block import Block
from coneskin.geometry.pose import Vector
from coneskin.robot.guard.signals.journal import force_block

__all__ = ["TruthRecorder"]

_AGAIN = 10.0  # s after which what was told is told again, for who looks on from later
_MOVED = 1e-4  # m by which a body that nothing touches must have moved


class TruthRecorder:
    """Recorder that makes a block of what has changed, at a bounded rate.

    Args:
        period: least time from one block to the next while a force only changes [s].
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._time = -math.inf
        self._force = 0.0
        self._places: tuple[Vector, ...] = ()

    def take(self, time: float, force: float, places: Sequence[Vector]) -> Block | None:
        """Return the block of an instant; None where it tells nothing new, or comes too soon.

        The first force, and its end, are told whenever they come.

        Args:
            time: host clock [s].
            force: sum of all contacts [N].
            places: of the bodies' parts, in the base frame [m].
        """
        turned = (force > 0.0) != (self._force > 0.0)
        if not turned and time - self._time < self._period:
            return None
        moved = max(map(math.dist, places, self._places), default=0.0) if self._places else 0.0
        if force == self._force and moved < _MOVED and not -math.inf < self._time <= time - _AGAIN:
            if not self._places:
                self._places = tuple(places)
            return None
        self._time, self._force, self._places = time, force, tuple(places)
        return force_block(time, force, places)
