"""States of the simulated controller and of its safety system, with the numbers of RTDE.

Source: Universal Robots, "RTDE Guide" (robot_mode, safety_mode, runtime_state and the two words of bits) and the
dashboard server's manual (names).
"""

from __future__ import annotations

from enum import IntEnum

__all__ = ["MOVING", "RobotMode", "Runtime", "SafetyMode", "robot_bits", "safety_bits"]


class Runtime(IntEnum):
    """State of the program: RTDE's runtime_state."""

    STOPPING = 0
    STOPPED = 1
    PLAYING = 2
    PAUSING = 3
    PAUSED = 4
    RESUMING = 5

    @property
    def paused(self) -> bool:
        """True for a program that is held, or that is being held while the arm brakes."""
        return self in (Runtime.PAUSING, Runtime.PAUSED)

    @property
    def word(self) -> str:
        """State as PolyScope says it: STOPPED, PLAYING or PAUSED."""
        return "PLAYING" if self is Runtime.PLAYING else "PAUSED" if self.paused else "STOPPED"


class RobotMode(IntEnum):
    """State of the arm: RTDE's robot_mode."""

    POWER_OFF = 3
    POWER_ON = 4
    IDLE = 5
    RUNNING = 7


class SafetyMode(IntEnum):
    """State of the safety system: RTDE's safety_mode."""

    NORMAL = 1
    REDUCED = 2
    PROTECTIVE_STOP = 3
    RECOVERY = 4
    SAFEGUARD_STOP = 5
    SYSTEM_EMERGENCY_STOP = 6
    ROBOT_EMERGENCY_STOP = 7
    VIOLATION = 8
    FAULT = 9


#: state -> word of RTDE's safety_status_bits
_SAFETY_BITS = {
    SafetyMode.NORMAL: 1 << 0,
    SafetyMode.REDUCED: 1 << 1,
    SafetyMode.PROTECTIVE_STOP: 1 << 2 | 1 << 10,
    SafetyMode.RECOVERY: 1 << 3,
    SafetyMode.SAFEGUARD_STOP: 1 << 4 | 1 << 10,
    SafetyMode.SYSTEM_EMERGENCY_STOP: 1 << 5 | 1 << 7 | 1 << 10,
    SafetyMode.ROBOT_EMERGENCY_STOP: 1 << 6 | 1 << 7 | 1 << 10,
    SafetyMode.VIOLATION: 1 << 8 | 1 << 10,
    SafetyMode.FAULT: 1 << 9 | 1 << 10,
}


#: states in which the arm may move and programs run
MOVING = frozenset((SafetyMode.NORMAL, SafetyMode.REDUCED))


def safety_bits(mode: SafetyMode) -> int:
    """Return RTDE's safety_status_bits."""
    return _SAFETY_BITS[mode]


def robot_bits(mode: RobotMode, program: bool) -> int:
    """Return RTDE's robot_status_bits: 0 power on, 1 program running, 2 teach button, 3 power button."""
    return int(mode is not RobotMode.POWER_OFF) | int(program) << 1
