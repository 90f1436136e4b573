"""Request of the guarded program to the driver process: what it starts on the arm, and for how long that holds."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from coneskin.robot.driver.waypoint import Waypoint

from .ur_rtde import MIN_ACCELERATION, MOVE_L_DECELERATION, SERVO_DECELERATION, UrArm, stop_time

__all__ = ["carry_out", "stop_acceleration"]

_ANSWER_TIME = 0.5  # s for the controller to take a tool or a payload, or to answer a question
_PATH_TIME = 3.0  # s for the controller to start its program again with a path in it
_MAX_DURATION = 10.0  # s for which a speed or a position may hold


class _RequestOutcome(NamedTuple):
    """What a request has led to.

    Attributes:
        started: it has started a motion, which replaces the one before.
        holds: time after which what it has started is void [s], counted from when it was sent.
        waits: the program wants the answer at the end of the motion.
        answer: what else the answer says.
    """

    started: bool = False
    holds: float = math.inf
    waits: bool = False
    answer: dict[str, Any] = {}  # noqa: RUF012 (never changed)


def carry_out(
    arm: UrArm, request: dict[str, Any], work: Callable[[float], None], restart: Callable[[bool], None]
) -> _RequestOutcome:
    """Start what a program asks for, or answer it.

    Args:
        arm: that it moves.
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
            acceleration, straight = stop_acceleration(request), move in ("move_l", "move_l_fk")
            work(stop_time(MOVE_L_DECELERATION if straight else acceleration))  # it first ends what is under way
            target = request["q"] if move in ("move_j", "move_l_fk") else request["pose"]
            getattr(arm, move)(target, request["speed"], acceleration)
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
            duration, acceleration = _duration(request), stop_acceleration(request)
            work(stop_time(min(acceleration, MOVE_L_DECELERATION)))
            getattr(arm, move)(request["qd" if move == "speed_j" else "twist"], acceleration)
            return _RequestOutcome(True, holds=duration)
        case "servo_j" | "servo_l" as move:
            duration = _duration(request)
            work(stop_time(SERVO_DECELERATION))
            target = request["q" if move == "servo_j" else "pose"]
            getattr(arm, move)(target, float(request.get("lookahead", 0.1)), float(request.get("gain", 300.0)))
            return _RequestOutcome(True, holds=duration)
        case "wait":
            return _RequestOutcome(waits=arm.moving())
        case "progress":
            return _RequestOutcome(answer={"waypoint": arm.waypoint(), "mode": arm.mode.value})
    work(_ANSWER_TIME)
    match request["do"]:
        case "set_tcp":
            arm.set_tcp(request["pose"])
        case "set_payload":
            arm.set_payload(request["mass"], request["centre"])
        case "ask":
            return _RequestOutcome(answer={"value": arm.ask(request["what"], *request["values"])})
        case other:
            raise ValueError(f"the arm cannot {other!r}")
    return _RequestOutcome()


def stop_acceleration(request: dict[str, Any]) -> float:
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
