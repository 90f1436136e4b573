"""Calls of ur_rtde as coneskin's own arm answers them, with the arguments and results that they have there.

What moves raises ``Collision`` after a touch, where the wheel's method returned False or nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from datetime import timedelta
from typing import Any, NamedTuple

from coneskin.robot.driver.waypoint import Waypoint

from .arm_client import ArmClient

__all__ = ["UrRtdeMethod"]

HOLD = 0.5  #: s for which a speed holds at least; a program of ur_rtde may rely on its lasting until speedStop
SERVO_HOLD = 0.1  #: s for which a position holds at least
STEADY = 1e-3  #: rad/s
_PERIOD = 0.002  # s, of the controller


class UrRtdeMethod(NamedTuple):
    """One method of ur_rtde on the arm.

    Attributes:
        call: takes the arm and then the method's own arguments.
        own: what coneskin calls it, for programs that are written anew.
        note: how it differs; empty where it does not.
    """

    call: Callable[..., Any]
    own: str
    note: str = ""


# ---- moves


def move_j(
    arm: ArmClient, q: Sequence[Any], speed: float = 1.05, acceleration: float = 1.4, asynchronous: bool = False
) -> bool:
    """Move in joint space to positions [rad], in rad/s and rad/s2, or along a path of them."""
    if _is_path(q):
        return _path(arm, [Waypoint.move_j(p[:6], *p[6:]) for p in q], asynchronous or speed is True)
    arm.move_j(q, speed, acceleration, wait=not asynchronous)
    return True


def move_l(
    arm: ArmClient, pose: Sequence[Any], speed: float = 0.25, acceleration: float = 1.2, asynchronous: bool = False
) -> bool:
    """Move the tool straight to a pose [m, rad], in m/s and m/s2, or along a path of them."""
    if _is_path(pose):
        return _path(arm, [Waypoint.move_l(p[:6], *p[6:]) for p in pose], asynchronous or speed is True)
    arm.move_l(pose, speed, acceleration, wait=not asynchronous)
    return True


def move_j_ik(
    arm: ArmClient, pose: Sequence[float], speed: float = 1.05, acceleration: float = 1.4, asynchronous: bool = False
) -> bool:
    """Move in joint space to a pose of the tool [m, rad]; speed and acceleration as of ``move_j``."""
    arm.move_j_ik(pose, speed, acceleration, wait=not asynchronous)
    return True


def move_l_fk(
    arm: ArmClient, q: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, asynchronous: bool = False
) -> bool:
    """Move the tool straight to where it is at joint positions [rad]; speed and acceleration as of ``move_l``."""
    arm.move_l_fk(q, speed, acceleration, wait=not asynchronous)
    return True


def _is_path(values: Sequence[Any]) -> bool:
    return len(values) > 0 and isinstance(values[0], Sequence)


def _path(arm: ArmClient, waypoints: Sequence[Waypoint], asynchronous: bool = False) -> bool:
    arm.move_path(waypoints, wait=not asynchronous)
    return True


def speed_j(arm: ArmClient, qd: Sequence[float], acceleration: float = 0.5, time: float = 0.0) -> bool:
    """Move the joints at these speeds [rad/s] for the time [s], or for ``HOLD`` if that is longer."""
    arm.speed_j(qd, acceleration, max(time, HOLD))
    return True


def speed_l(arm: ArmClient, xd: Sequence[float], acceleration: float = 0.25, time: float = 0.0) -> bool:
    """Move the tool at this velocity [m/s, rad/s] for the time [s], or for ``HOLD`` if that is longer."""
    arm.speed_l(xd, acceleration, max(time, HOLD))
    return True


def servo_j(
    arm: ArmClient, q: Sequence[float], _speed: float, _acceleration: float, time: float, lookahead: float, gain: float
) -> bool:
    """Follow joint positions [rad] for the time [s], or for ``SERVO_HOLD`` if that is longer."""
    arm.servo_j(q, max(time, SERVO_HOLD), lookahead, gain)
    return True


def servo_l(
    arm: ArmClient,
    pose: Sequence[float],
    _speed: float,
    _acceleration: float,
    time: float,
    lookahead: float,
    gain: float,
) -> bool:
    """Follow poses of the tool [m, rad] for the time [s], or for ``SERVO_HOLD`` if that is longer."""
    arm.servo_l(pose, max(time, SERVO_HOLD), lookahead, gain)
    return True


def stop(arm: ArmClient, a: float = 10.0, asynchronous: bool = False) -> bool:  # noqa: ARG001
    """Stop the arm with a deceleration [rad/s2, or m/s2 of the tool]."""
    arm.stop(a)
    return True


def stop_j(arm: ArmClient, a: float = 2.0, asynchronous: bool = False) -> None:  # noqa: ARG001
    """Stop the arm with a deceleration [rad/s2]; this method of ur_rtde returns nothing."""
    arm.stop(a)


def progress(arm: ArmClient) -> int:
    """Return the number of the way point to which a move goes, from 0; -1 where none runs."""
    waypoint = arm.progress()
    return -1 if waypoint is None else waypoint


class AsyncOperationStatus(NamedTuple):
    """Answer of getAsyncOperationProgressEx: the way point to which a move goes; None where no move runs."""

    waypoint: int | None

    def isAsyncOperationRunning(self) -> bool:
        """Tell whether a move runs."""
        return self.waypoint is not None

    def progress(self) -> int:
        """Return the number of the way point, from 0."""
        return self.waypoint or 0


# ---- set, ask, read


def set_tcp(arm: ArmClient, pose: Sequence[float]) -> bool:
    """Set the pose of the tool in the flange's frame [m, rad]."""
    arm.set_tcp(pose)
    return True


def set_payload(arm: ArmClient, mass: float, cog: Sequence[float] = (0.0, 0.0, 0.0)) -> bool:
    """Set what the arm carries: mass [kg] and its centre in the flange's frame [m]."""
    arm.set_payload(mass, cog)
    return True


def ask(name: str) -> UrRtdeMethod:
    """Return the method that asks the controller a question which moves nothing."""
    return UrRtdeMethod(lambda arm, *values: arm.ask(name, *values), f'ask("{name}", ...)', "while the arm stands")


def read(variable: str) -> UrRtdeMethod:
    """Return the method that reads a variable of the controller's states."""

    def read(arm: ArmClient) -> Any:
        value = arm.states.value(variable)
        return list(value) if isinstance(value, tuple) else value

    return UrRtdeMethod(read, f'states.value("{variable}")')


def is_steady(arm: ArmClient) -> bool:
    """Tell whether no joint is faster than ``STEADY``."""
    return arm.states.reading().speed < STEADY


def bit(variable: str) -> Callable[[ArmClient, int], bool]:
    """Return a function that tells whether a bit of a variable is set."""
    return lambda arm, n: bool(arm.states.value(variable) >> n & 1)


def set_digital(group: str) -> UrRtdeMethod:
    """Return the method that switches the digital outputs of a group."""

    def switch(arm: ArmClient, number: int, on: bool) -> bool:
        arm.outputs.set_digital(number, on, group)
        return True

    return UrRtdeMethod(switch, f'outputs.set_digital(..., "{group}")')


def set_analog(kind: str) -> UrRtdeMethod:
    """Return the method that sets analog outputs of a kind, as ratios from 0 to 1."""

    def set_ratio(arm: ArmClient, number: int, ratio: float) -> bool:
        arm.outputs.set_analog(number, ratio, kind)
        return True

    return UrRtdeMethod(set_ratio, f'outputs.set_analog(..., "{kind}")')


def set_register(arm: ArmClient, number: int, value: int) -> bool:
    """Write a whole number into an input register."""
    arm.outputs.set_register(number, int(value))
    return True


def set_double(arm: ArmClient, number: int, value: float) -> bool:
    """Write a number into an input register."""
    arm.outputs.set_register(number, float(value))
    return True


def init_period(_: ArmClient) -> timedelta:
    """Return when a period begins, for ``wait_period``."""
    return timedelta(seconds=time.monotonic())


def wait_period(_: ArmClient, t_cycle_start: timedelta) -> None:
    """Wait until a control cycle of 2 ms is over since its beginning."""
    time.sleep(max(0.0, t_cycle_start.total_seconds() + _PERIOD - time.monotonic()))
