"""The arm as a program sees it under guard: ur_rtde's motions, which raise when the guard has stopped them."""

from __future__ import annotations

import math
import select
from collections.abc import Callable, Sequence
from typing import Any

from .errors import KinematicsError, RobotConnectionError, RobotRefused
from .robot.channel import Channel
from .robot.owner_messages import decode_json, encode_json
from .robot.ur_models import ArmModel

__all__ = ["ArmProxy"]


class ArmProxy:
    """Moves the arm through the process that owns ur_rtde.

    Args:
        channel: to the owner.
        check: raises what has stopped the arm, if anything has; True tells it that something surely has.
        model: the arm, whose limits a target must keep.
    """

    def __init__(self, channel: Channel, check: Callable[[bool], None], model: ArmModel) -> None:
        self.channel = channel
        self._model = model
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
            KinematicsError: q is not six joint positions within the arm's limits.
        """
        self._do(do="move_j", q=self._joints(q), speed=speed, acceleration=acceleration, wait=wait)

    def move_l(self, pose: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, wait: bool = True) -> None:
        """Move the tool straight to a pose (x, y, z [m], rotation vector [rad]); as ``move_j``, in m/s and m/s2."""
        self._do(do="move_l", pose=_six(pose, "pose", "m and rad"), speed=speed, acceleration=acceleration, wait=wait)

    def speed_j(self, qd: Sequence[float], acceleration: float = 1.4) -> None:
        """Move the joints at these speeds [rad/s] until the next command; raises as ``move_j``."""
        self._do(do="speed_j", qd=_six(qd, "qd", "rad/s"), acceleration=acceleration)

    def servo_j(self, q: Sequence[float]) -> None:
        """Follow joint positions [rad], one each control cycle; raises as ``move_j``."""
        self._do(do="servo_j", q=self._joints(q))

    def stop(self, deceleration: float = 2.0) -> None:
        """Stop the motion of this program, with a deceleration of the leading joint [rad/s2]."""
        self._do(do="stop", acceleration=deceleration)

    def _joints(self, q: Sequence[float]) -> list[float]:
        joints = _six(q, "q", "rad")
        for number, (value, low, high) in enumerate(
            zip(joints, self._model.joint_lower, self._model.joint_upper, strict=True), 1
        ):
            if not low <= value <= high:
                hint = f"; {value:g} deg are {math.radians(value):.4f} rad" if abs(value) <= 363.0 else ""
                raise KinematicsError(
                    f"q[{number - 1}] must be within {low:.3f} to {high:.3f} rad, joint {number} of the "
                    f"{self._model.name}, got {value:g} rad{hint}"
                )
        return joints

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


def _six(values: Sequence[float], name: str, unit: str) -> list[float]:
    numbers = [float(value) for value in values]
    if len(numbers) != 6 or not all(map(math.isfinite, numbers)):
        raise KinematicsError(f"{name} must be 6 finite numbers [{unit}], got {numbers}")
    return numbers
