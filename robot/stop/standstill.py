"""Standstill of an arm that has been stopped: it tells when a program moves the arm again. Pure.

A program that starts anew within milliseconds is seen standing between two starts. So an arm that other programs may
move is called standing only at the end of a watch in which nothing has moved it, or once the controller's own safety
system holds it.
"""

from __future__ import annotations

from dataclasses import dataclass

from coneskin.robot.arm.joints import Joints
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


@dataclass(frozen=True, slots=True)
class _Standstill:
    """One standstill, as far as it was measured."""

    until: float  # host time from which on it is confirmed [s]
    duration: float  # until then, from the newest start of a program on [s]
    confirmed: bool
    q: Joints = ()  # as measured last
    ran: bool = True  # a program, then; at first the program of the stop may
    starts: int = 0  # of programs
    moving: int = 0  # samples in a row in which one moves the arm
    drift: Joints = ()  # of each joint, by programs [rad]
    touched_drift: Joints = ()  # the part of it while touched

    @property
    def crept(self) -> float:
        """Drift while touched, summed over the joints [rad]."""
        return sum(map(abs, self.touched_drift))

    def after(self, state: ControllerState, touched: bool, standstill: float) -> _Standstill:
        """Return it with one more measured state. An arm stands below the speed ``standstill`` [rad/s]."""
        running, starts, until = state.program_running, self.starts, self.until
        moving, drift, touched_drift = self.moving if running else 0, self.drift, self.touched_drift
        if self.q and (running or self.ran):  # a program's last step belongs to it
            moving = moving + 1 if state.speed > (standstill if touched else _MAX_SPEED) else 0
            step = [now - before for now, before in zip(state.q, self.q, strict=True)]
            drift = tuple([a + b for a, b in zip(drift or (0.0,) * len(step), step, strict=True)])
            if touched:
                touched_drift = tuple([a + b for a, b in zip(touched_drift or (0.0,) * len(step), step, strict=True)])
        if running and not self.ran and not self.confirmed:  # it has not moved the arm yet
            starts, until = starts + 1, state.time + self.duration
        confirmed = self.confirmed or state.stopped_by_safety or state.time >= until
        return _Standstill(until, self.duration, confirmed, state.q, running, starts, moving, drift, touched_drift)


class StandstillWatch:
    """Watch over the standstill of one arm, from stop to stop until a person resets it.

    A person who jogs or pushes the arm is left alone: no program runs then. What programs have moved the touched arm
    is summed, so that one which is started anew again and again gets no farther.

    Args:
        standstill: joint speed below which the arm stands [rad/s].

    Attributes:
        restarts: how often a program has moved the stopped arm.
    """

    def __init__(self, standstill: float) -> None:
        self._standstill = standstill
        self._now: _Standstill | None = None
        self._crept = 0.0  # before this standstill, summed over the joints [rad]
        self.restarts = 0

    @property
    def under_way(self) -> bool:
        """True from a measured standstill until something moves the arm, or may move it."""
        return self._now is not None

    @property
    def confirmed(self) -> bool:
        """True once the arm may be called standing."""
        return self._now is not None and self._now.confirmed

    @property
    def insists(self) -> bool:
        """True where the next stop has to be the strongest one: gentle ones do not keep the arm standing."""
        return self.restarts >= _MAX_RESTARTS

    def begin(self, now: float, duration: float) -> None:
        """Begin at a measured standstill [s]; after the duration [s] it is confirmed."""
        self.end()
        self._now = _Standstill(now + duration, duration, duration <= 0.0)

    def end(self) -> None:
        """End it: the arm is stopped again, or is to move."""
        if self._now is not None:
            self._crept += self._now.crept
        self._now = None

    def forget(self) -> None:
        """Forget what was: a person has let the arm move again."""
        self.end()
        self.restarts, self._crept = 0, 0.0

    def moved(self, state: ControllerState, touched: bool) -> str:
        """Take a measured state and return what moves the arm, or is about to; then the watch is over. Else empty.

        ``touched`` while anything touches the skin.
        """
        if self._now is None:
            return ""
        now = self._now = self._now.after(state, touched, self._standstill)
        moves = (
            now.moving >= STANDSTILL_SAMPLES
            or any(abs(way) > _MAX_DRIFT for way in now.drift)
            or now.crept > max(_POSITION_NOISE, _MAX_TOUCHED_DRIFT - self._crept)
        )
        if not moves and now.starts < _MAX_STARTS:
            return ""
        strongest = touched or not moves
        self.restarts = max(self.restarts + 1, _MAX_RESTARTS) if strongest else self.restarts + 1
        self.end()
        return "something moved the arm" if moves else "a program started again and again"
