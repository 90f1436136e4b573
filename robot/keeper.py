"""Stops the arm when the guard is gone, where no owner of ur_rtde is there to do so: a process of its own.

Its sockets are open before they are needed, and it imports nothing that can block. It acts when the guard's channel
ends without a farewell, brings no sign of life, or asks for a stop because its own sockets are gone. From then on it
keeps the arm standing, until the guard lives again or the guarded program has left.
"""

from __future__ import annotations

import select
import sys
import time
from collections.abc import Callable

from coneskin.errors import ConeSkinError

from .channel import Channel, inherit
from .foreign import ForeignStops
from .owner_messages import SILENCE, Farewell, Note, Stop, decode_command, decode_json
from .state_reader import StateReader
from .stopper import Stopper
from .vigil import Vigil
from .watch import Watch

__all__ = ["Keeper", "main"]

_STEP = 0.01  # s


class Keeper:
    """Watches a guard.

    Args:
        guard: the guard's channel.
        session: the guarded program's channel, which ends when the program leaves.
        vigil: over the arm.
        clock: monotonic seconds.
    """

    def __init__(
        self, guard: Channel, session: Channel, vigil: Vigil, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._guard = guard
        self._session = session
        self._vigil = vigil
        self._clock = clock
        self._heard: float | None = None  # None until the guard's first sign of life
        self._alone = False  # the guard is gone, or hangs

    def run(self) -> None:
        """Serve until the guard has left and the arm stands."""
        while self.step(_STEP):
            pass

    def step(self, timeout: float) -> bool:
        """Wait for messages [s] and serve them; False once there is nothing left to do."""
        inputs: list[Channel | StateReader] = [one for one in (self._guard, self._session) if not one.closed]
        if (reader := self._vigil.reader) is not None:
            inputs.append(reader)
        select.select(inputs, [], [], timeout)
        now = self._clock()
        self._session.receive()
        asked: Stop | None = None
        for message in self._guard.receive():
            self._heard, self._alone = now, False
            match decode_command(message):
                case Farewell():
                    return False
                case Stop() as stop:
                    asked = stop  # of several that have waited the newest
        if asked is not None:
            self._vigil.begin(asked.deceleration)
        gone = self._guard.closed
        if gone and self._heard is None:
            return False  # it never guarded anything
        if not gone and (self._heard is None or now - self._heard <= SILENCE):
            self._vigil.rest()
        elif not self._alone:
            self._alone = True
            self._guard.send(Note("error", f"the guard was silent for {SILENCE:g} s, the arm was stopped").encode())
            self._vigil.begin()
        else:
            self._vigil.look()
        if not (gone and self._session.closed):
            return True
        if not self._vigil.stands:
            self._vigil.begin()
        return False


def main(arguments: list[str]) -> int:
    """Run as ``python -m coneskin.robot.keeper``: take the channels, wait for the host, serve."""
    guard, session = inherit(arguments)
    while not (hello := session.receive()) and not session.closed:
        select.select([session], [], [], 1.0)
    if not hello:
        return 1
    settings = decode_json(hello[0])
    watch = Watch(**settings["watch"])
    try:
        with ForeignStops(settings["host"]) as stops, StateReader(settings["host"]) as reader:
            guard.send(Note("ready").encode())
            stopper = Stopper(stops, watch, settings["deceleration"], reader)
            Keeper(guard, session, Vigil(stopper, watch.standstill)).run()
    except ConeSkinError as exc:
        guard.send(Note("error", str(exc)).encode())
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
