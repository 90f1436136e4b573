"""Liveness of the processes of a guard: how long each may be silent. docs/look-up/promises.md says who hears whom.

Every heartbeat has one period. A program sends none: the guard sees in what the system says of it whether it is
suspended, and the end of its channel tells that it is dead.
"""

from __future__ import annotations

from typing import Final

BEAT_PERIOD: Final = 0.03  #: s between two heartbeats, and between two looks at the program
GUARD_SILENCE: Final = 0.5  #: s without a heartbeat of the guard after which the arm is stopped; 0.1 s occur under load
UNGUARDED_TIME: Final = 1.0  #: s without one after which whoever else can stops the arm, and the program is told
HOLD_UP_LIMIT: Final = 0.5  #: s for which a process that waits for a processor may be silent: no longer than the guard
MAX_ESCALATE: Final = 0.5  #: s; the longest that a scene may let a stop path do nothing before the next one is used
SETPOINT_SILENCE: Final = 0.1  #: s without a ``SetJointVelocity``, sent every 4 ms while the guard itself moves the arm
