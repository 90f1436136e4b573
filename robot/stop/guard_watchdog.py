"""Guard watchdog: a process that stops an externally controlled arm when its guard is gone. There are two.

It acts when the guard's channel ends without a shutdown message, brings no heartbeat, or asks for a stop because the
guard's own connections are gone. From then on it holds the arm at standstill, until the guard lives again or the
guarded program has left. A stop from two processes at once does no harm, so neither asks the other.

The first one's connections are open before they are needed. The second one waits longer, and opens its own through
whatever port answers then: what broke those of all others is not there yet.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack

from coneskin.core.channel import Channel, encode_json, wait_readable
from coneskin.core.child_process import first_message, inherit, shorten_time_slice
from coneskin.core.errors import ConeSkinError
from coneskin.robot.arm.inertia import held_braking
from coneskin.robot.driver.liveness import BEAT_PERIOD, GUARD_SILENCE, UNGUARDED_TIME
from coneskin.robot.driver.messages import LEAVE, Release, Shutdown, StatusReport, StopProgram, decode_command
from coneskin.robot.driver.protocol import PayloadReader, load_driver

from .backup_stop import CONNECT_TIMEOUT, StandstillHold
from .limits import MonitoringLimits

_POLL_PERIOD = 0.01  # s between two looks
_STOP_POLL_PERIOD = 0.002  # s; while a stop is under way
_ORPHAN_TIME = 1.0  # s without program and states, from which on stops reach nobody: none stays for 2 s ...
_LONELY_TIME = 0.6  # s without the guard, in which a stop is tried all the same, by connections that are opened first


class _GuardWatchdog:
    """Watchdog over one guard.

    Args:
        session: the guarded program's channel; it ends, or says ``LEAVE``, when the program leaves.
        second: True for the one that waits longer.
    """

    def __init__(
        self,
        guard: Channel,
        session: Channel,
        hold: StandstillHold,
        second: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._guard = guard
        self._session = session
        self._hold = hold
        self._patience = UNGUARDED_TIME if second else GUARD_SILENCE
        self._sign = StatusReport("alive", "second" if second else "").encode()
        self._left_at = self._gone_at = math.inf  # when the guarded program left, and the guard [s]
        self._ended = False  # the guard, in order
        self._asked: StopProgram | None = None  # a stop that waits for the one under way
        self._clock = clock
        self._heard: float | None = None  # None until the guard's first heartbeat
        self._alone = False  # the guard is gone, or hangs
        self._beaten = clock()  # last

    def run(self) -> None:
        """Serve until the guard has left and the arm stands."""
        while self.poll(_STOP_POLL_PERIOD if self._hold.stopping else _POLL_PERIOD):
            pass

    def poll(self, timeout: float) -> bool:
        """Wait for messages [s] and serve them; return False once there is nothing left to do."""
        inputs: list[Channel | PayloadReader] = [one for one in (self._guard, self._session) if not one.closed]
        if (reader := self._hold.reader) is not None:
            inputs.append(reader)
        wait_readable(inputs, timeout)
        now, hold = self._clock(), self._hold
        if LEAVE in self._session.receive() or self._session.closed:
            self._left_at = min(self._left_at, self._beaten)  # what was opened since may have taken long
        if now - self._beaten >= BEAT_PERIOD:
            self._beaten = now
            self._guard.send(self._sign)
        for message in self._guard.receive():
            self._heard, self._alone = now, False
            match decode_command(message):
                case Shutdown():
                    self._ended = True
                case Release(number):
                    self._guard.send(StatusReport("released", str(number)).encode())
                case StopProgram() as stop:
                    self._asked = stop  # of several that have waited the newest
        gone = self._guard.closed
        if gone:
            self._gone_at = min(self._gone_at, now)
        alone, unseen = now - self._gone_at, now - self._left_at
        if alone > _LONELY_TIME and unseen > _ORPHAN_TIME and hold.states_missing(unseen) and not hold.rest():
            if hold.stopping:  # nothing was said of this stop yet
                self._session.send(encode_json({"stands": False}))
            return False
        if hold.stopping or (self._alone and self._asked is None):
            outcome = hold.poll()
            if outcome and self._alone:  # tell the program whether the arm stands, where that is known now
                self._session.send(encode_json({"stands": hold.stands}))
        elif self._asked is not None:
            hold.begin(self._asked.deceleration)
            self._asked = None
        elif self._ended or (gone and self._heard is None):
            return False  # it has left, or never guarded anything
        elif not gone and (self._heard is None or now - self._heard <= self._patience):
            hold.rest()
        else:
            self._alone = True
            what = f"the guard was silent for {self._patience:g} s, the arm was stopped"
            self._guard.send(StatusReport("error", what).encode())
            hold.begin()
        return hold.stopping or not (gone and self._left_at < math.inf and (hold.stands or hold.failed))


def main(arguments: list[str]) -> int:
    """Run as ``python -m coneskin.robot.stop.guard_watchdog``: take the channels, wait for the settings, serve."""
    shorten_time_slice()
    lifeline, (guard, session) = inherit(arguments, parent=1)
    if (settings := first_message(session)) is None:
        return 1
    limits = MonitoringLimits(**settings["monitoring"])
    host = settings["host"]
    try:
        driver, second = load_driver(settings["driver"]), bool(settings.get("second"))
        with ExitStack() as stack:
            connections, reader = driver.stop_connections(host, CONNECT_TIMEOUT), None
            if not second:
                connections = stack.enter_context(driver.stop_connections(host))
                reader = stack.enter_context(driver.state_reader(host))
            held = held_braking(*settings["held_braking"])
            hold = StandstillHold(driver, connections, limits, settings["deceleration"], reader, held)
            stack.callback(hold.close)
            lifeline.hold()
            guard.send(StatusReport("ready").encode())
            _GuardWatchdog(guard, session, hold, second).run()
    except ConeSkinError as exc:
        guard.send(StatusReport("error", str(exc)).encode())
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
