"""Setup of a trial of the fault campaign, the limits that all share, and the outcome."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from tests.support.scenes import ESCALATE, start_with

GOAL = start_with(140.0)
SPEED, ACCELERATION, DECELERATION = 1.0, 2.0, 10.0
SKIN_SILENCE = ARM_SILENCE = 0.25  # s; a pseudo-terminal on a busy machine can stall for 0.1 s
STUCK_FRAMES = 200  # frames
RETREAT = 'kind = "retreat"\ndistance_mm = 60\nbare_side = "fast"'
COMPLY = 'kind = "comply"\ndistance_mm = 100\nbare_side = "fast"'
SLOW = 'kind = "slow"\nslow_to = 0.5\ntime_budget_s = 30'
LONG_SLOW = f"{SLOW}\npress_mm = 30"  # an arm that goes on until the place of the touch is certain
MONITORING_TABLE = "skin_silence_ms = 250\narm_silence_ms = 250\nstuck_frames = 200\nprogram_silence_ms = 250"
SECOND_SKIN = """
[[link]]
name = "upper_arm"
[[link.sensor]]
id = 1
radius1_mm = 48
radius2_mm = 48
height_mm = 260
xyz_mm = [0, 0, 80]
"""
#: s; v / a and four times escalate_ms, which docs/safety.md promises once the fault is known
STOP_BUDGET = SPEED / DECELERATION + 4.0 * ESCALATE
CLOCK = time.monotonic


def give_precedence(task: int) -> None:
    """Let a process or a thread run before all but the guard, as hardware does; nothing where that is not allowed."""
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, task, -10)
        if os.getsid(task) == task:  # Linux may first divide its time among sessions: autogroup in sched(7)
            Path(f"/proc/{task}/autogroup").write_text("-10")


_WATCH = """
import select, sys, time
late, before, over = 0.0, time.monotonic(), False
while not over:
    over = bool(select.select([sys.stdin], [], [], 0.01)[0])
    now = time.monotonic()
    late, before = max(late, now - before - 0.01), now
print(late)
"""


class MachineWatch:
    """Process that only sleeps and sees for how long the machine does not let it run; used in a ``with``.

    A thread of the campaign would wait for the campaign's other threads as well.

    Attributes:
        late: the longest time, once it has ended [s].
    """

    late = 0.0

    def __enter__(self) -> MachineWatch:
        command = [sys.executable, "-I", "-S", "-c", _WATCH]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        return self

    def __exit__(self, *_: object) -> None:
        self.late = float(self._process.communicate()[0])


@dataclass(frozen=True)
class Setup:
    """Setup of a trial, where it is not the usual one.

    Attributes:
        reaction: lines of [reaction].
        sheets: model of the skin's sheets; a ladder is shorted out by a contact at each end.
        skins: sensors: on the forearm, and on the upper arm.
        arm: more lines of [arm].
        mover: what moves an externally controlled arm: "" for one program, "heartbeat", "in servoj" and so on
            (trial.MOTIONS) for one that ends where the guard is gone, "driver servoj" or "driver speedj" for
            bench/faults/external_control_peer.py, or arguments of bench/faults/restarter.py.
        manners: of the program, words of bench/faults/program.py.
        files: that lie in the program's current folder: name -> text.
    """

    reaction: str = RETREAT
    sheets: str = "ladder"
    skins: int = 1
    arm: str = ""
    mover: str = ""
    manners: tuple[str, ...] = ()
    files: tuple[tuple[str, str], ...] = ()


USUAL_SETUP = Setup()


@dataclass
class Outcome:
    """Outcome of a trial.

    Attributes:
        seconds: from the fault to the measured standstill; None where there was none to measure.
        failures: what must not be, one line each.
        why: reason that the guard reported.
        machine_late: the longest time for which the machine did not let a process run that only sleeps [s].
        skin_late: how late the machine had made the frames of the virtual skin before the fault [s].
        repeated: trials that were thrown away for that.
        discarded: what had failed in them.
        held_up: the longest time that the guard's loop was held up, as it reports itself [s].
        pushed_in: how far the surface went towards a contact beyond what a bare stop does, the worst [m].
    """

    seconds: float | None = None
    held_up: float = 0.0
    skin_late: float = 0.0
    machine_late: float = 0.0
    repeated: int = 0
    discarded: list[str] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    why: str = ""
    pushed_in: float | None = None
