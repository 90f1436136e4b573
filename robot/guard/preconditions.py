"""Preconditions of an activation: what stands against it in skin and arm, one line each. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # a guard without an arm loads neither
    from coneskin.robot.arm.model import ArmModel
    from coneskin.robot.driver.state import ControllerState
    from coneskin.skin.detection.detector import Detector

    from .arm_supervisor import ArmSupervisor

__all__ = ["arm_blockers", "skin_blockers"]


def skin_blockers(detectors: Iterable[Detector], now: float, silence: float) -> list[str]:
    """Return why sensors cannot be guarded with, one line each; empty where they can.

    Args:
        detectors: of the sensors.
        now: host time [s].
        silence: how long a valid frame may be ago [s].
    """
    blockers = []
    for detector in detectors:
        name = detector.sensor.name
        if detector.age(now) > silence:
            blockers.append(f"{name}: no valid frame" + (f" ({detector.fault.value})" if detector.fault else ""))
        elif detector.touched:
            blockers.append(f"{name}: it is touched, or its layers are stuck together")
        elif not detector.ready:
            blockers.append(f"{name}: {detector.fault.value if detector.fault else 'settling'}")
    return blockers


def arm_blockers(arm: ArmSupervisor, now: float) -> list[str]:
    """Return why an arm must not be put under guard at a host time [s], one line each; empty where it may.

    Whether a program runs does not matter: a guard may be there before the program is.
    """
    blockers = []
    if not arm.backup_ready:
        process = "the arm's driver" if arm.internal_control else "the guard watchdog"
        blockers.append(f"{process} is not ready")
    if arm.needs.slider and not arm.speed_reduction.knows(now):
        blockers.append("the position of the controller's speed slider is not known")
    if arm.heartbeat is not None and (blocker := arm.heartbeat.blocker()):
        blockers.append(blocker)
    if arm.state is None or arm.state_age.silent(now):
        return [*blockers, "the controller is silent"]
    if trouble := arm.state_age.trouble(now):
        blockers.append(trouble)
    return blockers + _state_blockers(arm.model, arm.state)


def _state_blockers(model: ArmModel, state: ControllerState) -> list[str]:
    blockers = []
    if state.stopped_by_safety:
        blockers.append("the controller's own safety system holds the arm: see its screen")
    if not state.powered:
        blockers.append("the arm is not powered, or its brakes are not released")
    for number, (q, low, high) in enumerate(zip(state.q, model.joint_lower, model.joint_upper, strict=True), 1):
        if not low <= q <= high:
            blockers.append(f"joint {number} must be within {low:.3f} to {high:.3f} rad, it is at {q:.3f} rad")
    return blockers
