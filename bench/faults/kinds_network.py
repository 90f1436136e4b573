"""Kinds of fault of the network: every packet is dropped while the arm lives, on all ports or on some."""

from __future__ import annotations

from .kind import EXTERNAL, INTERNAL, WATCHDOG, FaultKind, away, kill, pause, says, slow, then, touch
from .setup import ARM_SILENCE, Setup
from .trial import Trial

UPLOAD = 0.2  # s; the stop that goes through is not the first one
CUT = says("cut network")


def restore(t: Trial) -> None:
    """Let the network live again; nothing may move the arm then."""
    t.controller("restore network")


NETWORK_KINDS = (
    FaultKind("network cut", CUT, ARM_SILENCE + WATCHDOG, controls=INTERNAL, after=restore),
    FaultKind("network cut, then a touch", then(CUT, touch), WATCHDOG, controls=INTERNAL, touched=True, after=restore),
    FaultKind(
        "network cut for 0.1 s",
        then(CUT, pause(0.1), says("restore network")),
        WATCHDOG,
        controls=INTERNAL,
        tolerated=True,
    ),
    FaultKind("network cut and program killed", then(CUT, kill("program")), WATCHDOG, INTERNAL, answers=False),
    FaultKind(
        "network cut, controller's heartbeat",
        CUT,
        ARM_SILENCE + WATCHDOG,
        controls=EXTERNAL,
        setup=Setup(arm='controller_heartbeat = "required"', mover="heartbeat"),
        after=restore,
    ),
    FaultKind("RTDE cut", says("cut rtde"), ARM_SILENCE + UPLOAD),
    FaultKind("script ports cut, then a touch", then(says("cut scripts"), touch), UPLOAD, touched=True),
    FaultKind("dashboard cut, then a touch", then(says("cut dashboard"), touch), touched=True),
    FaultKind(
        "script ports and dashboard cut, then a touch",
        then(says("cut scripts"), says("cut dashboard"), touch),
        2.0 * UPLOAD,
        touched=True,
    ),
    FaultKind(
        "script ports and dashboard cut and guard killed",
        then(says("cut scripts"), says("cut dashboard"), kill("guard")),
        2.0 * UPLOAD,
    ),
    away("network cut", CUT, WATCHDOG, after=restore),
    slow("network cut", CUT, ARM_SILENCE + WATCHDOG, INTERNAL, after=restore),
)
