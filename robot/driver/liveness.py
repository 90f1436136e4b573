"""Liveness of the processes of a guard, in one table: who is heard by whom, how long a silence may last, what follows.

Every heartbeat has one period. A program sends none: the guard sees in what the system says of it whether it is
suspended, and the end of its channel tells that it is dead.
"""

from __future__ import annotations

from typing import Final, NamedTuple

BEAT_PERIOD: Final = 0.03  #: s between two heartbeats, and between two looks at the program
GUARD_SILENCE: Final = 0.5  #: s without a heartbeat of the guard after which the arm is stopped; 0.1 s occur under load
UNGUARDED_TIME: Final = 1.0  #: s without one after which whoever else can stops the arm, and the program is told
HOLD_UP_LIMIT: Final = 0.5  #: s for which a process that waits for a processor may be silent: no longer than the guard
SETPOINT_SILENCE: Final = 0.1  #: s without a ``SetJointVelocity``, sent every 4 ms while the guard itself moves the arm


class _Liveness(NamedTuple):
    """One row: a process that may die or fall silent.

    Attributes:
        who: may fall silent.
        heard_by: who notices.
        sign: of life.
        limit: of the silence [s], or the key of the scene that sets it.
        follows: what the one who notices does.
    """

    who: str
    heard_by: str
    sign: str
    limit: float | str
    follows: str


LIVENESS: Final = (
    _Liveness("your program", "guard", "it is not suspended", "program_silence_ms", "stops the arm, latches"),
    _Liveness(
        "driver process, watchdogs",
        "guard",
        "heartbeat",
        "4/3 program_silence_ms",
        "stops the arm by another path, latches",
    ),
    _Liveness("guard", "driver process, first watchdog", "heartbeat", GUARD_SILENCE, "stops the arm"),
    _Liveness("guard", "second watchdog", "heartbeat", UNGUARDED_TIME, "stops the arm, holds it"),
    _Liveness("guard", "your program", "its reports", UNGUARDED_TIME, "raises RobotConnectionError"),
    _Liveness("guard that moves the arm", "driver process", "setpoints", SETPOINT_SILENCE, "stops the arm"),
    _Liveness("driver process", "controller", "writes", "1 / watchdog_hz", "ends its program"),
)
