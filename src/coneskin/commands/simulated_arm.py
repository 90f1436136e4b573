"""Simulated arm of a scene: a controller on this computer, where the scene expects the real one."""

from __future__ import annotations

import contextlib
import ipaddress
import math
import socket
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from coneskin.core.errors import ConeSkinError, RobotRefused

if TYPE_CHECKING:
    from coneskin.impact.simulation.live_plant import LivePlant
    from coneskin.robot.sim.process import SimulatedController
    from coneskin.scene.values.scene import Scene


@contextmanager
def simulated_arm(scene: Scene, bodies: bool = False) -> Iterator[socket.socket | None]:
    """Run a simulated controller of the scene's arm at its host; it starts where the scene's motion does.

    Args:
        bodies: let the arm meet the scene's bodies, if there are any, in the physics engine.

    Yields:
        the line with which the bodies press the virtual skin, for ``guard(pressed_by=...)``; None without bodies.

    Raises:
        RobotRefused: the scene has no arm, or its host is not an address of this computer.
        RobotConnectionError: it cannot be started; another one listens there, perhaps.
        MissingExtra: there are bodies to meet, and the physics engine is not installed.
    """
    if scene.arm is None:
        raise RobotRefused(f"{scene.name} has no [arm] to simulate: leave --simulated out")
    host = "127.0.0.1" if scene.arm.host == "localhost" else scene.arm.host
    if not _is_loopback(host):
        raise RobotRefused(
            f"--simulated starts a controller on this computer, but arm.host is {host}: leave --simulated out, or set "
            'host = "127.0.0.1"'
        )
    from coneskin.robot.sim.machine.states import START_Q
    from coneskin.robot.sim.process import SimulatedController

    start_q = scene.motion.waypoints[0] if scene.motion else START_Q
    with ExitStack() as stack:
        plant = None
        if bodies and scene.bodies:
            if scene.source is None or scene.source.kind != "virtual":
                raise RobotRefused(
                    f'{scene.name} has bodies, which press a virtual skin only: set kind = "virtual" in [source], or '
                    "leave the bodies out"
                )
            from coneskin.impact.simulation.live_plant import LivePlant

            plant = stack.enter_context(LivePlant(scene, start_q))
        line = None if plant is None else plant.controller
        controller = stack.enter_context(SimulatedController(scene.arm.model, host, start_q, plant=line))
        try:
            yield None if plant is None else plant.skin
        finally:
            if plant is not None:
                _tell(plant, controller)


def _tell(plant: LivePlant, controller: SimulatedController) -> None:
    """Say what the bodies had to bear, or why nobody knows."""
    with contextlib.suppress(ConeSkinError):
        if lost := controller.state()["plant_lost"]:
            print(f"coneskin: the simulated arm was lost: {lost}", file=sys.stderr)
            return
        outcome, began = plant.outcome()
        told = "the arm met no body"
        if not math.isnan(began):
            told = (
                f"the arm met a body at {outcome.approach:.2f} m/s: peak {outcome.peak:.0f} N, "
                f"{outcome.clamp:.0f} N after at most 0.5 s (simulated; no safety assessment)"
            )
        print(f"coneskin: {told}", file=sys.stderr)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name
        return False
