"""Requests of the guarded program to the driver process, and the answers to them; any thread may ask.

Each request has a number, which its answer repeats, and the time at which it is sent. A driver process that was held up
does not carry out what it should have done long ago.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from coneskin.core.channel import Channel, decode_json, encode_json, wait_readable
from coneskin.core.errors import RobotConnectionError, RobotRefused

__all__ = ["ArmRequests"]

_LOOK_PERIOD = 0.05  # s between two looks at what else may have ended a wait


class ArmRequests:
    """Requests to one driver process.

    Args:
        channel: to the driver process.
        check: raises what has stopped the arm, if anything has; its argument is True where something certainly has.
    """

    def __init__(self, channel: Channel, check: Callable[[bool], None]) -> None:
        self.channel = channel
        self.check = check
        self._number = 0  # of the newest request
        self._asked: set[int] = set()  # whose answers are waited for
        self._answers: dict[int, dict[str, Any]] = {}
        self._state = threading.Condition()
        self._reading = threading.Lock()  # one thread reads for all

    def do(self, **request: Any) -> dict[str, Any]:
        """Send a request, wait for its answer and return it.

        Raises:
            Collision: the skin was touched.
            RobotRefused: the guard, the controller or the driver process does not do it.
            RobotConnectionError: the driver process is gone.
        """
        self.check(False)
        with self._state:
            self._number += 1
            number = self._number
            self._asked.add(number)
        try:
            message = encode_json({**request, "number": number, "sent": time.monotonic()})
            dropped = self.channel.dropped
            if not self.channel.send(message) and self.channel.dropped > dropped:  # nobody would ever answer it
                raise RobotRefused(f"{request['do']}: the driver process does not take {len(message)} bytes")
            answer = self._await(number)
        finally:
            with self._state:
                self._asked.discard(number)
                self._answers.pop(number, None)
        if not answer["ok"]:
            if answer["stopped"]:
                self.check(True)
            raise RobotRefused(f"{request['do']}: {answer['why']}")
        self.check(False)
        return answer

    def _await(self, number: int) -> dict[str, Any]:
        while True:
            with self._state:
                for known in (number, 0):  # 0: of a driver process that could not start
                    if known in self._answers:
                        return self._answers[known]
            if self._reading.acquire(blocking=False):
                try:
                    self._read()
                finally:
                    self._reading.release()
                    with self._state:
                        self._state.notify_all()
            else:
                with self._state:
                    if number not in self._answers:
                        self._state.wait(_LOOK_PERIOD)
            self.check(False)
            if self.channel.closed and number not in self._answers:
                raise RobotConnectionError("the driver process has ended")

    def _read(self) -> None:
        """Wait a while for answers, and keep those that somebody waits for."""
        if self.channel.closed:
            return
        wait_readable([self.channel], _LOOK_PERIOD)
        for message in self.channel.receive():
            answer = decode_json(message)
            with self._state:
                if answer["number"] == 0 or answer["number"] in self._asked:
                    self._answers[answer["number"]] = answer
