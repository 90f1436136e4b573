"""The arm through the ur_rtde wheel: the only file that imports it. It runs in the owner's process and nowhere else.

The wheel can block a call for 301 s, report success for what never ran, and end the process (docs/safety.md). So
nothing that must be safe waits for it: the guard watches measured joint speed and has other ways to stop.

What is avoided here, and why:

* synchronous moves: during one the wheel cannot deliver a stop. Moves are asynchronous and their progress is polled.
* asynchronous stops: they turn every later stopJ of the session into a stopL.
* stopJ on a speed or servo thread: the controller aborts the program. Each mode has its own stop.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import Enum
from typing import Any

from coneskin.errors import MissingExtra, RobotConnectionError, RobotRefused

__all__ = ["Mode", "UrArm"]


_START = 2.0  # s for the control program to start; ur_rtde itself allows 5
_REGISTER = 0.02  # s until a register that was written is surely read: ten control cycles


class Mode(Enum):
    """What moves the arm, as far as this process commanded it."""

    IDLE = "idle"
    MOVE = "move"
    SPEED = "speed"
    SERVO = "servo"


@contextmanager
def rtde_errors(doing: str) -> Iterator[None]:
    """The gate for the wheel's errors: it raises bare RuntimeError for everything.

    Raises:
        RobotConnectionError: the wheel raised while doing this.
    """
    try:
        yield
    except RuntimeError as exc:
        why = "another program controls the arm, a second coneskin perhaps" if "already in use" in str(exc) else exc
        raise RobotConnectionError(f"{doing}: {why}") from exc


class UrArm:
    """One arm through RTDEControlInterface; open it in a ``with``.

    Args:
        host: the controller.
        watchdog_hz: the controller stops the program when this process is silent for longer than 1 / watchdog_hz.

    Raises:
        MissingExtra: the wheel is not installed.
        RobotConnectionError: on entering, where the controller refuses.
    """

    def __init__(self, host: str, watchdog_hz: float) -> None:
        self.host = host
        self.mode = Mode.IDLE
        self._watchdog_hz = watchdog_hz
        self._control: Any = None

    def __enter__(self) -> UrArm:
        try:
            import rtde_control  # type: ignore[import-not-found,unused-ignore]
        except ImportError as exc:
            raise MissingExtra("ur-rtde", "moving a UR arm (wheels exist for Python 3.11 and 3.12)") from exc
        with rtde_errors(f"connecting ur_rtde to {self.host}"):
            self._control = rtde_control.RTDEControlInterface(self.host)
            if not self._control.setWatchdog(self._watchdog_hz):
                raise RobotRefused(f"the controller {self.host} did not accept a watchdog of {self._watchdog_hz:g} Hz")
        return self

    def __exit__(self, *_: object) -> None:
        if self._control is not None:
            control, self._control = self._control, None
            with rtde_errors(f"leaving {self.host}"):
                control.stopScript()
                control.disconnect()

    def kick(self) -> None:
        """Tell the controller's watchdog that this process is alive."""
        with rtde_errors("kicking the controller's watchdog"):
            if self._control.isProgramRunning():
                self._control.kickWatchdog()

    def revive(self) -> None:
        """Start the control program again where something else has ended it; the arm does not move by that.

        The register of the last command is still there, and a new program would execute it at once: after speedJ the
        arm would start by itself. So command 0 is written first: a kick without a program does nothing else.

        Raises:
            RobotRefused: the controller does not start it.
        """
        with rtde_errors("starting the control program again"):
            if self._control.isProgramRunning():
                return
            self.mode = Mode.IDLE
            self._control.kickWatchdog()
            time.sleep(_REGISTER)
            running = self._control.reuploadScript() and self._await_program(_START)
            if not (running and self._control.setWatchdog(self._watchdog_hz)):
                raise RobotRefused(f"the controller {self.host} does not start ur_rtde's program again")

    def _await_program(self, seconds: float) -> bool:
        """Wait for the control program to run: uploading it only sends it."""
        end = time.monotonic() + seconds
        while not self._control.isProgramRunning():
            if time.monotonic() > end:
                return False
            time.sleep(0.005)
        return True

    def move_j(self, q: Sequence[float], speed: float, acceleration: float) -> None:
        """Start a move in joint space to q [rad], with the leading joint's speed [rad/s] and acceleration [rad/s2].

        Raises:
            RobotRefused: the controller did not take it.
        """
        self._end_streaming(acceleration)
        self._started(self._control.moveJ(list(q), speed, acceleration, True), "moveJ", Mode.MOVE)

    def move_l(self, pose: Sequence[float], speed: float, acceleration: float) -> None:
        """Start a straight move of the tool to a pose (x, y, z [m], rotation vector [rad]), in m/s and m/s2.

        Raises:
            RobotRefused: the controller did not take it.
        """
        self._end_streaming(10.0)
        self._started(self._control.moveL(list(pose), speed, acceleration, True), "moveL", Mode.MOVE)

    def speed_j(self, qd: Sequence[float], acceleration: float) -> None:
        """Move the joints at these speeds [rad/s] until the next command; acceleration of the leading joint [rad/s2].

        Raises:
            RobotRefused: the controller did not take it.
        """
        if self.mode is Mode.MOVE:  # a speed thread beside a live move thread would abort the program
            self.stop(acceleration)
        # one cycle: without a time URScript's speedj returns when the speed is reached, and takes no new target before
        self._started(self._control.speedJ(list(qd), acceleration, 0.002), "speedJ", Mode.SPEED)

    def servo_j(self, q: Sequence[float], lookahead: float = 0.1, gain: float = 300.0) -> None:
        """Follow joint positions q [rad], one each control cycle.

        Raises:
            RobotRefused: the controller did not take it.
        """
        if self.mode is not Mode.SERVO:
            self.stop(2.0)
        self._started(self._control.servoJ(list(q), 0.0, 0.0, 0.002, lookahead, gain), "servoJ", Mode.SERVO)

    def moving(self) -> bool:
        """Whether a move that was started here is still running; False in the other modes."""
        if self.mode is not Mode.MOVE:
            return False
        with rtde_errors("asking for progress"):
            if self._control.getAsyncOperationProgressEx().isAsyncOperationRunning():
                return True
        self.mode = Mode.IDLE
        return False

    def stop(self, deceleration: float) -> None:
        """Stop what was started here, in the way that its mode needs, and wait until the wheel says so.

        Its return proves nothing: measured joint speed does. Args: deceleration of the leading joint [rad/s2].
        """
        mode, self.mode = self.mode, Mode.IDLE
        with rtde_errors("stopping"):
            if mode is Mode.SPEED:
                self._control.speedStop(deceleration)
            elif mode is Mode.SERVO:
                self._control.servoStop(deceleration)
            else:  # also when idle: a move may have been started by a call whose answer was lost
                self._control.stopJ(deceleration)

    def _end_streaming(self, deceleration: float) -> None:
        if self.mode is not Mode.IDLE:
            self.stop(deceleration)

    def _started(self, accepted: bool, name: str, mode: Mode) -> None:
        if not accepted:
            self.mode = Mode.IDLE
            raise RobotRefused(
                f"the controller {self.host} did not take {name}: its program is not running, "
                "or a protective stop holds the arm"
            )
        self.mode = mode
