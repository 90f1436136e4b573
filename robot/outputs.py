"""What comes out of a guard: commands and events, and who takes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from .journal import GuardEvent

if TYPE_CHECKING:  # a guard without an arm loads none of them
    from .follower import FollowerProgram, Steer
    from .owner_messages import Clear, Halt, Speed, Stop
    from .slowing import Slider
    from .stop_watch import Use

__all__ = ["Command", "Output", "Outputs", "tell"]

Command: TypeAlias = "Stop | Speed | Halt | Clear | Use | FollowerProgram | Steer | Slider"
Output: TypeAlias = "Command | GuardEvent"


class Outputs(Protocol):
    """Takes what comes out, in order: a list, or something that sends a command as soon as it is there."""

    def append(self, output: Output, /) -> None:
        """Take one."""


def tell(out: Outputs, name: str, time: float, **details: Any) -> None:
    """Put an event out, of a host time [s]."""
    out.append(GuardEvent(name, time, details))
