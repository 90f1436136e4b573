"""Stop of an arm that has lost its guard, and its hold at standstill, by connections of its own.

What is decided is the guard's own ``ArmStop``. The first stop goes out through whatever connection is open, before
anything that may block. What is missing is opened meanwhile, the reader of states too. Without any state the arm cannot
be seen to stand: then a stop ends after a while, and is repeated.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import suppress
from enum import Enum

from coneskin.core.errors import ConeSkinError
from coneskin.robot.arm.model import Joints
from coneskin.robot.driver.messages import EndReaction, StopProgram
from coneskin.robot.driver.protocol import ArmDriver, PayloadReader, StopConnections
from coneskin.robot.driver.values import ControllerState, StopPath, UseStopPath

from .arm_stop import ArmStop
from .limits import MonitoringLimits
from .state_age import StateAge
from .stop_monitor import PROTECTIVE_PATIENCE

_STOP_PATHS = (StopPath.PROGRAM, StopPath.COMMAND, StopPath.SLIDER, StopPath.PROTECTIVE)
_REOPEN_PERIOD = 0.05  # s between two attempts to open what is missing while a stop is under way
_REPEAT_PERIOD = 1.0  # s between two stops while no state comes
_BLIND_TIMEOUT = 2.0  # s without a state after which a stop is given up, and the reader opened anew
CONNECT_TIMEOUT = 0.5  #: s that opening a port may take; what takes longer is tried again


class _HoldPhase(Enum):
    RESTING = "nothing was stopped yet"
    STOPPING = "a stop is under way"
    STOPPING_AGAIN = "the same, after one that has failed"
    STANDING = "it stands, and is watched"
    CONFIRMED = "it has stood for a whole watch"
    FAILED = "no state shows that it stands"


class StandstillHold:
    """Hold of one arm at standstill. A person who pushes or jogs the arm is left alone: no program runs then.

    Args:
        connections: open, or to be opened as far as that is possible.
        deceleration: of its stops, where the guard asks for no other [rad/s2].
        reader: of the controller's state, open; None where there is none yet.
        held_braking: as of `ArmStop`.

    Attributes:
        reader: connection that tells of new states; None while there is none.
    """

    def __init__(
        self,
        driver: ArmDriver,
        connections: StopConnections,
        limits: MonitoringLimits,
        deceleration: float,
        reader: PayloadReader | None = None,
        held_braking: Callable[[Joints, Joints], float] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.reader = reader
        self._phase = _HoldPhase.RESTING
        self._driver = driver
        self._connections = connections
        self._limits = limits
        self._deceleration = deceleration
        self._clock = clock
        own = frozenset[StopPath]().union(*driver.lost_with.values())
        self._stop = ArmStop(limits, tuple(path for path in _STOP_PATHS if path in own), held_braking)
        self._state: ControllerState | None = None  # the newest
        self._age = StateAge(limits.arm_silence)
        self._opened = -math.inf if reader is None else clock()  # when the reader was last opened, or tried
        self._quiet_until = -math.inf
        self._began: float | None = None  # the newest stop; None before the first
        self._due = 0.0  # when what is missing is opened next, or a stop repeated

    def begin(self, deceleration: float | None = None) -> None:
        """Stop the arm now, from now on with this deceleration [rad/s2]. ``poll`` then watches whether it stands.

        While states show that the arm moves, the stop is not given up.
        """
        self.rest()
        if deceleration is not None:
            self._deceleration = deceleration
        self._stop.send(StopProgram(self._deceleration), self)
        self._began = self._due = now = self._clock()
        self._stop.begin(now, None if self.states_missing() else self._state)
        self._phase = _HoldPhase.STOPPING_AGAIN if self.failed else _HoldPhase.STOPPING

    @property
    def stopping(self) -> bool:
        """True from a stop until the arm was measured standing, or no state has come for too long."""
        return self._phase is _HoldPhase.STOPPING or self._phase is _HoldPhase.STOPPING_AGAIN

    @property
    def stands(self) -> bool:
        """True where the arm was seen standing for a whole watch after the newest stop, and ever since."""
        return self._phase is _HoldPhase.CONFIRMED

    @property
    def failed(self) -> bool:
        """True from a stop that was given up, or states that stay away for as long, until the arm is seen standing."""
        return self._phase is _HoldPhase.FAILED or self._phase is _HoldPhase.STOPPING_AGAIN

    def append(self, command: StopProgram | EndReaction | UseStopPath, /) -> None:
        """Send a stop by one path, or by ``COMMAND`` where its connection is not there."""
        assert isinstance(command, UseStopPath)
        if not self._use(command.path):
            self._use(StopPath.COMMAND)

    def poll(self) -> bool:
        """Look at the arm, and stop it where it moves. To be called continuously.

        Returns:
            whether there is an outcome to report: ``stands`` has become true, or a stop has failed.
        """
        states, now = self.rest(), self._clock()
        if self.stopping:
            return self._continue(states, now)
        watch = self._stop.watch
        moved = "".join(watch.moved(state, True) for state, _ in states)  # every state has to be taken
        if self._began is not None and self.states_missing():
            if self._phase is _HoldPhase.CONFIRMED:
                self._phase = _HoldPhase.STANDING
            if now >= self._due:
                self._reconnect()
                for path in (StopPath.PROGRAM, StopPath.COMMAND):
                    self._use(path)
                self._due = self._clock() + _REPEAT_PERIOD
                if self.states_missing(_BLIND_TIMEOUT):
                    self._phase = _HoldPhase.FAILED
            return False
        if moved or not watch.under_way:
            self.begin()
            return False
        if self.stands:
            return False
        self._phase = _HoldPhase.CONFIRMED if watch.confirmed else _HoldPhase.STANDING
        if not watch.confirmed and self._state is not None:
            self._stop.insist(self._state, self)
        return watch.confirmed

    def close(self) -> None:
        """Close all connections; may be called again."""
        self._close_reader()
        self._connections.close()

    def _continue(self, states: list[tuple[ControllerState, float]], now: float) -> bool:
        """Go on with the stop under way. Return whether it has failed."""
        assert self._began is not None
        for state, measured_at in states:
            if self._stop.update(state, measured_at)[1]:
                self._stop.stay(state)
                self._phase = _HoldPhase.STANDING
        if not self.stopping:
            return False
        if now - max(self._began, self._age.newest.fresh_at) >= _BLIND_TIMEOUT:
            self._phase = _HoldPhase.FAILED
            self._due = now + _REPEAT_PERIOD
            return True
        if now >= self._due:
            self._reconnect()
            self._due = self._clock() + _REOPEN_PERIOD
        self._stop.escalate(self._clock(), self)
        return False

    def states_missing(self, time: float = 0.0) -> bool:
        """Tell whether no new state has come for a time [s], or else so long that the arm's motion is unknown."""
        return self._age.silent(self._clock(), time or max(2.0 * self._limits.arm_silence, CONNECT_TIMEOUT))

    def _reconnect(self) -> None:
        """Open what is missing; where a stop path comes back, a stop goes through it."""
        if self._connections.reopen():  # what was sent over the old ones may be lost
            self.append(UseStopPath(StopPath.PROGRAM, self._deceleration))
        now = self._clock()
        timeout = CONNECT_TIMEOUT if self.reader is None else _BLIND_TIMEOUT
        if now - max(self._age.newest.fresh_at, self._opened) < timeout:
            return
        self._close_reader()
        with suppress(ConeSkinError):  # the next look tries again
            self.reader = self._driver.state_reader(self._connections.host, CONNECT_TIMEOUT).__enter__()
        self._opened = self._clock()

    def rest(self) -> list[tuple[ControllerState, float]]:
        """Take what has come, and do nothing more while the arm is guarded.

        Returns:
            the fresh states, oldest first, and when each was measured [s].
        """
        states = []
        try:
            for payload in [] if self.reader is None else self.reader.read():
                self._state = self._driver.decode_state(self._clock(), payload)
                measured_at = self._age.feed(self._state)
                if self._age.newest.fresh:
                    states.append((self._state, measured_at))
        except ConeSkinError:  # reported elsewhere; here only the stops are left, until it can be opened again
            self._close_reader()
        for _, sock, _ in self._connections.drain():
            sock.close()
        return states

    def _close_reader(self) -> None:
        if self.reader is not None:
            self.reader.close()
            self.reader = None

    def _use(self, path: StopPath) -> bool:
        """Send a stop, unless it would replace the program of a protective stop that has only just been sent.

        Returns:
            whether this path is there.
        """
        now = self._clock()
        if now < self._quiet_until:
            return True
        taken = self._connections.use(path, self._deceleration)
        if taken and path is StopPath.PROTECTIVE:
            self._quiet_until = now + PROTECTIVE_PATIENCE * self._limits.escalate
        return taken
