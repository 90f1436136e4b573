"""Options of the simulated controller: its kind, and its deliberate deviations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

__all__ = ["DEFAULT_MODEL", "START_Q", "Options", "Version"]

Version = tuple[int, int]

#: arm that is simulated where none is named
DEFAULT_MODEL = "UR5e"
#: default joint positions at the start [rad]; clear of every singular position
START_Q = (0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0)


@dataclass(frozen=True, slots=True)
class Options:
    """Kind of a simulated controller, and its deliberate deviations.

    Attributes:
        model: name of the arm.
        version: of PolyScope, major and minor.
        start_q: joint positions at the start [rad].
        quirks: "real": the program of ur_rtde runs as it is; "fixed": with the corrections of docs/look-up/sim-ur.md.
        wrong_size: treatment of a data packet longer than its recipe; that of the real controller is not known.
        start_delay: from a program's last byte to its first cycle [s].
        unlock_after: time that must pass before a protective stop can be unlocked [s].
        after_protective_stop: effect of a protective stop on the program: paused (e-Series) or ended.
        program: URScript that the dashboard's ``play`` starts.
        programs: folder of the programs and installations that the dashboard can load.
        external_control: host and port from which a program takes the script of its External Control node.
        remote_control: whether the robot says that it is under remote control; it takes commands in any case.
        robot_api_port: on which the robot API of PolyScope X is served; 0 where it is not.
    """

    model: str = DEFAULT_MODEL
    version: Version = (5, 25)
    start_q: Sequence[float] = START_Q
    quirks: Literal["real", "fixed"] = "real"
    wrong_size: Literal["truncate", "drop"] = "truncate"
    start_delay: float = 0.010
    unlock_after: float = 5.0
    after_protective_stop: Literal["pause", "stop"] = "pause"
    program: str = ""
    programs: Path | None = None
    external_control: tuple[str, int] = ("127.0.0.1", 50002)
    remote_control: bool = True
    robot_api_port: int = 0
