"""Kinds of fault of the controller and of its connections, while the arm moves."""

from __future__ import annotations

from .kind import FaultKind, a_program, frozen_controller, killed_controller, says, then, touch
from .setup import ARM_SILENCE

CONTROLLER_KINDS = (
    # the controller
    FaultKind("controller frozen for 0.5 s", frozen_controller),
    FaultKind("controller killed", killed_controller, ARM_SILENCE, arm=False),
    FaultKind("RTDE closed", says("close rtde")),
    FaultKind(
        "RTDE silent", says("rtde silent"), ARM_SILENCE, after=lambda t: t.controller("rtde normal"), variant=True
    ),
    FaultKind("dashboard closed", says("close dashboard")),
    FaultKind("dashboard silent, then a touch", then(says("dashboard silent"), touch), touched=True),
    FaultKind("script ports closed", says("close scripts")),
    FaultKind("protective stop", says("protective stop")),
    FaultKind("emergency stop", says("emergency stop")),
    FaultKind("another program started, then a touch", then(a_program, touch), touched=True),
)
