"""Stops the arm when the guard is gone, where no owner of ur_rtde is there to do so: a process of its own.

Its sockets are open before they are needed, and it imports nothing that can block. It acts when the guard's channel
ends without a farewell, or brings no sign of life; then it stops the arm by one way after the other, until it stands.
"""

from __future__ import annotations

import select
import sys
import time
from collections.abc import Callable

from coneskin.errors import ConeSkinError

from .channel import Channel, inherit
from .foreign import ForeignStops
from .owner_messages import SILENCE, Farewell, Note, decode_json
from .state_reader import StateReader, decode_state
from .stop_watch import StopWatch, Way
from .watch import Watch

__all__ = ["Keeper", "main"]

WAYS = (Way.SCRIPT, Way.DASHBOARD, Way.PROTECTIVE)
_STEP = 0.01  # s
_LONGEST = 5.0  # s that a stop may take before the keeper gives up


class Keeper:
    """Watches a guard.

    Args:
        guard: the guard's channel.
        stops: open.
        reader: of the controller's state, open.
        watch: the limits.
        deceleration: of the stop [rad/s2].
        clock: monotonic seconds.
    """

    def __init__(
        self,
        guard: Channel,
        stops: ForeignStops,
        reader: StateReader,
        watch: Watch,
        deceleration: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._guard = guard
        self._stops = stops
        self._reader: StateReader | None = reader
        self._watch = watch
        self._deceleration = deceleration
        self._clock = clock
        self._speed: float | None = None
        self._heard: float | None = None  # None until the guard's first sign of life

    def run(self) -> None:
        """Serve until the guard has left and the arm stands."""
        while self.step(_STEP):
            pass

    def step(self, timeout: float) -> bool:
        """Wait for messages [s] and serve them; False once there is nothing left to do."""
        inputs: list[Channel | StateReader] = [self._guard]
        if self._reader is not None:
            inputs.append(self._reader)
        select.select(inputs, [], [], timeout)
        now = self._clock()
        for message in self._guard.receive():
            self._heard = now
            if message == Farewell().encode():
                return False
        self._read(None)
        if self._guard.closed:
            self.stop()
            return False
        if self._heard is not None and now - self._heard > SILENCE:
            self._guard.send(Note("error", f"the guard was silent for {SILENCE:g} s, the arm was stopped").encode())
            self.stop()
            self._heard = None
        return True

    def stop(self) -> bool:
        """Stop the arm; whether it was seen standing."""
        now = start = self._clock()
        budget = (self._speed or 0.0) / self._deceleration + 4.0 * self._watch.escalate
        stop = StopWatch(
            now, self._speed, WAYS, self._watch.escalate, budget, self._watch.standstill, self._watch.arm_silence
        )
        self._stops.use(WAYS[0], self._deceleration)
        while stop.standing_at is None and now - start < _LONGEST:
            select.select([self._reader] if self._reader else [], [], [], 0.002)
            self._read(stop)
            now = self._clock()
            for way in stop.next_ways(now):
                self._stops.use(way, self._deceleration)
        return stop.standing_at is not None

    def _read(self, stop: StopWatch | None) -> None:
        try:
            payloads = [] if self._reader is None else self._reader.read()
            for payload in payloads:
                state = decode_state(self._clock(), payload)
                self._speed = state.speed
                if stop is not None:
                    stop.sample(state.time, state.speed)
        except ConeSkinError:
            self._reader = None  # the guard says so; here only the stops are left
        self._stops.drain()


def main(arguments: list[str]) -> int:
    """Run as ``python -m coneskin.robot.keeper``: take the channels, wait for the host, serve."""
    guard, session = inherit(arguments)
    while not (hello := session.receive()) and not session.closed:
        select.select([session], [], [], 1.0)
    if not hello:
        return 1
    settings = decode_json(hello[0])
    try:
        with ForeignStops(settings["host"]) as stops, StateReader(settings["host"]) as reader:
            guard.send(Note("ready").encode())
            Keeper(guard, stops, reader, Watch(**settings["watch"]), settings["deceleration"]).run()
    except ConeSkinError as exc:
        guard.send(Note("error", str(exc)).encode())
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
