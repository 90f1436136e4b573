"""Where a guard is."""

from __future__ import annotations

from enum import Enum

__all__ = ["Phase"]


class Phase(Enum):
    """Where the guard is; the picture is in ``arm_reaction``."""

    STARTING = "starting"
    ARMED = "armed"
    SLOWED = "slowed"
    STOPPING = "stopping"
    RETREATING = "retreating"
    HALTING = "halting"
    LATCHED = "latched"

    @property
    def watched(self) -> bool:
        """Whether a fault has to stop the arm now."""
        return self in _WATCHED

    @property
    def stopping(self) -> bool:
        """Whether a stop is under way."""
        return self in _STOPPING


_WATCHED = frozenset({Phase.ARMED, Phase.SLOWED, Phase.RETREATING})
_STOPPING = frozenset({Phase.STOPPING, Phase.HALTING})
