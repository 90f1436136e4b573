"""``coneskin heartbeat``: the lines with which an external program depends on its guard, network or not.

example:
  coneskin heartbeat scene.toml          put what it prints at the beginning of the program on the controller

The lines are URScript. In PolyScope they go into a script node before the first move; how a program with ur_rtde gets
them: docs/do/guard-external.md. The scene's arm.controller_heartbeat = "required" stops a program without them.
Exit code: 0; 1 the scene has mistakes, or control = internal.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from coneskin.core.errors import RobotRefused


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="scene file, TOML, with control = external")


def run(args: argparse.Namespace) -> int:
    """Print the lines for the scene's arm."""
    from coneskin.robot.arm.models import arm_model
    from coneskin.robot.driver.protocol import HeartbeatDriver, load_driver, require
    from coneskin.scene.reader import load_scene

    scene = load_scene(args.scene)
    if scene.arm is None or scene.arm.control != "external":
        raise RobotRefused(
            f'{scene.name} must say control = "external" in [arm]: with internal control the driver\'s program has a '
            "watchdog already"
        )
    frequency = scene.arm.watchdog_hz
    driver = require(load_driver(arm_model(scene.arm.model).driver), HeartbeatDriver)
    print(driver.heartbeat_lines(frequency), end="")
    lifetime = f"{1000.0 / frequency:g} ms after the guard's last heartbeat (arm.watchdog_hz)"
    print(f"the program ends {lifetime}", file=sys.stderr)
    return 0
