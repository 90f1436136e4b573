"""What kind of controller is simulated, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

__all__ = ["START_Q", "Options", "Version"]

Version = tuple[int, int]

#: Joint positions at which the arm starts: clear of every singular position [rad].
START_Q = (0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0)


@dataclass(frozen=True, slots=True)
class Options:
    """What kind of controller, and what is wrong with it.

    Attributes:
        model: the arm.
        version: of PolyScope, major and minor.
        start_q: joint positions at the start [rad].
        quirks: "real": the program of ur_rtde runs as it is; "fixed": with the mistakes of docs/sim-ur.md mended.
        wrong_size: what to do with a data packet that is longer than its recipe; unknown of the real controller.
        start_delay: from a program's last byte to its first cycle [s].
        unlock_after: time that must pass before a protective stop can be unlocked [s].
        after_protective_stop: whether the program is paused (e-Series) or ended by one.
        program: URScript that the dashboard's ``play`` starts.
    """

    model: str = "ur10e"
    version: Version = (5, 25)
    start_q: Sequence[float] = START_Q
    quirks: Literal["real", "fixed"] = "real"
    wrong_size: Literal["truncate", "drop"] = "truncate"
    start_delay: float = 0.010
    unlock_after: float = 5.0
    after_protective_stop: Literal["pause", "stop"] = "pause"
    program: str = ""
