"""Stop of one arm: one stop path after the other, standstill, and the watch after it. Pure.

The guard stops its arm by this, and so does a guard watchdog, beside its own connections.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from coneskin.robot.arm.model import Joints
from coneskin.robot.driver.messages import EndReaction, StopProgram
from coneskin.robot.driver.protocol import StopSink
from coneskin.robot.driver.values import ControllerState, StopPath, UseStopPath

from .limits import MonitoringLimits
from .standstill import WATCH_DURATION, StandstillWatch
from .stop_monitor import PROTECTIVE_PATIENCE, StopMonitor


class ArmStop:
    """Newest stop of one arm, from its cause to the standing arm.

    The first path is used for every stop, the others where it does not work.

    Args:
        paths: the stop paths that there are, in the order of their use.
        held_braking: returns the deceleration that the motors hold at joint positions and speeds [rad/s2]. None where
            what the arm weighs is not known: then it is taken to brake as commanded.

    Attributes:
        paths: those that are left.
        watch: of the arm that stands.
    """

    def __init__(
        self,
        limits: MonitoringLimits,
        paths: tuple[StopPath, ...],
        held_braking: Callable[[Joints, Joints], float] | None = None,
    ) -> None:
        self._held_braking = held_braking
        self.paths = paths
        self.watch = StandstillWatch(limits.standstill)
        self._limits = limits
        self._first = paths[0]
        self._others_move = StopPath.DRIVER not in paths
        self._sent: tuple[tuple[StopPath, ...], float] = (), 0.0  # paths of the newest stop in order, deceleration
        self._monitor: StopMonitor | None = None  # of it
        self._protective_at = 0.0  # when it was last used

    def send(self, command: StopProgram | EndReaction, out: StopSink) -> None:
        """Send a stop by its first path. Another path than the driver process has the command's deceleration."""
        paths = self.paths
        if self.watch.insists and StopPath.PROTECTIVE in paths:
            paths = (StopPath.PROTECTIVE, *(path for path in paths if path is not StopPath.PROTECTIVE))
        for first in paths[:1]:
            out.append(command if first is StopPath.DRIVER else UseStopPath(first, command.deceleration))
        self._sent, self._monitor = (paths, command.deceleration), None

    @property
    def used(self) -> tuple[StopPath, ...]:
        """Paths of the newest stop."""
        return self._sent[0][:1] if self._monitor is None else tuple(self._monitor.used)

    @property
    def first_was_enough(self) -> bool:
        """True where the newest stop, whose arm stands, took no other path than the first."""
        return self._monitor is not None and self._monitor.used == [self._first]

    def held(self, state: ControllerState | None) -> float:
        """Return the deceleration that the motors hold, as far as that is known [rad/s2]; it takes a millisecond."""
        return math.inf if state is None or self._held_braking is None else self._held_braking(state.q, state.qd)

    def begin(self, now: float, state: ControllerState | None) -> None:
        """Begin to monitor the stop that was sent, at a host time [s] and in a state; None where that is not known."""
        order, deceleration = self._sent
        if order[:1] == (StopPath.PROTECTIVE,):
            self._protective_at = now
        speed = None if state is None else state.speed
        budget = self._limits.stop_budget(speed or 0.0, min(deceleration, self.held(state)))
        self._monitor = StopMonitor(now, speed, order, self._limits, budget)
        self.watch.end()

    def lose(self, paths: frozenset[StopPath], now: float, for_good: bool) -> None:
        """Drop stop paths that are lost, or that this stop must not count on, and use the next one at once."""
        self.paths = tuple(path for path in self.paths if path not in paths or not for_good)
        if self._monitor is not None:
            self._monitor.forget(paths, now)

    def escalate(self, now: float, out: StopSink) -> tuple[StopPath | None, int]:
        """Use the next path where one is due at a host time [s].

        Returns:
            the path, where this stop has used it for the first time. How often all of them have been used, where that
            has become 1, 2, 4 and so on, else 0.
        """
        stop, first = self._monitor, None
        if stop is None:
            return None, 0
        rounds, used = stop.rounds, len(stop.used)
        for path in stop.next_paths(now):
            out.append(UseStopPath(path, self._sent[1]))
            if path is StopPath.PROTECTIVE:
                self._protective_at = now
            if len(stop.used) > used:
                first = path
        return first, stop.rounds if stop.rounds > rounds and (stop.rounds & rounds) == 0 else 0

    def update(self, state: ControllerState, measured_at: float) -> tuple[bool, bool]:
        """Take a fresh state, measured at a host time [s].

        Returns:
            whether it is the first that shows a slowdown, and whether the arm stands, which begins the watch.
        """
        stop = self._monitor
        if stop is None or stop.course.standing_at is not None:
            return False, False
        before = stop.course
        stop.sample(state.time, state.speed, measured_at)
        after = stop.course  # of another name: a compiler takes the old one to be as it was
        slows = before.slowed_at is None and after.slowed_at is not None and not stop.use.rippled
        if after.standing_at is None:
            return slows, False
        self.watch.begin(state.time, math.inf)
        return slows, True

    def insist(self, state: ControllerState, out: StopSink) -> None:
        """Repeat a protective stop that the controller's safety system does not show, though the arm stands."""
        if not self.unconfirmed(state) or StopPath.PROTECTIVE not in self.paths:
            return
        if state.time - self._protective_at >= PROTECTIVE_PATIENCE * self._limits.escalate:
            self._protective_at = state.time
            out.append(UseStopPath(StopPath.PROTECTIVE, self._sent[1]))

    def stay(self, state: ControllerState) -> None:
        """Let the arm stand: at once where no other program can start, else to the end of a watch."""
        self.watch.begin(state.time, WATCH_DURATION if self._others_move or self.unconfirmed(state) else 0.0)

    def unconfirmed(self, state: ControllerState) -> bool:
        """Tell whether the newest stop took a protective stop that the controller does not show."""
        return StopPath.PROTECTIVE in self.used and not state.stopped_by_safety
