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
        return self in _WATCHED_PHASES

    @property
    def stopping(self) -> bool:
        """True while a stop is under way."""
        return self in _STOPPING_PHASES


_WATCHED_PHASES = frozenset({Phase.ACTIVE, Phase.SLOWED, Phase.RETREATING})
_STOPPING_PHASES = frozenset({Phase.STOPPING, Phase.HALTING})
