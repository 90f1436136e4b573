"""Options, states and notices of the simulated controller, as values with the numbers of RTDE.

Source: Universal Robots, "RTDE Guide" (robot_mode, safety_mode, runtime_state and the two words of bits) and the
dashboard server's manual (names).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Literal

from coneskin.robot.ur.rtde_codec import RobotMode, SafetyMode


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


#: state that occurs here -> word of RTDE's safety_status_bits
SAFETY_BITS = {
    SafetyMode.NORMAL: 1 << 0,
    SafetyMode.REDUCED: 1 << 1,
    SafetyMode.PROTECTIVE_STOP: 1 << 2 | 1 << 10,
    SafetyMode.SAFEGUARD_STOP: 1 << 4 | 1 << 10,
    SafetyMode.ROBOT_EMERGENCY_STOP: 1 << 6 | 1 << 7 | 1 << 10,
    SafetyMode.FAULT: 1 << 9 | 1 << 10,
}


def joint_mode(mode: RobotMode) -> int:
    """Return RTDE's joint_mode, and its tool_mode, of an arm that runs, stands with its brakes on, or is off."""
    return {RobotMode.RUNNING: 253, RobotMode.IDLE: 255}.get(mode, 239)


#: states in which the arm may move and programs run
MOVING = frozenset((SafetyMode.NORMAL, SafetyMode.REDUCED))


Version = tuple[int, int]


def has_since(version: Version, polyscope_5: int | None, cb3: int | None) -> bool:
    """Return whether a version has what came with these minor ones of PolyScope 5 and of CB3; None for never."""
    first = cb3 if version[0] == 3 else polyscope_5
    return first is not None and (version[0] > 5 or version[1] >= first)


#: name of a service -> its TCP port on a UR controller; ur_rtde knows no others
PORTS = {"RTDE": 30004, "dashboard": 29999, "primary": 30001, "secondary": 30002, "realtime": 30003}
SCRIPT_PORTS = ("primary", "secondary", "realtime")  #: those that take URScript, and send the state
READ_ONLY = " (read-only)"  #: end of the name of a port beside each of these, which takes nothing
PORTS |= {"interpreter": 30020, **{name + READ_ONLY: PORTS[name] + 10 for name in SCRIPT_PORTS}}
FIRST_X = 10  #: major version of PolyScope X
#: arm that is simulated where none is named
DEFAULT_MODEL = "UR5e"
#: default joint positions at the start [rad]; clear of every singular position
START_Q = (0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0)


@dataclass(frozen=True, slots=True)
class Options:
    """Kind of a simulated controller, and its deliberate deviations."""

    model: str = DEFAULT_MODEL  #: name of the arm
    version: Version = (5, 25)  #: of PolyScope, major and minor
    start_q: Sequence[float] = START_Q  #: joint positions at the start [rad]
    start_delay: float = 0.010  #: from a program's last byte to its first cycle [s]
    unlock_after: float = 5.0  #: time that must pass before a protective stop can be unlocked [s]
    #: effect of a protective stop on the program: paused (e-Series) or ended
    after_protective_stop: Literal["pause", "stop"] = "pause"
    program: str = ""  #: URScript that the dashboard's ``play`` starts
    programs: Path | None = None  #: folder of the programs and installations that the dashboard can load
    #: host and port from which a program takes the script of its External Control node
    external_control: tuple[str, int] = ("127.0.0.1", 50002)
    #: whether the robot starts under remote control. In local control it takes no program, and no command that changes
    #: anything
    remote_control: bool = True
    #: whether it has these at all; without, as URSim, it takes all, and says "not in remote control"
    remote_enabled: bool = True
    #: services that are switched off, as all are on a robot that comes from the factory since 5.10
    closed: frozenset[str] = frozenset()
    fieldbus: bool = False  #: an EtherNet/IP or PROFINET adapter holds the lower half of the input registers
    watchdog_delay: float = 0.0  #: by which the watchdog on an input is late [s]
    #: of the leading joint where nothing commands one, as in a pause; an assumption [rad/s^2]
    deceleration: float = 10.0

    @property
    def steps(self) -> int:
        """Steps of the simulation, of 2 ms each, in a control cycle: CB3 has 125 Hz."""
        return 4 if self.version[0] == 3 else 1

    @property
    def services(self) -> dict[str, int]:
        """Services that are open -> their TCP ports. PolyScope X has no dashboard."""
        closed = self.closed | {"dashboard"} if self.version[0] >= FIRST_X else self.closed
        return {name: port for name, port in PORTS.items() if name.removesuffix(READ_ONLY) not in closed}


#: how grave an error is: report levels of the client interface
WARNING_REPORT, FAULT_REPORT = 2, 4


@dataclass(frozen=True, slots=True)
class TextNotice:
    """Text of a program's ``textmsg``."""

    text: str


@dataclass(frozen=True, slots=True)
class PopupNotice:
    """Window that a program's ``popup`` opens."""

    title: str
    text: str
    warning: bool = False
    error: bool = False


@dataclass(frozen=True, slots=True)
class ProgramNotice:
    """Event of a program: "STARTED", "STOPPED", "PAUSED" or "RESUMED"."""

    name: str
    event: str


@dataclass(frozen=True, slots=True)
class ProgramFailed:
    """Program that cannot be run, or that has failed, in a line and a column from 1; 0 where these are not known."""

    text: str
    line: int = 0
    column: int = 0


@dataclass(frozen=True, slots=True)
class SafetyNotice:
    """New state of the safety system."""

    mode: SafetyMode


@dataclass(frozen=True, slots=True)
class ErrorNotice:
    """Entry of the controller's log: C153A0 has the code 153 and the argument 0."""

    code: int
    argument: int
    text: str
    report: int = WARNING_REPORT


Notice = TextNotice | PopupNotice | ProgramNotice | ProgramFailed | SafetyNotice | ErrorNotice
