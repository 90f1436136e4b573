"""Driver process: it moves the arm through ur_rtde for the program, and stops it for the guard.

It has two channels: the guard's, which always comes first, and the program's. After a ``StopProgram`` the program is
refused until the guard sends ``Release``. When either channel ends, or the guard sends no heartbeat, the arm is
stopped, whatever setpoint the guard then still sends; when this process hangs, the controller's watchdog stops it.

A request of the program has a number, which its answer repeats, and the time at which it was sent: one that has waited
for long is void, because the program has given it up. Speeds and servo positions expire: they are not kept for a
program that sends no more.
"""

from __future__ import annotations

import math
import signal
import sys
import time
from collections.abc import Callable
from typing import Any, NamedTuple

from coneskin.core.channel import Channel, decode_json, encode_json, wait_readable
from coneskin.core.child_process import first_message, inherit, shorten_time_slice
from coneskin.core.errors import ConeSkinError
from coneskin.robot.driver.deadman import Deadman
from coneskin.robot.driver.liveness import GUARD_SILENCE, SETPOINT_SILENCE
from coneskin.robot.driver.messages import (
    DatedVelocity,
    EndReaction,
    GuardCommand,
    Heartbeat,
    Release,
    StatusReport,
    StopProgram,
    decode_command,
)
from coneskin.robot.driver.values import Waypoint

from .ur_rtde import MIN_ACCELERATION, MOVE_L_DECELERATION, SERVO_DECELERATION, STRAIGHT_MOVES, UrArm, stop_time

_ANSWER_TIME = 0.5  # s for the controller to take a tool or a payload, or to answer a question
_PATH_TIME = 3.0  # s for the controller to start its program again with a path in it
_MAX_DURATION = 10.0  # s for which a speed or a position may hold


class _RequestOutcome(NamedTuple):
    """What a request has led to."""

    started: bool = False  #: it has started a motion, which replaces the one before
    holds: float = math.inf  #: time after which what it has started is void [s], counted from when it was sent
    waits: bool = False  #: the program wants the answer at the end of the motion
    answer: dict[str, Any] = {}  # noqa: RUF012 (never changed)


def carry_out(
    arm: UrArm, request: dict[str, Any], work: Callable[[float], None], restart: Callable[[bool], None]
) -> _RequestOutcome:
    """Start what a program asks for, or answer it.

    Args:
        request: with the name of what is to be done, and its values.
        work: called with a time [s] before a call that may block for so long, and with 0 after it.
        restart: called with False before the program on the controller is started anew, and with True after it.

    Raises:
        RobotRefused: the arm, or the controller, does not take it.
        RobotConnectionError: the wheel raised.
        ValueError, KeyError, TypeError: the request is damaged, or asks for what cannot be.
    """
    wait = bool(request.get("wait", True))
    match request["do"]:
        case "move_j" | "move_j_ik" | "move_l" | "move_l_fk" as move:
            acceleration, straight = _stop_acceleration(request), move in STRAIGHT_MOVES
            work(stop_time(MOVE_L_DECELERATION if straight else acceleration))  # it first ends what is under way
            target = request["q"] if move in ("move_j", "move_l_fk") else request["pose"]
            arm.move(move, target, request["speed"], acceleration)
            return _RequestOutcome(True, waits=wait)
        case "move_path":
            waypoints = [Waypoint.from_message(message) for message in request["waypoints"]]
            if not waypoints:
                raise ValueError("a path needs at least one way point")
            work(stop_time(MOVE_L_DECELERATION) + _PATH_TIME)
            restart(False)
            arm.move_path(waypoints)
            restart(True)
            return _RequestOutcome(True, waits=wait)
        case "speed_j" | "speed_l" as move:
            duration, acceleration = _duration(request), _stop_acceleration(request)
            work(stop_time(min(acceleration, MOVE_L_DECELERATION)))
            arm.speed(move, request["qd" if move == "speed_j" else "twist"], acceleration)
            return _RequestOutcome(True, holds=duration)
        case "servo_j" | "servo_l" as move:
            duration = _duration(request)
            work(stop_time(SERVO_DECELERATION))
            target = request["q" if move == "servo_j" else "pose"]
            arm.servo(move, target, float(request.get("lookahead", 0.1)), float(request.get("gain", 300.0)))
            return _RequestOutcome(True, holds=duration)
        case "wait":
            return _RequestOutcome(waits=arm.moving() or arm.arriving)
        case "progress":
            return _RequestOutcome(answer={"waypoint": arm.waypoint(), "mode": arm.mode.value})
    work(_ANSWER_TIME)
    match request["do"]:
        case "set_tcp":
            arm.set("set_tcp", list(request["pose"]))
        case "set_payload":
            arm.set("set_payload", request["mass"], list(request["centre"]))
        case "ask":
            return _RequestOutcome(answer={"value": arm.ask(request["what"], *request["values"])})
        case other:
            raise ValueError(f"the arm cannot {other!r}")
    return _RequestOutcome()


def _stop_acceleration(request: dict[str, Any]) -> float:
    """Return an acceleration, or a deceleration, of the leading joint [rad/s2], or of the tool [m/s2].

    Raises:
        ValueError: it is not finite, or so low that a stop with it would take minutes.
    """
    acceleration = float(request["acceleration"])
    if not MIN_ACCELERATION <= acceleration < math.inf:
        raise ValueError(f"acceleration must be finite and at least {MIN_ACCELERATION:g}, got {acceleration:g}")
    return acceleration


def _duration(request: dict[str, Any]) -> float:
    """Return for how long a speed or a position holds [s]."""
    duration = float(request["duration"])
    if not 0.0 < duration <= _MAX_DURATION:
        raise ValueError(f"duration must be above 0 and at most {_MAX_DURATION:g} s, got {duration:g} s")
    return duration


_MOTION_COMMANDS = (StopProgram, EndReaction, DatedVelocity)
_START_TIMEOUT = 3.0  # s for the controller to start the control program again
_MOVE_POLL_PERIOD = 0.005  # s between two looks at a move whose end the program waits for


class _DriverProcess:
    """Server of both channels; one step at a time, so that it can be tested with a mocked arm.

    Args:
        arm: the arm, already open.
        on_end: called before the last stop.
        work: called in each step, and with a time [s] before a call that may block for so long.
        request_lifetime: time after which a request that was not taken is void [s].
        deceleration: of the leading joint, for a stop that the guard does not command any more [rad/s2].
    """

    def __init__(
        self,
        arm: UrArm,
        guard: Channel,
        program: Channel,
        clock: Callable[[], float] = time.monotonic,
        on_end: Callable[[], None] = lambda: None,
        work: Callable[[float], None] = lambda _: None,
        deceleration: float = 10.0,
        request_lifetime: float = 0.2,
    ) -> None:
        self._arm, self._guard, self._program = arm, guard, program
        self._clock, self._on_end, self._work = clock, on_end, work
        self._quit = False
        self._heard = clock()
        self._allowed = self._forbidden = False  # forbidden: the guard's setpoints as well, until it stops the arm
        self._patience = math.inf  # s for which the guard may be silent; without limit while nothing moves
        self._waiting: list[int] = []  # numbers of the requests whose end the program waits for
        self._expires = math.inf  # when the speeds or positions of the program are void
        self._request_lifetime = request_lifetime
        self._kicked = -1.0
        self._deceleration = deceleration

    def run(self) -> None:
        """Serve until one of the channels ends, or until ``end``; then stop the arm."""
        self._guard.send(StatusReport("ready").encode())
        try:
            while not self._quit and self.poll(self._until_due()):
                pass
        finally:
            self._on_end()
            self._stop(self._deceleration)

    def end(self) -> None:
        """End ``run``. May be called from a signal handler."""
        self._quit = True

    def _until_due(self) -> float:
        """Return how long nothing but a message needs this process [s]."""
        if self._waiting:
            return _MOVE_POLL_PERIOD
        due = min(self._kicked + self._arm.kick_period, self._expires, self._heard + self._patience)
        return max(due - self._clock(), 0.0)

    def poll(self, timeout: float) -> bool:
        """Wait for messages [s] and serve them; return False once a channel has ended."""
        self._work(timeout)
        wait_readable([self._guard, self._program], timeout)
        now = self._clock()
        self._take_guard(now)
        for message in self._program.receive():
            self._take_guard(self._clock())  # a stop must not wait behind all that a program has asked for
            if self._guard.closed:
                return False
            self._serve_program(message)
            self._kick(self._clock())
        if self._guard.closed or self._program.closed:
            return False
        if self._waiting and not self._arm.moving():
            ended = {"ok": False, "stopped": True, "why": "the move was ended before the arm arrived"}
            self._answer_waiting(**(ended if self._arm.arriving else {"ok": True}))
        if now > self._expires and self._try_to_stop(at_once=False):  # the program has not renewed it
            what = "no new speed or servo command of the program has come in time: the arm was stopped"
            self._guard.send(StatusReport("remark", what).encode())
        if now - self._heard > self._patience:
            self._forbid(f"the guard has been silent for {self._patience:g} s")
        self._kick(now)
        return True

    def _take_guard(self, now: float) -> None:
        """Serve what the guard has sent."""
        commands = [decode_command(message) for message in self._guard.receive()]
        newest = max((n for n, command in enumerate(commands) if isinstance(command, _MOTION_COMMANDS)), default=0)
        for number, command in enumerate(commands):
            if isinstance(command, DatedVelocity) and number < newest:
                continue  # a newer motion command has overtaken it
            if self._patience != SETPOINT_SILENCE or not isinstance(command, Heartbeat):
                self._heard = now
            self._serve_guard(command)

    def _kick(self, now: float) -> None:
        if now - self._kicked >= 0.5 * self._arm.kick_period:  # or sooner than it must, awake for something else
            self._arm.kick()
            self._kicked = now

    def _serve_guard(self, command: GuardCommand) -> None:
        try:
            match command:
                case StopProgram(deceleration) | EndReaction(deceleration):
                    self._allowed, self._patience, self._forbidden = False, math.inf, False
                    self._deceleration = deceleration
                    self._answer_waiting(ok=False, stopped=True, why="the guard has stopped the arm")
                    self._stop(deceleration)
                    self._guard.send(StatusReport("done").encode())
                case DatedVelocity(decided, (qd, acceleration)) if not self._forbidden:
                    if self._clock() - decided <= SETPOINT_SILENCE:  # else the guard, or this process, was held up
                        self._allowed, self._patience, self._expires = False, SETPOINT_SILENCE, math.inf
                        self._arm.speed("speed_j", qd, acceleration)
                case Release(number):
                    self._work(_START_TIMEOUT)
                    self._arm.revive()
                    self._arm.arriving = False
                    self._allowed, self._patience, self._forbidden = True, GUARD_SILENCE, False
                    self._guard.send(StatusReport("released", str(number)).encode())
        except ConeSkinError as exc:
            self._guard.send(StatusReport("error", str(exc)).encode())

    def _forbid(self, why: str) -> None:
        """Stop the arm because the guard itself, or a stop, has failed."""
        self._allowed, self._patience, self._forbidden = False, math.inf, True
        self._answer_waiting(ok=False, stopped=True, why=why)
        self._guard.send(StatusReport("error", why).encode())
        self._try_to_stop()

    def _try_to_stop(self, at_once: bool = True) -> bool:
        try:
            self._stop(self._deceleration, at_once)
        except ConeSkinError as exc:
            self._guard.send(StatusReport("error", str(exc)).encode())
            return False
        return True

    def _stop(self, deceleration: float, at_once: bool = True) -> None:
        self._expires = math.inf
        self._work(stop_time(deceleration))
        self._arm.stop(deceleration, at_once)
        self._work(0.0)

    def _serve_program(self, message: bytes) -> None:
        number = 0
        try:
            request = decode_json(message)
            number, now = int(request["number"]), self._clock()
            sent = min(float(request["sent"]), now)  # what is said to come from later holds no longer
            age = now - sent
            if request["do"] != "stop" and not age <= self._request_lifetime:
                why = f"it was sent {age:.2f} s ago, and holds for {self._request_lifetime:g} s"
                why = f"it is void: {why}; this process was held up"
                self._reply(number, ok=False, stopped=False, void=True, why=why)
            elif not self._allowed:
                self._reply(number, ok=False, stopped=True, why="the guard does not let the arm move")
            elif request["do"] == "stop":
                self._stop_for_program(_stop_acceleration(request))
                self._arm.arriving = False
                self._answer_waiting(ok=False, stopped=False, why="the program itself has stopped the arm")
                self._reply(number, ok=True)
            else:
                self._carry_out(number, sent, request)
        except (ConeSkinError, ValueError, KeyError, TypeError, ArithmeticError) as exc:
            self._reply(number, ok=False, stopped=False, why=f"{type(exc).__name__}: {exc}")

    def _stop_for_program(self, deceleration: float) -> None:
        try:
            self._stop(deceleration, at_once=False)
        except ConeSkinError as exc:  # what was under way may go on, and nothing would let it expire
            self._forbid(f"a stop of the program has failed: {exc}")
            raise

    def _carry_out(self, number: int, sent: float, request: dict[str, Any]) -> None:
        """Do what the program asks for, and answer it now or at the end of the motion.

        What was under way expires as before until this was taken: a request that is refused must not renew it.
        """
        outcome = carry_out(self._arm, request, self._work, self._report_restart)
        if outcome.started:
            self._expires = sent + outcome.holds
            self._answer_waiting(ok=False, stopped=False, why="another motion of the program has replaced it")
        if outcome.waits:
            self._waiting.append(number)
        else:
            self._reply(number, ok=True, **outcome.answer)

    def _report_restart(self, over: bool) -> None:
        self._guard.send(StatusReport("restarted" if over else "restarts").encode())

    def _answer_waiting(self, **answer: Any) -> None:
        waiting, self._waiting = self._waiting, []
        for number in waiting:
            self._reply(number, **answer)

    def _reply(self, number: int, **answer: Any) -> None:
        self._program.send(encode_json({"number": number, **answer}))


def main(arguments: list[str]) -> int:
    """Run as ``python -m coneskin.robot.ur.driver_process``: take the channels, wait for the host, serve."""
    shorten_time_slice()
    lifeline, (guard, program) = inherit(arguments, parent=1)
    if (settings := first_message(program)) is None:
        return 1
    try:
        with Deadman(guard, program) as deadman, UrArm(settings["host"], settings["watchdog_hz"]) as arm:
            driver = _DriverProcess(
                arm,
                guard,
                program,
                on_end=deadman.end_soon,
                work=deadman.work,
                deceleration=settings["deceleration"],
                request_lifetime=settings["request_lifetime"],
            )
            signal.signal(signal.SIGTERM, lambda *_: driver.end())
            lifeline.hold()
            driver.run()
    except ConeSkinError as exc:
        guard.send(StatusReport("error", str(exc)).encode())
        program.send(encode_json({"number": 0, "ok": False, "stopped": False, "why": str(exc)}))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
