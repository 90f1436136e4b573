"""Reading of an arm for the program that it guards: what its controller measures and says, at one moment."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from coneskin.robot.arm.model import Joints

__all__ = ["DIGITAL_GROUPS", "ArmReading"]

#: group of digital inputs, or outputs -> its first bit in the words of an ``ArmReading``, and how many it has
DIGITAL_GROUPS: Mapping[str, tuple[int, int]] = MappingProxyType(
    {"standard": (0, 8), "configurable": (8, 8), "tool": (16, 2)}
)


class ArmReading(NamedTuple):
    """What the controller says of the arm at one moment.

    Attributes:
        controller_time: the controller's own clock [s].
        q: measured joint positions [rad].
        qd: measured joint speeds [rad/s].
        tcp_pose: measured pose of the tool (x, y, z [m], rotation vector [rad]).
        tcp_speed: measured velocity of the tool [m/s, rad/s].
        tcp_force: force and torque at the tool as the controller estimates them [N, Nm].
        mode: of the arm, as its maker calls it, such as "RUNNING".
        safety_mode: of the controller's own safety system, such as "NORMAL".
        speed_fraction: position of the speed slider, 0 to 1.
        program_running: a program runs on the controller.
        digital_inputs: one bit each, as ``DIGITAL_GROUPS`` says.
        digital_outputs: likewise.
        analog_inputs: two of the controller, then two of the tool, in the unit that each is set to [V or A].
        analog_outputs: two, likewise.
    """

    controller_time: float
    q: Joints
    qd: Joints
    tcp_pose: Joints
    tcp_speed: Joints
    tcp_force: Joints
    mode: str
    safety_mode: str
    speed_fraction: float
    program_running: bool
    digital_inputs: int
    digital_outputs: int
    analog_inputs: tuple[float, float, float, float]
    analog_outputs: tuple[float, float]

    @property
    def speed(self) -> float:
        """Largest joint speed [rad/s], without sign."""
        return max(map(abs, self.qd))

    def digital_input(self, number: int, group: str = "standard") -> bool:
        """Return whether a digital input of a group is high; numbers count from 0.

        Raises:
            ValueError: there is no such input.
        """
        return bool(self.digital_inputs >> _bit(group, number) & 1)

    def digital_output(self, number: int, group: str = "standard") -> bool:
        """Return whether a digital output of a group is high; numbers count from 0.

        Raises:
            ValueError: there is no such output.
        """
        return bool(self.digital_outputs >> _bit(group, number) & 1)


def _bit(group: str, number: int) -> int:
    first, count = DIGITAL_GROUPS.get(group, (0, 0))
    if not 0 <= number < count:
        raise ValueError(
            f"no {group} input or output has the number {number}; {dict(DIGITAL_GROUPS)}: first bit, count"
        )
    return first + number
