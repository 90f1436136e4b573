"""What must be true of an arm before it is put under guard. Pure."""

from __future__ import annotations

from .state_reader import ControllerState
from .ur_models import ArmModel

__all__ = ["arm_faults"]


def arm_faults(model: ArmModel, state: ControllerState) -> list[str]:
    """Why an arm in this state must not be armed, one line each; empty where it may.

    Whether a program plays does not matter: a guard may be there before the program is.
    """
    wrong = []
    if state.stopped_by_safety:
        wrong.append("the controller's own safety system holds the arm: see its screen")
    if not state.running:
        wrong.append("the arm is not powered, or its brakes are not released")
    for number, (q, low, high) in enumerate(zip(state.q, model.joint_lower, model.joint_upper, strict=True), 1):
        if not low <= q <= high:
            wrong.append(f"joint {number} must be within {low:.3f} to {high:.3f} rad, it is at {q:.3f} rad")
    return wrong
