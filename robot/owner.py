"""The owner of ur_rtde: a process of its own that moves the arm for the program and stops it for the guard.

Two channels: the guard's, which always comes first, and the program's. After a ``Stop`` the program is refused until
the guard says ``Clear``. When either channel ends, or the guard gives no sign of life, the arm is stopped; when this
process ends or hangs, the controller's watchdog stops the arm.
"""

from __future__ import annotations

import math
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

from coneskin.errors import ConeSkinError

from .channel import Channel, inherit
from .owner_messages import (
    SILENCE,
    STEERING_SILENCE,
    Alive,
    Clear,
    GuardCommand,
    Halt,
    Note,
    Speed,
    Stop,
    decode_command,
    decode_json,
    encode_json,
)
from .ur_rtde import UrArm

__all__ = ["Owner", "main"]

_MOTIONS = (Stop, Halt, Speed)
_LEAVING = 2.0  # s for the last stop and the goodbye; ur_rtde can block both for minutes
_KICK_EVERY = 0.02  # well within the watchdog's period, and no load for the controller


class Owner:
    """Serves both channels; one step at a time, so that it can be tested with a mocked arm.

    Args:
        arm: the arm, already open.
        guard: the guard's channel.
        program: the program's channel.
        clock: monotonic seconds.
        leaving: called before the last stop.
        deceleration: of the leading joint, for a stop that the guard does not command any more [rad/s2].
    """

    def __init__(
        self,
        arm: UrArm,
        guard: Channel,
        program: Channel,
        clock: Callable[[], float] = time.monotonic,
        leaving: Callable[[], None] = lambda: None,
        deceleration: float = 10.0,
    ) -> None:
        self._clock = clock
        self._leaving = leaving
        self._quit = False
        self._heard = clock()
        self._arm = arm
        self._guard = guard
        self._program = program
        self._allowed = False
        self._patience = math.inf  # s for which the guard may be silent; while nothing moves, for ever
        self._waiting = False  # the program waits for the end of a move
        self._kicked = -1.0
        self._deceleration = deceleration

    def run(self) -> None:
        """Serve until one of the channels ends, or ``leave``; then stop the arm."""
        self._guard.send(Note("ready").encode())
        try:
            while not self._quit and self.step(0.005):
                pass
        finally:
            self._leaving()
            self._arm.stop(self._deceleration)

    def leave(self) -> None:
        """End ``run``. May be called from a signal handler."""
        self._quit = True

    def step(self, timeout: float) -> bool:
        """Wait for messages [s] and serve them; False once a channel has ended."""
        select.select([self._guard, self._program], [], [], timeout)
        now = self._clock()
        commands = [decode_command(message) for message in self._guard.receive()]
        newest = max((n for n, command in enumerate(commands) if isinstance(command, _MOTIONS)), default=0)
        for number, command in enumerate(commands):
            if isinstance(command, Speed) and number < newest:
                continue  # the guard has thought better of it meanwhile
            if self._patience != STEERING_SILENCE or not isinstance(command, Alive):
                self._heard = now
            self._serve_guard(command)
        if self._guard.closed:
            return False
        for message in self._program.receive():
            self._serve_program(message)
        if self._program.closed:
            return False
        if self._waiting and not self._arm.moving():
            self._reply({"ok": True})
        if now - self._heard > self._patience:
            self._forbid(f"the guard has been silent for {self._patience:g} s")
        if now - self._kicked >= _KICK_EVERY:
            self._arm.kick()
            self._kicked = now
        return True

    def _serve_guard(self, command: GuardCommand) -> None:
        try:
            match command:
                case Stop(deceleration) | Halt(deceleration):
                    self._allowed, self._patience = False, math.inf
                    self._deceleration = deceleration
                    self._refuse_waiting("the guard has stopped the arm")
                    self._arm.stop(deceleration)
                    self._guard.send(Note("done").encode())
                case Speed(qd, acceleration):
                    self._allowed, self._patience = False, STEERING_SILENCE
                    self._arm.speed_j(qd, acceleration)
                case Clear():
                    self._arm.revive()
                    self._allowed, self._patience = True, SILENCE
        except ConeSkinError as exc:
            self._guard.send(Note("error", str(exc)).encode())

    def _forbid(self, why: str) -> None:
        """Stop the arm because of the guard itself."""
        self._allowed, self._patience = False, math.inf
        self._refuse_waiting(why)
        self._guard.send(Note("error", why).encode())
        try:
            self._arm.stop(self._deceleration)
        except ConeSkinError as exc:
            self._guard.send(Note("error", str(exc)).encode())

    def _serve_program(self, message: bytes) -> None:
        try:
            request = decode_json(message)
            if not self._allowed:
                self._reply({"ok": False, "stopped": True, "why": "the guard does not let the arm move"})
                return
            self._waiting = self._start(request)
            if not self._waiting:
                self._reply({"ok": True})
        except (ConeSkinError, ValueError, KeyError, TypeError) as exc:
            self._reply({"ok": False, "stopped": False, "why": f"{exc}"})

    def _start(self, request: dict[str, Any]) -> bool:
        """Start what the program asks for; True where it wants to wait for the end."""
        match request["do"]:
            case "move_j":
                self._arm.move_j(request["q"], request["speed"], request["acceleration"])
            case "move_l":
                self._arm.move_l(request["pose"], request["speed"], request["acceleration"])
            case "speed_j":
                self._arm.speed_j(request["qd"], request["acceleration"])
                return False
            case "servo_j":
                self._arm.servo_j(request["q"])
                return False
            case "stop":
                self._arm.stop(request["acceleration"])
                return False
            case other:
                raise ValueError(f"the arm cannot {other!r}")
        return bool(request.get("wait", True))

    def _refuse_waiting(self, why: str) -> None:
        if self._waiting:
            self._reply({"ok": False, "stopped": True, "why": why})

    def _reply(self, answer: dict[str, Any]) -> None:
        self._waiting = False
        self._program.send(encode_json(answer))


def main(arguments: list[str]) -> int:
    """Run as ``python -m coneskin.robot.owner``: take the channels, wait for the host, serve."""
    guard, program = inherit(arguments)
    while not (hello := program.receive()) and not program.closed:
        select.select([program], [], [], 1.0)
    if not hello:
        return 1
    settings = decode_json(hello[0])
    try:
        with UrArm(settings["host"], settings["watchdog_hz"]) as arm:
            owner = Owner(
                arm, guard, program, leaving=lambda: _end_within(_LEAVING), deceleration=settings["deceleration"]
            )
            signal.signal(signal.SIGTERM, lambda *_: owner.leave())
            owner.run()
    except ConeSkinError as exc:
        guard.send(Note("error", str(exc)).encode())
        program.send(encode_json({"ok": False, "stopped": False, "why": str(exc)}))
        return 1
    return 0


def _end_within(seconds: float) -> None:
    """End this process after so long, whatever ur_rtde does: then the controller's watchdog ends its program."""
    timer = threading.Timer(seconds, os._exit, (1,))
    timer.daemon = True
    timer.start()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
