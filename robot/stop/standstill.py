"""Standstill of an arm that has been stopped: it tells when a program moves the arm again. Pure.

A program that starts anew within milliseconds is seen standing between two starts. So an arm that other programs may
move is called standing only at the end of a watch in which nothing has moved it, or once the controller's own safety
system holds it.
"""

from __future__ import annotations

from coneskin.robot.arm.model import Joints
from coneskin.robot.driver.values import ControllerState

from .stop_monitor import STANDSTILL_SAMPLES

#: s; programs that start anew after up to 0.3 s, and the time a controller needs to start and to move one
WATCH_DURATION = 0.7
_MAX_SPEED = 0.05  # rad/s; faster is a motion, and under a touch any speed is
_MAX_DRIFT = 0.02  # rad; farther is a motion, however slow
_MAX_TOUCHED_DRIFT = 0.002  # rad, summed over the joints: 2 mm at a metre's reach, while anything touches the skin
_POSITION_NOISE = 0.0005  # rad, summed over the joints; what measured positions may differ by while the arm stands
_MAX_STARTS = 3  # of programs during one watch, from which on a loop starts them that will move the arm sooner or later
_MAX_RESTARTS = 2  # motions of a stopped arm, from which on it is stopped by the strongest path; touched, one is enough


class _StandstillMonitor:
    """Monitor of one arm from its standstill on. A person who jogs or pushes the arm is left alone: no program runs.

    What programs have moved it is summed, so that one which is started anew again and again gets no farther.

    Args:
        standstill: joint speed below which the arm stands [rad/s].
        crept: what programs have moved the touched arm before this standstill, summed over the joints [rad].

    Attributes:
        crept: the same until now.
    """

    def __init__(self, standstill: float, crept: float = 0.0) -> None:
        self._standstill = standstill
        self._before = crept
        self.crept = crept
        self._q: Joints | None = None  # as measured last
        self._ran = False
        self._drift: list[float] = []  # by programs
        self._touched_drift: list[float] = []  # the part of it while touched
        self._moving = 0  # samples in a row

    def moved(self, state: ControllerState, touched: bool) -> bool:
        """Take a measured state and tell whether a program moves the arm.

        Args:
            state: as measured.
            touched: True while anything touches the skin.
        """
        last, ran = self._q, self._ran
        self._q, self._ran = state.q, state.program_running
        if not state.program_running:
            self._moving = 0
        if last is None or not (state.program_running or ran):  # a program's last step belongs to it
            return False
        self._moving = self._moving + 1 if state.speed > (self._standstill if touched else _MAX_SPEED) else 0
        if not self._drift:
            self._drift, self._touched_drift = [0.0] * len(last), [0.0] * len(last)
        for i, (now, before) in enumerate(zip(state.q, last, strict=True)):
            self._drift[i] += now - before
            if touched:
                self._touched_drift[i] += now - before
        here = sum(map(abs, self._touched_drift))
        self.crept = self._before + here
        return (
            self._moving >= STANDSTILL_SAMPLES
            or max(map(abs, self._drift)) > _MAX_DRIFT
            or here > max(_POSITION_NOISE, _MAX_TOUCHED_DRIFT - self._before)
        )


class StandstillWatch:
    """Watch over the standstill of one arm, from stop to stop until a person resets it.

    Args:
        standstill: joint speed below which the arm stands [rad/s].

    Attributes:
        confirmed: True once the arm may be called standing.
        restarts: how often a program has moved the stopped arm.
        why: what ended the newest watch.
    """

    def __init__(self, standstill: float) -> None:
        self._standstill = standstill
        self._monitor: _StandstillMonitor | None = None
        self._until = self._duration = 0.0
        self._ran = True
        self._crept = 0.0
        self.confirmed = False
        self.restarts = 0
        self.why = ""
        self._starts = 0

    @property
    def under_way(self) -> bool:
        """True from a measured standstill until something moves the arm, or may move it."""
        return self._monitor is not None

    @property
    def insists(self) -> bool:
        """True where the next stop has to be the strongest one: gentle ones do not keep the arm standing."""
        return self.restarts >= _MAX_RESTARTS

    def begin(self, now: float, duration: float) -> None:
        """Begin at a measured standstill [s]; after the duration [s] it is confirmed.

        A program that starts meanwhile has not moved the arm yet: the duration counts from its start then.
        """
        self._monitor = _StandstillMonitor(self._standstill, self._crept)
        self._until, self._duration, self.confirmed = now + duration, duration, duration <= 0.0
        self._starts = 0
        self._ran = True  # what runs now may be the program of the stop

    def end(self) -> None:
        """End it: the arm is stopped again, or is to move."""
        if self._monitor is not None:
            self._crept = self._monitor.crept
        self._monitor, self.confirmed = None, False

    def forget(self) -> None:
        """Forget what was: a person has let the arm move again."""
        self.end()
        self.restarts, self._crept = 0, 0.0

    def moved(self, state: ControllerState, touched: bool) -> bool:
        """Take a measured state and tell whether a program moves the arm, or is about to; then the watch is over.

        Args:
            state: as measured.
            touched: True while anything touches the skin.
        """
        if self._monitor is None:
            return False
        if self._monitor.moved(state, touched):
            self.restarts = max(self.restarts + 1, _MAX_RESTARTS) if touched else self.restarts + 1
            self.why = "something moved the arm"
            self.end()
            return True
        if state.program_running and not self._ran and not self.confirmed:
            self._until, self._starts = state.time + self._duration, self._starts + 1
            if self._starts >= _MAX_STARTS:
                self.restarts, self.why = max(self.restarts + 1, _MAX_RESTARTS), "a program started again and again"
                self.end()
                return True
        self._ran = state.program_running
        self.confirmed = self.confirmed or state.stopped_by_safety or state.time >= self._until
        return False
