"""State of the simulated controller as a person or a test asks for it."""

from __future__ import annotations

from typing import Any

from coneskin.robot.sim.urscript.values import values_of

from .controller import Controller

__all__ = ["describe"]


def describe(controller: Controller) -> dict[str, Any]:
    """Return the state: positions and speeds as they are measured [rad], [rad/s], and the words of its modes."""
    arm = controller.arm
    return {
        "cycle": controller.cycle,
        "q": list(arm.measured.q),
        "qd": list(arm.measured.qd),
        "turning": arm.turning,
        "plant_lost": controller.plant_lost,
        "tcp": list(values_of(arm.tcp_pose(arm.measured.q))),
        "program": controller.program.name if controller.program is not None else "",
        "runtime": controller.runtime.name,
        "robot_mode": controller.robot_mode.name,
        "safety": controller.safety.name,
        "slider": controller.slider,
        "resistance": list(controller.resistance),
        "digital_outputs": controller.digital_outputs,
    }
