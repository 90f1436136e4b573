"""Phases of a guard."""

from __future__ import annotations

from enum import Enum

__all__ = ["Phase"]


class Phase(Enum):
    """Phase of a guard. The transitions are drawn in ``arm_supervisor``."""

    STARTING = "starting"
    ACTIVE = "active"
    SLOWED = "slowed"
    STOPPING = "stopping"
    RETREATING = "retreating"
    HALTING = "halting"
    LATCHED = "latched"

    @property
    def watched(self) -> bool:
        """True where a fault has to stop the arm now."""
        return self is Phase.ACTIVE or self is Phase.SLOWED or self is Phase.RETREATING

    @property
    def stopping(self) -> bool:
        """True while a stop is under way."""
        return self is Phase.STOPPING or self is Phase.HALTING
