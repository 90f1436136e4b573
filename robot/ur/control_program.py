"""Control program of the ur_rtde wheel on the controller: started, kept alive, started again.

The only file that imports the wheel.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from coneskin.core.errors import MissingExtra, RobotConnectionError, RobotRefused

__all__ = ["ControlProgram", "rtde_errors"]

_START_TIMEOUT = 2.0  # s for the control program to start; ur_rtde itself allows 5
_REGISTER_DELAY = 0.02  # s, ten control cycles, until a register that was written has surely been read


@contextmanager
def rtde_errors(doing: str) -> Iterator[None]:
    """Convert the wheel's errors: it raises bare RuntimeError for everything.

    Raises:
        RobotConnectionError: the wheel raised while doing this.
    """
    try:
        yield
    except RuntimeError as exc:
        why = "another program controls the arm, a second coneskin perhaps" if "already in use" in str(exc) else exc
        raise RobotConnectionError(f"{doing}: {why}") from exc


class ControlProgram:
    """Program by which RTDEControlInterface moves the arm; open it in a ``with``.

    Args:
        host: the controller.
        watchdog_hz: the controller stops the program when this process is silent for longer than 1 / watchdog_hz.

    Attributes:
        control: the wheel's RTDEControlInterface; None outside the ``with``.
        wheel: its module.

    Raises:
        MissingExtra: the wheel is not installed.
        RobotConnectionError: on entering, where the controller refuses.
    """

    def __init__(self, host: str, watchdog_hz: float) -> None:
        self.host = host
        self.control: Any = None
        self.wheel: Any = None
        self._watchdog_hz = watchdog_hz

    def __enter__(self) -> ControlProgram:
        try:
            import rtde_control  # type: ignore[import-not-found,unused-ignore]
        except ImportError as exc:
            raise MissingExtra("ur-rtde", "moving a UR arm (wheels exist for Python 3.11 and 3.12)") from exc
        self.wheel = rtde_control
        with rtde_errors(f"connecting ur_rtde to {self.host}"):
            self.control = rtde_control.RTDEControlInterface(self.host)
            if not self.set_watchdog():
                raise RobotRefused(f"the controller {self.host} did not accept a watchdog of {self._watchdog_hz:g} Hz")
        return self

    def __exit__(self, *_: object) -> None:
        if self.control is not None:
            control, self.control = self.control, None
            with rtde_errors(f"disconnecting from {self.host}"):
                control.stopScript()
                control.disconnect()

    @property
    def runs(self) -> bool:
        """True while the controller runs it."""
        return bool(self.control.isProgramRunning())

    def set_watchdog(self, silence: float = 0.0) -> bool:
        """Let the controller allow this silence [s], or that of ``watchdog_hz`` if it is longer; True where it does."""
        return bool(self.control.setWatchdog(min(self._watchdog_hz, 1.0 / silence) if silence else self._watchdog_hz))

    def kick(self) -> None:
        """Kick the controller's watchdog: this process is alive."""
        with rtde_errors("kicking the controller's watchdog"):
            if self.runs:
                self.control.kickWatchdog()

    def restart(self) -> None:
        """Start it again where something else has ended it; the arm does not move meanwhile.

        The register of the last command is still there, and a new program would execute it at once: after speedJ the
        arm would start by itself. So command 0 is written first: a kick without a program does nothing else.

        Raises:
            RobotRefused: the controller does not start it.
        """
        self.control.kickWatchdog()
        time.sleep(_REGISTER_DELAY)
        running = self.control.reuploadScript() and self._await_start()
        if not (running and self.set_watchdog()):
            raise RobotRefused(f"the controller {self.host} does not start ur_rtde's program again")

    def _await_start(self) -> bool:
        """Wait for it to run: uploading it only sends it."""
        end = time.monotonic() + _START_TIMEOUT
        while not self.runs:
            if time.monotonic() > end:
                return False
            time.sleep(0.005)
        return True
