"""Table of arm drivers: the family of an arm -> the module that drives it."""

from __future__ import annotations

from importlib import import_module

from coneskin.core.errors import RobotRefused

from .protocol import ArmDriver

#: family of an arm -> "module:object"; a new maker is one row
DRIVERS = {"ur": "coneskin.robot.ur.driver:UR_DRIVER"}


def load_driver(family: str) -> ArmDriver:
    """Import the driver of a family of arms.

    Raises:
        RobotRefused: no driver is known for the family, or its row names nothing that can be imported.
    """
    try:
        module, _, name = DRIVERS[family].partition(":")
    except KeyError:
        raise RobotRefused(f"no driver for the arm family {family!r}; known: {', '.join(DRIVERS)}") from None
    try:
        driver: ArmDriver = getattr(import_module(module), name)
    except (ImportError, AttributeError, ValueError) as exc:
        raise RobotRefused(
            f"the driver {DRIVERS[family]!r} of the arm family {family!r} cannot be loaded: {exc}; write "
            '"module:object" in coneskin.robot.driver.registry'
        ) from exc
    return driver
