"""An arm that stands latched: whether a program moves it again. Pure."""

from __future__ import annotations

from .state_reader import ControllerState
from .stop_watch import STEADY
from .ur_models import Joints

__all__ = ["Latch"]

_MOVES = 0.05  # rad/s; a latched arm that a program moves faster is moved, and under a touch at any speed
_DRIFT = 0.02  # rad; the same, however slowly it came there


class Latch:
    """Watches one arm from its standstill on. A person who jogs it, or pushes it, is left alone: no program plays.

    Args:
        standstill: joint speed below which the arm stands [rad/s].
    """

    def __init__(self, standstill: float) -> None:
        self._standstill = standstill
        self._q: Joints | None = None  # where it stands
        self._moving = 0

    def moved(self, state: ControllerState, touched: bool) -> bool:
        """Take a measured state; whether a program moves the arm.

        Args:
            state: as measured.
            touched: whether anything touches the skin.
        """
        if self._q is None or not state.playing:
            self._q, self._moving = state.q, 0
            return False
        self._moving = self._moving + 1 if state.speed > (self._standstill if touched else _MOVES) else 0
        drift = max(abs(a - b) for a, b in zip(state.q, self._q, strict=True))
        return self._moving >= STEADY or drift > _DRIFT
