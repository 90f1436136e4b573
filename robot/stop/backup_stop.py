"""Stop of an arm that has lost its guard, by one stop path after the other, and its hold at standstill.

The first stop goes out through whatever connection is open, before anything that may block; what is missing is opened
meanwhile, the reader of states too. Without any state the arm cannot be seen to stand: then a stop ends after a while,
and ``StandstillHold`` repeats it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import suppress

from coneskin.core.channel import wait_readable
from coneskin.core.errors import ConeSkinError
from coneskin.robot.driver.protocol import ArmDriver, PayloadReader, StopConnections
from coneskin.robot.driver.values import ControllerState, StopPath

from .limits import MonitoringLimits
from .standstill import WATCH_DURATION, StandstillWatch
from .state_age import StateAge
from .stop_monitor import PROTECTIVE_PATIENCE, StopMonitor

_STOP_PATHS = (StopPath.PROGRAM, StopPath.COMMAND, StopPath.SLIDER, StopPath.PROTECTIVE)
_STRONGEST_FIRST = (StopPath.PROTECTIVE, StopPath.PROGRAM, StopPath.COMMAND, StopPath.SLIDER)
_REOPEN_PERIOD = 0.05  # s between two attempts to open what is missing
_BLIND_TIMEOUT = 2.0  # s without a state after which a stop is given up, and the reader opened anew
_CONNECT_TIMEOUT = 0.5  # s that opening the reader may take


def _never() -> bool:
    return False


class BackupStop:
    """Stop of one arm from outside its guard.

    Args:
        driver: of the arm.
        connections: open, or to be opened as far as that is possible.
        limits: of the monitoring.
        deceleration: of the stop [rad/s2].
        reader: of the controller's state, open; None where there is none yet.
        clock: monotonic seconds.
    """

    def __init__(
        self,
        driver: ArmDriver,
        connections: StopConnections,
        limits: MonitoringLimits,
        deceleration: float,
        reader: PayloadReader | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._driver = driver
        self._connections = connections
        self._limits = limits
        self._deceleration = deceleration
        self._reader = reader
        self._clock = clock
        self._state: ControllerState | None = None  # the newest
        self._age = StateAge(limits.arm_silence)
        self._opened = -math.inf if reader is None else clock()  # when the reader was last opened, or tried
        self._quiet_until = -math.inf
        self._used: list[StopPath] = []  # by the newest stop

    @property
    def reader(self) -> PayloadReader | None:
        """Connection that tells of new states; None while there is none."""
        return self._reader

    def states_missing(self, at_least: float = _CONNECT_TIMEOUT) -> bool:
        """Tell whether no new state has come for so long that the arm's motion is unknown; not before a time [s]."""
        return self._age.silent(self._clock(), max(2.0 * self._limits.arm_silence, at_least))

    def stop(
        self, deceleration: float | None = None, over: Callable[[], bool] = _never, strongest: bool = False
    ) -> bool:
        """Stop the arm and return whether it was seen standing.

        While states show that the arm moves, the stop is not given up.

        Args:
            deceleration: of the stop [rad/s2]; by default that of the constructor.
            over: asked continuously; True ends the stop as it is.
            strongest: begin with the protective stop.
        """
        gentle = self._deceleration if deceleration is None else deceleration
        limits = self._limits
        self.read()
        paths = _STRONGEST_FIRST if strongest else _STOP_PATHS
        if not self._use(paths[0], gentle):
            self._use(StopPath.COMMAND, gentle)
        now = start = self._clock()
        speed = None if self._state is None or self.states_missing() else self._state.speed
        budget = limits.stop_budget(speed or 0.0, gentle)
        stop = StopMonitor(now, speed, paths, limits.escalate, budget, limits.standstill, limits.arm_silence)
        look_at = now
        while stop.standing_at is None and now - max(start, self._age.fresh_at) < _BLIND_TIMEOUT and not over():
            if now >= look_at:
                self.reconnect(gentle)
                look_at = self._clock() + _REOPEN_PERIOD
            wait_readable([] if self._reader is None else [self._reader], 0.002)
            self.read(stop)
            now = self._clock()
            for path in stop.next_paths(now):
                self._use(path, gentle)
        self._used = stop.used
        return stop.standing_at is not None

    def insist(self) -> None:
        """Repeat the protective stop, where the newest stop took one that the controller does not show."""
        if StopPath.PROTECTIVE in self._used and self._state is not None and not self._state.stopped_by_safety:
            self._use(StopPath.PROTECTIVE, self._deceleration)

    def repeat(self) -> None:
        """Send a gentle stop once more, through both connections, without looking at its effect."""
        self.reconnect(self._deceleration)
        for path in (StopPath.PROGRAM, StopPath.COMMAND):
            self._use(path, self._deceleration)

    def reconnect(self, deceleration: float) -> None:
        """Open what is missing; where a stop path comes back, a stop with this deceleration goes through it."""
        if self._connections.reopen() and not self._use(StopPath.PROGRAM, deceleration):
            self._use(StopPath.COMMAND, deceleration)  # what was sent over the old ones may be lost
        now = self._clock()
        if now - max(self._age.fresh_at, self._opened) < (
            _BLIND_TIMEOUT if self._reader is not None else _CONNECT_TIMEOUT
        ):
            return
        self._close_reader()
        with suppress(ConeSkinError):  # the next look tries again
            self._reader = self._driver.state_reader(self._connections.host, _CONNECT_TIMEOUT).__enter__()
        self._opened = self._clock()

    def read(self, stop: StopMonitor | None = None) -> list[ControllerState]:
        """Return the states that have come, oldest first, without waiting."""
        states = []
        try:
            for payload in [] if self._reader is None else self._reader.read():
                state = self._driver.decode_state(self._clock(), payload)
                states.append(state)
                measured_at = self._age.feed(state)
                if self._age.fresh and stop is not None:
                    stop.sample(state.time, state.speed, measured_at)
                self._state = state
        except ConeSkinError:  # reported elsewhere; here only the stops are left, until it can be opened again
            self._close_reader()
        for _, sock, _ in self._connections.drain():
            sock.close()
        return states

    def close(self) -> None:
        """Close all connections; may be called again."""
        self._close_reader()
        self._connections.close()

    def _close_reader(self) -> None:
        if self._reader is not None:
            self._reader.close()
            self._reader = None

    def _use(self, path: StopPath, deceleration: float) -> bool:
        """Send a stop, unless it would replace the program of a protective stop that has only just been sent.

        Returns:
            whether this path is there.
        """
        now = self._clock()
        if now < self._quiet_until:
            return True
        taken = self._connections.use(path, deceleration)
        if taken and path is StopPath.PROTECTIVE:
            self._quiet_until = now + PROTECTIVE_PATIENCE * self._limits.escalate
        return taken


_REPEAT_PERIOD = 1.0  # s between two stops while no state comes


class StandstillHold:
    """Hold of one arm at standstill. A person who pushes or jogs the arm is left alone: no program runs then.

    Args:
        backup_stop: of the arm.
        standstill: joint speed below which the arm stands [rad/s].
        clock: monotonic seconds.

    Attributes:
        stands: True where the arm was seen standing for a whole watch after the newest stop, and ever since.
        failed: True where the newest stop was given up before the arm was seen standing, or where its state has been
            missing for so long since then that it would be given up.
    """

    def __init__(self, backup_stop: BackupStop, standstill: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._stop = backup_stop
        self._clock = clock
        self._watch = StandstillWatch(standstill)
        self._due: float | None = None  # None until the first stop
        self.stands = self.failed = False

    @property
    def reader(self) -> PayloadReader | None:
        """Connection that tells of new states; None while there is none."""
        return self._stop.reader

    def rest(self) -> None:
        """Take what has come and do nothing more: the arm is guarded."""
        self._stop.read()

    def begin(self, deceleration: float | None = None, over: Callable[[], bool] = lambda: False) -> None:
        """Stop the arm now; ``poll`` then watches whether it stands. Arguments as of ``BackupStop.stop``."""
        self._watch.end()
        self.stands = False
        self.failed = not self._stop.stop(deceleration, over, self._watch.insists)
        self._due = self._clock() + _REPEAT_PERIOD
        if not self.failed:
            self._watch.begin(self._clock(), WATCH_DURATION)

    def poll(self, over: Callable[[], bool] = lambda: False) -> bool:
        """Look at the arm, and stop it where it moves. To be called continuously.

        Returns:
            whether there is an outcome to report: ``stands`` has become true, or a stop has failed.
        """
        states = self._stop.read()
        moved = sum(self._watch.moved(state, True) for state in states) > 0  # every state has to be taken
        if self._due is not None and self._stop.states_missing():
            self.stands = False
            if self._clock() < self._due:
                return False
            self._stop.repeat()
            self._due = self._clock() + _REPEAT_PERIOD
            self.failed = self.failed or self._stop.states_missing(_BLIND_TIMEOUT)
            return False
        if moved or not self._watch.under_way:
            self.begin(over=over)
            return self.failed
        self.failed = False
        if self.stands:
            return False
        self.stands = self._watch.confirmed
        if not self.stands:
            self._stop.insist()
        return self.stands
