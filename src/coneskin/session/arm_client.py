"""Arm client: the arm of a guarded program, whose motions raise when the guard has stopped them."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

from coneskin.core.channel import Channel, decode_json, encode_json, wait_readable
from coneskin.core.errors import KinematicsError, RobotConnectionError, RobotRefused
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.driver.protocol import OutputWriter, ProgramDriver, VariableReader, load_driver, require
from coneskin.robot.driver.values import Waypoint

_MAX_ATTEMPTS = 10  # at one request, where this computer held it up until it was void
_ANSWER_PERIOD = 0.05  # s between two looks at what else may have ended a wait


class _ArmRequests:
    """Requests to one driver process; ``check`` as of ``ArmClient``."""

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

        One that a busy computer held up until it was void is sent once more: whoever asked still waits.
        """
        for _ in range(_MAX_ATTEMPTS):
            answer = self._do(request)
            if not answer.get("void"):
                break
        if not answer["ok"]:
            if answer["stopped"]:
                self.check(True)
            raise RobotRefused(f"{request['do']}: {answer['why']}")
        self.check(False)
        return answer

    def _do(self, request: dict[str, Any]) -> dict[str, Any]:
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
            return self._await(number)
        finally:
            with self._state:
                self._asked.discard(number)
                self._answers.pop(number, None)

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
                        self._state.wait(_ANSWER_PERIOD)
            self.check(False)
            if self.channel.closed and number not in self._answers:
                raise RobotConnectionError("the driver process has ended")

    def _read(self) -> None:
        """Wait a while for answers, and keep those that somebody waits for."""
        if self.channel.closed:
            return
        wait_readable([self.channel], _ANSWER_PERIOD)
        for message in self.channel.receive():
            answer = decode_json(message)
            with self._state:
                if answer["number"] == 0 or answer["number"] in self._asked:
                    self._answers[answer["number"]] = answer


class _ArmOutputs:
    """Digital and analog outputs, and the registers for users.

    After a touch a gripper must not go on either: whatever is set here is refused until a person has reset the guard.
    """

    def __init__(self, writer: OutputWriter, check: Callable[[bool], None]) -> None:
        self._writer = writer
        self._check = check

    def set_digital(self, number: int, on: bool, group: str = "standard") -> None:
        """Switch a digital output.

        Args:
            number: from 0.
            on: True for high.
            group: "standard", "configurable" or "tool".

        Raises:
            Collision: the skin was touched.
            RobotRefused: the guard has stopped the arm, or another client has taken the outputs.
            RobotConnectionError, RobotTimeout: the controller is gone.
            ValueError: there is no such output.
        """
        self._check(False)
        self._writer.set_digital(group, number, on)

    def set_analog(self, number: int, ratio: float, kind: str = "voltage") -> None:
        """Set an analog output, 0 or 1, "voltage" or "current", to a ratio of its range, 0 to 1; as ``set_digital``."""
        self._check(False)
        self._writer.set_analog(number, ratio, kind)

    def set_register(self, number: int, value: int | float) -> None:
        """Write an input register that programs on the controller read; all else as ``set_digital``.

        Args:
            number: 18 to 22 or 42 to 46.
            value: an int for the register of integers, a float for that of floats.
        """
        self._check(False)
        self._writer.set_register(number, value)

    def close(self) -> None:
        """Close the connection; may be called again."""
        self._writer.close()


class ArmClient:
    """Client of the driver process, which moves the arm. Each of its motions raises what the guard has stopped.

    Args:
        channel: to the driver.
        check: raises what has stopped the arm, if anything has; its argument is True where something certainly has.
        model: the arm, whose joint limits a target must keep.
        host: its controller, for states and outputs.
    """

    def __init__(self, channel: Channel, check: Callable[[bool], None], model: ArmModel, host: str) -> None:
        self._requests = _ArmRequests(channel, check)
        self._do = self._requests.do
        self._model = model
        self._host = host

    @cached_property
    def states(self) -> VariableReader:
        """What the controller says of the arm, over a connection of its own that the first use opens.

        Raises:
            RobotConnectionError, RobotTimeout: it cannot be opened.
        """
        return require(load_driver(self._model.driver), ProgramDriver).variable_reader(self._host).__enter__()

    @cached_property
    def outputs(self) -> _ArmOutputs:
        """Outputs of the controller, over a connection of their own that the first use opens.

        Raises:
            RobotConnectionError, RobotTimeout: it cannot be opened.
        """
        return _ArmOutputs(
            require(load_driver(self._model.driver), ProgramDriver).output_writer(self._host).__enter__(),
            self._requests.check,
        )

    @property
    def connected(self) -> bool:
        """Whether the driver process, which moves the arm, can still be reached."""
        return not self._requests.channel.hung_up()

    def close(self) -> None:
        """Close the connections for states and outputs; may be called again."""
        for name in ("states", "outputs"):
            if name in self.__dict__:
                self.__dict__[name].close()

    # ---- moves

    def move_j(self, q: Sequence[float], speed: float = 1.05, acceleration: float = 1.4, wait: bool = True) -> None:
        """Move in joint space to q [rad], with speed [rad/s] and acceleration [rad/s2] of the leading joint.

        Args:
            wait: return when the arm is there; otherwise at once.

        Raises:
            Collision: the skin was touched.
            RobotRefused: the guard or the controller does not let the arm move.
            KinematicsError: q is not a joint position for each joint, within the arm's limits.
        """
        self._do(do="move_j", q=self._joints(q), speed=speed, acceleration=acceleration, wait=wait)

    def move_l(self, pose: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, wait: bool = True) -> None:
        """Move the tool straight to a pose (x, y, z [m], rotation vector [rad]); as ``move_j``, in m/s and m/s2."""
        self._do(do="move_l", pose=_six(pose, "pose", "m and rad"), speed=speed, acceleration=acceleration, wait=wait)

    def move_j_ik(
        self, pose: Sequence[float], speed: float = 1.05, acceleration: float = 1.4, wait: bool = True
    ) -> None:
        """Move in joint space to a pose of the tool (x, y, z [m], rotation vector [rad]); all else as ``move_j``."""
        self._do(
            do="move_j_ik", pose=_six(pose, "pose", "m and rad"), speed=speed, acceleration=acceleration, wait=wait
        )

    def move_l_fk(self, q: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, wait: bool = True) -> None:
        """Move the tool straight to where it is at joint positions q [rad]; all else as ``move_l``."""
        self._do(do="move_l_fk", q=self._joints(q), speed=speed, acceleration=acceleration, wait=wait)

    def move_path(self, waypoints: Sequence[Waypoint], wait: bool = True) -> None:
        """Move along way points, and past those that have a blend without a stop; ``progress`` says where it is.

        The controller needs some 0.1 s to take a path, and the arm stands meanwhile. The blend of the last way point
        has no meaning: the arm stops there.

        Args:
            waypoints: one or more.
            wait: return when the arm is at the last one; otherwise as soon as it moves.

        Raises:
            Collision, RobotRefused, KinematicsError: as ``move_j``.
        """
        points = [self._waypoint(number, point) for number, point in enumerate(waypoints)]
        if not points:
            raise KinematicsError("a path needs at least one way point")
        points[-1] = points[-1]._replace(blend=0.0)
        self._do(do="move_path", waypoints=points, wait=wait)

    def wait(self) -> None:
        """Wait for the end of the move under way; return at once where none is.

        Raises:
            Collision, RobotRefused: as ``move_j``; also where the program has stopped or replaced the move meanwhile.
        """
        self._do(do="wait")

    def progress(self) -> int | None:
        """Return the number of the way point to which the arm moves, from 0; 0 in a single move, None in no move.

        Raises:
            Collision, RobotRefused: as ``move_j``.
        """
        waypoint = self._do(do="progress")["waypoint"]
        return None if waypoint is None else int(waypoint)

    # ---- motions that the program has to renew

    def speed_j(self, qd: Sequence[float], acceleration: float = 1.4, duration: float = 0.5) -> None:
        """Move the joints at these speeds until the next command, for ``duration`` at most: then the arm is stopped.

        Args:
            qd: joint speeds [rad/s].
            acceleration: of the leading joint [rad/s2].
            duration: for which the speeds hold [s], up to 10; a program that hangs moves the arm no longer than that.

        Raises:
            Collision, RobotRefused, KinematicsError: as ``move_j``.
        """
        speeds = _six(qd, "qd", "rad/s")
        self._do(do="speed_j", qd=speeds, acceleration=acceleration, duration=duration)

    def speed_l(self, twist: Sequence[float], acceleration: float = 0.25, duration: float = 0.5) -> None:
        """Move the tool at a velocity (m/s, rad/s) with an acceleration [m/s2]; all else as ``speed_j``."""
        self._do(
            do="speed_l", twist=_six(twist, "twist", "m/s and rad/s"), acceleration=acceleration, duration=duration
        )

    def servo_j(self, q: Sequence[float], duration: float = 0.1, lookahead: float = 0.1, gain: float = 300.0) -> None:
        """Follow joint positions [rad], one each control cycle; without a next one for ``duration`` the arm is stopped.

        Args:
            q: joint positions [rad].
            duration: for which the position holds [s], up to 10.
            lookahead: time over which the controller smooths the way [s], 0.03 to 0.2.
            gain: with which it follows, 100 to 2000.

        Raises:
            Collision, RobotRefused, KinematicsError: as ``move_j``.
        """
        self._do(do="servo_j", q=self._joints(q), duration=duration, lookahead=lookahead, gain=gain)

    def servo_l(
        self, pose: Sequence[float], duration: float = 0.1, lookahead: float = 0.1, gain: float = 300.0
    ) -> None:
        """Follow poses of the tool (x, y, z [m], rotation vector [rad]); all else as ``servo_j``."""
        target = _six(pose, "pose", "m and rad")
        self._do(do="servo_l", pose=target, duration=duration, lookahead=lookahead, gain=gain)

    def stop(self, deceleration: float = 2.0) -> None:
        """Stop the motion of this program, with a deceleration of the leading joint [rad/s2]."""
        self._do(do="stop", acceleration=deceleration)

    # ---- while the arm stands

    def set_tcp(self, pose: Sequence[float]) -> None:
        """Set the pose of the tool in the flange's frame (x, y, z [m], rotation vector [rad]) while the arm stands.

        Raises:
            RobotRefused: the arm moves, or the guard or the controller does not let it be set.
        """
        self._do(do="set_tcp", pose=_six(pose, "pose", "m and rad"))

    def set_payload(self, mass: float, centre: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        """Set what the arm carries while it stands: mass [kg], and centre of gravity in the flange's frame [m].

        Raises:
            RobotRefused: as ``set_tcp``.
            KinematicsError: the mass is negative, or a number is not finite.
        """
        numbers = [float(mass), *map(float, centre)]
        if len(numbers) != 4 or not all(map(math.isfinite, numbers)) or numbers[0] < 0.0:
            raise KinematicsError(
                f"a payload is a mass from 0 kg on and a centre of 3 numbers [m], got {mass}, {centre}"
            )
        self._do(do="set_payload", mass=numbers[0], centre=numbers[1:])

    def ask(self, name: str, *values: Any) -> Any:
        """Return the controller's answer to a question that moves nothing, such as its inverse kinematics.

        Args:
            name: of the question, as ur_rtde names it; docs/do/ur-rtde.md lists them.
            values: its arguments there.

        Raises:
            RobotRefused: the arm moves, there is no such question, or as ``move_j``.
        """
        return self._do(do="ask", what=name, values=list(values))["value"]

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

    def _waypoint(self, number: int, point: Waypoint) -> Waypoint:
        where = f"the target of way point {number}"
        target = self._joints(point.target) if point.joints else _six(point.target, where, "m and rad")
        numbers = (point.speed, point.acceleration, point.blend)
        if not all(map(math.isfinite, numbers)) or min(point.speed, point.acceleration) <= 0.0 or point.blend < 0.0:
            raise KinematicsError(
                f"way point {number} needs a speed and an acceleration above 0 and a blend [m] from 0 on, got {numbers}"
            )
        return point._replace(target=tuple(target))


def _six(values: Sequence[float], name: str, unit: str) -> list[float]:
    numbers = [float(value) for value in values]
    if len(numbers) != 6 or not all(map(math.isfinite, numbers)):
        raise KinematicsError(f"{name} must be 6 finite numbers [{unit}], got {numbers}")
    return numbers
