"""Outputs of the arm's controller for a guarded program: none is set once the guard has stopped the arm."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from coneskin.robot.driver.protocol import OutputWriter

__all__ = ["ArmOutputs"]


class ArmOutputs:
    """Digital and analog outputs, and the registers for users.

    After a touch a gripper must not go on either: whatever is set here is refused until a person has reset the guard.

    Args:
        writer: to the controller, open.
        check: raises what has stopped the arm, if anything has.
    """

    def __init__(self, writer: OutputWriter, check: Callable[[bool], None]) -> None:
        self._writer = writer
        self._check = check

    def set_digital(self, number: int, on: bool, group: str = "standard") -> None:
        """Switch a digital output.

        Args:
            number: from 0.
            on: True for high.
            group: "standard", "configurable" or "tool".

        Raises:
            Collision: the skin was touched.
            RobotRefused: the guard has stopped the arm, or another client has taken the outputs.
            RobotConnectionError, RobotTimeout: the controller is gone.
            ValueError: there is no such output.
        """
        self._check(False)
        self._writer.set_digital(group, number, on)

    def set_analog(self, number: int, ratio: float, kind: str = "voltage") -> None:
        """Set an analog output, 0 or 1, to a ratio of its range, 0 to 1; all else as ``set_digital``.

        Args:
            number: 0 or 1.
            ratio: of its range, 0 to 1.
            kind: "voltage" or "current".
        """
        self._check(False)
        self._writer.set_analog(number, ratio, kind)

    def set_register(self, number: int, value: int | float) -> None:
        """Write an input register that programs on the controller read; all else as ``set_digital``.

        Args:
            number: 18 to 22 or 42 to 46.
            value: an int for the register of integers, a float for that of floats.
        """
        self._check(False)
        self._writer.set_register(number, value)

    def close(self) -> None:
        """Close the connection; may be called again."""
        self._writer.close()
