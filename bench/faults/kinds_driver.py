"""Kinds of fault while Universal Robots' own external_control.urscript moves the arm, driven from another process.

They are there with --external-control SCRIPT. external_control_peer.py is the driver, on the other end of the
script's reverse interface. To the guard the motion is another's; it stops the arm.
"""

from __future__ import annotations

from collections.abc import Callable

from .kind import EXTERNAL, FEW, FaultKind, a_program, breaks, halt, kill, says, then, together, touch
from .setup import SKIN_SILENCE, Setup
from .trial import Trial

CHILD_SILENCE = 0.34  # s; without a sign of life of the driver process or of the guard watchdog
HEARTBEAT_TIMEOUT = 0.55  # s; without one of the guard
DRIVERS = ("servoj", "speedj")  # how the script moves the arm


def driven(name: str, inject: Callable[[Trial], float], notice: float = FEW, **more: object) -> list[FaultKind]:
    """Return the kinds of a fault in both ways in which the script moves the arm."""
    return [
        FaultKind(
            f"external_control, {how}: {name}",
            inject,
            notice,
            controls=EXTERNAL,
            setup=Setup(mover=f"driver {how}"),
            variant=how == "speedj",
            **more,  # type: ignore[arg-type]
        )
        for how in DRIVERS
    ]


DRIVER_KINDS = (
    *driven("touch", touch, touched=True),
    *driven("skin silent", breaks(stall_after=0), SKIN_SILENCE),
    *driven("guard killed", kill("guard")),
    *driven("guard frozen", halt("guard"), HEARTBEAT_TIMEOUT, after=Trial.thaw_all),
    *driven("watchdog killed", kill("watchdog")),
    *driven("watchdog frozen", halt("watchdog"), CHILD_SILENCE, after=Trial.thaw_all),
    *driven("guard and watchdog killed", together(kill("guard"), kill("watchdog"))),
    *driven("protective stop", says("protective stop")),
    *driven("another program started, then a touch", then(a_program, touch), touched=True),
    # the script waits 0.2 s for its driver, and stops by itself
    *driven("driver killed, then a touch", then(kill("mover"), touch), touched=True),
    *driven("driver frozen, then a touch", then(halt("mover"), touch), touched=True, after=Trial.thaw_all),
)
