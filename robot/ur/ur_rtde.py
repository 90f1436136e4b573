"""Motions of a UR arm by the ur_rtde wheel. They run in the driver process and nowhere else.

The wheel can block a call for 301 s, report success for what never ran, and end the process (docs/safety.md). So no
stop depends on it: the guard monitors measured joint speed and has other stop paths.

What is avoided here, and why:

* synchronous moves: during one the wheel cannot deliver a stop. Moves are asynchronous and their progress is polled.
* asynchronous stops: they turn every later stopJ of the session into a stopL.
* stopJ on a speed or servo thread: the controller aborts the program. Each mode has its own stop.
* a path without a watchdog: the wheel writes it into its program and starts that anew, which forgets the watchdog.
* getForwardKinematics without a tool, which takes what an earlier command has left behind for one.

The only file that imports the wheel.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import Enum
from typing import Any

from coneskin.core.errors import ConeSkinError, MissingExtra, RobotConnectionError, RobotRefused
from coneskin.robot.driver.values import Waypoint

_START_TIMEOUT = 2.0  # s for the control program to start; ur_rtde itself allows 5
_REGISTER_DELAY = 0.02  # s, ten control cycles, until a register that was written has surely been read


@contextmanager
def _rtde_errors(doing: str) -> Iterator[None]:
    """Convert the wheel's errors: it raises bare RuntimeError for everything but values that it does not take.

    Raises:
        RobotConnectionError: the wheel raised while doing this.
        ValueError: what it was given for this is not within its limits.
    """
    try:
        yield
    except ValueError as exc:
        raise ValueError(f"{doing}: {exc}; speeds are in rad/s, of a straight move in m/s") from exc
    except RuntimeError as exc:
        if isinstance(exc, ConeSkinError):
            raise
        why = "another program controls the arm, a second coneskin perhaps" if "already in use" in str(exc) else exc
        raise RobotConnectionError(f"{doing}: {why}") from exc


MOVE_L_DECELERATION = 10.0  #: rad/s2, of the stop before a straight move
SERVO_DECELERATION = 2.0  #: rad/s2, of the stop before servo positions
STRAIGHT_MOVES = ("move_l", "move_l_fk")  #: kinds of a move on which the tool goes straight
MIN_ACCELERATION = 0.1  #: rad/s2 or m/s2
_STOP_MARGIN = 0.3  # s for a stop to begin and to be confirmed
_MAX_JOINT_SPEED = 3.5  # rad/s, of any joint; a stop takes this divided by the deceleration at most
_MIN_KICK_PERIOD = 0.02  # s; no load for the controller
_MAX_KICK_PERIOD = 0.04  # s; longer than from one heartbeat of the guard to the next, which wakes the driver as well
_NO_TOOL = [0.0, 0.0, 1e-12, 0.0, 0.0, 0.0]  # m and rad; the wheel sends a packet of a wrong size for exact zeros
_MAX_STOP_TIME = 3.0  # s; ur_rtde waiting longer for a stop counts as a hang, however gentle the stop is

#: questions to the controller that move nothing, by the wheel's names
QUESTION_WORDS = (
    *("getForwardKinematics", "getInverseKinematics", "getInverseKinematicsHasSolution", "poseTrans"),
    *("isPoseWithinSafetyLimits", "isJointsWithinSafetyLimits", "getTCPOffset", "getStepTime", "getJointTorques"),
    *("getTargetWaypoint", "getActualJointPositionsHistory", "getActualToolFlangePose", "getTargetJointAccelerations"),
    *("getJacobian", "getJacobianTimeDerivative", "getMassMatrix", "getCoriolisAndCentrifugalTorques"),
)


def wheel_remedy(python: tuple[int, ...] = sys.version_info[:2], system: str = "") -> str:
    """Return how a computer gets the wheel: by pip where there is one, and never by a build from C++ sources.

    Args:
        python: version of the interpreter.
        system: platform, as sysconfig names it; empty for this one.
    """
    from sysconfig import get_platform

    if python in ((3, 11), (3, 12)) and (system or get_platform()) in ("linux-x86_64", "win-amd64"):
        return "pip install ur-rtde"
    return (
        "it has wheels for Python 3.11 and 3.12 on x86-64 Linux and Windows only: take one of these, or let another "
        'program move the arm with control = "external" in [arm]'
    )


def stop_time(deceleration: float) -> float:
    """Return how long a stop with this deceleration [rad/s2] may keep ur_rtde busy [s]."""
    return min(_MAX_JOINT_SPEED / max(deceleration, MIN_ACCELERATION), _MAX_STOP_TIME) + _STOP_MARGIN


class Mode(Enum):
    """Kind of motion that this process has commanded."""

    IDLE = "idle"
    MOVE = "move"
    SPEED = "speed"
    SERVO = "servo"


_WHEEL_NAMES = {
    **{"move_j": "moveJ", "move_j_ik": "moveJ_IK", "move_l": "moveL", "move_l_fk": "moveL_FK"},
    **{"speed_j": "speedJ", "speed_l": "speedL", "servo_j": "servoJ", "servo_l": "servoL"},
    **{"set_tcp": "setTcp", "set_payload": "setPayload"},
}


class UrArm:
    """Arm behind RTDEControlInterface, which has a program of its own on the controller; open it in a ``with``.

    Args:
        watchdog_hz: the controller stops the program when this process is silent for longer than 1 / watchdog_hz.

    Attributes:
        mode: what it does.
        arriving: a move was started here, and has neither arrived nor been followed by another motion; without its mode
            something else has ended it.
        control: the wheel's RTDEControlInterface; None outside the ``with``.
        wheel: its module.
        kick_period: after which the controller's watchdog is to be kicked at the latest [s].

    Raises:
        MissingExtra: the wheel is not installed.
        RobotConnectionError: on entering, where the controller refuses.
    """

    def __init__(self, host: str, watchdog_hz: float) -> None:
        self.host = host
        self.mode = Mode.IDLE
        self.arriving = False
        self.control: Any = None
        self.wheel: Any = None
        self._watchdog_hz = watchdog_hz
        self.kick_period = min(max(0.2 / watchdog_hz, _MIN_KICK_PERIOD), _MAX_KICK_PERIOD)

    def __enter__(self) -> UrArm:
        try:
            import rtde_control  # type: ignore[import-not-found,unused-ignore]
        except ImportError as exc:
            raise MissingExtra("ur-rtde", "moving a UR arm", remedy=wheel_remedy()) from exc
        self.wheel = rtde_control
        with _rtde_errors(f"connecting ur_rtde to {self.host}"):
            self.control = rtde_control.RTDEControlInterface(self.host)
            if not self._set_watchdog():
                raise RobotRefused(f"the controller {self.host} did not accept a watchdog of {self._watchdog_hz:g} Hz")
        return self

    def __exit__(self, *_: object) -> None:
        if self.control is not None:
            control, self.control = self.control, None
            with _rtde_errors(f"disconnecting from {self.host}"):
                control.stopScript()
                control.disconnect()

    def _set_watchdog(self, silence: float = 0.0) -> bool:
        """Let the controller allow this silence [s], or that of ``watchdog_hz`` if it is longer; True where it does."""
        return bool(self.control.setWatchdog(min(self._watchdog_hz, 1.0 / silence) if silence else self._watchdog_hz))

    def kick(self) -> None:
        """Kick the controller's watchdog: this process is alive."""
        with _rtde_errors("kicking the controller's watchdog"):
            if self.control.isProgramRunning():
                self.control.kickWatchdog()

    def revive(self) -> None:
        """Start the control program again where something else has ended it; the arm does not move meanwhile.

        The register of the last command is still there, and a new program would execute it at once: after speedJ the
        arm would start by itself. So command 0 is written first: a kick without a program does nothing else.

        Raises:
            RobotRefused: the controller does not start it, or another program runs there and takes its place.
        """
        with _rtde_errors("starting the control program again"):
            asked = time.monotonic()
            if self.control.isProgramRunning() and self._set_watchdog():
                return  # the wheel may know of an end a state later: a program that takes a command runs
            if (waited := time.monotonic() - asked) > _START_TIMEOUT:  # whoever asked has long been told that it failed
                raise RobotRefused(
                    f"another program ran on {self.host}, and took no command for {waited:.1f} s: reset again"
                )
            self.mode = Mode.IDLE
            self.control.kickWatchdog()
            time.sleep(_REGISTER_DELAY)
            running = self.control.reuploadScript() and self._await_start()
            if not (running and self._set_watchdog()):
                raise RobotRefused(f"the controller {self.host} does not start ur_rtde's program again")

    def _await_start(self) -> bool:
        """Wait for the control program to run: uploading it only sends it."""
        end = time.monotonic() + _START_TIMEOUT
        while not self.control.isProgramRunning():
            if time.monotonic() > end:
                return False
            time.sleep(0.005)
        return True

    def move(self, kind: str, target: Sequence[float], speed: float, acceleration: float) -> None:
        """Start a move to joint positions [rad] or to a pose of the tool (x, y, z [m], rotation vector [rad]).

        Args:
            kind: "move_j" to positions and "move_j_ik" to a pose, in joint space; "move_l" to a pose and "move_l_fk" to
                positions, straight.
            speed: of the leading joint [rad/s], or of the tool [m/s] where it moves straight.
            acceleration: likewise [rad/s2] or [m/s2].

        Raises:
            RobotRefused: the controller did not take it.
        """
        if self.mode is not Mode.IDLE:
            self.stop(MOVE_L_DECELERATION if kind in STRAIGHT_MOVES else acceleration, at_once=False)
        self._start(kind, Mode.MOVE, list(target), speed, acceleration, True)

    def move_path(self, waypoints: Sequence[Waypoint]) -> None:
        """Start a move along way points. It takes some 0.1 s before the arm moves, in which nothing can be stopped.

        Raises:
            RobotRefused: the controller did not take it.
            ValueError: a speed, an acceleration or a blend is not within the wheel's limits.
        """
        if self.mode is not Mode.IDLE:
            self.stop(MOVE_L_DECELERATION, at_once=False)
        entry, path = self.wheel.PathEntry, self.wheel.Path()
        for point in waypoints:
            kind = {"j": entry.MoveJ, "l": entry.MoveL, "p": entry.MoveP}[point.kind]
            position = entry.PositionJoints if point.joints else entry.PositionTcpPose
            values = [*point.target, point.speed, point.acceleration, point.blend]
            path.addEntry(entry(kind, position, values))
        with _rtde_errors("movePath"):
            self._started(self.control.movePath(path, True), "movePath", Mode.MOVE)
            if not self._set_watchdog():
                self.stop(MOVE_L_DECELERATION)
                raise RobotRefused(f"the controller {self.host} did not take the watchdog of a path: it was stopped")

    def set(self, kind: str, *values: object) -> None:
        """Set the tool or the payload; nothing may move.

        Args:
            kind: "set_tcp": pose of the tool in the flange's frame (x, y, z [m], rotation vector [rad]); or
                "set_payload": mass [kg], and its centre in the flange's frame [m].

        Raises:
            RobotRefused: the arm is being moved, or the controller did not take it.
        """
        name = _WHEEL_NAMES[kind]
        self._stand_for(name)
        with _rtde_errors(name):
            accepted = getattr(self.control, name)(*values)
        if not accepted:
            raise RobotRefused(f"the controller {self.host} did not take {name}{values}")

    def speed(self, kind: str, target: Sequence[float], acceleration: float) -> None:
        """Move at these speeds until the next command.

        Args:
            kind: "speed_j" for speeds of the joints [rad/s], "speed_l" for a velocity of the tool [m/s, rad/s].
            acceleration: of the leading joint [rad/s2], or of the tool [m/s2].

        Raises:
            RobotRefused: the controller did not take it.
        """
        if self.mode not in (Mode.IDLE, Mode.SPEED):  # a speed thread beside another live thread aborts the program
            self.stop(acceleration if kind == "speed_j" else MOVE_L_DECELERATION, at_once=False)
        # one cycle: without a time URScript's speedj returns when the speed is reached, and takes no new target before
        self._start(kind, Mode.SPEED, list(target), acceleration, 0.002)

    def servo(self, kind: str, target: Sequence[float], lookahead: float, gain: float) -> None:
        """Follow joint positions [rad] ("servo_j") or poses of the tool ("servo_l"), one each control cycle.

        Raises:
            RobotRefused: the controller did not take it.
        """
        if self.mode is not Mode.SERVO:
            self.stop(SERVO_DECELERATION, at_once=False)
        self._start(kind, Mode.SERVO, list(target), 0.0, 0.0, 0.002, lookahead, gain)

    def moving(self) -> bool:
        """Tell whether a move that was started here still runs; False in the other modes."""
        return self.waypoint() is not None

    def waypoint(self) -> int | None:
        """Return the number of the way point to which a move goes, from 0; None where no move runs."""
        if self.mode is not Mode.MOVE:
            return None
        with _rtde_errors("asking for progress"):
            status = self.control.getAsyncOperationProgressEx()
            ended = not self.control.isProgramRunning()  # by somebody else, and the move with it
            if status.isAsyncOperationRunning() and not ended:
                return int(status.progress())
        self.mode, self.arriving = Mode.IDLE, ended
        return None

    def ask(self, name: str, *values: object) -> object:
        """Return the answer of the controller to a question that moves nothing; nothing may move meanwhile.

        Args:
            name: of the wheel's method, one of ``QUESTION_WORDS``.

        Raises:
            RobotRefused: the arm is being moved, or this is no such question.
        """
        if name not in QUESTION_WORDS:
            known = ", ".join(QUESTION_WORDS)
            raise RobotRefused(f"{name} is not a question that the arm's driver answers; known: {known}")
        self._stand_for(name)
        with _rtde_errors(name):
            if name == "getForwardKinematics" and values:
                tool = list(values[1]) if len(values) > 1 else self.control.getTCPOffset()  # type: ignore[call-overload]
                values = (values[0], tool if any(tool) else _NO_TOOL)
            return getattr(self.control, name)(*values)

    def stop(self, deceleration: float, at_once: bool = True) -> None:
        """Stop what was started here, by the stop of its mode, and wait until the wheel returns.

        The return proves nothing: measured joint speed does. During the call nothing kicks the controller's watchdog,
        which ends the program where the stop takes longer than 1 / watchdog_hz.

        Args:
            deceleration: of the leading joint [rad/s2]; after ``speed_l`` and ``servo_l`` of the tool [m/s2].
            at_once: False where some milliseconds do not matter, but the program shall go on: they go into a watchdog
                that is as long as the stop may take.
        """
        mode, self.mode = self.mode, Mode.IDLE
        patient = not at_once and mode is not Mode.IDLE
        with _rtde_errors("stopping"):
            if patient:
                self._set_watchdog(stop_time(deceleration))
            if mode is Mode.SPEED:
                self.control.speedStop(deceleration)
            elif mode is Mode.SERVO:
                self.control.servoStop(deceleration)
            else:  # also when idle: a move may have been started by a call whose answer was lost
                self.control.stopJ(deceleration)
            if patient:
                self._set_watchdog()

    def _stand_for(self, name: str) -> None:
        """Refuse a call while something moves: one that waited would keep a stop waiting as well."""
        if self.moving() or self.mode is not Mode.IDLE:
            raise RobotRefused(f"{name} must wait until the arm has arrived or was stopped: call stop first")

    def _start(self, kind: str, mode: Mode, *values: object) -> None:
        """Start a motion by the wheel's method of that kind."""
        name = _WHEEL_NAMES[kind]
        with _rtde_errors(name):
            self._started(getattr(self.control, name)(*values), name, mode)

    def _started(self, accepted: bool, name: str, mode: Mode) -> None:
        if not accepted:
            self.mode = Mode.IDLE
            raise RobotRefused(
                f"the controller {self.host} did not take {name}: its program is not running, "
                "or a protective stop holds the arm"
            )
        self.mode, self.arriving = mode, mode is Mode.MOVE
