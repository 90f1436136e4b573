"""Monitor of the processes beside a guard: the program that guards, and driver process or guard watchdog. Pure.

Each is needed for a stop, or moves the arm. It is missed where it dies, where it falls silent (``liveness``), and where
the program that it runs on the controller ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from coneskin.robot.driver.liveness import BEAT_PERIOD, HOLD_UP_LIMIT
from coneskin.robot.driver.values import StopPath
from coneskin.robot.stop.limits import MonitoringLimits

if TYPE_CHECKING:
    from .arm_supervisor import ArmSupervisor


_USER_PROGRAM = "the program that guards"
#: what is wrong with a helper that is silent, and with a program
_SILENT_WORDS = (
    "no heartbeat for {:.0f} ms: it hangs, or is frozen",
    "it was suspended for {:.0f} ms, by Ctrl-Z, a signal or a debugger",
)
_HELD_UP_WORDS = (
    "no heartbeat for {:.0f} ms: this computer holds it up (%s). End what else runs, or see `coneskin doctor`"
)
_LOOK_TIME: Final = 3.0 * BEAT_PERIOD  # s for which it counts that a process was seen waiting
_RESTART_TIMEOUT: Final = 5.0  # s for the driver's program to run again after an announced end
#: channel of a helper -> what it is
HELPER_NAMES: Final[Mapping[str, str]] = {
    "driver": "the driver process",
    "watchdog": "the guard watchdog",
    "second": "the second guard watchdog",
}
#: process that can be lost -> the stop path that goes with it; the driver knows those of its connections
_LOST_WITH_PROCESS: Mapping[str, frozenset[StopPath]] = {
    "driver": frozenset({StopPath.DRIVER}),
    "watchdog": frozenset({StopPath.WATCHDOG}),
}


class _DriverProgram(NamedTuple):
    """Program of the driver process on the controller."""

    ran: bool = False
    end: float = math.inf  # by when it has to run again, after an announced end [s]
    restarted_at: float = -math.inf  # [s]


class CompanionMonitor:
    """Monitor of the processes beside one guard.

    Args:
        arm: the arm under guard, or None: then there are none to miss.
    """

    def __init__(self, limits: MonitoringLimits, arm: ArmSupervisor | None) -> None:
        self._arm = arm
        self._helper = "driver" if arm is not None and arm.internal_control else "watchdog"
        self._limits: dict[str, float] = {}  # longest silence of each process [s], by its name
        if arm is not None:
            helpers = ("driver",) if arm.internal_control else ("watchdog", "second")
            self._limits[_USER_PROGRAM] = limits.program_silence
            self._limits |= {HELPER_NAMES[name]: limits.process_silence for name in helpers}
        self._heard: dict[str, float] = {}
        self._held_up: dict[str, tuple[float, str]] = {}  # process -> when it was last seen waiting [s], and for what
        self._suspended = False  # the program, by the newest look
        self._silent: dict[str, str] = {}  # process -> what is wrong with it now
        self._heard_until = -math.inf  # before it none can be silent [s]
        self._program = _DriverProgram()

    @property
    def blockers(self) -> Iterable[str]:
        """What stood against an activation when the clocks were last looked at, one line each."""
        return self._silent.values()

    def hear_program(self, now: float, suspended: bool) -> None:
        """Take a look at the program that guards, at a host time [s]. Only a look shows that it is suspended."""
        self._suspended = suspended
        if not suspended:
            self._heard[_USER_PROGRAM] = now

    def hear_helper(self, now: float, second: bool = False) -> None:
        """Note a message of the driver process, or of a guard watchdog, the ``second`` or not, at a host time [s]."""
        process = HELPER_NAMES["second" if second else self._helper]
        self._heard[process] = now
        self._held_up.pop(process, None)

    def hold_up_helper(self, now: float, load: str, name: str) -> str:
        """Note that this computer does not let the driver process, or a guard watchdog, run at a host time [s].

        Args:
            load: how busy the computer is, in words.
            name: of the process, one of ``HELPER_NAMES``.

        Returns:
            a remark for people. Empty after the first since it was heard.
        """
        process = HELPER_NAMES.get(name, HELPER_NAMES[self._helper])
        new = process not in self._held_up
        self._held_up[process] = now, _HELD_UP_WORDS % load
        return f"{process} waits for a processor ({load}): it may do so for {HOLD_UP_LIMIT:g} s" if new else ""

    def doubt_driver(self, now: float) -> None:
        """Let the stop under way not count on the driver process, which has reported an error."""
        if self._arm is not None:
            self._arm.lose(_LOST_WITH_PROCESS["driver"], now, for_good=False)

    def lose(self, what: str, now: float) -> None:
        """Drop the stop paths that go with a process, or with a connection, that is gone."""
        arm = self._arm
        if arm is None:
            return
        if what in HELPER_NAMES:
            arm.backup_ready = arm.backup_ready and what == "second"
            self._limits.pop(HELPER_NAMES[what], None)  # it is known to be gone
        arm.lose(_LOST_WITH_PROCESS.get(what) or arm.driver.lost_with.get(what, frozenset()), now)

    def restart(self, now: float, over: bool) -> None:
        """Note that the driver process ends its program and starts it again, or has done so.

        Nothing moves while it does not run. A start that is not reported in time counts as an end. To announce
        it again gives it no more time.
        """
        _, end, restarted_at = self._program
        if over:
            self._program = _DriverProgram(restarted_at=now)
        else:
            self._program = _DriverProgram(True, min(end, now + _RESTART_TIMEOUT), restarted_at)

    def program_ended(self, now: float, measured_at: float, running: bool) -> str:
        """Take whether a program runs on the controller, and return what is wrong. Empty where nothing is.

        The end of the driver's program may be the only sign that the driver process hangs. A guard that was held up
        reads states from before a restart after the report that it is over: they show nothing.

        Args:
            now: host time [s].
            measured_at: host time at which it was measured [s].
        """
        ran, end, restarted_at = self._program
        if measured_at < restarted_at:
            return ""
        if self._arm is None or not self._arm.internal_control or not self._arm.phase.watched:
            ran, end = False, math.inf
        elif running and now >= end:  # it was refused, and the old one goes on
            ran, end = True, math.inf
        elif running or now < end < math.inf:
            ran = True
        elif ran:
            self._program = _DriverProgram(restarted_at=restarted_at)
            return "the driver's program has ended on the controller: its process may hang"
        if ran is not self._program.ran or end != self._program.end:
            self._program = _DriverProgram(ran, end, restarted_at)
        return ""

    def poll(self, now: float) -> list[tuple[str, frozenset[StopPath]]]:
        """Return each process that has fallen silent since the last look: why, and what a stop must not count on.

        The time is that on the ``_StallClock`` [s].
        """
        if now < self._heard_until:
            return []
        before, self._silent = self._silent, self._look(now)
        if not self._silent:
            return []
        helper = HELPER_NAMES[self._helper]
        return [
            (why, _LOST_WITH_PROCESS[self._helper] if process == helper else frozenset())
            for process, why in self._silent.items()
            if process not in before
        ]

    def _look(self, now: float) -> dict[str, str]:
        """Return what is wrong with each process that is silent. Empty where all are heard."""
        found, heard_until = {}, math.inf
        for process, limit in self._limits.items():
            heard = self._heard.get(process)
            if heard is None:
                found[process] = f"{process}: no sign of life yet"
                continue
            heard_until = min(heard_until, heard + limit - BEAT_PERIOD)
            if process == _USER_PROGRAM and not self._suspended:
                continue
            since, what = self._held_up.get(process, (-math.inf, ""))
            waits = now - since <= _LOOK_TIME
            allowed = max(limit, HOLD_UP_LIMIT) if waits else limit
            if now - heard > allowed:
                said = what if waits else _SILENT_WORDS[process == _USER_PROGRAM]
                found[process] = f"{process}: {said.format(1e3 * allowed)}"
        self._heard_until = -math.inf if found else heard_until
        return found
