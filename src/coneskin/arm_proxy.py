"""The arm as a program sees it under guard: ur_rtde's motions, which raise when the guard has stopped them."""

from __future__ import annotations

import select
from collections.abc import Callable, Sequence
from typing import Any

from .errors import RobotConnectionError, RobotRefused
from .robot.channel import Channel
from .robot.owner_messages import decode_json, encode_json

__all__ = ["ArmProxy"]


class ArmProxy:
    """Moves the arm through the process that owns ur_rtde.

    Args:
        channel: to the owner.
        check: raises what has stopped the arm, if anything has; True tells it that something surely has.
    """

    def __init__(self, channel: Channel, check: Callable[[bool], None]) -> None:
        self.channel = channel
        self._check = check
        self._waiting = False

    def move_j(self, q: Sequence[float], speed: float = 1.05, acceleration: float = 1.4, wait: bool = True) -> None:
        """Move in joint space to q [rad], with speed [rad/s] and acceleration [rad/s2] of the leading joint.

        Args:
            q: six joint positions [rad].
            speed: of the leading joint [rad/s].
            acceleration: of the leading joint [rad/s2].
            wait: return when the arm is there; otherwise at once.

        Raises:
            Collision: the skin was touched.
            RobotRefused: the guard or the controller does not let the arm move.
        """
        self._do(do="move_j", q=[float(x) for x in q], speed=speed, acceleration=acceleration, wait=wait)

    def move_l(self, pose: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, wait: bool = True) -> None:
        """Move the tool straight to a pose (x, y, z [m], rotation vector [rad]); as ``move_j``, in m/s and m/s2."""
        self._do(do="move_l", pose=[float(x) for x in pose], speed=speed, acceleration=acceleration, wait=wait)

    def speed_j(self, qd: Sequence[float], acceleration: float = 1.4) -> None:
        """Move the joints at these speeds [rad/s] until the next command; raises as ``move_j``."""
        self._do(do="speed_j", qd=[float(x) for x in qd], acceleration=acceleration)

    def servo_j(self, q: Sequence[float]) -> None:
        """Follow joint positions [rad], one each control cycle; raises as ``move_j``."""
        self._do(do="servo_j", q=[float(x) for x in q])

    def stop(self, deceleration: float = 2.0) -> None:
        """Stop the motion of this program, with a deceleration of the leading joint [rad/s2]."""
        self._do(do="stop", acceleration=deceleration)

    def _do(self, **request: Any) -> None:
        self._check(False)
        self.channel.receive()  # an answer that nobody waited for any more
        self.channel.send(encode_json(request))
        while True:
            select.select([self.channel], [], [], 0.05)
            for message in self.channel.receive():
                answer = decode_json(message)
                if answer["ok"]:
                    self._check(False)
                    return
                if answer["stopped"]:
                    self._check(True)
                raise RobotRefused(f"{request['do']}: {answer['why']}")
            self._check(False)
            if self.channel.closed:
                raise RobotConnectionError("the process that owns ur_rtde has ended")
