"""Values between a guard and the driver of an arm: state, reading, stop paths, setpoints, way points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from types import MappingProxyType
from typing import Any, NamedTuple, Self

from coneskin.robot.arm.joints import Joints


class ControllerState(NamedTuple):
    """One sample of the controller."""

    time: float  #: host time at which it was read [s]
    controller_time: float  #: the controller's own clock [s]
    q: Joints  #: measured joint positions [rad]
    qd: Joints  #: measured joint speeds [rad/s]
    powered: bool  #: the arm is powered and its brakes are released
    stopped_by_safety: bool  #: the controller's own safety system holds the arm: a protective stop or worse
    program_running: bool  #: a program runs on the controller
    current: Joints | None = None  #: measured motor currents [A]; None where the controller does not send them
    target_current: Joints | None = None  #: those that the controller expects of this motion [A]; None likewise

    @property
    def speed(self) -> float:
        """Largest joint speed [rad/s], without sign."""
        return max(map(abs, self.qd))


class StopPath(Enum):
    """One way to stop the arm. The driver of a controller implements it."""

    DRIVER = "driver"  #: the stop of the motion that is under way, through the driver process
    PROGRAM = "program"  #: a program that brakes, sent to the controller; it replaces the one that runs
    COMMAND = "command"  #: the stop command of the controller's operating interface
    SLIDER = "slider"  #: the controller's speed slider at 0, over a connection that lives; it stays there until a reset
    PROTECTIVE = "protective"  #: a protective stop; only a person can unlock it
    WATCHDOG = "watchdog"  #: the guard watchdog's stop, over connections of its own or new ones


class UseStopPath(NamedTuple):
    """Command to use a stop path."""

    path: StopPath  #: which; DRIVER is used by ``StopProgram`` and ``EndReaction``
    deceleration: float  #: of the leading joint, where the path can have one [rad/s2]


#: in the order in which they are used where coneskin moves the arm, and where another program does
INTERNAL_PATHS = (StopPath.DRIVER, StopPath.PROGRAM, StopPath.COMMAND, StopPath.SLIDER, StopPath.PROTECTIVE)
EXTERNAL_PATHS = (StopPath.PROGRAM, StopPath.COMMAND, StopPath.SLIDER, StopPath.PROTECTIVE, StopPath.WATCHDOG)


class JointVelocitySetpoint(NamedTuple):
    """Speeds for the setpoint program with this token."""

    token: int  #: of the motion; 0 belongs to none
    qd: Joints  #: joint speeds [rad/s]
    acceleration: float  #: of the leading joint [rad/s2]


class SetpointProgram(NamedTuple):
    """Command to start the program that follows setpoints, after the first of them was sent."""

    token: int  #: of the motion, above 0; the program ends where a setpoint carries another one
    deceleration: float  #: of the leading joint at the end [rad/s2]
    watchdog_hz: float  #: setpoints that come less often than this end the program


class SetSpeedSlider(NamedTuple):
    """Command to set the controller's speed slider, from 0 to 1."""

    fraction: float


class Waypoint(NamedTuple):
    """One way point, made by ``move_j``, ``move_j_ik``, ``move_l`` or ``move_p``.

    Attributes:
        kind: of the move to it: "j" in joint space, "l" straight, "p" straight with a constant speed of the tool.
        joints: True where the target is joint positions, False where it is a pose of the tool.
        target: joint positions [rad], or a pose (x, y, z [m], rotation vector [rad]).
        speed: of the leading joint [rad/s], or of the tool [m/s].
        acceleration: of the leading joint [rad/s2], or of the tool [m/s2].
        blend: how far from it the arm may turn off towards the next one [m]; 0 stops there, and so does the last.
    """

    kind: str
    joints: bool
    target: tuple[float, ...]
    speed: float
    acceleration: float
    blend: float = 0.0

    @classmethod
    def move_j(cls, q: Sequence[float], speed: float = 1.05, acceleration: float = 1.4, blend: float = 0.0) -> Self:
        """Return a way point at joint positions [rad], reached in joint space."""
        return cls("j", True, tuple(q), speed, acceleration, blend)

    @classmethod
    def move_j_ik(
        cls, pose: Sequence[float], speed: float = 1.05, acceleration: float = 1.4, blend: float = 0.0
    ) -> Self:
        """Return a way point at a pose, reached in joint space."""
        return cls("j", False, tuple(pose), speed, acceleration, blend)

    @classmethod
    def move_l(cls, pose: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, blend: float = 0.0) -> Self:
        """Return a way point at a pose, reached straight."""
        return cls("l", False, tuple(pose), speed, acceleration, blend)

    @classmethod
    def move_p(cls, pose: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, blend: float = 0.0) -> Self:
        """Return a way point at a pose, reached straight with a constant speed of the tool."""
        return cls("p", False, tuple(pose), speed, acceleration, blend)

    @classmethod
    def from_message(cls, message: Sequence[Any]) -> Self:
        """Return the way point that a list of its attributes describes.

        Raises:
            ValueError, TypeError: it describes none.
        """
        kind, joints, target, *numbers = message
        speed, acceleration, blend = map(float, numbers)
        if kind not in ("j", "l", "p") or len(target) != 6:
            raise ValueError(f"a way point has a kind j, l or p and a target of 6 numbers, got {message!r}")
        return cls(kind, bool(joints), tuple(map(float, target)), speed, acceleration, blend)


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
