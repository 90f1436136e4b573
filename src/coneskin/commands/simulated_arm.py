"""Simulated arm of a scene: a controller on this computer, where the scene expects the real one."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from coneskin.errors import RobotRefused

if TYPE_CHECKING:
    from coneskin.scene.scene import Scene

__all__ = ["simulated_arm"]


@contextmanager
def simulated_arm(scene: Scene) -> Iterator[None]:
    """Run a simulated controller of the scene's arm at its host; it starts where the scene's motion does.

    Raises:
        RobotRefused: the scene has no arm, or its host is not an address of this computer.
        RobotConnectionError: it cannot be started; another one listens there, perhaps.
    """
    if scene.arm is None:
        raise RobotRefused(f"{scene.name} has no [arm] to simulate: leave --simulated out")
    host = "127.0.0.1" if scene.arm.host == "localhost" else scene.arm.host
    if not _is_loopback(host):
        raise RobotRefused(
            f"--simulated starts a controller on this computer, but arm.host is {host}: leave --simulated out, or set "
            'host = "127.0.0.1"'
        )
    from coneskin.robot.sim.process import SimulatedController

    start_q = scene.motion.waypoints[0] if scene.motion else None
    with SimulatedController(scene.arm.model, host, start_q):
        yield


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name
        return False
